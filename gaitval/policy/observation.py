"""Observations of a walking body, and how far it is from the reference.

The paper's 71 numbers (section III-A), or an `extended` observation (docs/decisions.md), and its
mirror image in the sagittal plane. World axes, rad, m and s:

| elements | content; "difference": from the reference, only in the extended observation |
|---|---|
| 0 - 24 | joint angles; difference |
| 25 - 49 | joint velocities; difference, in tens of rad/s |
| 50 - 52 | velocity of the centre of mass |
| 53 - 55 | angular velocity of the whole body |
| 56 | phase of the right gait cycle, 0 to 1 |
| 57 - 70 | body parameters mu; extended: scaled to -1 ... 1 |
| 71 - 74 | sine and cosine of the phase, and of twice the phase (from here on extended only) |
| 75 - 80 | pelvis: rotation vector and position; difference |
| 81 - 86 | pelvis: angular velocity and velocity; difference |
| 87 - 92 | right and left foot relative to the pelvis; difference |
| 93 - 98 | ground reaction on right and left foot, body weights, mean over the last action |
| 99 | walking speed over the square root of gravity times leg length |
| 100 - 125 | last action: 25 joints, pace |
"""

import math
from typing import NamedTuple

import numpy as np

from gaitval.arrays import Array, Index
from gaitval.compiled import njit, njit_borrowing
from gaitval.constants import GRAVITY
from gaitval.coordinates import ACTUATED, mirrored
from gaitval.model.body import SEGMENTS, BodyModel
from gaitval.model.parameters import PARAMETERS
from gaitval.model.tree import (
    ACTUATED_COUNT,
    COORDINATE_COUNT,
    SEGMENT_COUNT,
    Tree,
    empty_frames,
    forward,
    rotation_matrix,
    rotation_vector,
    velocities,
    whole_body_motion,
)
from gaitval.reference.motion import END_EFFECTORS, ReferenceMotion
from gaitval.simulation.servo import closed_cycle
from gaitval.simulation.tables import read_table

OBSERVATION_SIZES = {"paper": 71, "extended": 126}

PARAMETERS_OBSERVED = slice(57, 71)
"""Position of mu in both observations; in the extended one it is scaled to -1 ... 1."""

EFFECTOR_COUNT = len(END_EFFECTORS)
ERROR_COUNT = 12
"""Numbers of `measure`'s errors."""
ACTION_COUNT = ACTUATED_COUNT + 1
"""Numbers of an action with a pace."""
_EFFECTORS = np.array([SEGMENTS.index(name) for name in END_EFFECTORS])

_FORCE_WEIGHTS = np.array([2.0, 3.0, 1.0])
"""Weights of forward, sideways and vertical ground reaction in the reward."""

_VELOCITY_SCALE = 0.1
"""Joint velocities are observed in tens of rad/s, so that they have the same scale as the
angles."""

MIRROR_FROM = 0.25
"""Phases of the right cycle between which it counts as the right leg's half: from a quarter before
its heel strike to a quarter after it. At the ends, in the middle of stance, the policy passes from
the body to its mirror image, and nothing makes its two actions equal there: with the ends at the
heel strikes their difference kicked the body just when it lands."""

_LARGEST_STATE = 1e3
"""rad, m, rad/s, m/s: a number beyond this is not a movement, and would spoil the running
statistics of the whole training."""


def _mirror() -> tuple[Index, Array]:
    """Order (126,) and signs (126,) that turn an extended observation into its mirror image in the
    sagittal plane. The last 26 mirror an action.
    """
    joints = [ACTUATED.index(mirrored(name)) for name in ACTUATED]
    joint_signs = [-1 if name in ("lumbar_bending", "lumbar_rotation") else 1 for name in ACTUATED]
    # Mirrored in the plane y = 0, a polar vector (position, velocity, force) changes the sign of y;
    # an axial vector (rotation, angular velocity) changes those of x and z. Joint coordinates have
    # the same sign on both sides (`coordinates`), so legs and arms only change places.
    polar, axial = [1, -1, 1], [-1, 1, -1]
    order: list[int] = []
    signs: list[int] = []

    def add(block: list[int], block_signs: list[int]) -> None:
        start = len(order)
        order.extend(start + i for i in block)
        signs.extend(block_signs)

    # Blocks are appended in the order in which `measure` fills the observation.
    same, swapped = [0, 1, 2], [3, 4, 5, 0, 1, 2]
    add(joints, joint_signs)  # joint angles
    add(joints, joint_signs)  # joint velocities
    add(same, polar)  # velocity of the centre of mass
    add(same, axial)  # angular velocity of the body
    add([0], [1])  # phase
    add(list(range(len(PARAMETERS))), [1] * len(PARAMETERS))  # mu
    add(list(range(4)), [1] * 4)  # sines and cosines of the phase
    add(same, axial)  # pelvis rotation
    add(same, polar)  # pelvis position
    add(same, axial)  # pelvis angular velocity
    add(same, polar)  # pelvis velocity
    add(swapped, polar * 2)  # feet
    add(swapped, polar * 2)  # ground reaction
    add([0], [1])  # walking speed
    add(joints, joint_signs)  # last action
    add([0], [1])  # its pace
    return np.array(order), np.array(signs, dtype=float)


