"""Walks of a mass point that obey Newton's second law but for a hidden force of known size."""

import numpy as np

from gaitval.constants import GRAVITY
from gaitval.walk.simulation.rollout import Rollout

MASS, STEP = 70.0, 0.002


def newton_walk(hidden: np.ndarray, seconds: float = 5.0) -> Rollout:
    """A body that ground, gravity and a hidden force (N) move from rest; the ground's force swings
    by a third of the weight."""
    count = round(seconds / STEP)
    time = STEP * np.arange(count)
    weight = MASS * GRAVITY
    force = weight * np.column_stack(
        [0.1 * np.sin(6.0 * time), 0.05 * np.cos(6.0 * time), 1.0 + 0.3 * np.sin(12.0 * time)]
    )
    change = (force - [0.0, 0.0, weight] + hidden) * STEP / MASS
    velocity = np.cumsum(change, axis=0) - change  # a row's force acts in the step after it
    path = np.cumsum(velocity, axis=0) * STEP
    feet = np.stack([0.4 * force, 0.6 * force], axis=1)
    nothing = np.zeros((count, 6))
    return Rollout(
        time=time,
        phase=time,
        positions=np.zeros((count, 31)),
        velocities=np.zeros((count, 31)),
        moments=np.zeros((count, 25)),
        ground_reaction=feet,
        centre_of_pressure=feet,
        free_moment=np.zeros((count, 2)),
        centre_of_mass=path.astype(np.float32),
        root_force=nothing,
        mu=np.zeros(14),
        start_phase=np.zeros(1),
        fell=np.zeros(1),
    )
