"""One reference motion for any speed between those of several: their blend.

Curves are blended at equal phase and stride length with them; the stride time follows from length
and speed. A blend of neighbouring references, which differ by a fifth in speed, obeys Newton's
laws nearly as they do; the ground and the policy see to the rest.
"""

from collections.abc import Sequence
from typing import Final, NamedTuple

import numpy as np

from gaitval.arrays import Array
from gaitval.policy.environment import WalkingEnvironment
from gaitval.policy.observation import Targets
from gaitval.simulation.servo import ReferenceTables

RATES: Final = ("target_velocities", "servo_velocities")
"""Per second in the tables, and blended per cycle."""


class Speed(NamedTuple):
    """Numbers of a blend: m/s, m, s, and speed over the square root of gravity times leg length."""

    speed: float
    stride_length: float
    stride_time: float
    dimensionless: float


def _tables(targets: Targets, servo: ReferenceTables) -> dict[str, Array]:
    """Everything of a reference that has a row for each phase; not copied."""
    return {
        "target_positions": targets.positions,
        "target_velocities": targets.velocities,
        "centre_of_mass": targets.centre_of_mass,
        "end_effectors": targets.end_effectors,
        "ground_reaction": targets.ground_reaction,
        "target_moments": targets.moments,
        "servo_positions": servo.positions,
        "servo_velocities": servo.velocities,
        "servo_moments": servo.moments,
    }


class Blend:
    """Tables of a reference at any speed, in the arrays of one environment.

    Parameters
    ----------
    environments : one for each reference of the same body, from slow to fast, their action bias
        found (`WalkingEnvironment.centre`).

    Attributes
    ----------
    now : what the tables are of.
    habits : (100, A) action bias at that speed.
    """

    def __init__(self, environments: Sequence[WalkingEnvironment]) -> None:
        self._speeds = [
            Speed(
                each.task.reference.speed,
                each.yardstick.targets.stride_length,
                each.task.reference.stride_time,
                each.yardstick.targets.speed,
            )
            for each in environments
        ]
        self._known = []
        for each, speed in zip(environments, self._speeds, strict=True):
            tables = _tables(each.yardstick.targets, each.walker.tables)
            self._known.append(
                {
                    name: values * (speed.stride_time if name in RATES else 1.0)
                    for name, values in tables.items()
                }
            )
        self._bias = [each.habits() for each in environments]
        self.habits = self._bias[0]
        self.now = self._speeds[0]

    @property
    def slowest(self) -> float:
        """m/s."""
        return self._speeds[0].speed

    @property
    def fastest(self) -> float:
        """m/s."""
        return self._speeds[-1].speed

    def at(self, speed: float, targets: Targets, servo: ReferenceTables) -> Targets:
        """Write the tables at a speed, m/s, clipped to what is known, into those of `targets` and
        `servo`; gives `targets` with the numbers of that speed.
        """
        speed = min(max(speed, self.slowest), self.fastest)
        places = [each.speed for each in self._speeds]
        upper = min(max(int(np.searchsorted(places, speed)), 1), len(places) - 1)
        if len(places) == 1:
            upper = 0
        lower = max(upper - 1, 0)
        below, above = self._speeds[lower], self._speeds[upper]
        share = 0.0 if upper == lower else (speed - below.speed) / (above.speed - below.speed)

        def between(first: float, second: float) -> float:
            return first + share * (second - first)

        length = between(below.stride_length, above.stride_length)
        self.now = Speed(
            speed, length, length / speed, between(below.dimensionless, above.dimensionless)
        )
        for name, out in _tables(targets, servo).items():
            first, second = self._known[lower][name], self._known[upper][name]
            np.subtract(second, first, out=out)
            out *= share
            out += first
            if name in RATES:
                out /= self.now.stride_time
        self.habits = self._bias[lower] + share * (self._bias[upper] - self._bias[lower])
        return targets._replace(stride_length=length, speed=self.now.dimensionless)