MIRROR_ORDER, MIRROR_SIGNS = _mirror()
# An observation ends with the last action, so its last elements, counted from their first, mirror
# an action.
ACTION_ORDER = MIRROR_ORDER[-ACTION_COUNT:] - (OBSERVATION_SIZES["extended"] - ACTION_COUNT)
ACTION_SIGNS = MIRROR_SIGNS[-ACTION_COUNT:]
"""An action's mirror image is `ACTION_SIGNS * action[ACTION_ORDER]`, an observation's likewise."""


@njit
def is_mirrored(phase: float) -> bool:
    """Whether it is the left leg's half of the cycle, from a quarter before its heel strike.

    Parameters
    ----------
    phase : of the right gait cycle; any real number.
    """
    return bool((phase + MIRROR_FROM) % 1.0 >= 0.5)


class Targets(NamedTuple):
    """Reference over one cycle for observation and reward, without the forward travel; the first
    sample is repeated at the end.
    """

    positions: Array  # (N + 1, 31)
    velocities: Array  # (N + 1, 31)
    centre_of_mass: Array  # (N + 1, 3)
    end_effectors: Array  # (N + 1, 12)
    ground_reaction: Array  # (N + 1, 6)
    moments: Array  # (N + 1, 25), Nm/kg
    has_moment: Array  # (25,), 1 where the record has a moment
    stride_length: float
    speed: float  # over the square root of gravity times leg length


def targets_of(reference: ReferenceMotion, model: BodyModel) -> Targets:
    """The targets that `measure` compares a body with.

    Parameters
    ----------
    reference : the motion to imitate, over one right gait cycle.
    model : the body as scaled, whose mass and leg length make moments and speed dimensionless or
        per kg.
    """
    stride = reference.speed * reference.stride_time
    travel = stride * reference.phase
    positions = reference.positions.copy()
    # Without the forward travel everything is periodic, so that tables can be read at any phase;
    # `measure` adds it again.
    positions[:, 3] -= travel
    com = reference.centre_of_mass.copy()
    com[:, 0] -= travel
    effectors = reference.end_effectors.copy()
    effectors[..., 0] -= travel[:, None]

    def closed(values: Array) -> Array:
        return closed_cycle(values.reshape(len(values), -1))

    return Targets(
        closed(positions),
        closed(reference.velocities),
        closed(com),
        closed(effectors),
        closed(reference.ground_reaction),
        closed(reference.moments / model.mass),
        # A joint whose recorded moment is unknown is zero throughout; it must not be rewarded for
        # exerting none.
        np.any(reference.moments != 0.0, axis=0).astype(float),
        stride,
        reference.speed / math.sqrt(GRAVITY * model.leg_length),
    )


@njit_borrowing
def _square(values: Array) -> float:
    total = 0.0
    for i in range(values.shape[0]):
        total += values[i] * values[i]
    return total


