"""The checklists of Hicks 2015 and ASME V&V 40, row by row.

`checklist.toml` has the rows; what a run says of each is read from its `metrics.json`. A row that
the run cannot answer says "not done", and why.
"""

import tomllib
from collections.abc import Mapping, Sequence
from importlib import resources
from typing import Final, NamedTuple

from gaitval.metrics.results import METRICS, Metrics
from gaitval.metrics.verdicts import limit_verdicts
from gaitval.metrics.whole_body import momentum_residual
from gaitval.model.ground import LEVEL
from gaitval.reporting.facts import at, shown
from gaitval.reporting.figure_data import table
from gaitval.reporting.run_files import RunFiles

NOT_DONE: Final = "not done"
_COLUMNS: Final = ("document", "item", "value", "limit", "evidence")


class ChecklistRow(NamedTuple):
    """A row: which document asks what, the run's value, the limit and where the value is."""

    source: str
    item: str
    value: str
    limit: str = ""
    evidence: str = ""


def beside_metrics(run: RunFiles) -> dict[str, str]:
    """What the checklist takes of a `run` beside its metrics, by name; empty where it is not there:
    the force that would be needed beside ground and gravity, its largest mean over a second, and
    the seed.
    """
    momentum = ""
    if run.walk.rollout is not None:
        ground = LEVEL if run.walk.model is None else run.walk.model.ground
        left = momentum_residual(run.walk.rollout, run.metrics.method.model_mass_kg, ground)
        momentum = "" if left is None else shown(left, "% of body weight", 3)
    return {"momentum": momentum, "seed": str((run.origin.provenance or {}).get("seed", ""))}


def checklist(metrics: Metrics, beside: Mapping[str, str]) -> list[ChecklistRow]:
    """Every row, of a run with the results `metrics` and what is `beside_metrics`."""
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


def as_csv(rows: Sequence[ChecklistRow]) -> str:
    """The `rows` as a table."""
    return table(dict(zip(_COLUMNS, map(list, zip(*rows, strict=True)), strict=True)))
