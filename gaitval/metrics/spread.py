"""How far a verdict can be relied on: the same value in repeated walks, or over many pushes."""

import math
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass
from typing import Any, Final

import numpy as np
from scipy import stats

from gaitval.metrics.tolerances import Tolerance, Verdict, holds

CONFIDENCE: Final = 0.9
"""Of the intervals."""

Repeated = Mapping[tuple[str, str], Sequence[float | None]]
"""Values by measure and target, one a repeat; None where it could not be measured."""


@dataclass(frozen=True)
class Spread:
    """A verdict in repeats.

    Attributes
    ----------
    repeats, kept : walks (of `push_survival`: pushes), and those that keep the limit (survive).
    low, high : interval of `CONFIDENCE`, in the measure's unit: of the value of one more walk, or
        of the share of pushes that are survived; None with too few repeats.
    close : the limit is kept, but the interval reaches beyond it, a repeat does not keep it, or one
        push less survived would fail it.
    """

    repeats: int
    kept: int
    low: float | None
    high: float | None
    close: bool

    def as_dict(self) -> dict[str, Any]:
        """The fields by name, to be written as JSON."""
        return asdict(self)


def repeated_values(rows: Sequence[Mapping[str, Any]]) -> Repeated:
    """The values of rows of `repeats.repeated_walks` by measure and target."""
    found: dict[tuple[str, str], list[float | None]] = {}
    for row in rows:
        for measure, targets in row["measures"].items():
            for target, value in targets.items():
                found.setdefault((measure, target), []).append(value)
    return found


def prediction_interval(values: Sequence[float]) -> tuple[float, float] | None:
    """Where one more value of the same kind falls with probability `CONFIDENCE`, if they are normal
    (Student's t); None with fewer than three.
    """
    count = len(values)
    if count < 3:
        return None
    t = float(stats.t.ppf(0.5 + 0.5 * CONFIDENCE, count - 1))
    half = t * float(np.std(values, ddof=1)) * math.sqrt(1.0 + 1.0 / count)
    mean = float(np.mean(values))
    return mean - half, mean + half


def share_interval(kept: int, count: int) -> tuple[float, float]:
    """Wilson's score interval of a share (Wilson 1927), from 0 to 1."""
    z = float(stats.norm.ppf(0.5 + 0.5 * CONFIDENCE))
    share, grown = kept / count, 1.0 + z * z / count
    middle = (share + z * z / (2 * count)) / grown
    half = z * math.sqrt(share * (1.0 - share) / count + z * z / (4 * count * count)) / grown
    return max(middle - half, 0.0), min(middle + half, 1.0)


def spread_of(verdict: Verdict, values: Sequence[float | None]) -> Spread | None:
    """The spread of a verdict over repeated walks; None without any."""
    if not values:
        return None
    tolerance = verdict.tolerance
    kept = sum(holds(tolerance, value, tolerance.value) for value in values)
    found = [value for value in values if value is not None]
    interval = prediction_interval(found)
    if interval is None:
        return Spread(len(values), kept, None, None, verdict.passed and kept < len(values))
    low, high = interval
    if min(found) >= 0.0:  # sizes of errors have no other side
        low = max(low, 0.0)
    beyond = kept < len(values) or not _kept_within(tolerance, low, high)
    return Spread(len(values), kept, low, high, verdict.passed and beyond)


def spread_of_pushes(verdict: Verdict, survived: int, count: int) -> Spread:
    """The spread of the share of pushes survived, %."""
    low, high = (100.0 * end for end in share_interval(survived, count))
    tolerance = verdict.tolerance
    one_less = 100.0 * (survived - 1) / count
    close = verdict.passed and not holds(tolerance, one_less, tolerance.value)
    return Spread(count, survived, low, high, close)


def spread_of_falls(falls: int, walks: int) -> Spread:
    """The spread of a number of falls: walks that did not end in one, and the interval of how many
    of as many walks would.
    """
    low, high = (walks * end for end in share_interval(falls, walks))
    return Spread(walks, walks - falls, low, high, close=False)


def _kept_within(tolerance: Tolerance, low: float, high: float) -> bool:
    worst = low if tolerance.limit == "at_least" else high
    return holds(tolerance, worst, tolerance.value)
