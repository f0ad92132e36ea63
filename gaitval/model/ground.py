"""The plane that a body walks on, and the direction of gravity in its axes.

Every engine and every measure has the ground's axes as its world: x along the walk, in the plane; z
normal to it; the plane is z = 0. What a slope changes is gravity, which is then no longer -z. So a
contact law, a foot's height and a drift are the same on any slope, and only what weighs or lifts
asks for `gravity` or `up`.

With a the slope and b the cross-slope (rise over horizontal distance ahead, and to the left), the
axes in a world whose third axis is up are x = (1, 0, a) / M, y = z × x, z = (-a, -b, 1) / N with M²
= 1 + a², N² = 1 + a² + b²; their third components, a / M, b / (M N), 1 / N, are the direction that
is up.
"""

import math
from dataclasses import dataclass
from typing import Final

import numpy as np

from gaitval.arrays import Array
from gaitval.constants import GRAVITY


@dataclass(frozen=True)
class Ground:
    """A plane.

    Attributes
    ----------
    slope : %, rise over horizontal distance in the direction of the walk; uphill is positive.
    cross_slope : %, likewise to the left: the left foot's ground is higher where it is positive.
    """

    slope: float = 0.0
    cross_slope: float = 0.0

    @property
    def level(self) -> bool:
        """Whether gravity is normal to it."""
        return self.slope == 0.0 and self.cross_slope == 0.0

    @property
    def up(self) -> Array:
        """(3,) unit vector against gravity, in the ground's axes."""
        a, b = self.slope / 100.0, self.cross_slope / 100.0
        along, whole = math.sqrt(1.0 + a * a), math.sqrt(1.0 + a * a + b * b)
        return np.array([a / along, b / (along * whole), 1.0 / whole])

    @property
    def gravity(self) -> Array:
        """(3,) m/s², in the ground's axes."""
        # Subtracted from zero, so that level ground has no negative zeros.
        return np.asarray(0.0 - GRAVITY * self.up)

    @property
    def angles(self) -> tuple[float, float]:
        """rad: by how much what is upright leans forward, and to the right, in the ground's axes;
        of a slope and of a cross-slope alone their angles.
        """
        x, y, z = self.up
        return math.atan2(x, z), -math.atan2(y, math.hypot(x, z))

    @property
    def steepness(self) -> float:
        """Rise over horizontal distance in the steepest direction, 1: the friction coefficient that
        holds what rests on it.
        """
        return math.hypot(self.slope, self.cross_slope) / 100.0

    @property
    def from_level(self) -> Array:
        """(3, 3) rotation that takes a vector from axes whose z is up, and whose x is in the
        vertical plane of the walk, to the ground's.
        """
        a, b = self.slope / 100.0, self.cross_slope / 100.0
        x = np.array([1.0, 0.0, a]) / math.sqrt(1.0 + a * a)
        z = np.array([-a, -b, 1.0]) / math.sqrt(1.0 + a * a + b * b)
        return np.array([x, np.cross(z, x), z])

    def mirrored(self) -> "Ground":
        """With left and right exchanged."""
        return Ground(self.slope, 0.0 - self.cross_slope)

    def __str__(self) -> str:
        if self.level:
            return "level ground"
        across = f", {self.cross_slope:+g} % to the left" if self.cross_slope else ""
        return f"a slope of {self.slope:+g} %{across}"


LEVEL: Final = Ground()
