"""The checklists of Hicks 2015 and ASME V&V 40, row by row, to paste into a supplement.

`checklist.toml` has the rows; what a run says of each is read from its `metrics.json`. A row that
the run cannot answer says "not done", and why.
"""

import re
import tomllib
from collections.abc import Mapping, Sequence
from importlib import resources
from pathlib import Path
from typing import Final, NamedTuple

from gaitval.artefacts import write_text
from gaitval.metrics.results import METRICS, Metrics
from gaitval.metrics.verdicts import limit_verdicts
from gaitval.reporting.facts import at, shown
from gaitval.reporting.figure_data import table

NOT_DONE: Final = "not done"
_COLUMNS: Final = ("document", "item", "value", "limit", "evidence")


class ChecklistRow(NamedTuple):
    """A row: which document asks what, the run's value, the limit and where the value is."""

    source: str
    item: str
    value: str
    limit: str = ""
    evidence: str = ""


def checklist(metrics: Metrics, beside: Mapping[str, str]) -> list[ChecklistRow]:
    """Every row, of a run with the results `metrics` and what its other files say (`beside`, see
    `credibility.beside_metrics`).
    """
    text = resources.files("gaitval.reporting").joinpath("checklist.toml").read_text("utf-8")
    limits = {each.first.id: each for each in limit_verdicts(metrics)}
    found = []
    for row in tomllib.loads(text)["row"]:
        start, limit = (row["source"], row["item"]), row.get("limit", "")
        if "limit_id" in row:
            verdict = limits.get(row["limit_id"])
            place = f"{METRICS}#/tolerances ({row['limit_id']})"
            if verdict is not None:
                value = verdict.value_text().replace("-", "−")
                # a spreadsheet takes what begins with = for a formula
                bound = verdict.limit_text().removeprefix("= ")
                found.append(ChecklistRow(*start, value, bound, place))
                continue
            row = {"not_done": "this run does not judge it"}
        if "not_done" in row:
            found.append(ChecklistRow(*start, NOT_DONE, limit, row["not_done"]))
        elif "beside" in row:
            value = beside[row["beside"]]
            found.append(ChecklistRow(*start, value or NOT_DONE, limit, row["evidence"]))
        elif "answer" in row:
            found.append(ChecklistRow(*start, row["answer"], limit, row.get("evidence", "")))
        else:
            place = row.get("least") or row["pointer"]
            value = _value(metrics, row, place)
            found.append(ChecklistRow(*start, value or NOT_DONE, limit, f"{METRICS}#{place}"))
    return found


def _value(metrics: Metrics, row: Mapping[str, str], place: str) -> str:
    """The value of a row that is read; empty where the run has none."""
    try:
        value = at(metrics, place)
    except (KeyError, AttributeError):
        return ""
    if value is None:
        return ""
    if "least" in row and isinstance(value, Mapping):
        return shown(100.0 * min(each.walk for each in value.values()), "%", 0)
    if isinstance(value, Sequence) and not isinstance(value, str):
        wanted = row.get("counts")
        count = sum(wanted is None or each == wanted for each in value)
        if not count and "or_held_out" in row:
            unseen = [name for name in metrics.recorded if not metrics.known[name]]
            return f"{row['or_held_out']}: {', '.join(unseen)}" if unseen else ""
        return f"{count} of {len(value)}" if wanted else f"{count}" if count else ""
    text = shown(value, row.get("unit", ""), 2)
    if "of" in row:
        return f"{text} of {at(metrics, row['of'])}"
    if "plus" in row:
        return f"{text} of {int(str(value)) + int(str(at(metrics, row['plus'])))}"
    return text


_LATEX: Final = {
    **{each: f"\\{each}" for each in "%&#_${}"},
    **{"≤": r"$\le$", "≥": r"$\ge$", "<": "$<$", ">": "$>$", "°": r"\textdegree{}", "−": "$-$"},
    **{"\\": r"\textbackslash{}", "~": r"\textasciitilde{}", "^": r"\textasciicircum{}"},
    **{"`": r"\textasciigrave{}", "/": r"/\allowbreak{}"},
}
"""How LaTeX writes a character that it reads otherwise. A place such as `metrics.json#/unseen` has
no space, so without a break after its slashes it runs into the margin."""
_WIDTHS: Final = (0.11, 0.25, 0.17, 0.11, 0.18)
"""Of the columns, of a line of text; the rest is the space between them."""


def _latex(text: str) -> str:
    """The `text` of a cell; the sign of a number is a minus, and not a hyphen."""
    return "".join(_LATEX.get(c, c) for c in re.sub(r"(?<![\w.])-(?=\d)", "−", text))


def tables(rows: Sequence[ChecklistRow]) -> dict[str, str]:
    """The `rows` as text, by file name: CSV, Markdown, and LaTeX that breaks over pages."""
    columns = dict(zip(_COLUMNS, map(list, zip(*rows, strict=True)), strict=True))
    cells = [[each.replace("|", "\\|") for each in row] for row in rows]
    bars = ["| " + " | ".join(row) + " |" for row in (_COLUMNS, ["---"] * 5, *cells)]
    places = "".join(rf"p{{{width}\linewidth}}" for width in _WIDTHS)
    latex = [
        r"% needs \usepackage{longtable}",
        rf"\begin{{longtable}}{{@{{}}{places}@{{}}}}",
        rf"\hline {' & '.join(_COLUMNS)} \\ \hline \endhead",
        *(rf"{' & '.join(map(_latex, row))} \\" for row in rows),
        r"\hline",
        r"\end{longtable}",
    ]
    return {
        "checklist.csv": table(columns),
        "checklist.md": "\n".join(bars) + "\n",
        "checklist.tex": "\n".join(latex) + "\n",
    }


def write_checklist(folder: Path, rows: Sequence[ChecklistRow]) -> None:
    """Write the `tables` of `rows` into a `folder`."""
    for name, text in tables(rows).items():
        write_text(folder / name, text)
