"""One walking body: its dynamics, ground contact and joint servos, advanced one action at a time.

The servo of a joint is τ = k (q̂(φ) + a − q) + d (p q̂̇(φ) − q̇) + τ_ff(φ) − β q̇, with q̂ the
reference, a the action's offset, p its pace, τ_ff the reference's moment and β the passive joint
damping. The phase φ of the gait cycle grows p times as fast as in the reference. The spring and the
dampers are integrated implicitly (as springs about zero); terms that do not depend on the state
enter as forces, so the torque that acted is known exactly: τ = command − k q⁺ − (d + β) q̇⁺ with
the state after the step.

Two engines advance the body in the same way: `compiled` (`walk/simulation/dynamics.py`), which runs
all physics steps of an action in one compiled call, and DART. A third, MuJoCo, is a second-engine
check: with its own integrator and a shorter step its walks are similar, not equal.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any, Literal, NamedTuple

import numpy as np

from gaitval.arrays import Array
from gaitval.configuration import Configuration
from gaitval.constants import GRAVITY
from gaitval.gait.accuracy import RecordAccuracy
from gaitval.gait.record import GaitRecord
from gaitval.model.body import BodyModel
from gaitval.model.parameters import PARAMETERS, apply_parameters, nominal_parameters
from gaitval.model.tree import ACTUATED_COUNT, COORDINATE_COUNT, tree_arrays
from gaitval.walk.contact.forces import ground_forces
from gaitval.walk.contact.law import contact_law
from gaitval.walk.reference.dynamic_fit import consistent_reference
from gaitval.walk.reference.motion import ReferenceMotion
from gaitval.walk.simulation.physics_steps import (
    Account,
    Action,
    WalkerBody,
    advance,
    empty_account,
    outside_steps,
    workspace,
)
from gaitval.walk.simulation.servo import reference_tables, servo_stiffness

if TYPE_CHECKING:
    from gaitval.walk.simulation.mujoco_body import MujocoBody
    from gaitval.walk.simulation.skeleton import HumanSkeleton

Engine = Literal["compiled", "dart", "mujoco"]

MUJOCO_STEPS = 4
"""MuJoCo's steps in a physics step; its springs are explicit."""

MOVED = 3.0
"""Mass that a foot's contact is taken to move, over that of foot and toes. The ground's forces lag
behind the law by the a of `walk.contact.forces` in steps, which is in inverse proportion to this
mass. They chatter where it is 4 + 2/a times what the contact does move, and a foot cannot move
without itself and its toes. With 2, forces of a fast walk were 1.9 % of body weight (RMS) from it,
with 3 they are 1.3; from 4.5 to 5.5 on, by person, they chatter."""


@dataclass(frozen=True)
class WalkingTask:
    """What a policy is trained for: a body, the person's gait, and all constants.

    Attributes
    ----------
    model : the body as scaled, to which mu is applied.
    reference_mu : (14,) mu of the body that the reference was made for; None for the nominal ones.
    """

    model: BodyModel
    record: GaitRecord
    reference: ReferenceMotion
    configuration: Configuration
    reference_mu: Array | None = None

    @property
    def reference_body(self) -> BodyModel:
        """The body that the reference was made for."""
        return (
            self.model
            if self.reference_mu is None
            else apply_parameters(self.model, self.reference_mu)
        )

    def with_environment(self, **settings: Any) -> "WalkingTask":
        """The same task with some `settings` of `environment` changed."""
        environment = self.configuration.environment.model_copy(update=settings)
        configuration = self.configuration.model_copy(update={"environment": environment})
        return replace(self, configuration=configuration)

    @classmethod
    def of(
        cls,
        model: BodyModel,
        record: GaitRecord,
        configuration: Configuration,
        accuracy: RecordAccuracy | None = None,
        *,
        mu: Array | None = None,
        near: ReferenceMotion | None = None,
    ) -> "WalkingTask":
        """The task of walking like `record` on `model`, given the parameters `mu` (14,) if not
        None. How accurate the record is (`accuracy`) weights the fit of its reference motion, which
        begins with that of a similar body (`near`) if there is one.
        """
        body = model if mu is None else apply_parameters(model, mu)
        reference = consistent_reference(record, body, configuration.contact, accuracy, near)
        return cls(model, record, reference, configuration, mu)


