"""The physics steps of one action of a walker: servos, contact, dynamics (compiled)."""

from collections.abc import Iterator
from typing import NamedTuple

import numpy as np

from gaitval._internal.numba.compiled import njit, njit_borrowing
from gaitval.arrays import Array
from gaitval.model.tree import (
    ACTUATED_COUNT,
    COORDINATE_COUNT,
    SEGMENT_COUNT,
    Frames,
    Tree,
    empty_frames,
    forward,
    velocities,
)
from gaitval.walk.contact.forces import ContactWorkspace, contact_forces, contact_workspace
from gaitval.walk.contact.law import ContactLaw
from gaitval.walk.simulation.dynamics import (
    DynamicsWorkspace,
    accelerations,
    dynamics_workspace,
    integrate,
)
from gaitval.walk.simulation.servo import ReferenceTables
from gaitval.walk.simulation.tables import read_table


class WalkerBody(NamedTuple):
    """What a physics step needs to know about a body and its servos.

    Attributes
    ----------
    stiffness, damping : (25,) Nm/rad and Nms/rad of the servos.
    total_damping : (25,) Nms/rad, with the passive joint damping.
    lag : (2,) as in `walk.contact.forces.contact_forces`.
    physics_step : s.
    phase_step : fraction of a gait cycle in a physics step.
    """

    tree: Tree
    law: ContactLaw
    tables: ReferenceTables
    stiffness: Array
    damping: Array
    total_damping: Array
    lag: Array
    physics_step: float
    phase_step: float


class Action(NamedTuple):
    """What an action asks for.

    Attributes
    ----------
    pace : rate of the phase over that of the reference.
    offset, next_offset : (25,) rad, of the joint targets before and at the end of the action.
    root_force : (6,) external moment Nm and force N on the pelvis (a push), world.
    """

    pace: float
    offset: Array
    next_offset: Array
    root_force: Array


class Account(NamedTuple):
    """The physics steps of one action, N rows.

    Attributes
    ----------
    phase : (N,) of the right gait cycle, after the step.
    positions, velocities : (N, 31) after the step.
    moments : (N, 25) Nm, net joint moments that acted.
    feet : (N, 2, 6) right and left foot, force N of the ground and moment Nm about the world
        origin that acted.
    mean_ground_reaction : (2, 3) N, right and left foot, mean over all rows.
    mean_moments, mean_square_moments : (25,) Nm, Nm², likewise.
    """

    phase: Array
    positions: Array
    velocities: Array
    moments: Array
    feet: Array
    mean_ground_reaction: Array
    mean_moments: Array
    mean_square_moments: Array


def empty_account(count: int) -> Account:
    """Account of `count` physics steps, to be filled."""
    states, joints = (count, COORDINATE_COUNT), (ACTUATED_COUNT,)
    rows = (count,), states, states, (count, *joints), (count, 2, 6)
    return Account(*(np.zeros(shape) for shape in (*rows, (2, 3), joints, joints)))


class Workspace(NamedTuple):
    """Arrays that a physics step works in: what moves, the forces (31,) of `forces`, what the
    reference asks for (3, 25), its command (25,) and feet (2, 6), and the acceleration (31,) that
    they make.
    """

    frames: Frames
    contact: ContactWorkspace
    dynamics: DynamicsWorkspace
    forces: Array
    targets: Array
    command: Array
    feet: Array
    acceleration: Array


@njit
def workspace(spheres: int) -> Workspace:
    """Arrays to be filled, for a body with this many contact spheres (`spheres`)."""
    return Workspace(
        empty_frames(),
        contact_workspace(spheres),
        dynamics_workspace(),
        np.empty(COORDINATE_COUNT),
        np.empty((3, ACTUATED_COUNT)),
        np.empty(ACTUATED_COUNT),
        np.empty((2, 6)),
        np.empty(COORDINATE_COUNT),
    )


@njit_borrowing
def forces(
    body: WalkerBody,
    state: Array,
    phase: float,
    pace: float,
    offset: Array,
    root_force: Array,
    memory: Array,
    work: Workspace,
) -> None:
    """Frames of all segments and the generalised forces that one physics step applies.

    Parameters
    ----------
    body, state : what steps, and its positions and velocities (2, 31).
    phase, pace : of the gait cycle, and its rate over that of the reference.
    offset : (25,) rad, of the joint targets.
    root_force : (6,) external moment Nm and force N on the pelvis (a push), world.
    memory : (K, 3) N, in and out, as `walk.contact.forces.contact_forces`.
    work : its frames, forces, command (the servos' share, Nm) and feet are filled.
    """
    tree, tables, frames = body.tree, body.tables, work.frames
    forces, command = work.forces, work.command
    targets = work.targets
    read_table(tables.positions, phase, targets[0])
    read_table(tables.velocities, phase, targets[1])
    read_table(tables.moments, phase, targets[2])
    for i in range(ACTUATED_COUNT):
        # Only what does not depend on the state: k (q̂ + a) + d p q̂̇ + τ_ff. The integrator adds
        # -k q - (d + β) q̇ implicitly (`walker`).
        target, rate, moment = targets[0, i], targets[1, i], targets[2, i]
        command[i] = (
            body.stiffness[i] * (target + offset[i]) + body.damping[i] * pace * rate + moment
        )
        forces[6 + i] = command[i]
    for i in range(6):
        forces[i] = root_force[i]
    forward(tree.joint_position, state[0], frames, SEGMENT_COUNT)
    velocities(state[1], frames, SEGMENT_COUNT)
    contact_forces(tree, body.law, frames, body.lag, memory, forces, work.feet, work.contact)


