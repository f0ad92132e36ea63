"""Joint moments against the published bands of healthy people at the same walking speed."""

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cache
from typing import Final

import numpy as np

from gaitval._internal.io.text_tables import shipped_table
from gaitval.apps.judge.limits import LIMITS
from gaitval.arrays import Array
from gaitval.constants import STANDARD_GRAVITY

GROUPS: Final = (
    ("very slow", 0.227),
    ("slow", 0.363),
    ("free", 0.500),
    ("fast", 0.636),
    ("very fast", np.inf),
)
"""Walking speed over the root of gravity times leg length up to which a group goes (Schwartz et al.
2008; recalled, not read in the source)."""

BANDED: Final = ("hip_flexion", "hip_adduction", "knee_angle", "ankle_angle")
SIZED: Final = ("ankle_angle",)
"""Curves whose size all healthy people share. Those of hip and knee do not: the middle fits best
0.5 to 1.3 and -1.2 to 1.5 times into those of the ten built-in adults."""
PERCENT: Final = np.arange(0, 101, 2)


@dataclass(frozen=True)
class Band:
    """Mean - SD and mean + SD (101,) of healthy people, Nm/kg."""

    low: Array
    high: Array

    @property
    def middle(self) -> Array:
        """Of the band, (101,) Nm/kg."""
        return (self.low + self.high) / 2

    def distance(self, curve: Array) -> float:
        """RMS distance of a curve (101,) from the middle, over the RMS half width: SD."""
        half = (self.high - self.low) / 2
        return float(np.sqrt(((curve - self.middle) ** 2).mean() / (half**2).mean()))

    def factor(self, curve: Array) -> float:
        """How many times a curve (101,) is larger or smaller than the middle, by the multiple of
        this that fits best; at most `JudgeLimits.smallest_share`'s inverse, which is also that of
        the opposite sign.
        """
        share = float((curve * self.middle).sum() / (self.middle**2).sum())
        share = max(share, LIMITS.smallest_share)
        return max(share, 1.0 / share)


@cache
def bands() -> Mapping[tuple[str, str], Band]:
    """Bands by group of speed and curve without side; see `schwartz2008.csv`."""
    rows: dict[tuple[str, str, str], Array] = {}
    for _, row in shipped_table("gaitval.apps.judge", "schwartz2008.csv").rows:
        values = np.array(row[3:], dtype=float)
        rows[row[0], row[1], row[2]] = np.interp(np.arange(101), PERCENT, values)
    return {
        (group, curve): Band(rows[group, curve, "low"], rows[group, curve, "high"])
        for group, _ in GROUPS
        for curve in BANDED
    }


def speed_group(speed: float, leg_length: float) -> str:
    """The group that walks at this `speed` (m/s) with legs of `leg_length` (m, hip to floor)."""
    # Dimensionless speed v / sqrt(g l): people of different size walk alike at the same one.
    froude = speed / np.sqrt(STANDARD_GRAVITY * leg_length)
    return next(name for name, upto in GROUPS if froude < upto)
