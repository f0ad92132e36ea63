"""Joint moments against the published bands of healthy people at the same walking speed."""

from collections.abc import Mapping, Sequence
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

    def share(self, curve: Array) -> float:
        """The multiple of the middle that fits a curve (101,) best."""
        return float((curve * self.middle).sum() / (self.middle**2).sum())

    def factor(self, curve: Array) -> float:
        """How many times a curve (101,) is larger or smaller than the middle, by its `share`; at
        most `JudgeLimits.smallest_share`'s inverse, which is also that of the opposite sign.
        """
        share = max(self.share(curve), LIMITS.smallest_share)
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


def unit_of_moments(shares: Sequence[float], mass: float) -> str | None:
    """The unit in which moments are that were taken for Nm, by the `shares` of healthy people's
    that those of the ankles are, of a body of `mass` kg; None if they are Nm or nothing fits.
    """
    weight = mass * STANDARD_GRAVITY
    units = (("Nm", 1.0), ("Nm/kg", mass), ("Nm/N", weight), ("Nmm", 1e-3), ("Nmm/kg", 1e-3 * mass))
    for unit, newton_metres in (*units, ("kNm", 1e3)):
        if shares and all(
            1.0 / LIMITS.usual_factor < share * newton_metres < LIMITS.usual_factor
            for share in shares
        ):
            return None if unit == "Nm" else unit
    return None


def unit_of_forces(ratio: float, mass: float) -> list[str]:
    """A sentence on the unit in which forces are that carry `ratio` times the weight of a body of
    `mass` kg if they are in N; nothing if they are in N or nothing fits.
    """
    weight = mass * STANDARD_GRAVITY
    for unit, newtons in (("% of body weight", 0.01 * weight), ("N/kg", mass), ("lbf", 4.448)):
        if not 0.5 < ratio < 2.0 and 0.8 < ratio * newtons < 1.25:
            return [
                f"Forces: they carry {100 * ratio:.3g} % of the model's weight if they are in N, "
                f"but {100 * ratio * newtons:.0f} % in {unit}. Give them in N."
            ]
    return []
