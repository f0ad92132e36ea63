"""Whether everything that shows a limit of a recording says the same of it.

A made-up session is imported as recorded and made consistent, with a mass that the plates
contradict; given the folder of the raw data, the walk of WBDS01 too. Value, limit and
verdict of each limit are read back from what the command prints, the page, Python, `gaitval judge`
on the files that the import wrote, and the table of many imports.
"""

import csv
import html
import io
import re
import sys
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final, NamedTuple
from unittest.mock import patch

ROOT = Path(__file__).resolve().parents[2]

JUDGE_SLACK: Final = {"ik-marker-rms": 0.1, "ik-marker-largest": 0.5}
"""cm. The motion that an import writes, and `judge` reads, is low-passed; the import's marker
errors are of each frame as it was fitted."""
OTHER_SLACK: Final = 0.01
"""Relative, of all other limits: files have six digits, and `judge` leaves out the frames within
0.05 s of those in which a plate shows half a step."""


class Said(NamedTuple):
    """What one output says of a limit; None where it does not show it."""

    verdict: str
    limit: float | None
    value: float | None


@dataclass(frozen=True)
class Compared:
    """What was compared.

    Attributes
    ----------
    numbers : how many limits, each of one recording.
    outputs : names of the outputs that show at least one.
    failed : limits that failed.
    differences : a sentence for each limit of which two outputs say different things.
    """

    numbers: int
    outputs: tuple[str, ...]
    failed: int
    differences: tuple[str, ...]


Outputs = Mapping[str, Mapping[str, Said]]


def compared(
    folder: Path, data: Path | None = None, size: Mapping[str, Any] | None = None
) -> Compared:
    """Import sessions into a folder and compare all outputs.

    Parameters
    ----------
    data : raw data, for the walk of WBDS01.
    size : lengths and rates of the made-up session, where they are not its own defaults.
    """
    numbers = failed = 0
    shown: dict[str, None] = {}
    differences = []
    for name, options in _sessions(folder, data, size or {}).items():
        outputs = _outputs(folder / name, options)
        shown |= dict.fromkeys(output for output, rows in outputs.items() if rows)
        every = dict.fromkeys(row for rows in outputs.values() for row in rows)
        numbers += len(every)
        failed += sum(message.verdict == "FAILED" for message in outputs["terminal"].values())
        differences += [f"{name}: {text}" for row in every for text in _differences(row, outputs)]
    return Compared(numbers, tuple(shown), failed, tuple(differences))


def _differences(row: str, outputs: Outputs) -> Iterator[str]:
    messages = {name: rows[row] for name, rows in outputs.items() if row in rows}
    verdicts = {one.verdict for one in messages.values()}
    limits = {one.limit for one in messages.values() if one.limit is not None}
    if len(verdicts) > 1 or len(limits) > 1:
        yield f"{row}: " + ", ".join(f"{name} {one.verdict}" for name, one in messages.items())
    reference = outputs["Python"].get(row)
    if reference is None or reference.value is None:
        yield f"{row}: not in Python"
        return
    for name, one in messages.items():
        if one.value is None:
            continue
        slack = 0.006 * abs(reference.value) + 0.006  # three digits, or two decimals
        if name == "judge":
            slack += _slack(row, reference.value)
        if abs(one.value - reference.value) > slack:
            yield f"{row}: {name} {one.value:g}, Python {reference.value:g}"


def _slack(row: str, value: float) -> float:
    from gaitval.metrics.tolerances import load_registry

    known = {one.title: one.id for one in load_registry().tolerance}
    return JUDGE_SLACK.get(known.get(row.split(" (")[0], ""), OTHER_SLACK * abs(value))


def _sessions(
    folder: Path, data: Path | None, size: Mapping[str, Any]
) -> dict[str, dict[str, Any]]:
    sys.path.insert(0, str(ROOT / "tests" / "support"))
    from made_up_session import made_up_session
    from recorded_sessions import wbds01_t01

    (folder / "files").mkdir(parents=True)
    request = made_up_session(folder / "files", noise=0.003, **size).request
    # 11.5 % too heavy: within what the import takes, beyond what it takes for right
    heavy = {"request": request, "mass": 1.115 * request.mass_kg}
    found: dict[str, dict[str, Any]] = {
        "recorded": heavy | {"consistent": False},
        "consistent": heavy | {"consistent": True},
    }
    if data is not None:
        recorded = wbds01_t01(data)
        found["WBDS01"] = {"request": recorded, "mass": recorded.mass_kg, "consistent": False}
    return found


# ---- What each output says, by the name of the limit. ----


def _outputs(out: Path, options: Mapping[str, Any]) -> Outputs:
    from gaitval.configuration import load_configuration
    from gaitval.importing.batch_person import BatchPerson
    from gaitval.importing.importing import import_files

    request = options["request"]
    person = BatchPerson(
        name=out.name,
        sex=request.sex,
        static=request.static,
        trials=request.trials,
        forces=request.forces,
        mass=options["mass"],
        height=request.height_m,
        consistent=options["consistent"],
    )
    imported = import_files(person, out, configuration=load_configuration())
    terminal = _terminal(imported, out)
    judged = _judged(out / "recording", request.trials[0].name, reduced=options["consistent"])
    return {
        "terminal": terminal,
        "page": _page(out / "recording" / "recording.html"),
        "Python": _python(out),
        "judge": judged,
        "table": _table(person, imported, out.parent / "tables", terminal),
    }


