"""Compare a validation with a stored one: what improved and what was lost."""

from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Literal, Protocol
from xml.etree import ElementTree

from gaitval import __version__
from gaitval._internal.io.artefacts import scratch, write_json, write_text
from gaitval._internal.io.build_info import now, source_commit
from gaitval._internal.text.number_text import unit_text
from gaitval.errors import ArtefactError
from gaitval.gait.record import Origin
from gaitval.metrics.origin import is_judged, measure_origin
from gaitval.metrics.results import Metrics
from gaitval.metrics.tolerances import UNITS, load_registry
from gaitval.metrics.whole_error import MeanError, changed_errors, mean_errors

MeasureOutcome = Literal["lost", "kept", "improved", "new"]

LONG_MEASURES = ("consecutive_cycles", "push_survival")
"""Measures that need longer rollouts than the compared one."""

FALLS = ("falls", "walk")
"""Measure and target of how many of the walks fell."""


class Allowed(Protocol):
    """How much of a measure may be lost, and whether "lower" or "higher" is better."""

    @property
    def value(self) -> float:
        """In the unit of the measure."""

    @property
    def better(self) -> str:
        """Which way."""


@dataclass(frozen=True)
class Row:
    """One measure in the baseline and in the current run.

    Attributes
    ----------
    measure, target, unit : as in `tolerances.Measure`.
    baseline, current : None where it could not be measured.
    margin : how much may be lost.
    change : "lost" if it got worse by more than the margin or can no longer be measured, "improved"
        if it got better by more than the margin, "new" if the baseline lacks the measure, else
        "kept".
    origin : where what the walk is compared with comes from; a change of the distance from what was
        not recorded is a change of the walk, not of its accuracy.
    """

    measure: str
    target: str
    unit: str
    baseline: float | None
    current: float | None
    margin: float
    change: MeasureOutcome
    origin: Origin | None = None


def _change(
    baseline: float | None, current: float | None, margin: float, better: str
) -> MeasureOutcome:
    if current is None:
        return "kept" if baseline is None else "lost"
    if baseline is None:
        return "improved"
    gain = baseline - current if better == "lower" else current - baseline
    if gain < -margin:
        return "lost"
    return "improved" if gain > margin else "kept"


def _values(metrics: Metrics) -> dict[tuple[str, str], float | None]:
    return {(row.measure, row.target): row.value for row in metrics.measures}


def _falls_so_far(stored: Metrics, now: Metrics) -> float:
    """Falls of the stored walks from the start phases that are walked `now`, within its length."""
    length = now.method.consecutive_cycles
    fell = {
        each.start_phase for each in stored.walk.starts if each.fell and each.cycles.right < length
    }
    return float(sum(each.start_phase in fell for each in now.walk.starts))


def compare(
    baseline: Metrics,
    current: Metrics,
    *,
    leave_out: Collection[str] = (),
    margins: Mapping[str, Allowed] | None = None,
) -> list[Row]:
    """A row for every measure of `baseline` or `current`, new ones last, except those in
    `leave_out`, without which falls are those of the starts and cycles of `current`. `margins`, by
    measure, replace those of the installed gaitval. Raises ArtefactError for different subjects.
    """
    ours, theirs = current.subject.identifier, baseline.subject.identifier
    if ours != theirs:
        raise ArtefactError(
            f"the baseline is of subject {theirs}, but the run is of subject {ours}. Give the "
            "baseline of the same subject."
        )
    allowed: dict[str, Allowed] = {each.measure: each for each in load_registry().margin}
    allowed |= margins or {}
    before, now = _values(baseline), _values(current)
    if leave_out and before.get(FALLS) is not None:  # from fewer starts, and not as far
        before[FALLS] = _falls_so_far(baseline, current)
    origins = current.origins
    return [
        Row(
            measure=measure,
            target=target,
            unit=UNITS[measure],
            baseline=before.get((measure, target)),
            current=now.get((measure, target)),
            margin=allowed[measure].value,
            change=_change(
                before[measure, target],
                now.get((measure, target)),
                allowed[measure].value,
                allowed[measure].better,
            )
            if (measure, target) in before
            else "new",
            origin=measure_origin(measure, target, origins),
        )
        # a dictionary for its order: the baseline's, then what only the new run has
        for measure, target in dict.fromkeys([*before, *now])
        if measure not in leave_out
    ]


