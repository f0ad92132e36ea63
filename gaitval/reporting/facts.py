"""Figures that say from which file they were read, and from where in it."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any, Final
from urllib.parse import quote

from gaitval.reporting.page import number

METRICS: Final = "metrics.json"
UNKNOWN: Final = "not known"


@dataclass(frozen=True)
class Fact:
    """A row of the page.

    Attributes
    ----------
    what : what the figure is.
    text : the figure with its unit, or `UNKNOWN`.
    file : beside the report, from which the figure was read; none for what is not known.
    pointer : where in that file, or what it was worked out from there.
    note : how it was worked out, or why it is not known and how it could be.
    """

    what: str
    text: str
    file: str = ""
    pointer: str = ""
    note: str = ""

    @property
    def link(self) -> str:
        """Where the figure is, as the target of a link; nothing without a file that browsers show:
        a page that was sent alone must not offer arrays beside it.
        """
        if not self.file.endswith((".json", ".toml")):
            return ""
        return quote(self.file) + (f"#{quote(self.pointer)}" if self.pointer else "")


def at(values: Any, pointer: str) -> Any:
    """What a JSON pointer leads to; KeyError where it leads nowhere."""
    for part in pointer.split("/")[1:]:
        name = part.replace("~1", "/").replace("~0", "~")
        values = values[int(name)] if isinstance(values, list) else values[name]
    return values


def read_fact(
    values: Mapping[str, Any],
    pointer: str,
    what: str,
    unit: str = "",
    *,
    digits: int = 3,
    note: str = "",
    file: str = METRICS,
) -> Fact:
    """The figure or the word that a file has at a place."""
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
    """A figure that was worked out from what a file has at a place."""
    if value is None:
        return Fact(what, UNKNOWN, file, pointer, note)
    return Fact(what, shown(value, unit, digits), file, pointer, note)


def measured_force(record: Mapping[str, Any]) -> float:
    """Mean vertical force of both feet over the gait cycle as the plates measured it, body weights;
    the correction of the plates divides it out.
    """
    corrected = float(record["consistency"]["mean_force"]["vertical"])
    return corrected if record["plates"] is None else corrected / float(record["plates"]["scale"])


def measured_force_fact(record: Mapping[str, Any]) -> Fact:
    """The mean vertical force of the record in `metrics.json` as it was measured."""
    plates = record["plates"]
    return derived_fact(
        "/record/consistency/mean_force",
        "Mean vertical force as measured, which steady walking makes 1",
        measured_force(record),
        "body weights",
        note="Nothing is corrected."
        if plates is None
        else f"The correction of the plates multiplies it by {number(plates['scale'], 4)}.",
    )


def mean_of_known(values: Mapping[str, float | None]) -> float | None:
    """Over what is known; None if nothing is."""
    known = [value for value in values.values() if value is not None]
    return sum(known) / len(known) if known else None


def compiled_walks(starts: Sequence[Mapping[str, Any]]) -> int:
    """How many of the walks from start phases walked in the compiled engine; the others did in
    DART, as all of those that are stored without their engine did.
    """
    return sum(start.get("engine") == "compiled" for start in starts)


def shown(value: Any, unit: str, digits: int) -> str:
    """A figure or word as text with its unit."""
    if isinstance(value, bool):
        return "yes" if value else "no"
    if isinstance(value, float):
        value = number(value, digits)
    return f"{value} {unit}".strip()
