"""Observations of a walking body, and how far it is from the reference.

The paper's 71 numbers (section III-A), or an `extended` observation (docs/paper.md), and its
mirror image in the sagittal plane: the parts of `PARTS`, in their order, in world axes, rad, m and
s. The paper's ends with the body parameters.

It is long because whatever a policy is shown of a body, and compared by, is measured at once.
"""

import math
from collections.abc import Sequence
from typing import Any, Final, NamedTuple

import numpy as np
from numpy.typing import NDArray

from gaitval._internal.numba.compiled import njit_borrowing
from gaitval._internal.numba.lanes import (
    floor,
    fused,
    magnitude,
    remainder,
    sine_cosine,
    sqrt,
    where,
)
from gaitval.arrays import Array, Index
from gaitval.constants import GRAVITY
from gaitval.coordinates import ACTUATED, mirrored
from gaitval.model.body import SEGMENTS, BodyModel
from gaitval.model.parameters import PARAMETERS
from gaitval.model.tree import (
    ACTUATED_COUNT,
    COORDINATE_COUNT,
    SEGMENT_COUNT,
    Frames,
    Tree,
    empty_frames,
    enter_rotation,
    enter_rotation_vector,
    forward,
    turned_inertia,
    velocities,
)
from gaitval.policy import reward
from gaitval.walk.reference.motion import END_EFFECTORS, ReferenceMotion
from gaitval.walk.simulation.servo import closed_cycle
from gaitval.walk.simulation.tables import read_table

OBSERVATION_CLIP = 10.0
"""Normalised observations are clipped at this, during and after training."""

EFFECTOR_COUNT = len(END_EFFECTORS)
ACTION_COUNT = ACTUATED_COUNT + 1
"""Numbers of an action with a pace."""
_EFFECTORS = np.array([SEGMENTS.index(name) for name in END_EFFECTORS])

_FORCE_WEIGHTS = np.array([2.0, 3.0, 1.0])
"""Weights of forward, sideways and vertical ground reaction in the reward."""

VELOCITY_SCALE = 0.1
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


class ObservationPart(NamedTuple):
    """A part of an observation.

    Attributes
    ----------
    name : "difference" in the comments of `PARTS` is from the reference, and only in the extended
        observation; the paper's has the coordinates themselves.
    mirrors, signs : of each element, which element of the part takes its place in the mirror image
        in the sagittal plane, and its sign.
    """

    name: str
    mirrors: Sequence[int]
    signs: Sequence[int]


def _unchanged(name: str, count: int) -> ObservationPart:
    return ObservationPart(name, range(count), [1] * count)


# Mirrored in the plane y = 0, a polar vector (position, velocity, force) changes the sign of y; an
# axial vector (rotation, angular velocity) changes those of x and z. Joint coordinates have the
# same sign on both sides (`coordinates`), so legs and arms only change places.
_POLAR, _AXIAL = [1, -1, 1], [-1, 1, -1]
_BOTH_FEET = [3, 4, 5, 0, 1, 2]
_JOINTS = [ACTUATED.index(mirrored(name)) for name in ACTUATED]
_JOINT_SIGNS = [-1 if name in ("lumbar_bending", "lumbar_rotation") else 1 for name in ACTUATED]

PARTS: Final = (
    ObservationPart("joint_angles", _JOINTS, _JOINT_SIGNS),  # difference
    ObservationPart("joint_velocities", _JOINTS, _JOINT_SIGNS),  # difference, in tens of rad/s
    ObservationPart("centre_of_mass_velocity", range(3), _POLAR),
    ObservationPart("angular_velocity", range(3), _AXIAL),  # of the whole body
    _unchanged("phase", 1),  # of the right gait cycle, 0 to 1
    _unchanged("parameters", len(PARAMETERS)),  # mu; extended: scaled to -1 ... 1
    # from here on extended only
    _unchanged("waves", 4),  # sine and cosine of the phase, and of twice the phase
    ObservationPart("pelvis_rotation", range(3), _AXIAL),  # vector; difference
    ObservationPart("pelvis_position", range(3), _POLAR),  # difference
    ObservationPart("pelvis_angular_velocity", range(3), _AXIAL),  # difference
    ObservationPart("pelvis_velocity", range(3), _POLAR),  # difference
    ObservationPart("feet", _BOTH_FEET, _POLAR * 2),  # right and left, from the pelvis; difference
    ObservationPart(
        "ground_reaction", _BOTH_FEET, _POLAR * 2
    ),  # body weights, mean over the last action
    _unchanged("speed", 1),  # of walking, over the square root of gravity times leg length
    ObservationPart(
        "action", [*_JOINTS, ACTUATED_COUNT], [*_JOINT_SIGNS, 1]
    ),  # last: 25 joints, pace
)
"""Of an observation, in order."""