def _outside_engine(
    engine: Engine, model: BodyModel, physics_step: float
) -> "HumanSkeleton | MujocoBody | None":
    """The body in DART or MuJoCo, which are slow to import; None for the compiled engine."""
    if engine == "dart":
        from gaitval.walk.simulation.skeleton import HumanSkeleton

        return HumanSkeleton(model, physics_step=physics_step)
    if engine == "mujoco":
        from gaitval.walk.simulation.mujoco_body import MujocoBody

        step = physics_step / MUJOCO_STEPS
        return MujocoBody(model, option=f'timestep="{step}" integrator="Euler"')
    return None


class Steps(NamedTuple):
    """The physics steps of a walk, T rows: those of every `Account`, and the external moment Nm and
    force N (T, 6) on the pelvis.
    """

    phase: Array
    positions: Array
    velocities: Array
    moments: Array
    feet: Array
    root_force: Array


def put_rows(arrays: Sequence[Array], row: int, new: Sequence[Array]) -> int:
    """Write `new` into `arrays` from a `row` on, each into its own, as many rows as the first has:
    what has one row is repeated. The row after them.
    """
    rows = slice(row, row + len(new[0]))
    for kept, each in zip(arrays, new, strict=True):
        kept[rows] = each
    return rows.stop


class Trajectory:
    """Arrays that `Walker.step` fills, one row a physics step.

    Parameters
    ----------
    steps : number of rows.
    many : walkers that act at the same time; none for a single one. They are the arrays' last axis,
        as in what eight of them work in, so that an action of all is one copy.
    """

    def __init__(self, steps: int, *many: int) -> None:
        self.rows = 0
        shapes = [array.shape[1:] for array in empty_account(0)[:5]]
        self._arrays = Steps(*(np.zeros((steps, *shape, *many)) for shape in (*shapes, (6,))))
        self.phase, self.positions, self.velocities = self._arrays[:3]
        self.moments, self.feet, self.root_force = self._arrays[3:]

    def append(self, account: Account, root_force: Array) -> None:
        """Add an action's steps and the external force (6,) on the pelvis during it, both with a
        last axis of the walkers if there are many.
        """
        self.rows = put_rows(self._arrays, self.rows, (*account[:5], root_force))

    def extend(self, steps: Steps) -> None:
        """Add `steps` of another recording."""
        self.rows = put_rows(self._arrays, self.rows, steps)

    def steps(self) -> Steps:
        """The steps of the walker."""
        return Steps(*(array[: self.rows] for array in self._arrays))

    def steps_of(self, walker: int, rows: int) -> Steps:
        """A copy of the first steps of one of many."""
        return Steps(*(np.ascontiguousarray(array[:rows, ..., walker]) for array in self._arrays))


class WalkerArrays(NamedTuple):
    """What an action of a walker changes; K contact spheres.

    Attributes
    ----------
    state : (2, 31) positions and velocities after the last physics step.
    memory : (K, 3) N, the spheres' forces in it.
    offset : (25,) rad, of the joint targets.
    ground, moments, squares : (2, 3) N, (25,) Nm, (25,) Nm², means over the last action.
    """

    state: Array
    memory: Array
    offset: Array
    ground: Array
    moments: Array
    squares: Array


def walker_arrays(spheres: int, *many: int) -> WalkerArrays:
    """Arrays of a walker with `spheres` contact spheres, or (many, …) of several, all zero."""
    joints = (ACTUATED_COUNT,)
    shapes = (2, COORDINATE_COUNT), (spheres, 3), joints, (2, 3), joints, joints
    return WalkerArrays(*(np.zeros((*many, *shape)) for shape in shapes))


