"""The walking task as a Gymnasium environment.

State, action and reward follow the paper (sections III-A, equations 1 and 2) with the decisions
of docs/decisions.md: bounded reward kernels, an `extended` observation beside the paper's 71
numbers, early termination on the pelvis's height, rotation and drift.
"""

from typing import Any, NamedTuple

import gymnasium
import numpy as np
from numpy.typing import NDArray

from gaitval.arrays import Array
from gaitval.compiled import njit, njit_borrowing
from gaitval.configuration import EnvironmentSettings, RewardSettings
from gaitval.coordinates import ACTUATED, mirrored
from gaitval.model.body import SEGMENTS
from gaitval.model.parameters import nominal_parameters, parameter_bounds
from gaitval.model.tree import (
    Tree,
    empty_frames,
    forward,
    rotation_matrix,
    rotation_vector,
    velocities,
    whole_body_motion,
)
from gaitval.reference.motion import END_EFFECTORS, ReferenceMotion
from gaitval.simulation.walker import Engine, Trajectory, Walker, WalkingTask, closed_cycle

OBSERVATION_SIZES = {"paper": 71, "extended": 125}
PARAMETERS_OBSERVED = slice(57, 71)
"""Where mu is in both observations; in the extended one it is scaled to -1 ... 1."""
REWARD_TERMS = (
    "joint_positions",
    "joint_velocities",
    "centre_of_mass",
    "pelvis_rotation",
    "end_effectors",
    "ground_reaction",
    "joint_moments",
    "pace",
    "torque",
)
_EFFECTORS = np.array([SEGMENTS.index(name) for name in END_EFFECTORS])

_FORCE_WEIGHTS = np.array([2.0, 3.0, 1.0])
"""Of forward, sideways and vertical ground reaction in the reward."""

_VELOCITY_SCALE = 0.1
"""Joint velocities are observed in tens of rad/s, so that they weigh like the angles."""

_LARGEST_STATE = 1e3
"""rad, m, rad/s, m/s: a number beyond it is no movement, and would spoil the running statistics
of a whole training."""


def _mirror() -> tuple[NDArray[np.int64], Array]:
    """Order (125,) and signs (125,) that turn an extended observation into its mirror image at
    the sagittal plane. The last 26 are the mirror of an action.
    """
    joints = [ACTUATED.index(mirrored(name)) for name in ACTUATED]
    joint_signs = [-1 if name in ("lumbar_bending", "lumbar_rotation") else 1 for name in ACTUATED]
    polar, axial = [1, -1, 1], [-1, 1, -1]
    order: list[int] = []
    signs: list[int] = []

    def add(block: list[int], block_signs: list[int]) -> None:
        start = len(order)
        order.extend(start + i for i in block)
        signs.extend(block_signs)

    same, swapped = [0, 1, 2], [3, 4, 5, 0, 1, 2]
    add(joints, joint_signs)  # joint angles
    add(joints, joint_signs)  # joint velocities
    add(same, polar)  # velocity of the centre of mass
    add(same, axial)  # angular velocity of the body
    add([0], [1])  # phase
    add(list(range(14)), [1] * 14)  # mu
    add(list(range(4)), [1] * 4)  # sines and cosines of the phase
    add(same, axial)  # pelvis rotation
    add(same, polar)  # pelvis position
    add(same, axial)  # pelvis angular velocity
    add(same, polar)  # pelvis velocity
    add(swapped, polar * 2)  # feet
    add(swapped, polar * 2)  # ground reaction
    add(joints, joint_signs)  # last action
    add([0], [1])  # its pace
    return np.array(order), np.array(signs, dtype=float)


_MIRROR_ORDER, _MIRROR_SIGNS = _mirror()
_ACTION_ORDER = _MIRROR_ORDER[-26:] - (OBSERVATION_SIZES["extended"] - 26)
_ACTION_SIGNS = _MIRROR_SIGNS[-26:]


def action_size(constants: EnvironmentSettings) -> int:
    """Numbers in an action: one a joint, and the pace where it is the policy's."""
    return len(ACTUATED) + (constants.pace_scale > 0.0)