def _terminal(imported: Any, out: Path) -> dict[str, Said]:
    """Of the table and of the last lines, which name everything that failed."""
    from rich.console import Console

    from gaitval.cli.recording import say_what_was_made
    from gaitval.terminal import display

    text = io.StringIO()
    with patch.object(display, "output", Console(file=text, width=400)):
        say_what_was_made(imported, out)
    found = {}
    for line in text.getvalue().splitlines():
        cells = [cell.strip() for cell in line.strip("│").split("│")]
        if line.startswith("│") and len(cells) == 5:
            name, value, limit, _, verdict = cells
            found[name] = Said(verdict, float(limit), float(value))
    last = {line for line in text.getvalue().splitlines() if line.startswith("FAILED: ")}
    for name, message in found.items():
        output = sum(line.startswith(f"FAILED: {name}: ") for line in last)
        if output != (message.verdict == "FAILED"):
            found[name] = message._replace(verdict=f"{message.verdict}, {output} times at the end")
    return found


def _page(path: Path) -> dict[str, Said]:
    row = re.compile(
        r"<tr[^>]*><td[^>]*>(?:<span[^>]*>)?([^<]*)(?:</span>)?</td>"
        r"<td class=\"n value\">([-\d.]+) .*?</td>"
        r"<td class=\"n\">≤&nbsp;([\d.]+) .*?</td><td[^>]*>.*?</td>"
        r"<td class=\"word\"><span[^>]*>([^<]*)</span></td></tr>"
    )
    return {
        html.unescape(name): Said(verdict, float(limit), float(value))
        for name, value, limit, verdict in row.findall(path.read_text(encoding="utf-8"))
    }


def _rows(rows: Any) -> dict[str, Said]:
    """Of rows of quantity and target; angles in standing have no target in their name."""
    return {
        row["quantity"] if row["unit"] == "deg" else f"{row['quantity']} ({row['target']})": Said(
            row["verdict"], row["limit"], row["value"]
        )
        for row in rows
    }


def _python(out: Path) -> dict[str, Said]:
    from gaitval.importing.stored import Session

    return _rows(Session.load(out).overview().to_dict("records"))


def _judged(folder: Path, trial: str, *, reduced: bool) -> dict[str, Said]:
    """Of the files of the first trial, which with `--consistent` have a model of their own."""
    from gaitval.apps.judge.judge import judge
    from gaitval.apps.judge.request import JudgeRequest
    from gaitval.apps.judge.write import result_of
    from gaitval.metrics.recording_limits import CONSISTENT
    from gaitval.metrics.tolerances import RECORDING_UNITS, load_registry

    found = judge(
        JudgeRequest(
            model=folder / ("trial1_model.osim" if reduced else "model.osim"),
            ik=folder / "trial1_ik.mot",
            id=folder / "trial1_id.sto",
            markers=folder / "trial1_markers.trc",
            external_loads=folder / "trial1_external_loads.xml",
            reduced=reduced,
        )
    )
    measure = {row.id: row.measure for row in load_registry().tolerance}
    # a consistent model has masses of its own, so its weight is not that of the person given
    shared = {*RECORDING_UNITS, *(() if reduced else ("weight_error",))}
    targets = {
        "root": trial + (CONSISTENT if reduced else ""),
        "trial": trial,
        "model": "plates",
    }
    return {
        f"{row.title} ({targets[row.target]})": Said(str(row.verdict), row.limit, row.value)
        for row in result_of(found).limits
        if measure[row.id] in shared
    }


def _table(person: Any, imported: Any, target: Path, known: Mapping[str, Said]) -> dict[str, Said]:
    """Of `batch.csv`, which names what failed and counts the others."""
    from gaitval.configuration import load_configuration
    from gaitval.importing import batch_imports as batch

    with patch.object(batch, "import_files", return_value=imported):
        batch.import_batch([person], target, load_configuration())
    with (target / batch.TABLE).open(newline="", encoding="utf-8") as file:
        (row,) = csv.DictReader(file)
    counts = {word: int(count) for count, word in re.findall(r"(\d+) ([^,]+)", row["limits"])}
    named = {
        text.rsplit(": ", 1)[0]: text.rsplit(": ", 1)[1]
        for text in filter(None, row["failed"].split("; "))
    }
    found = {}
    for name, message in known.items():
        verdict = "FAILED" if name in named else message.verdict
        wrong = message.verdict == "FAILED" and name not in named
        found[name] = Said("not named" if wrong else verdict, None, None)
    if counts != {
        word: sum(message.verdict == word for message in found.values()) for word in counts
    }:
        found["counts"] = Said(row["limits"], None, None)
    return found