@njit_borrowing
def enter(
    body: WalkerBody, state: Array, phase: float, row: int, account: Account, work: Workspace
) -> None:
    """Write the step of a `body` that led to `state` and `phase`, with its forces in `work`, in row
    `row` of the account.
    """
    command, feet = work.command, work.feet
    share = 1.0 / account.phase.shape[0]
    if row == 0:
        for side in range(2):
            for i in range(3):
                account.mean_ground_reaction[side, i] = 0.0
        for i in range(ACTUATED_COUNT):
            account.mean_moments[i] = account.mean_square_moments[i] = 0.0
    account.phase[row] = phase
    for i in range(COORDINATE_COUNT):
        account.positions[row, i] = state[0, i]
        account.velocities[row, i] = state[1, i]
    for side in range(2):
        for i in range(6):
            account.feet[row, side, i] = feet[side, i]
        for i in range(3):
            account.mean_ground_reaction[side, i] += share * feet[side, i]
    for i in range(ACTUATED_COUNT):
        # The torque that acted is known exactly, because spring and dampers were implicit in the
        # state after the step.
        moment = (
            command[i]
            - body.stiffness[i] * state[0, 6 + i]
            - body.total_damping[i] * state[1, 6 + i]
        )
        account.moments[row, i] = moment
        account.mean_moments[i] += share * moment
        account.mean_square_moments[i] += share * moment * moment


@njit_borrowing
def steps(
    body: WalkerBody,
    state: Array,
    phase: float,
    pace: float,
    target: Array,
    slope: Array,
    root_force: Array,
    memory: Array,
    account: Account,
    work: Workspace,
) -> float:
    """`advance`, of one walker, or of eight in lanes; returns the phase after the last step.

    Parameters
    ----------
    body, state, phase, pace, root_force, memory, account : as in `advance` and `Action`.
    target : (25,) rad, in and out: offset of the joint targets before the first step.
    slope : (25,) rad, change of the targets from step to step.
    work : overwritten.
    """
    step, acceleration = body.physics_step, work.acceleration
    for row in range(account.phase.shape[0]):
        for i in range(ACTUATED_COUNT):
            target[i] += slope[i]
        forces(body, state, phase, pace, target, root_force, memory, work)
        accelerations(
            body.tree, work.frames, state, work.forces, body.stiffness, body.total_damping, step,
            work.dynamics, acceleration,
        )  # fmt: skip
        integrate(state, acceleration, step)
        phase += pace * body.phase_step
        enter(body, state, phase, row, account, work)
    return phase


@njit
def advance(
    body: WalkerBody, state: Array, phase: float, action: Action, memory: Array, account: Account
) -> float:
    """All physics steps of an action; returns the phase after them.

    Parameters
    ----------
    body, phase : what walks, and the phase of the right gait cycle before the action.
    state : (2, 31) in and out.
    action : what is asked for.
    memory : (K, 3) in and out, as `walk.contact.forces.contact_forces`.
    account : filled; its length is the number of steps.
    """
    pace, offset, next_offset, root_force = action
    slope = (next_offset - offset) / account.phase.shape[0]
    target, work = offset.copy(), workspace(memory.shape[0])
    phase = steps(body, state, phase, pace, target, slope, root_force, memory, account, work)
    return phase


@njit
def outside_steps(
    substeps: int,
    body: WalkerBody,
    state: Array,
    phase: float,
    pace: float,
    target: Array,
    slope: Array,
    root_force: Array,
    memory: Array,
    account: Account,
    work: Workspace,
) -> Iterator[int]:
    """`steps` of one walker with another engine's dynamics and integrator: it stops before each of
    the engine's steps, so many `substeps` in a physics step, for the caller to make it under
    `work.forces` and to change `state`. Yields the row of the account that the engine's step
    belongs to. `slope` is the change of the targets in one of them; `body`, `state`, `phase`,
    `pace`, `target`, `root_force`, `memory`, `account` and `work` are as in `steps`.

    A generator is handed its arguments once. To hand a body to two compiled functions in every
    physics step took longer than DART needs for it.
    """
    for row in range(account.phase.shape[0]):
        for _ in range(substeps):
            for i in range(ACTUATED_COUNT):
                target[i] += slope[i]
            forces(body, state, phase, pace, target, root_force, memory, work)
            yield row
            phase += pace * body.phase_step / substeps
        enter(body, state, phase, row, account, work)
