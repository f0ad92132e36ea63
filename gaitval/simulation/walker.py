"""One walking body: its dynamics, ground contact and joint servos, advanced one action at a time.

The servo of a joint is τ = k (q̂(φ) + a − q) + d (p q̂̇(φ) − q̇) + τ_ff(φ) − β q̇, with q̂ the
reference, a the action's offset, p its pace, τ_ff the reference's moment and β the passive joint
damping. The phase φ of the gait cycle grows p times as fast as in the reference. The spring and the
dampers are integrated implicitly (as springs about zero); terms that do not depend on the state
enter as forces, so the torque that acted is known exactly: τ = command − k q⁺ − (d + β) q̇⁺ with
the state after the step.

Two engines advance the body in the same way: `compiled` (`simulation/dynamics.py`), which runs
all physics steps of an action in one compiled call, and DART.
"""

from dataclasses import dataclass
from typing import TYPE_CHECKING, Literal, NamedTuple

import numpy as np

from gaitval.arrays import Array
from gaitval.compiled import njit, njit_borrowing
from gaitval.configuration import Configuration
from gaitval.constants import GRAVITY
from gaitval.gait.record import GaitRecord
from gaitval.model.body import BodyModel
from gaitval.model.contact import (
    ContactWorkspace,
    contact_forces,
    contact_workspace,
    ground_forces,
)
from gaitval.model.contact_law import ContactLaw, contact_law
from gaitval.model.parameters import PARAMETERS, apply_parameters, nominal_parameters
from gaitval.model.tree import Frames, Tree, empty_frames, forward, tree_arrays, velocities
from gaitval.reference.dynamic_fit import consistent_reference
from gaitval.reference.motion import ReferenceMotion
from gaitval.simulation.dynamics import (
    DynamicsWorkspace,
    accelerations,
    dynamics_workspace,
    integrate,
)
from gaitval.simulation.servo import ReferenceTables, reference_tables, servo_stiffness

if TYPE_CHECKING:
    from gaitval.simulation.skeleton import HumanSkeleton

Engine = Literal["compiled", "dart"]


@dataclass(frozen=True)
class WalkingTask:
    """What a policy is trained for: a body, the person's gait, and all constants."""

    model: BodyModel
    record: GaitRecord
    reference: ReferenceMotion
    configuration: Configuration

    @classmethod
    def of(
        cls, model: BodyModel, record: GaitRecord, configuration: Configuration
    ) -> "WalkingTask":
        """The task with the reference motion of a record on a model."""
        reference = consistent_reference(record, model, configuration.contact)
        return cls(model, record, reference, configuration)


class WalkerBody(NamedTuple):
    """What a physics step needs to know about a body and its servos.

    Attributes
    ----------
    stiffness, damping : (25,) Nm/rad and Nms/rad of the servos.
    total_damping : (25,) Nms/rad, with the passive joint damping.
    lag : (2,) as in `model.contact.contact_forces`.
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


def empty_account(steps: int) -> Account:
    """Account of this many steps, to be filled."""
    return Account(
        np.zeros(steps),
        np.zeros((steps, 31)),
        np.zeros((steps, 31)),
        np.zeros((steps, 25)),
        np.zeros((steps, 2, 6)),
        np.zeros((2, 3)),
        np.zeros(25),
        np.zeros(25),
    )


class Workspace(NamedTuple):
    """Arrays that a physics step works in: what moves, the forces (31,) of `_forces`, its command
    (25,) and feet (2, 6), and the acceleration (31,) that they make.
    """

    frames: Frames
    contact: ContactWorkspace
    dynamics: DynamicsWorkspace
    forces: Array
    command: Array
    feet: Array
    acceleration: Array


@njit
def _workspace(spheres: int) -> Workspace:
    return Workspace(
        empty_frames(),
        contact_workspace(spheres),
        dynamics_workspace(),
        np.empty(31),
        np.empty(25),
        np.empty((2, 6)),
        np.empty(31),
    )


@njit_borrowing
def _forces(
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
    pace : rate of the phase over that of the reference.
    offset : (25,) rad, of the joint targets.
    root_force : (6,) external moment Nm and force N on the pelvis (a push), world.
    work : its frames, forces, command (the servos' share, Nm) and feet are filled.
    """
    tree, tables, frames = body.tree, body.tables, work.frames
    forces, command = work.forces, work.command
    count = tables.positions.shape[0] - 1
    place = (phase - np.floor(phase)) * count
    row = int(place)
    part = place - row
    for i in range(25):
        target = (1.0 - part) * tables.positions[row, i] + part * tables.positions[row + 1, i]
        rate = (1.0 - part) * tables.velocities[row, i] + part * tables.velocities[row + 1, i]
        moment = (1.0 - part) * tables.moments[row, i] + part * tables.moments[row + 1, i]
        command[i] = (
            body.stiffness[i] * (target + offset[i]) + body.damping[i] * pace * rate + moment
        )
        forces[6 + i] = command[i]
    for i in range(6):
        forces[i] = root_force[i]
    forward(tree.joint_position, state[0], frames.rotation, frames.origin, frames.axes, 14)
    velocities(frames.origin, frames.axes, state[1], frames.angular, frames.linear, 14)
    contact_forces(tree, body.law, frames, body.lag, memory, forces, work.feet, work.contact)