class _Targets(NamedTuple):
    """Reference over one cycle for observation and reward, first sample repeated at the end;
    without the forward travel.
    """

    positions: Array  # (N + 1, 31)
    velocities: Array  # (N + 1, 31)
    centre_of_mass: Array  # (N + 1, 3)
    end_effectors: Array  # (N + 1, 12)
    ground_reaction: Array  # (N + 1, 6)
    moments: Array  # (N + 1, 25), Nm/kg
    has_moment: Array  # (25,), 1 where the record has a moment
    stride_length: float


def _targets(reference: ReferenceMotion, mass: float) -> _Targets:
    stride = reference.speed * reference.stride_time
    travel = stride * reference.phase
    positions = reference.positions.copy()
    positions[:, 3] -= travel
    com = reference.centre_of_mass.copy()
    com[:, 0] -= travel
    effectors = reference.end_effectors.copy()
    effectors[..., 0] -= travel[:, None]

    def closed(values: Array) -> Array:
        return closed_cycle(values.reshape(len(values), -1))

    return _Targets(
        closed(positions),
        closed(reference.velocities),
        closed(com),
        closed(effectors),
        closed(reference.ground_reaction),
        closed(reference.moments / mass),
        np.any(reference.moments != 0.0, axis=0).astype(float),
        stride,
    )


@njit_borrowing
def _at(table: Array, phase: float, out: Array) -> None:
    count = table.shape[0] - 1
    place = (phase - np.floor(phase)) * count
    row = int(place)
    part = place - row
    for i in range(table.shape[1]):
        out[i] = (1.0 - part) * table[row, i] + part * table[row + 1, i]


@njit_borrowing
def _square(values: Array) -> float:
    total = 0.0
    for i in range(values.shape[0]):
        total += values[i] * values[i]
    return total


