"""What a finding is, and the loop that looks for all of them."""

from collections.abc import Callable, Collection, Iterable, Mapping
from dataclasses import dataclass, field
from typing import Any, Final, NamedTuple

import numpy as np

from gaitval.gait.quality_flags import QualityFlag

Limits = tuple[float, float]
"""The least and the largest value of a sound recording; infinite where there is none."""

SCALES: Final[Mapping[str, float]] = {"mm": 1e3, "ms": 1e3, "cm": 1e2, "%": 1e2}
"""What a value in m, s or 1 is multiplied by for a sentence."""


class Figure(float):
    """A number that a sentence may show in another unit: `{value:.0f mm}` of metres."""

    def __format__(self, spec: str) -> str:
        digits, _, unit = spec.partition(" ")
        shown = format(float(self) * SCALES.get(unit, 1.0), digits)
        # what rounds to nothing has no sign
        shown = shown[1:] if shown.startswith("-") and float(shown) == 0.0 else shown
        return f"{shown} {unit}" if unit else shown


class Seen(NamedTuple):
    """One value of a finding, at one place.

    Attributes
    ----------
    value : in the finding's unit.
    where : the plate, foot or markers concerned.
    words : what the sentence needs besides; numbers may be shown in another unit (`Figure`).
    plate : name of the plate without which the trial can be used; empty where there is none.
    limits : in the place of the finding's, where these depend on what was seen.
    certain : whether it cannot be right, where that depends on more than the value.
    """

    value: float
    where: str
    words: Mapping[str, Any] = {}
    plate: str = ""
    limits: Limits | None = None
    certain: bool | None = None


@dataclass(frozen=True)
class Finding:
    """Something that may be wrong with a recording.

    Attributes
    ----------
    name : in files; what was looked at.
    needs : the type of what it looks at, a part of a recording.
    values : from that part, and the `numbers` as keywords; nothing where nothing can be concluded.
    limits : of sound recordings; one number is the largest value.
    unit : of value and limits.
    sentence : what was seen and why it is implausible, with the words of `Seen`, `{value}`,
        `{limit}` (the one that it is beyond), `{low}` and `{high}`.
    remedy : what to do about it, a sentence without its point, likewise.
    impossible : limits beyond which it cannot be right, so that nothing may be computed with it.
    numbers : further numbers that decide, by the keyword of `values`.
    source : where limits and numbers come from.
    hidden_by : names of findings that explain this one, of the same plate or of no plate.
    """

    name: str
    needs: type
    values: Callable[..., Iterable[Seen]]
    limits: float | Limits
    unit: str
    sentence: str
    remedy: str = ""
    impossible: Limits = (-np.inf, np.inf)
    numbers: Mapping[str, Any] = field(default_factory=dict)
    source: str = ""
    hidden_by: Collection[str] = ()

    @property
    def low(self) -> float:
        """The least value of sound recordings."""
        return self.limits[0] if isinstance(self.limits, tuple) else -np.inf

    @property
    def high(self) -> float:
        """The largest value of sound recordings."""
        return self.limits[1] if isinstance(self.limits, tuple) else self.limits

    def limits_of(self, seen: Seen) -> Limits:
        """Those that a value is held against."""
        return (self.low, self.high) if seen.limits is None else seen.limits

    def flag(self, seen: Seen) -> QualityFlag | None:
        """The warning about a value; None if it is within its limits."""
        low, high = self.limits_of(seen)
        if np.isnan(seen.value) or low <= seen.value <= high:
            return None
        limit = low if seen.value < low else high
        shown = {"value": seen.value, "limit": limit, "low": low, "high": high, **seen.words}
        figures = {
            name: Figure(each) if isinstance(each, float) else each for name, each in shown.items()
        }
        said = ". ".join(each.format(**figures) for each in (self.sentence, self.remedy) if each)
        least, most = self.impossible
        certain = not least <= seen.value <= most if seen.certain is None else seen.certain
        return QualityFlag(
            self.name, seen.where, seen.value, limit, self.unit, said, certain, seen.plate
        )


class Looked(NamedTuple):
    """A finding that was looked for, and the value that is nearest to its limits or beyond.

    Attributes
    ----------
    value, low, high : in the `unit`; infinite where there is no such limit.
    """

    name: str
    where: str
    value: float
    low: float
    high: float
    unit: str

    @property
    def kept(self) -> bool:
        """Whether the value is within the limits."""
        return self.low <= self.value <= self.high

    @property
    def excess(self) -> float:
        """How far the value is beyond a limit, over the size of that limit; negative within."""
        return max(
            (away / (abs(limit) or 1.0) for away, limit in (
                (self.low - self.value, self.low), (self.value - self.high, self.high)
            ) if np.isfinite(limit)),
            default=-np.inf,
        )  # fmt: skip


class Result(NamedTuple):
    """Of all findings that could be looked for.

    Attributes
    ----------
    flags : the warnings, in the order of the table.
    looked : a row for each finding.
    """

    flags: tuple[QualityFlag, ...]
    looked: tuple[Looked, ...]


def look_for(
    findings: Iterable[Finding], parts: Iterable[object], before: Collection[str] = ()
) -> Result:
    """Look for each of the `findings` in those `parts` of a recording that it needs.

    A warning that another one explains (`Finding.hidden_by`) is not given; `before` are names of
    findings that were made before of the same recording. A part that is not there hides nothing.
    """
    there = {type(part): part for part in parts}
    flags, looked = list[QualityFlag](), list[Looked]()
    told = {name: {""} for name in before}
    for finding in findings:
        if finding.needs not in there:
            continue
        rows = []
        for seen in finding.values(there[finding.needs], **finding.numbers):
            rows.append(
                Looked(finding.name, seen.where, seen.value, *finding.limits_of(seen), finding.unit)
            )
            flag = finding.flag(seen)
            if flag is None or _explained(finding, flag, told):
                continue
            flags.append(flag)
            told.setdefault(flag.check, set()).add(flag.plate)
        looked += sorted(rows, key=lambda row: row.excess)[-1:]
    return Result(tuple(flags), tuple(looked))


def _explained(finding: Finding, flag: QualityFlag, told: Mapping[str, Collection[str]]) -> bool:
    """Whether a flag is explained by one `told` before, by name with the plates concerned."""
    return any({"", flag.plate} & {*told.get(name, ())} for name in finding.hidden_by)
