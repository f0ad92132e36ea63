"""One walking body: skeleton, ground contact and joint servos, advanced action by action.

The servo of a joint is τ = k (q̂(φ) + a − q) + d (q̂̇(φ) − q̇) + τ_ff(φ) − β q̇, with q̂ the
reference, a the action's offset, τ_ff the recorded moment and β the passive joint damping. DART
integrates the spring and the dampers implicitly (as springs about zero); what does not depend
on the state enters as a force, so the torque that acted is known exactly:
τ = command − k q⁺ − (d + β) q̇⁺ with the state after the step.
"""

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from gaitval.compiled import njit
from gaitval.configuration import Configuration, Servo
from gaitval.coordinates import ACTUATED, ROOT
from gaitval.data.record import GaitRecord
from gaitval.kinematics.reference import ReferenceMotion, build_reference
from gaitval.kinematics.tree import GRAVITY, Tree, tree_arrays
from gaitval.scaling.model import BodyModel
from gaitval.scaling.parameters import PARAMETERS, apply_parameters, nominal_parameters
from gaitval.simulation.contact import ContactLaw, contact_law, ground_forces
from gaitval.simulation.skeleton import HumanSkeleton

Array = NDArray[np.float64]

REFERENCE_MASS = 70.0
"""kg, of the body that `configuration.Servo` gives gains for."""

_SERVO_OF = {
    "hip": "hip",
    "knee": "knee",
    "ankle": "ankle",
    "subtalar": "subtalar",
    "mtp": "toe",
    "lumbar": "lumbar",
    "arm": "shoulder",
    "elbow": "shoulder",
}


@dataclass(frozen=True)
class WalkingTask:
    """What a policy is trained for: a body, how the person walks, and all constants."""

    model: BodyModel
    record: GaitRecord
    reference: ReferenceMotion
    configuration: Configuration

    @classmethod
    def of(
        cls, model: BodyModel, record: GaitRecord, configuration: Configuration
    ) -> "WalkingTask":
        """Task with the reference motion of a record on a model."""
        return cls(
            model, record, build_reference(record, model, configuration.contact), configuration
        )


def servo_stiffness(servo: Servo, mass: float) -> Array:
    """Stiffness (25,) Nm/rad of the joint servos of a body of `mass` kg."""
    gains = [getattr(servo, _SERVO_OF[name.split("_")[0]]) for name in ACTUATED]
    return np.array(gains, dtype=float) * mass / REFERENCE_MASS


class ReferenceTables(NamedTuple):
    """Reference of the actuated coordinates, sampled over one cycle with the first sample
    repeated at its end: (N + 1, 25) positions rad, velocities rad/s, moments Nm.
    """

    positions: Array
    velocities: Array
    moments: Array


def closed_cycle(values: Array) -> Array:
    """Samples (N, …) of one cycle with the first repeated at its end, contiguous."""
    return np.ascontiguousarray(np.concatenate([values, values[:1]]))


def reference_tables(reference: ReferenceMotion, feed_forward: float) -> ReferenceTables:
    """Tables of a reference motion; the moments are weighted with `feed_forward`."""
    actuated = slice(len(ROOT), None)
    return ReferenceTables(
        closed_cycle(reference.positions[:, actuated]),
        closed_cycle(reference.velocities[:, actuated]),
        closed_cycle(feed_forward * reference.moments),
    )


@njit
def generalised_forces(
    tree: Tree,
    law: ContactLaw,
    tables: ReferenceTables,
    gains: Array,
    state: Array,
    phase: float,
    offset: Array,
    lag: Array,
    memory: Array,
    root_force: Array,
    forces: Array,
    command: Array,
    feet: Array,
) -> None:
    """Forces that one physics step applies.

    Parameters
    ----------
    gains : (2, 25) servo stiffness Nm/rad and damping Nms/rad (without passive damping).
    state : (2, 31) positions and velocities.
    phase : of the right gait cycle.
    offset : (25,) rad, the action's offset of the joint targets.
    lag, memory : as `contact.ground_forces`.
    root_force : (6,) external moment Nm and force N on the pelvis (a push), world.
    forces : (31,) out, for `setForces`.
    command : (25,) out, Nm, the servo's share of them.
    feet : (2, 6) out, as `contact.ground_forces`.
    """
    count = tables.positions.shape[0] - 1
    place = (phase - np.floor(phase)) * count
    row = int(place)
    part = place - row
    for i in range(25):
        target = (1.0 - part) * tables.positions[row, i] + part * tables.positions[row + 1, i]
        rate = (1.0 - part) * tables.velocities[row, i] + part * tables.velocities[row + 1, i]
        moment = (1.0 - part) * tables.moments[row, i] + part * tables.moments[row + 1, i]
        command[i] = gains[0, i] * (target + offset[i]) + gains[1, i] * rate + moment
        forces[6 + i] = command[i]
    for i in range(6):
        forces[i] = root_force[i]
    ground_forces(tree, law, state[0], state[1], lag, memory, forces, feet)


@njit
def joint_moments(
    gains: Array, total_damping: Array, command: Array, state: Array, out: Array
) -> None:
    """Net joint moments (25,) Nm of the physics step that led to `state` (2, 31)."""
    for i in range(25):
        out[i] = command[i] - gains[0, i] * state[0, 6 + i] - total_damping[i] * state[1, 6 + i]