@njit
def measure(
    tree: Tree,
    targets: Targets,
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
    action_change: float,
    parameters: Array,
    extended: bool,
    half_cycle: bool,
    observation: Array,
    errors: Array,
) -> bool:
    """Observation and squared errors of one state.

    It is long because both use the same differences from the reference and it runs at every action:
    two functions would have to pass twelve arrays.

    Parameters
    ----------
    tree : the body.
    targets : of the reference, see `targets_of`.
    state : (2, 31) coordinates and velocities, rad, m and per s.
    phase : of the right gait cycle, counting on over cycles.
    pace : of the last action.
    lift : m, added to the reference's heights for the leg length of the body.
    half_action : phase of half an action: means over the action are compared with the reference at
        its middle.
    mass, weight : of the nominal body, kg and N.
    ground : (2, 3) N, mean over the action.
    moments : (25,) Nm, mean over the action.
    action : (26,) the last action.
    action_change : mean squared difference of the last action from the one before.
    parameters : (14,) the observed mu.
    extended : whether the observation is the extended one (126,) or the paper's (71,).
    half_cycle : the sines and cosines are of the phase within its half of the cycle, see
        `is_mirrored`.
    observation : (71,) or (126,) out.
    errors : (12,) out: squared errors of the first nine `REWARD_TERMS`, then height m, rotation rad
        and drift m of the pelvis, for termination.

    Returns
    -------
    False, and both arrays unchanged, if the simulation has diverged.
    """
    for i in range(2):
        for d in range(COORDINATE_COUNT):
            # Written with `not`, so that a NaN counts as diverged too.
            if not abs(state[i, d]) < _LARGEST_STATE:
                return False
    q, qd = state[0], state[1]
    frames, motion = empty_frames(), np.empty((3, 3))
    forward(tree.joint_position, q, frames.rotation, frames.origin, frames.axes, SEGMENT_COUNT)
    velocities(frames.origin, frames.axes, qd, frames.angular, frames.linear, SEGMENT_COUNT)
    whole_body_motion(tree, frames, motion)

    q_ref, qd_ref = np.empty(COORDINATE_COUNT), np.empty(COORDINATE_COUNT)
    com_ref, grf_ref, moment_ref = np.empty(3), np.empty(6), np.empty(ACTUATED_COUNT)
    ee_ref, effector = np.empty(3 * EFFECTOR_COUNT), np.empty(3 * EFFECTOR_COUNT)
    read_table(targets.positions, phase, q_ref)
    read_table(targets.velocities, phase, qd_ref)
    read_table(targets.centre_of_mass, phase, com_ref)
    read_table(targets.end_effectors, phase, ee_ref)
    for i in range(COORDINATE_COUNT):
        # Chain rule: at another pace the same motion takes place in 1 / pace of the time.
        qd_ref[i] *= pace
    travel = targets.stride_length * phase
    q_ref[3] += travel
    q_ref[5] += lift
    com_ref[0] += travel
    com_ref[2] += lift

    # The rotation that takes the reference's pelvis to the walker's, as a vector in world axes: its
    # length is the angle between them. A difference of the coordinates would not be an angle.
    turn = rotation_vector(frames.rotation[0] @ rotation_matrix(q_ref).T)
    joint = q[6:] - q_ref[6:]
    joint_rate = qd[6:] - qd_ref[6:]
    for e in range(EFFECTOR_COUNT):
        for i in range(3):
            effector[3 * e + i] = frames.origin[_EFFECTORS[e], i] - ee_ref[3 * e + i]
        # The position of the pelvis is a separate error.
        effector[3 * e] -= travel + q[3] - q_ref[3]
        effector[3 * e + 1] -= q[4] - q_ref[4]
    # Forces and moments are means over the action that has just ended, which lie in its middle.
    middle = phase - pace * half_action
    read_table(targets.ground_reaction, middle, grf_ref)
    read_table(targets.moments, middle, moment_ref)

    errors[0] = _square(joint)
    errors[1] = _square(joint_rate)
    errors[2] = _square(motion[0] - com_ref)
    errors[3] = _square(turn)
    errors[4] = _square(effector)
    errors[5] = 0.0
    for i in range(6):
        # Body weights here, Nm/kg below: the reward does not depend on a person's size.
        errors[5] += (_FORCE_WEIGHTS[i % 3] * (ground[i // 3, i % 3] / weight - grf_ref[i])) ** 2
    errors[6] = 0.0
    for i in range(ACTUATED_COUNT):
        errors[6] += targets.has_moment[i] * (moments[i] / mass - moment_ref[i]) ** 2
    errors[7] = (pace - 1.0) ** 2
    errors[8] = action_change
    errors[9] = abs(q[5] - q_ref[5])
    errors[10] = np.sqrt(errors[3])
    errors[11] = np.sqrt((q[3] - q_ref[3]) ** 2 + (q[4] - q_ref[4]) ** 2)

    if extended:
        # Relative to the reference, so that the same numbers mean the same for every person; the
        # paper's observation has the coordinates themselves.
        observation[0:ACTUATED_COUNT] = joint
        observation[ACTUATED_COUNT : 2 * ACTUATED_COUNT] = _VELOCITY_SCALE * joint_rate
    else:
        observation[0:ACTUATED_COUNT] = q[6:]
        observation[ACTUATED_COUNT : 2 * ACTUATED_COUNT] = qd[6:]
    observation[50:53] = motion[1]
    observation[53:56] = motion[2]
    seen = phase - np.floor(phase)
    # The phase says which leg is which even if the policy sees half cycles, because a person's two
    # sides are not the same.
    observation[56] = seen
    if half_cycle:
        seen = (seen + MIRROR_FROM) % 0.5
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
        observation[99] = targets.speed
        observation[100:126] = action
    return True