def _places() -> dict[str, slice]:
    found, start = {}, 0
    for part in PARTS:
        found[part.name] = slice(start, start := start + len(part.signs))
    return found


OBSERVED: Final = _places()
"""Where each of `PARTS` is."""
OBSERVATION_SIZES = {"paper": OBSERVED["parameters"].stop, "extended": OBSERVED["action"].stop}
PARAMETERS_OBSERVED = OBSERVED["parameters"]
"""Position of mu in both observations; in the extended one it is scaled to -1 ... 1."""

# where parts begin: compiled code takes no dictionary
_ANGLES: Final[int] = OBSERVED["joint_angles"].start
_VELOCITIES: Final[int] = OBSERVED["joint_velocities"].start
_COM_VELOCITY: Final[int] = OBSERVED["centre_of_mass_velocity"].start
_SPIN: Final[int] = OBSERVED["angular_velocity"].start
_PHASE: Final[int] = OBSERVED["phase"].start
_MU: Final[int] = OBSERVED["parameters"].start
_WAVES: Final[int] = OBSERVED["waves"].start
_TURN: Final[int] = OBSERVED["pelvis_rotation"].start
_PLACE: Final[int] = OBSERVED["pelvis_position"].start
_TURNING: Final[int] = OBSERVED["pelvis_angular_velocity"].start
_MOVING: Final[int] = OBSERVED["pelvis_velocity"].start
_FEET: Final[int] = OBSERVED["feet"].start
_GROUND: Final[int] = OBSERVED["ground_reaction"].start
_SPEED: Final[int] = OBSERVED["speed"].start
_ACTION: Final[int] = OBSERVED["action"].start


def _mirror() -> tuple[Index, Array]:
    """Order (126,) and signs (126,) that turn an extended observation into its mirror image in the
    sagittal plane. The last 26 mirror an action.
    """
    order = [OBSERVED[part.name].start + i for part in PARTS for i in part.mirrors]
    signs = [sign for part in PARTS for sign in part.signs]
    return np.array(order), np.array(signs, dtype=float)


MIRROR_ORDER, MIRROR_SIGNS = _mirror()
# An observation ends with the last action, so its last elements, counted from their first, mirror
# an action.
ACTION_ORDER = MIRROR_ORDER[-ACTION_COUNT:] - (OBSERVATION_SIZES["extended"] - ACTION_COUNT)
ACTION_SIGNS = MIRROR_SIGNS[-ACTION_COUNT:]
"""An action's mirror image is `ACTION_SIGNS * action[ACTION_ORDER]`, an observation's likewise."""


@njit_borrowing
def normalise(seen: Array, mean: Array, deviation: Array, out: NDArray[np.float32]) -> None:
    """Observations `seen` (B, size) as a network takes them, into `out`, by the `mean` and
    `deviation` (size,) of what training saw: to single precision after all else, as the learner
    does, or the actor would see other numbers than it was trained on.
    """
    for e in range(len(seen)):
        for i in range(len(mean)):
            each = (seen[e, i] - mean[i]) / deviation[i]
            # NaN is neither, and stays
            if each < -OBSERVATION_CLIP:
                each = -OBSERVATION_CLIP
            elif each > OBSERVATION_CLIP:
                each = OBSERVATION_CLIP
            out[e, i] = each


@njit_borrowing
def is_mirrored(phase: float) -> bool:
    """Whether it is the left leg's half of the cycle, from a quarter before its heel strike, at any
    `phase` of the right gait cycle.
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
    """The targets that `measure` compares a body with: of `reference`, over one right gait cycle,
    with moments and speed per kg or without dimension by mass and leg length of `model`, the body
    as scaled.
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