@njit
def _measure(
    tree: Tree,
    targets: _Targets,
    state: Array,
    phase: float,
    pace: float,
    lift: float,
    half_action: float,
    mass: float,
    weight: float,
    ground: Array,
    moments: Array,
    action: Array,
    parameters: Array,
    extended: bool,
    half_cycle: bool,
    observation: Array,
    errors: Array,
) -> bool:
    """Observation and squared errors of one state.

    Returns False, and leaves both as they were, where the state is no movement any more.

    Parameters
    ----------
    pace : of the last action.
    lift : m, added to the reference's heights for the leg length of the body.
    half_action : phase of half an action: means over the action are compared with its middle.
    mass, weight : kg and N, of the nominal body.
    ground : (2, 3) N, mean over the action.
    moments : (25,) Nm, mean over the action.
    action : (26,) the last one.
    parameters : (14,) the mu that is observed.
    half_cycle : the sines and cosines of the phase are of its half of the cycle, 0 to 0.5.
    observation : (71,) or (125,) out.
    errors : (11,) out: squared errors of the first eight `REWARD_TERMS`, then height m,
        rotation rad and drift m of the pelvis, for termination.
    """
    for i in range(2):
        for d in range(31):
            if not abs(state[i, d]) < _LARGEST_STATE:
                return False
    q, qd = state[0], state[1]
    frames, motion = empty_frames(), np.empty((3, 3))
    forward(tree.joint_position, q, frames.rotation, frames.origin, frames.axes, 14)
    velocities(frames.origin, frames.axes, qd, frames.angular, frames.linear, 14)
    whole_body_motion(tree, frames, motion)

    q_ref, qd_ref = np.empty(31), np.empty(31)
    com_ref, ee_ref, grf_ref, moment_ref = np.empty(3), np.empty(12), np.empty(6), np.empty(25)
    _at(targets.positions, phase, q_ref)
    _at(targets.velocities, phase, qd_ref)
    _at(targets.centre_of_mass, phase, com_ref)
    _at(targets.end_effectors, phase, ee_ref)
    for i in range(31):
        qd_ref[i] *= pace
    travel = targets.stride_length * phase
    q_ref[3] += travel
    q_ref[5] += lift
    com_ref[0] += travel
    com_ref[2] += lift

    turn = rotation_vector(frames.rotation[0] @ rotation_matrix(q_ref).T)
    joint = q[6:] - q_ref[6:]
    joint_rate = qd[6:] - qd_ref[6:]
    effector = np.empty(12)
    for e in range(4):
        for i in range(3):
            effector[3 * e + i] = frames.origin[_EFFECTORS[e], i] - ee_ref[3 * e + i]
        # Where the pelvis is, is an error of its own.
        effector[3 * e] -= travel + q[3] - q_ref[3]
        effector[3 * e + 1] -= q[4] - q_ref[4]
    middle = phase - pace * half_action
    _at(targets.ground_reaction, middle, grf_ref)
    _at(targets.moments, middle, moment_ref)

    errors[0] = _square(joint)
    errors[1] = _square(joint_rate)
    errors[2] = _square(motion[0] - com_ref)
    errors[3] = _square(turn)
    errors[4] = _square(effector)
    errors[5] = 0.0
    for i in range(6):
        errors[5] += (_FORCE_WEIGHTS[i % 3] * (ground[i // 3, i % 3] / weight - grf_ref[i])) ** 2
    errors[6] = 0.0
    for i in range(25):
        errors[6] += targets.has_moment[i] * (moments[i] / mass - moment_ref[i]) ** 2
    errors[7] = (pace - 1.0) ** 2
    errors[8] = abs(q[5] - q_ref[5])
    errors[9] = np.sqrt(errors[3])
    errors[10] = np.sqrt((q[3] - q_ref[3]) ** 2 + (q[4] - q_ref[4]) ** 2)

    if extended:
        observation[0:25] = joint
        observation[25:50] = _VELOCITY_SCALE * joint_rate
    else:
        observation[0:25] = q[6:]
        observation[25:50] = qd[6:]
    observation[50:53] = motion[1]
    observation[53:56] = motion[2]
    seen = phase - np.floor(phase)
    # The phase tells which leg is which even where the policy sees half cycles: a person's two
    # sides are not the same.
    observation[56] = seen
    if half_cycle and seen >= 0.5:
        seen -= 0.5
    observation[57:71] = parameters  # PARAMETERS_OBSERVED
    if extended:
        angle = 2.0 * np.pi * seen
        observation[71] = np.sin(angle)
        observation[72] = np.cos(angle)
        observation[73] = np.sin(2.0 * angle)
        observation[74] = np.cos(2.0 * angle)
        observation[75:78] = turn
        observation[78:81] = q[3:6] - q_ref[3:6]
        observation[81:84] = qd[0:3] - qd_ref[0:3]
        observation[84:87] = qd[3:6] - qd_ref[3:6]
        observation[87:93] = effector[0:6]
        for i in range(6):
            observation[93 + i] = ground[i // 3, i % 3] / weight
        observation[99:125] = action
    return True


@njit_borrowing
def _reward(weights: Array, sharpness: Array, errors: Array, effort: float, terms: Array) -> float:
    """Terms (9,) of the reward, in the order of `REWARD_TERMS`, and their sum: weights (9,) over
    the sum of the first eight times exp(-sharpness (8,) x squared error); the last is the torque
    cost.
    """
    total, reward = 0.0, 0.0
    for i in range(8):
        total += weights[i]
    for i in range(8):
        terms[i] = weights[i] / total * np.exp(-sharpness[i] * errors[i])
        reward += terms[i]
    terms[8] = -weights[8] / total * effort
    return float(reward + terms[8])


def _reward_numbers(reward: RewardSettings) -> tuple[Array, Array]:
    weights = [getattr(reward, name) for name in REWARD_TERMS]
    sharpness = [getattr(reward, f"{name}_sharpness") for name in REWARD_TERMS[:-1]]
    return np.array(weights, dtype=float), np.array(sharpness, dtype=float)


class WalkingEnvironment(gymnasium.Env[NDArray[np.float32], NDArray[np.float32]]):
    """Walk like the reference.

    Action: 25 numbers; times `action_scale` they are the offsets (rad) of the joint targets from
    the reference. Unless `pace_scale` is 0 there is a 26th; times that it is added to the pace of
    1 at which the walker goes through the recorded cycle. Observation: see
    `EnvironmentSettings.observation`. `info` of every step holds `errors` (11,), `reward_terms`
    (9,) and `cycles`, the gait cycles walked since the start.

    Reset options: `phase` (else uniform over the cycle: reference-state initialisation), `mu`
    (14,) (else random within the bounds), `push` = (phase after which it starts, force N,
    direction rad from straight ahead, left positive) or None for no push, `noise` (standard
    deviation of the initial joint angles, rad).

    Parameters
    ----------
    engine : of the physics, see `Walker`.

    Attributes
    ----------
    difficulty : 0 to 1, share of the ranges of mu and of the largest push that is drawn from;
        the training raises it.
    tolerance_share : of the tolerances of height, rotation and drift, at which a walk ends; the
        training begins with less than 1.
    walker : the simulated body.
    """

    metadata: dict[str, Any] = {"render_modes": []}  # noqa: RUF012 (Gymnasium's own form)

    def __init__(self, task: WalkingTask, *, engine: Engine = "compiled") -> None:
        configuration = task.configuration
        self.task = task
        self.constants = configuration.environment
        self.walker = Walker(task, engine=engine)
        self.difficulty = 1.0
        self.tolerance_share = 1.0
        self._extended = self.constants.observation == "extended"
        self._mirrors = self._extended and self.constants.mirror
        size = OBSERVATION_SIZES[self.constants.observation]
        self.observation_space = gymnasium.spaces.Box(-np.inf, np.inf, (size,), np.float32)
        limit = self.constants.action_limit
        self._size = action_size(self.constants)
        self.action_space = gymnasium.spaces.Box(-limit, limit, (self._size,), np.float32)
        self._mass = task.model.mass
        self._targets = _targets(task.reference, self._mass)
        self._weights, self._sharpness = _reward_numbers(configuration.reward)
        self._lower, self._upper = parameter_bounds(configuration.randomisation)
        self._nominal = nominal_parameters()
        self._middle = 0.5 * (self._lower + self._upper)
        self._half_range = np.maximum(0.5 * (self._upper - self._lower), 1e-9)
        self._parameters = self._nominal
        self._observation = np.zeros(size)
        self._errors = np.zeros(11)
        self._terms = np.zeros(9)
        self._root_force = np.zeros(6)
        self._action = np.zeros(26)
        self._half_action = 0.5 * self.walker.action_seconds / task.reference.stride_time
        self._steps = 0
        self._longest = round(self.constants.episode_seconds / self.walker.action_seconds)
        self._push: tuple[float, float, float] | None = None
        self._pushed_again = False
        self._push_left = 0.0
        self._start_phase = 0.0
        self._lift = 0.0

    def _random_parameters(self) -> Array:
        drawn = self.np_random.uniform(self._lower, self._upper)
        return np.asarray(self._nominal + self.difficulty * (drawn - self._nominal), dtype=float)

    def _random_push(self, earliest: float, latest: float) -> tuple[float, float, float]:
        constants = self.constants
        focused = self.np_random.uniform() < 0.5
        largest = constants.push_focus if focused else constants.push_force
        return (
            self.np_random.uniform(earliest, latest),
            self.difficulty * self.np_random.uniform(0.0, largest),
            self.np_random.uniform(-0.5 * np.pi, 0.5 * np.pi),
        )

    def reset(
        self, *, seed: int | None = None, options: dict[str, Any] | None = None
    ) -> tuple[NDArray[np.float32], dict[str, Any]]:
        """Start at a state of the reference; see the class for `options`."""
        super().reset(seed=seed)
        options = options or {}
        phase = options["phase"] if "phase" in options else self.np_random.uniform()
        mu = options["mu"] if "mu" in options else self._random_parameters()
        if "push" in options:
            self._push, self._pushed_again = options["push"], False
        else:
            self._pushed_again = self.np_random.uniform() < self.constants.push_probability
            first, interval = phase + 0.5, self.constants.push_interval[1]
            self._push = self._random_push(first, first + interval) if self._pushed_again else None
        noise = options.get("noise", self.constants.initial_noise)
        mu = np.asarray(mu, dtype=float)
        if not np.array_equal(mu, self.walker.mu):
            self.walker.set_parameters(mu)
        self._parameters = (mu - self._middle) / self._half_range if self._extended else mu
        self._lift = self._leg_extension()
        positions, rates = np.empty(31), np.empty(31)
        _at(self._targets.positions, phase, positions)
        _at(self._targets.velocities, phase, rates)
        positions[3] += self._targets.stride_length * phase
        positions[5] += self._lift
        positions[6:] += noise * self.np_random.standard_normal(25)
        self.walker.reset(positions, rates, phase)
        self._start_phase = phase
        self._steps = 0
        self._push_left = 0.0
        self._root_force[:] = 0.0
        ground = self.walker.mean_ground_reaction.reshape(6)
        _at(self._targets.ground_reaction, phase, ground)
        ground *= self.walker.weight
        self._action[:] = 0.0
        self._measure()
        return self._seen(), {}

    def _pace(self) -> float:
        """Of the last action."""
        return float(1.0 + self.constants.pace_scale * self._action[-1])

    def _is_mirrored(self) -> bool:
        """Whether the policy acts as in a mirror now: in the second half of the right cycle."""
        return self._mirrors and self.walker.phase % 1.0 >= 0.5

    def _seen(self) -> NDArray[np.float32]:
        """The observation as the policy gets it."""
        observation = self._observation
        if self._is_mirrored():
            observation = _MIRROR_SIGNS * observation[_MIRROR_ORDER]
        return observation.astype(np.float32)

    def _leg_extension(self) -> float:
        """How much higher the pelvis is over the ankles than in the nominal body, m."""
        legs = [SEGMENTS.index(name) for name in ("thigh_r", "shank_r", "foot_r")]
        nominal = sum(self.task.model.segments[i].joint_position[2] for i in legs)
        return float(nominal - self.walker.tree.joint_position[legs, 2].sum())

    def _measure(self) -> bool:
        walker = self.walker
        return bool(
            _measure(
                walker.tree,
                self._targets,
                walker.state,
                walker.phase,
                self._pace(),
                self._lift,
                self._half_action,
                self._mass,
                walker.weight,
                walker.mean_ground_reaction,
                walker.mean_moments,
                self._action,
                self._parameters,
                self._extended,
                self._mirrors,
                self._observation,
                self._errors,
            )
        )

    def _push_now(self) -> None:
        """Set the force on the pelvis for the next action."""
        self._root_force[:] = 0.0
        if self._push is None:
            return
        start, force, direction = self._push
        if self._push_left == 0.0 and self.walker.phase >= start:
            self._push_left = self.constants.push_seconds
        if self._push_left > 0.0:
            # Force x time is exact whatever the length of an action.
            share = min(1.0, self._push_left / self.walker.action_seconds)
            self._root_force[3] = share * force * np.cos(direction)
            self._root_force[4] = share * force * np.sin(direction)
            self._push_left -= share * self.walker.action_seconds
            if self._push_left <= 1e-12:
                shortest, longest = (start + cycles for cycles in self.constants.push_interval)
                self._push = self._random_push(shortest, longest) if self._pushed_again else None

    def step(
        self, action: NDArray[np.float32], recording: Trajectory | None = None
    ) -> tuple[NDArray[np.float32], float, bool, bool, dict[str, Any]]:
        """Advance by one action; see the class for `action` and `info`."""
        limit = self.constants.action_limit
        self._action[: self._size] = np.clip(action, -limit, limit)
        if self._is_mirrored():
            self._action[:] = _ACTION_SIGNS * self._action[_ACTION_ORDER]
        self._push_now()
        offset = self.constants.action_scale * self._action[:-1]
        self.walker.step(offset, self._root_force, recording, pace=self._pace())
        self._steps += 1
        if self._measure():
            effort = float(self.walker.mean_square_moments.sum()) / self._mass**2
            reward = _reward(self._weights, self._sharpness, self._errors, effort, self._terms)
            share = self.tolerance_share
            fell = not (
                self._errors[8] < share * self.constants.height_tolerance
                and self._errors[9] < share * self.constants.rotation_tolerance
                and self._errors[10] < share * self.constants.drift_tolerance
            )
        else:  # it blew up, perhaps to no number at all: the last observation stands
            self._terms[:] = 0.0
            reward, fell = 0.0, True
        info = {
            "errors": self._errors.copy(),
            "reward_terms": self._terms.copy(),
            "cycles": self.walker.phase - self._start_phase,
        }
        return (
            self._seen(),
            reward,
            fell,
            self._steps >= self._longest,
            info,
        )