class Walker:
    """A body on the ground that follows the reference through its joint servos.

    Parameters
    ----------
    engine : `compiled`, or `dart`, which agree to rounding (tested), or `mujoco`.
    arrays : to work in, all zero; new ones if None.

    Attributes
    ----------
    gains : (2, 25) servo stiffness Nm/rad and damping Nms/rad (without passive damping).
    tree, law, lag : the body and its contact with the parameters `mu` (14,), see
        `walk.contact.forces.contact_forces`.
    body, tables : these and the servos, as the compiled functions take them, and what the servos
        follow.
    state : (2, 31) positions and velocities after the last physics step.
    phase : of the right gait cycle, not wrapped: whole cycles walked are counted in it.
    mean_ground_reaction : (2, 3) N, right and left foot, mean over the last action.
    mean_moments, mean_square_moments : (25,) Nm, Nm², joint moments over the last action.
    arrays : all that an action changes but the phase; see `move_to`.
    """

    def __init__(
        self, task: WalkingTask, *, engine: Engine = "compiled", arrays: WalkerArrays | None = None
    ) -> None:
        environment = task.configuration.environment
        self.task = task
        self.engine = engine
        self.physics_step = environment.physics_step
        self.steps_per_action = environment.steps_per_action
        self.action_seconds = self.physics_step * self.steps_per_action
        self.weight = task.model.mass * GRAVITY
        stiffness = servo_stiffness(task.configuration.servo, task.model.mass)
        self.gains = np.vstack([stiffness, task.configuration.servo.damping_time * stiffness])
        self._outside = _outside_engine(engine, task.model, self.physics_step)
        self._substeps = MUJOCO_STEPS if engine == "mujoco" else 1
        self.tables = reference_tables(
            task.reference,
            task.configuration.servo.feed_forward,
            self.physics_step / self._substeps,
        )
        self._work = workspace(len(task.model.spheres))
        arrays = walker_arrays(len(task.model.spheres)) if arrays is None else arrays
        self.arrays = arrays
        self.state, self._memory, self.offset = arrays.state, arrays.memory, arrays.offset
        self.phase = 0.0
        self.mean_ground_reaction = arrays.ground
        self.mean_moments, self.mean_square_moments = arrays.moments, arrays.squares
        self._account = empty_account(self.steps_per_action)._replace(
            mean_ground_reaction=arrays.ground,
            mean_moments=arrays.moments,
            mean_square_moments=arrays.squares,
        )
        moved = [task.model[f"foot_{s}"].mass + task.model[f"toes_{s}"].mass for s in "rl"]
        self.lag = self.physics_step / (MOVED * np.array(moved))
        self.set_parameters(nominal_parameters())

    def set_parameters(self, mu: Array) -> None:
        """Give the body the parameters mu (14,), in the order of `PARAMETERS`."""
        self.mu = np.asarray(mu, dtype=float)
        model = apply_parameters(self.task.model, self.mu)
        self.tree = tree_arrays(model)
        friction = float(self.mu[PARAMETERS.index("friction")])
        self.law = contact_law(self.task.configuration.contact, friction)
        stiffness, damping = self.gains
        total = damping + self.mu[PARAMETERS.index("damping")]
        phase_step = self.physics_step / self.task.reference.stride_time
        self.body = WalkerBody(
            self.tree, self.law, self.tables, stiffness, damping, total, self.lag,
            self.physics_step, phase_step,
        )  # fmt: skip
        if self._outside is not None:
            self._outside.configure(model)
            self._outside.set_servo(stiffness, self.body.total_damping)

    def reset(self, positions: Array, velocities: Array, phase: float) -> None:
        """Place the body at a state (31,), (31,) and a phase."""
        self.state[0] = positions
        self.state[1] = velocities
        if self._outside is not None:
            self._outside.set(positions, velocities)
        self.phase = float(phase)
        self.offset[:] = 0.0
        # The feet carry the body from the first step on, as if it had been walking.
        ground_forces(
            self.tree, self.law, self.state[0], self.state[1],
            np.zeros(2), self._memory, np.zeros(COORDINATE_COUNT), np.zeros((2, 6)),
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
        """Advance by one action: `offset` (25,) rad of the joint targets, and an external moment
        and force on the pelvis, `root_force` (6,) Nm and N, world, at a `pace` through the gait
        cycle, 1 as fast as the reference; `recording` keeps its steps.

        The offset moves linearly from the last action's to this one's, so that joint moments have
        no steps.
        """
        account = self._account
        action = Action(pace, self.offset, offset, root_force)
        if self._outside is None:
            self.phase = advance(self.body, self.state, self.phase, action, self._memory, account)
        else:
            self.phase = self._advance_outside(action)
        self.offset[:] = offset
        if recording is not None:
            recording.append(account, root_force)

    def _advance_outside(self, action: Action) -> float:
        """`advance` with another engine's dynamics and integrator, which is at `state`."""
        engine, account, substeps = self._outside, self._account, self._substeps
        assert engine is not None
        pace, offset, next_offset, root_force = action
        # `lag` is proportional to the step, and the contact acts in each of the engine's steps.
        body = self.body._replace(lag=self.body.lag / substeps)
        slope = (next_offset - offset) / (len(account.phase) * substeps)
        for row in outside_steps(
            substeps, body, self.state, self.phase, pace, offset.copy(), slope, root_force,
            self._memory, account, self._work,
        ):  # fmt: skip
            self._add_forces(row, body.physics_step / substeps)
            self.state[0], self.state[1] = engine.advance(self._work.forces)
        return float(account.phase[-1])

    def _add_forces(self, row: int, step: float) -> None:
        """Change the forces of an engine's `step` (s), which is of a `row` of the account."""
