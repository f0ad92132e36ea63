"""What balance is judged by in one walk: paths of the centre of mass and the feet, and steps.

Axes are those of a rollout: x forward, y left, z up; m, s, N.
"""

from dataclasses import dataclass
from typing import Final

import numpy as np

from gaitval.arrays import Array
from gaitval.constants import GRAVITY
from gaitval.coordinates import SIDES, Side
from gaitval.metrics.cycles import foot_events
from gaitval.model.body import SEGMENTS, BodyModel
from gaitval.model.tree import segment_frames
from gaitval.walk.simulation.rollout import Rollout

OUTWARD: Final = (-1.0, 1.0)
"""Sign of y that points outward of the right and the left foot."""
_FEET: Final = tuple(SEGMENTS.index(f"foot_{side[0]}") for side in SIDES)


@dataclass(frozen=True)
class Footstep:
    """A foot that is placed.

    Attributes
    ----------
    side : of the foot.
    strike : row of its heel strike.
    lift : row at which it left the ground before; 0 if that was before the walk began.
    """

    side: Side
    strike: int
    lift: int

    @property
    def column(self) -> int:
        """0 for the right foot, 1 for the left."""
        return SIDES.index(self.side)


@dataclass(frozen=True)
class BalanceWalk:
    """A walk, T rows.

    Attributes
    ----------
    time : (T,) s.
    centre, velocity : (T, 3) of the centre of mass.
    feet : (T, 2, 3) right and left ankle.
    pressure : (T, 2, 2) m, x and y of the centre of pressure of each foot; NaN off the ground.
    force : (T, 2, 3) N, of the ground on each foot.
    steps : in order.
    pendulum : m, height of the centre of mass above the ground, mean of the walk before it was
        disturbed: the length of the pendulum that it is compared with.
    onset : row at which the disturbance begins; T if there is none.
    fell : whether it ended in a fall.
    """

    time: Array
    centre: Array
    velocity: Array
    feet: Array
    pressure: Array
    force: Array
    steps: tuple[Footstep, ...]
    pendulum: float
    onset: int
    fell: bool

    @property
    def rate(self) -> float:
        """1/s, eigenfrequency of the pendulum."""
        return float(np.sqrt(GRAVITY / self.pendulum))

    @property
    def extrapolated(self) -> Array:
        """(T, 2) m, the extrapolated centre of mass: its place plus its velocity over `rate` (Hof
        2005), forward and left.
        """
        return np.asarray(self.centre[:, :2] + self.velocity[:, :2] / self.rate)

    def after(self) -> list[Footstep]:
        """The steps whose heel strike is after the disturbance began."""
        return [each for each in self.steps if each.strike >= self.onset]

    def offset(self, step: Footstep) -> Array:
        """(2,) m, of the foot from the extrapolated centre of mass at its heel strike: forward, and
        outward.
        """
        away = self.feet[step.strike, step.column, :2] - self.extrapolated[step.strike]
        return np.asarray(away * [1.0, OUTWARD[step.column]])


def steps_of(vertical: Array, *, step: float, threshold: float) -> tuple[Footstep, ...]:
    """The steps of a walk with `vertical` forces (T, 2) N on the right and left foot, every `step`
    s; a foot is on the ground above the `threshold`, N.
    """
    found = []
    for column, side in enumerate(SIDES):
        events = foot_events(vertical[:, column], step=step, threshold=threshold)
        for strike in events.heel_strikes.tolist():
            lifts = events.toe_offs[events.toe_offs < strike]
            found.append(Footstep(side, strike, int(lifts[-1]) if len(lifts) else 0))
    return tuple(sorted(found, key=lambda each: each.strike))


def walked(rollout: Rollout, model: BodyModel, *, threshold: float) -> BalanceWalk:
    """What balance is judged by in a `rollout` of the body `model` as it walked, disturbed by its
    push. A foot is on the ground above `threshold` N.
    """
    pushed = np.flatnonzero(rollout.root_force.any(axis=1))
    onset = int(pushed[0]) if len(pushed) else len(rollout.time)
    step = float(rollout.time[1] - rollout.time[0])
    frames = segment_frames(model, rollout.positions)
    before = slice(0, max(onset, 2))
    return BalanceWalk(
        time=rollout.time,
        centre=rollout.centre_of_mass,
        velocity=np.gradient(rollout.centre_of_mass, step, axis=0),
        feet=frames[..., :3, 3][:, list(_FEET)],
        pressure=rollout.centre_of_pressure[..., :2],
        force=rollout.ground_reaction,
        steps=steps_of(rollout.ground_reaction[..., 2], step=step, threshold=threshold),
        pendulum=float(rollout.centre_of_mass[before, 2].mean()),
        onset=onset,
        fell=bool(rollout.fell[0]),
    )