class Yardstick(NamedTuple):
    """What an environment compares a body with; constant from its construction on.

    Attributes
    ----------
    targets : of the reference, see `observation.targets_of`.
    weights, sharpness : (10,), (9,) as in `policy.reward`.
    tolerances : (3,) of height m, rotation rad and drift m of the pelvis.
    half_action : phase of half an action.
    mass, weight : of the nominal body, kg and N.
    extended, mirrors : whether the observation is the extended one, and whether it is mirrored in
        the left leg's half of the cycle.
    """

    targets: Targets
    weights: Array
    sharpness: Array
    tolerances: Array
    half_action: float
    mass: float
    weight: float
    extended: bool
    mirrors: bool


class EpisodeArrays(NamedTuple):
    """What changes with every action.

    Attributes
    ----------
    action, before : (26,) the last action as it acts, and the one before.
    parameters : (14,) the observed mu.
    observation : (size,), before it is mirrored.
    errors : of `reward.ERRORS`: squared errors of all `REWARD_TERMS` but the torque, then height m,
        rotation rad and drift m of the pelvis, for termination.
    terms : (10,) as in `weighted_reward`.
    root_force : (6,) Nm, N, of the push.
    """

    action: Array
    before: Array
    parameters: Array
    observation: Array
    errors: Array
    terms: Array
    root_force: Array


class MeasureWorkspace(NamedTuple):
    """Arrays that `measure` works in.

    Attributes
    ----------
    frames : of all segments.
    place, velocity, arm, momentum, inertia, turned, adjugate : of `whole_body_motion`, motion (3,
        3) what it gives.
    positions, velocities, centre_of_mass, end_effectors, ground_reaction, moments : of `Targets`,
        at a phase; pelvis (3, 3) their rotation of it.
    rotation, turn, joint, joint_rate, effector : differences from them; of the pelvis a matrix and
        a vector.
    """

    frames: Frames
    place: Array
    velocity: Array
    arm: Array
    momentum: Array
    inertia: Array
    turned: Array
    adjugate: Array
    motion: Array
    positions: Array
    velocities: Array
    centre_of_mass: Array
    end_effectors: Array
    ground_reaction: Array
    moments: Array
    pelvis: Array
    rotation: Array
    turn: Array
    joint: Array
    joint_rate: Array
    effector: Array


def measure_workspace() -> MeasureWorkspace:
    """Arrays to be overwritten."""
    segment, square, joints = (SEGMENT_COUNT, 3), (3, 3), ACTUATED_COUNT
    effectors = 3 * EFFECTOR_COUNT
    sizes = (
        segment, segment, 3, 3, square, square, square, square, COORDINATE_COUNT, COORDINATE_COUNT,
        3, effectors, 6, joints, square, square, 3, joints, joints, effectors,
    )  # fmt: skip
    return MeasureWorkspace(empty_frames(), *(np.zeros(size) for size in sizes))


@njit_borrowing
def _cross(a: Array, b: Array, out: Array) -> None:
    """out += a × b."""
    out[0] += a[1] * b[2] - a[2] * b[1]
    out[1] += a[2] * b[0] - a[0] * b[2]
    out[2] += a[0] * b[1] - a[1] * b[0]


@njit_borrowing
def whole_body_motion(tree: Tree, frames: Frames, out: Array, work: MeasureWorkspace) -> None:
    """Motion of the whole body, `tree` with the poses and velocities of all segments in `frames`,
    as if it were rigid: `out` (3, 3), rows: centre of mass m, its velocity m/s, and the angular
    velocity rad/s with which a rigid body of the same inertia about it has the same angular
    momentum; world. The place to adjugate of `work` is overwritten.
    """
    mass, place, velocity, arm = tree.mass, work.place, work.velocity, work.arm
    momentum, inertia, turned, adjugate = work.momentum, work.inertia, work.turned, work.adjugate
    com, com_velocity, angular = out[0], out[1], out[2]
    total = mass[0]
    for s in range(1, mass.shape[0]):
        total += mass[s]
    for i in range(3):
        com[i] = com_velocity[i] = angular[i] = momentum[i] = 0.0
        for j in range(3):
            inertia[i, j] = adjugate[i, j] = 0.0
    for s in range(mass.shape[0]):
        r, c = frames.rotation[s], tree.centre_of_mass[s]
        for i in range(3):
            arm[i] = r[i, 0] * c[0] + r[i, 1] * c[1] + r[i, 2] * c[2]
            place[s, i] = frames.origin[s, i] + arm[i]
            velocity[s, i] = frames.linear[s, i]
        _cross(frames.angular[s], arm, velocity[s])
        for i in range(3):
            com[i] += mass[s] / total * place[s, i]
            com_velocity[i] += mass[s] / total * velocity[s, i]
    for s in range(mass.shape[0]):
        # L = Σ (r × m v + J ω) and I = Σ (J + m (r² 1 - r rᵀ)), about the whole body's centre of
        # mass.
        turned_inertia(frames.rotation[s], tree.inertia[s], turned)
        for i in range(3):
            place[s, i] -= com[i]
            velocity[s, i] = mass[s] * (velocity[s, i] - com_velocity[i])
        _cross(place[s], velocity[s], momentum)
        x, y, z = place[s, 0], place[s, 1], place[s, 2]
        square = x * x + y * y + z * z
        for i in range(3):
            inertia[i, i] += mass[s] * square
            for j in range(3):
                momentum[i] += turned[i, j] * frames.angular[s, j]
                inertia[i, j] += turned[i, j] - mass[s] * place[s, i] * place[s, j]
    # I⁻¹ L by Cramer's rule: the columns of the adjugate are cross products of the rows of I.
    for i in range(3):
        _cross(inertia[(i + 1) % 3], inertia[(i + 2) % 3], adjugate[i])
    determinant = (
        inertia[0, 0] * adjugate[0, 0]
        + inertia[0, 1] * adjugate[0, 1]
        + inertia[0, 2] * adjugate[0, 2]
    )
    for i in range(3):
        for j in range(3):
            angular[i] += adjugate[j, i] * momentum[j] / determinant


