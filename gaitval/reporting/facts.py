"""Figures that cite the file they were read from, and the place in it."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Final
from urllib.parse import quote

from pydantic import BaseModel

from gaitval.metrics.record_results import RecordResult
from gaitval.metrics.results import METRICS
from gaitval.metrics.typed import Result
from gaitval.metrics.walk_results import Endurance
from gaitval.reporting.page import number

UNKNOWN: Final = "not known"


@dataclass(frozen=True)
class Fact:
    """A row of the page.

    Attributes
    ----------
    what : what the figure is.
    text : the figure with its unit, or `UNKNOWN`.
    file : beside the report, from which the figure was read; none for what is not known.
    pointer : where in that file it is, or what it was computed from.
    note : how it was computed, or why it is not known and how it could be.
    """

    what: str
    text: str
    file: str = ""
    pointer: str = ""
    note: str = ""

    @property
    def link(self) -> str:
        """Target of a link to the figure; empty without a file that browsers show: a page that was
        sent alone must not offer arrays beside it.
        """
        if not self.file.endswith((".json", ".toml")):
            return ""
        return quote(self.file) + (f"#{quote(self.pointer)}" if self.pointer else "")


def at(values: object, pointer: str) -> object:
    """What a JSON `pointer` leads to in `values`, a result or table; KeyError or AttributeError
    where it leads nowhere.
    """
    for part in pointer.split("/")[1:]:
        # RFC 6901, section 4: ~1 first, so that ~01 becomes ~1 and not a slash
        name = part.replace("~1", "/").replace("~0", "~")
        match values:
            case BaseModel():
                values = getattr(values, name)
            case Mapping():
                values = values[name]
            case Sequence():
                values = values[int(name)]
    return values


def read_fact(
    values: Result,
    pointer: str,
    what: str,
    unit: str = "",
    *,
    digits: int = 3,
    note: str = "",
    file: str = METRICS,
) -> Fact:
    """The figure or word at `pointer` in `values`, the content of `file`, as a row named `what`:
    with `unit`, `digits` decimals and a `note`.
    """
    found = at(values, pointer)
    if found is None:
        return Fact(what, UNKNOWN, file, pointer, note or "The file has no value here.")
    return Fact(what, shown(found, unit, digits), file, pointer, note)


def derived_fact(
    pointer: str,
    what: str,
    value: float | None,
    unit: str = "",
    *,
    digits: int = 3,
    note: str,
    file: str = METRICS,
) -> Fact:
    """A `value` computed from the place `pointer` in `file`, as a row named `what`: with `unit`,
    `digits` decimals and a `note`; None is not known.
    """
    if value is None:
        return Fact(what, UNKNOWN, file, pointer, note)
    return Fact(what, shown(value, unit, digits), file, pointer, note)


def measured_force(record: RecordResult) -> float:
    """Mean vertical force of both feet over the gait cycle of `record` as the plates measured it,
    body weights; the correction of the plates is divided out.
    """
    corrected = record.consistency.mean_force.vertical
    return corrected if record.plates is None else corrected / record.plates.scale


def measured_force_fact(record: RecordResult) -> Fact:
    """`measured_force` of the `record` in `metrics.json` as a row."""
    plates = record.plates
    return derived_fact(
        "/record/consistency/mean_force",
        "Mean vertical force as measured, which steady walking makes 1",
        measured_force(record),
        "body weights",
        note="Nothing is corrected."
        if plates is None
        else f"The correction of the plates multiplies it by {number(plates.scale, 4)}.",
    )


def mean_of_known(values: Mapping[str, float | None]) -> float | None:
    """Mean of those of `values` that are not None; None if all are."""
    known = [value for value in values.values() if value is not None]
    return sum(known) / len(known) if known else None


def compiled_walks(starts: Sequence[Endurance]) -> int:
    """How many of the walks from `starts` ran in the compiled engine. The others ran in DART, as
    did all that were stored without their engine.
    """
    return sum(start.engine == "compiled" for start in starts)


def shown(value: object, unit: str, digits: int) -> str:
    """A figure or word `value` as text: floats with `digits` decimals, then the `unit`."""
    if isinstance(value, bool):
        return "yes" if value else "no"
    if isinstance(value, float):
        value = number(value, digits)
    return f"{value} {unit}".strip()
