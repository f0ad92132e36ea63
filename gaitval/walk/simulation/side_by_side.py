"""Eight walkers that take their physics steps side by side, one in each lane of a vector.

The functions are those of a single walker (`walk.simulation.physics_steps`), compiled for `lanes`,
so each walker's steps are, bit for bit, those that it takes alone.
"""

from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np

from gaitval._internal.numba.compiled import njit_borrowing
from gaitval._internal.numba.lanes import WIDTH, in_lanes, numbers_in_lanes, with_lanes
from gaitval.arrays import Array
from gaitval.model.tree import ACTUATED_COUNT, Tree
from gaitval.walk.simulation.physics_steps import (
    Account,
    WalkerBody,
    Workspace,
    empty_account,
    steps,
    workspace,
)
from gaitval.walk.simulation.servo import ReferenceTables
from gaitval.walk.simulation.tables import LaneTables
from gaitval.walk.simulation.walker import Walker, WalkerArrays, walker_arrays


class LaneArrays(NamedTuple):
    """What an action asks for and changes, with a last axis of eight.

    Attributes
    ----------
    walkers : `WalkerArrays`; the offset is the one before the action.
    phase, pace : (1, 8).
    next_offset : (25, 8) rad, at the end of the action.
    root_force : (6, 8).
    target, slope : (25, 8) rad, of the joint targets' offsets, to work in.
    """

    walkers: WalkerArrays
    phase: Array
    pace: Array
    next_offset: Array
    root_force: Array
    target: Array
    slope: Array


@njit_borrowing
def advance_lanes(
    bodies: WalkerBody, arrays: LaneArrays, account: Account, work: Workspace
) -> None:
    """All physics steps of an action of eight walkers (`physics_steps.advance`) with `bodies` whose
    numbers and arrays have a last axis of eight, but for what all have in common; `phase_step` is
    (1, 8). Phases and states of `arrays` change; `account`, whose length is the number of steps, is
    filled, with a last axis of eight; `work` is overwritten.
    """
    # The same memory, seen as arrays whose elements are vectors of eight numbers (`lanes`).
    lanes = in_lanes(arrays)
    walkers = lanes.walkers
    count = account.phase.shape[0]
    for i in range(ACTUATED_COUNT):
        lanes.target[i] = walkers.offset[i]
        lanes.slope[i] = (lanes.next_offset[i] - walkers.offset[i]) / float(count)
    body = WalkerBody(
        in_lanes(bodies.tree), numbers_in_lanes(bodies.law), bodies.tables,
        in_lanes(bodies.stiffness), in_lanes(bodies.damping), in_lanes(bodies.total_damping),
        # The step is common to all, so not in lanes.
        in_lanes(bodies.lag), bodies.physics_step, in_lanes(bodies.phase_step)[0],
    )  # fmt: skip
    lanes.phase[0] = steps(
        body, walkers.state, lanes.phase[0], lanes.pace[0], lanes.target, lanes.slope,
        lanes.root_force, walkers.memory, in_lanes(account), in_lanes(work),
    )  # fmt: skip


def _tables_of(walkers: Sequence[Walker]) -> Any:
    """What the servos of each walker follow; walkers of one task share it."""
    kinds = list({id(walker.task): walker.tables for walker in walkers}.items())
    # A table once for each task, and for each lane its number: the tables are large, and eight
    # copies of one would not stay in the processor's cache.
    order = [key for key, _ in kinds]
    which = np.array([order.index(id(walker.task)) for walker in walkers])
    stacks = [np.array(tables) for tables in zip(*(tables for _, tables in kinds), strict=True)]
    members: Any = (LaneTables(stack, which) for stack in stacks)
    return ReferenceTables(*members)


class SideBySide:
    """Bodies and working arrays of eight walkers.

    They have the same physics step and number of spheres; the tasks of the walkers are not changed.

    Parameters
    ----------
    walkers : eight, with the compiled engine.

    Attributes
    ----------
    bodies, arrays, account, work : as `advance_lanes` takes them.
    """

    def __init__(self, walkers: Sequence[Walker]) -> None:
        first = walkers[0]
        body, spheres = first.body, len(first.task.model.spheres)
        one = np.zeros(1)
        kind: Any = type(first.law)
        assert all(type(walker.law) is kind for walker in walkers), "one contact law for all"
        law = kind(*(np.zeros(WIDTH) for _ in kind._fields))
        tree, stiffness, damping, total, lag, phase_step = (
            with_lanes(arrays) for arrays in (body.tree, *body[3:6], body.lag, one)
        )
        self.bodies = WalkerBody(
            tree, law, _tables_of(walkers), stiffness, damping, total, lag,
            body.physics_step, phase_step,
        )  # fmt: skip
        self.account = with_lanes(empty_account(first.steps_per_action))
        arrays = with_lanes(walker_arrays(spheres))._replace(
            ground=self.account.mean_ground_reaction,
            moments=self.account.mean_moments,
            squares=self.account.mean_square_moments,
        )
        joints, force = np.zeros(ACTUATED_COUNT), np.zeros(6)
        members = (with_lanes(array) for array in (one, one, joints, force, joints, joints))
        self.arrays = LaneArrays(arrays, *members)
        self.work = with_lanes(workspace(spheres))
        for lane, walker in enumerate(walkers):
            self.enter_body(lane, walker)

    def enter_body(self, lane: int, walker: Walker) -> None:
        """The walker of a lane has other parameters."""
        bodies, body = self.bodies, walker.body
        phase_step: Any = bodies.phase_step
        on = bodies.tree.sphere_segment, body.tree.sphere_segment
        assert np.array_equal(*on), "spheres on the same segments for all"
        for name in Tree._fields:
            # Which segment a sphere is on is common to all bodies: an index, not in lanes.
            if name != "sphere_segment":
                getattr(bodies.tree, name)[..., lane] = getattr(body.tree, name)
        law: Any = body.law  # a named tuple of numbers
        for name in law._fields:
            getattr(bodies.law, name)[lane] = getattr(law, name)
        for name in ("stiffness", "damping", "total_damping", "lag"):
            getattr(bodies, name)[:, lane] = getattr(body, name)
        phase_step[0, lane] = body.phase_step

    def advance(self) -> None:
        """All physics steps of an action of every walker."""
        advance_lanes(self.bodies, self.arrays, self.account, self.work)