@njit_borrowing
def diverged(state: Array) -> Any:
    """1 if a `state` (2, 31) is no movement any more, otherwise 0; of lanes, in each."""
    found: Any = 0.0
    for i in range(2):
        for d in range(COORDINATE_COUNT):
            # A NaN is not smaller than anything, and so counts as diverged.
            found = where(magnitude(state[i, d]) < _LARGEST_STATE, found, 1.0)
    return found


@njit_borrowing
def _square(values: Array) -> Any:
    total = values[0] * values[0]
    for i in range(1, values.shape[0]):
        total += values[i] * values[i]
    return total


@njit_borrowing
def measure(
    tree: Tree,
    yardstick: Yardstick,
    state: Array,
    phase: Any,
    pace: Any,
    lift: Any,
    ground: Array,
    moments: Array,
    change: Any,
    episode: EpisodeArrays,
    work: MeasureWorkspace,
) -> None:
    """Observation and squared errors of one state, or of eight in lanes, into `episode`. `change`
    is the mean squared difference of the last action from the one before; `tree`, `yardstick`,
    `state`, `phase`, `pace`, `lift`, `ground`, `moments`, `episode`, `work` are as
    `judgement.judge` takes them.

    It is long because both use the same differences from the reference and it runs at every action:
    two functions would have to pass twelve arrays.
    """
    targets, mass, weight = yardstick.targets, yardstick.mass, yardstick.weight
    observation, errors, action = episode.observation, episode.errors, episode.action
    parameters, extended = episode.parameters, yardstick.extended
    q, qd, frames, motion = state[0], state[1], work.frames, work.motion
    forward(tree.joint_position, q, frames, SEGMENT_COUNT)
    velocities(qd, frames, SEGMENT_COUNT)
    whole_body_motion(tree, frames, motion, work)

    q_ref, qd_ref, com_ref, ee_ref = (
        work.positions, work.velocities, work.centre_of_mass, work.end_effectors
    )  # fmt: skip
    read_table(targets.positions, phase, q_ref)
    read_table(targets.velocities, phase, qd_ref)
    read_table(targets.centre_of_mass, phase, com_ref)
    read_table(targets.end_effectors, phase, ee_ref)
    travel = targets.stride_length * phase
    q_ref[3] += travel
    q_ref[5] += lift
    com_ref[0] += travel
    com_ref[2] += lift
    for i in range(COORDINATE_COUNT):
        # Chain rule: at another pace the same motion takes place in 1 / pace of the time.
        qd_ref[i] *= pace

    # The rotation that takes the reference's pelvis to the walker's, as a vector in world axes: its
    # length is the angle between them. A difference of the coordinates would not be an angle.
    wanted, rotation, turn = work.pelvis, work.rotation, work.turn
    enter_rotation(q_ref, wanted)
    for i in range(3):
        for j in range(3):
            # As a library's product of matrices rounds.
            first = frames.rotation[0, i, 0] * wanted[j, 0]
            two = fused(frames.rotation[0, i, 1], wanted[j, 1], first)
            rotation[i, j] = fused(frames.rotation[0, i, 2], wanted[j, 2], two)
    enter_rotation_vector(rotation, turn)
    joint, joint_rate, effector = work.joint, work.joint_rate, work.effector
    for i in range(ACTUATED_COUNT):
        joint[i] = q[6 + i] - q_ref[6 + i]
        joint_rate[i] = qd[6 + i] - qd_ref[6 + i]
    for e in range(EFFECTOR_COUNT):
        for i in range(3):
            effector[3 * e + i] = frames.origin[_EFFECTORS[e], i] - ee_ref[3 * e + i]
        # The position of the pelvis is a separate error.
        effector[3 * e] -= travel + q[3] - q_ref[3]
        effector[3 * e + 1] -= q[4] - q_ref[4]
    # Forces and moments are means over the action that has just ended, which lie in its middle.
    grf_ref, moment_ref = work.ground_reaction, work.moments
    middle = phase - pace * yardstick.half_action
    read_table(targets.ground_reaction, middle, grf_ref)
    read_table(targets.moments, middle, moment_ref)

    errors[reward.JOINT_POSITIONS] = _square(joint)
    errors[reward.JOINT_VELOCITIES] = _square(joint_rate)
    for i in range(3):
        com_ref[i] = motion[0, i] - com_ref[i]
    errors[reward.CENTRE_OF_MASS] = _square(com_ref)
    errors[reward.PELVIS_ROTATION] = _square(turn)
    errors[reward.END_EFFECTORS] = _square(effector)
    for i in range(6):
        # Body weights here, Nm/kg below: the reward does not depend on a person's size.
        grf_ref[i] = _FORCE_WEIGHTS[i % 3] * (ground[i // 3, i % 3] / weight - grf_ref[i])
    errors[reward.GROUND_REACTION] = _square(grf_ref)
    errors[reward.JOINT_MOMENTS] = 0.0
    for i in range(ACTUATED_COUNT):
        off = moments[i] / mass - moment_ref[i]
        errors[reward.JOINT_MOMENTS] += targets.has_moment[i] * (off * off)
    errors[reward.PACE] = (pace - 1.0) * (pace - 1.0)
    errors[reward.ACTION_CHANGE] = change
    forward_drift, left_drift = q[3] - q_ref[3], q[4] - q_ref[4]
    errors[reward.HEIGHT] = magnitude(q[5] - q_ref[5])
    errors[reward.ROTATION] = sqrt(errors[reward.PELVIS_ROTATION])
    errors[reward.DRIFT] = sqrt(forward_drift * forward_drift + left_drift * left_drift)

    for i in range(ACTUATED_COUNT):
        # Relative to the reference, so that the same numbers mean the same for every person; the
        # paper's observation has the coordinates themselves.
        observation[_ANGLES + i] = joint[i] if extended else q[6 + i]
        rate = VELOCITY_SCALE * joint_rate[i] if extended else qd[6 + i]
        observation[_VELOCITIES + i] = rate
    for i in range(3):
        observation[_COM_VELOCITY + i] = motion[1, i]
        observation[_SPIN + i] = motion[2, i]
    # The phase says which leg is which even if the policy sees half cycles, because a person's two
    # sides are not the same.
    seen = phase - floor(phase)
    observation[_PHASE] = seen
    for i in range(parameters.shape[0]):
        observation[_MU + i] = parameters[i]
    if not extended:
        return
    if yardstick.mirrors:
        seen = remainder(seen + MIRROR_FROM, 0.5)
    angle = 2.0 * np.pi * seen
    observation[_WAVES], observation[_WAVES + 1] = sine_cosine(angle)
    observation[_WAVES + 2], observation[_WAVES + 3] = sine_cosine(2.0 * angle)
    for i in range(3):
        observation[_TURN + i] = turn[i]
        observation[_PLACE + i] = q[3 + i] - q_ref[3 + i]
        observation[_TURNING + i] = qd[i] - qd_ref[i]
        observation[_MOVING + i] = qd[3 + i] - qd_ref[3 + i]
    for i in range(6):
        observation[_FEET + i] = effector[i]
        observation[_GROUND + i] = ground[i // 3, i % 3] / weight
    observation[_SPEED] = targets.speed
    for i in range(action.shape[0]):
        observation[_ACTION + i] = action[i]