def new(rows: Sequence[Row]) -> list[Row]:
    """The `rows` that the baseline lacks: what it was stored with did not have the measure."""
    return [row for row in rows if row.change == "new"]


def lost(rows: Sequence[Row]) -> list[Row]:
    """The `rows` that got worse; the check fails if there are any."""
    return [row for row in rows if row.change == "lost"]


def traded(rows: Sequence[Row]) -> dict[MeanError, tuple[float, float]]:
    """The mean errors of `rows` that changed by more than 3 %, before and now: those that got worse
    and those that got better, within their margins or not.
    """
    before = mean_errors({(row.measure, row.target): row.baseline for row in rows})
    return changed_errors(
        before, mean_errors({(row.measure, row.target): row.current for row in rows})
    )


def prepare(path: Path, option: str) -> None:
    """Refuse the file `path` of an `option` if it cannot be written, before minutes of walking; its
    folder is made. Raises ArtefactError.
    """
    if path.is_dir():
        raise ArtefactError(f"{option} {path}: is a folder. Give the name of a file in it.")
    try:
        with scratch(path.parent):
            pass
    except ArtefactError as error:
        message = str(error).replace("with --out", f"for {option}")
        raise ArtefactError(f"{option} {path}: {message}") from None


def write_rows(rows: Sequence[Row], path: Path, *, about: Mapping[str, str]) -> None:
    """Write `rows` to `path` as JSON: `about`, the version and commit of gaitval, the time, the
    `traded` errors, and a list of measures.
    """
    names = ("measure", "target", "unit", "baseline", "current", "margin", "change")
    measures = [{name: getattr(row, name) for name in names} for row in rows]
    code = {"gaitval": __version__, "commit": source_commit(), "time": now()}
    errors = [
        {"error": error.name, "unit": error.unit, "baseline": before, "current": current}
        for error, (before, current) in traded(rows).items()
    ]
    write_json(path, {**about, **code, "changed_errors": errors, "measures": measures})


def write_junit(rows: Sequence[Row], path: Path, *, about: Mapping[str, str]) -> None:
    """Write `rows` to `path` as JUnit XML, a test case per measure; those lost are failures.
    `about` becomes the properties of the suite.
    """
    suite = ElementTree.Element(
        "testsuite",
        name="gaitval.regression",
        tests=str(len(rows)),
        failures=str(len(lost(rows))),
        errors="0",
        skipped="0",
    )
    properties = ElementTree.SubElement(suite, "properties")
    for name, value in about.items():
        ElementTree.SubElement(properties, "property", name=name, value=value)
    for row in rows:
        case = ElementTree.SubElement(
            suite, "testcase", classname=f"gaitval.{row.measure}", name=row.target
        )
        text = (
            f"{row.change}: {_text(row.baseline, row.unit)} in the baseline, "
            f"{_text(row.current, row.unit)} now, margin {_text(row.margin, row.unit)}"
        )
        if row.change == "lost":
            ElementTree.SubElement(case, "failure", message=text, type=_kind(row))
        else:
            ElementTree.SubElement(case, "system-out").text = text
    suites = ElementTree.Element("testsuites")
    suites.append(suite)
    ElementTree.indent(suites)
    write_text(path, ElementTree.tostring(suites, encoding="unicode", xml_declaration=True) + "\n")


def _kind(row: Row) -> str:
    """What was lost: accuracy, where there is a record; else the walk is another."""
    return "accuracy" if is_judged(row.origin) else "distance"


def _text(value: float | None, unit: str) -> str:
    return "not measured" if value is None else f"{value:.4g}{unit_text(unit)}"


def shown(value: float | None) -> str:
    """A measure (`value`) on a page or in a table."""
    return "not measured" if value is None else f"{value:.4g}".replace("-", "−")
