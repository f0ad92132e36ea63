"""Whether only what acts on a simulated body changes its momentum (Newton's second law)."""

import numpy as np

from gaitval.constants import GRAVITY
from gaitval.model.ground import LEVEL, Ground
from gaitval.walk.simulation.rollout import Rollout

EVERY = 1.0
"""s over which the balance is made. A rollout is stored in single precision, 4e-6 m of the centre
of mass 34 m from where it started, so a velocity over two steps of 2 ms is known to 1e-3 m/s, which
over a second is 0.01 % of the weight."""


def momentum_residual(rollout: Rollout, mass: float, ground: Ground = LEVEL) -> float | None:
    """The largest force on a body of `mass` (kg) in `rollout` on a `ground` that ground, gravity
    and push do not explain, % of body weight; None if it is shorter than two windows.

    Over windows of `EVERY` seconds, each half a window later than the one before: the change of
    momentum less the impulse of all external forces, divided by the duration (Newton's second law,
    integrated as the simulation does).
    """
    step = float(rollout.time[1] - rollout.time[0]) if len(rollout.time) > 1 else EVERY
    window = round(EVERY / step)
    if len(rollout.time) < 2 * window:
        return None
    force = rollout.ground_reaction.sum(axis=1) + rollout.root_force[:, 3:]
    force = force + mass * ground.gravity
    starts = np.arange(1, len(force) - window - 1, window // 2)
    # windows overlap by half, so that a force at the edge of one is inside another
    ends = starts + window
    velocity = np.gradient(rollout.centre_of_mass, step, axis=0)
    # The force at a sample changes the velocity over the step before it to that over the step after
    # it, and a central difference is the mean of both.
    total = np.cumsum(force, axis=0)
    impulse = step * 0.5 * ((total[ends] - total[starts]) + (total[ends - 1] - total[starts - 1]))
    change = mass * (velocity[ends] - velocity[starts])
    residual = np.linalg.norm(change - impulse, axis=1) / (window * step)
    return float(100.0 * residual.max() / (mass * GRAVITY))