@njit_borrowing
def _enter(
    body: WalkerBody, state: Array, phase: float, row: int, account: Account, work: Workspace
) -> None:
    """Enter the step that led to `state` and `phase` in row `row` of the account."""
    command, feet = work.command, work.feet
    share = 1.0 / account.phase.shape[0]
    if row == 0:
        account.mean_ground_reaction[:, :] = 0.0
        account.mean_moments[:] = 0.0
        account.mean_square_moments[:] = 0.0
    account.phase[row] = phase
    for i in range(31):
        account.positions[row, i] = state[0, i]
        account.velocities[row, i] = state[1, i]
    for side in range(2):
        for i in range(6):
            account.feet[row, side, i] = feet[side, i]
        for i in range(3):
            account.mean_ground_reaction[side, i] += share * feet[side, i]
    for i in range(25):
        moment = (
            command[i]
            - body.stiffness[i] * state[0, 6 + i]
            - body.total_damping[i] * state[1, 6 + i]
        )
        account.moments[row, i] = moment
        account.mean_moments[i] += share * moment
        account.mean_square_moments[i] += share * moment * moment


@njit_borrowing
def _steps(
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
    """`_advance`, with the change `slope` (25,) rad of the targets from step to step."""
    for row in range(account.phase.shape[0]):
        for i in range(25):
            target[i] += slope[i]
        _forces(body, state, phase, pace, target, root_force, memory, work)
        accelerations(
            body.tree,
            work.frames,
            state,
            work.forces,
            body.stiffness,
            body.total_damping,
            body.physics_step,
            work.dynamics,
            work.acceleration,
        )
        integrate(state, work.acceleration, body.physics_step)
        phase += pace * body.phase_step
        _enter(body, state, phase, row, account, work)
    return phase


@njit
def _advance(
    body: WalkerBody,
    state: Array,
    phase: float,
    action: Action,
    memory: Array,
    account: Account,
) -> float:
    """All physics steps of an action; returns the phase after them.

    Parameters
    ----------
    state : (2, 31) in and out.
    memory : (K, 3) in and out, as `model.contact.contact_forces`.
    account : filled; its length is the number of steps.
    """
    pace, offset, next_offset, root_force = action
    slope = (next_offset - offset) / account.phase.shape[0]
    target, work = offset.copy(), _workspace(memory.shape[0])
    phase = _steps(body, state, phase, pace, target, slope, root_force, memory, account, work)
    return phase


def _skeleton(model: BodyModel, physics_step: float) -> "HumanSkeleton":
    from gaitval.simulation.skeleton import HumanSkeleton  # imports dartpy, which is slow

    return HumanSkeleton(model, physics_step=physics_step)


def _advance_in_dart(
    skeleton: "HumanSkeleton",
    body: WalkerBody,
    state: Array,
    phase: float,
    action: Action,
    memory: Array,
    account: Account,
) -> float:
    """`_advance` with DART's dynamics and integrator; the skeleton is at `state`."""
    pace, offset, next_offset, root_force = action
    work = _workspace(len(memory))
    target = offset.copy()
    slope = (next_offset - offset) / len(account.phase)
    for row in range(len(account.phase)):
        target += slope
        _forces(body, state, phase, pace, target, root_force, memory, work)
        skeleton.skeleton.setForces(work.forces)
        skeleton.step()
        state[0] = skeleton.skeleton.getPositions()
        state[1] = skeleton.skeleton.getVelocities()
        phase += pace * body.phase_step
        _enter(body, state, phase, row, account, work)
    return phase


class Trajectory:
    """Arrays that `Walker.step` fills, one row a physics step; see `Account`."""

    def __init__(self, steps: int) -> None:
        self.rows = 0
        account = empty_account(steps)
        self.phase = account.phase
        self.positions = account.positions
        self.velocities = account.velocities
        self.moments = account.moments
        self.feet = account.feet
        self.root_force = np.zeros((steps, 6))

    def append(self, account: Account, root_force: Array) -> None:
        """Add an action's steps and the external force (6,) on the pelvis during it."""
        rows = slice(self.rows, self.rows + len(account.phase))
        self.phase[rows] = account.phase
        self.positions[rows] = account.positions
        self.velocities[rows] = account.velocities
        self.moments[rows] = account.moments
        self.feet[rows] = account.feet
        self.root_force[rows] = root_force
        self.rows = rows.stop


class Walker:
    """A body on the ground that follows the reference through its joint servos.

    Parameters
    ----------
    engine : `compiled`, or `dart`; they agree to rounding (tested).

    Attributes
    ----------
    gains : (2, 25) servo stiffness Nm/rad and damping Nms/rad (without passive damping).
    tree, law, lag : the body and its contact with the parameters `mu` (14,), see
        `model.contact.contact_forces`.
    state : (2, 31) positions and velocities after the last physics step.
    phase : of the right gait cycle, not wrapped: whole cycles walked are counted in it.
    mean_ground_reaction : (2, 3) N, right and left foot, mean over the last action.
    mean_moments, mean_square_moments : (25,) Nm, Nm², joint moments over the last action.
    """

    def __init__(self, task: WalkingTask, *, engine: Engine = "compiled") -> None:
        environment = task.configuration.environment
        self.task = task
        self.engine = engine
        self.physics_step = environment.physics_step
        self.steps_per_action = environment.steps_per_action
        self.action_seconds = self.physics_step * self.steps_per_action
        self.weight = task.model.mass * GRAVITY
        stiffness = servo_stiffness(task.configuration.servo, task.model.mass)
        self.gains = np.vstack([stiffness, task.configuration.servo.damping_time * stiffness])
        self._tables = reference_tables(task.reference, task.configuration.servo.feed_forward)
        self._skeleton = _skeleton(task.model, self.physics_step) if engine == "dart" else None
        self.state = np.zeros((2, 31))
        self.phase = 0.0
        self.offset = np.zeros(25)
        self._account = empty_account(self.steps_per_action)
        self.mean_ground_reaction = self._account.mean_ground_reaction
        self.mean_moments = self._account.mean_moments
        self.mean_square_moments = self._account.mean_square_moments
        # A foot's contact moves the foot, its toes and about as much of the shank.
        moved_mass = 2.0 * (task.model["foot_r"].mass + task.model["toes_r"].mass)
        self.lag = np.full(2, self.physics_step / moved_mass)
        self._memory = np.zeros((len(task.model.spheres), 3))
        self.set_parameters(nominal_parameters())

    def set_parameters(self, mu: Array) -> None:
        """Give the body the parameters mu (14,), in the order of `PARAMETERS`."""
        self.mu = np.asarray(mu, dtype=float)
        model = apply_parameters(self.task.model, self.mu)
        self.tree = tree_arrays(model)
        friction = float(self.mu[PARAMETERS.index("friction")])
        self.law = contact_law(self.task.configuration.contact, friction)
        stiffness, damping = self.gains
        self._body = WalkerBody(
            self.tree,
            self.law,
            self._tables,
            stiffness,
            damping,
            damping + self.mu[PARAMETERS.index("damping")],
            self.lag,
            self.physics_step,
            self.physics_step / self.task.reference.stride_time,
        )
        if self._skeleton is not None:
            self._skeleton.configure(model)
            self._skeleton.set_servo(stiffness, self._body.total_damping)

    def reset(self, positions: Array, velocities: Array, phase: float) -> None:
        """Place the body at a state (31,), (31,) and a phase."""
        self.state[0] = positions
        self.state[1] = velocities
        if self._skeleton is not None:
            self._skeleton.skeleton.setPositions(positions)
            self._skeleton.skeleton.setVelocities(velocities)
        self.phase = float(phase)
        self.offset[:] = 0.0
        # The feet carry the body from the first step on, as if it had been walking.
        ground_forces(
            self.tree, self.law, self.state[0], self.state[1],
            np.zeros(2), self._memory, np.zeros(31), np.zeros((2, 6)),
        )  # fmt: skip
        self.mean_ground_reaction[:] = 0.0
        self.mean_moments[:] = 0.0
        self.mean_square_moments[:] = 0.0

    def step(
        self,
        offset: Array,
        root_force: Array,
        recording: Trajectory | None = None,
        *,
        pace: float = 1.0,
    ) -> None:
        """Advance by one action.

        The offset of the joint targets moves linearly from the last action's to this one's, so
        that joint moments have no steps.

        Parameters
        ----------
        offset : (25,) rad.
        root_force : (6,) external moment Nm and force N on the pelvis, world.
        pace : how fast to go through the gait cycle, 1 as fast as the reference.
        """
        account = self._account
        action = Action(pace, self.offset, offset, root_force)
        walk = (self._body, self.state, self.phase, action, self._memory, account)
        if self._skeleton is None:
            self.phase = _advance(*walk)
        else:
            self.phase = _advance_in_dart(self._skeleton, *walk)
        self.offset[:] = offset
        if recording is not None:
            recording.append(account, root_force)
