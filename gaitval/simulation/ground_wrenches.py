"""The wrench of the ground on both feet in a walk: what a force plate under each would feel."""

import numpy as np

from gaitval.arrays import Array
from gaitval.contact.forces import ground_forces
from gaitval.model.tree import COORDINATE_COUNT
from gaitval.simulation.rollout import Rollout
from gaitval.simulation.walker import Walker, WalkingTask


def ground_wrenches(walk: Rollout, task: WalkingTask) -> Array:
    """Force N of the ground on the right and left foot and its moment Nm about the world's origin,
    (T, 2, 6), in the T physics steps of a `walk`; zero in the first row. `task` is the walk's,
    whose body and contact it has.

    A rollout keeps the force and the centre of pressure but not the free moment, so the contact law
    is computed again at its states.
    """
    walker = Walker(task)
    walker.set_parameters(walk.mu)
    memory = np.zeros((len(task.model.spheres), 3))
    found, generalised = np.zeros((len(walk.time), 2, 6)), np.zeros(COORDINATE_COUNT)
    for row in range(1, len(found)):  # a step's force is that of the state before it
        ground_forces(
            walker.tree, walker.law, walk.positions[row - 1], walk.velocities[row - 1],
            walker.lag, memory, generalised, found[row],
        )  # fmt: skip
    return found
