"""What a walk was made of: the steps of the engine, and the contact law again at its states."""

from collections.abc import Iterator
from contextlib import contextmanager

import numpy as np
import pytest

from gaitval.arrays import Array
from gaitval.walk.contact.forces import ground_forces
from gaitval.walk.simulation.rollout import Rollout
from gaitval.walk.simulation.walker import Steps, Trajectory, Walker, WalkingTask


@contextmanager
def engine_steps() -> Iterator[list[Steps]]:
    """The steps of each walk that is recorded meanwhile, as the engine made them."""
    found: list[Steps] = []
    kept = Trajectory.steps
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(Trajectory, "steps", lambda self: found.append(kept(self)) or found[-1])
        yield found


def ground_again(walk: Rollout, task: WalkingTask, velocities: Array) -> tuple[Array, Array]:
    """Wrench of the ground on both feet (T, 2, 6), as `Rollout.wrenches`, and its generalised force
    (T, 31), by the positions of a `walk` and `velocities` (T, 31). The lag begins without a force.
    """
    walker = Walker(task)
    walker.set_parameters(walk.mu)
    memory = np.zeros((len(task.model.spheres), 3))
    feet, generalised = np.zeros((len(walk.time), 2, 6)), np.zeros_like(walk.positions)
    for row, at in enumerate(walk.positions):
        ground_forces(
            walker.tree, walker.law, at, velocities[row], walker.lag, memory, generalised[row],
            feet[row],
        )  # fmt: skip
    return feet, generalised