class Recording:
    """Arrays that `Walker.step` fills, one row a physics step."""

    def __init__(self, steps: int) -> None:
        self.rows = 0
        self.phase = np.zeros(steps)
        self.positions = np.zeros((steps, 31))
        self.velocities = np.zeros((steps, 31))
        self.moments = np.zeros((steps, 25))
        self.feet = np.zeros((steps, 2, 6))
        self.root_force = np.zeros((steps, 6))


class Walker:
    """A body on the ground that follows the reference through its joint servos.

    Attributes
    ----------
    state : (2, 31) positions and velocities after the last physics step.
    phase : of the right gait cycle, not wrapped: whole cycles walked are counted in it.
    mean_ground_reaction : (2, 3) N, right and left foot, mean over the last action.
    mean_moments, mean_square_moments : (25,) Nm, Nm², joint moments over the last action.
    """

    def __init__(self, task: WalkingTask) -> None:
        environment = task.configuration.environment
        self.task = task
        self.physics_step = environment.physics_step
        self.steps_per_action = environment.steps_per_action
        self.action_seconds = self.physics_step * self.steps_per_action
        self.weight = task.model.mass * GRAVITY
        stiffness = servo_stiffness(task.configuration.servo, task.model.mass)
        damping = task.configuration.servo.damping_time * stiffness
        self.gains = np.vstack([stiffness, damping])
        self.tables = reference_tables(task.reference, task.configuration.servo.feed_forward)
        self.body = HumanSkeleton(task.model, physics_step=self.physics_step)
        self.skeleton = self.body.skeleton
        self.state = np.zeros((2, 31))
        self.phase = 0.0
        self.offset = np.zeros(25)
        self.mean_ground_reaction = np.zeros((2, 3))
        self.mean_moments = np.zeros(25)
        self.mean_square_moments = np.zeros(25)
        self._forces = np.zeros(31)
        self._command = np.zeros(25)
        self._feet = np.zeros((2, 6))
        # A foot's contact moves the foot, its toes and about as much of the shank.
        moved_mass = 2.0 * (task.model["foot_r"].mass + task.model["toes_r"].mass)
        self._lag = np.full(2, self.physics_step / moved_mass)
        self._memory = np.zeros((len(task.model.spheres), 3))
        self.set_parameters(nominal_parameters())

    def set_parameters(self, mu: Array) -> None:
        """Give the body the parameters mu (14,), in the order of `PARAMETERS`."""
        self.mu = np.asarray(mu, dtype=float)
        model = apply_parameters(self.task.model, self.mu)
        self.tree = tree_arrays(model)
        self.body.configure(model)
        self.total_damping = self.gains[1] + self.mu[PARAMETERS.index("damping")]
        self.body.set_servo(self.gains[0], self.total_damping)
        friction = float(self.mu[PARAMETERS.index("friction")])
        self.law = contact_law(self.task.configuration.contact, friction)

    def reset(self, positions: Array, velocities: Array, phase: float) -> None:
        """Place the body at a state (31,), (31,) and a phase."""
        self.state[0] = positions
        self.state[1] = velocities
        self.skeleton.setPositions(positions)
        self.skeleton.setVelocities(velocities)
        self.phase = float(phase)
        self.offset[:] = 0.0
        self._memory[:] = 0.0
        self.mean_ground_reaction[:] = 0.0
        self.mean_moments[:] = 0.0
        self.mean_square_moments[:] = 0.0

    def step(self, offset: Array, root_force: Array, recording: Recording | None = None) -> None:
        """Advance by one action.

        The offset of the joint targets moves linearly from the last action's to this one's, so
        that joint moments have no steps.

        Parameters
        ----------
        offset : (25,) rad.
        root_force : (6,) external moment Nm and force N on the pelvis, world.
        """
        count = self.steps_per_action
        slope = (offset - self.offset) / count
        phase_step = self.physics_step / self.task.reference.stride_time
        forces, command, feet = self._forces, self._command, self._feet
        state, skeleton = self.state, self.skeleton
        moments = np.zeros(25)
        ground = np.zeros((2, 3))
        moment_sum, square_sum = np.zeros(25), np.zeros(25)
        for _ in range(count):
            self.offset += slope
            generalised_forces(
                self.tree,
                self.law,
                self.tables,
                self.gains,
                state,
                self.phase,
                self.offset,
                self._lag,
                self._memory,
                root_force,
                forces,
                command,
                feet,
            )
            skeleton.setForces(forces)
            self.body.step()
            state[0] = skeleton.getPositions()
            state[1] = skeleton.getVelocities()
            self.phase += phase_step
            joint_moments(self.gains, self.total_damping, command, state, moments)
            ground += feet[:, :3]
            moment_sum += moments
            square_sum += moments * moments
            if recording is not None:
                row = recording.rows
                recording.phase[row] = self.phase
                recording.positions[row] = state[0]
                recording.velocities[row] = state[1]
                recording.moments[row] = moments
                recording.feet[row] = feet
                recording.root_force[row] = root_force
                recording.rows = row + 1
        self.offset[:] = offset
        self.mean_ground_reaction[:] = ground / count
        self.mean_moments[:] = moment_sum / count
        self.mean_square_moments[:] = square_sum / count
