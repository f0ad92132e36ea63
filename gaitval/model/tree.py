"""The body model as plain arrays, and its forward kinematics compiled with numba.

Root convention: positions (rotation vector, origin of the pelvis) and velocities (angular, linear)
in world axes, as in dartpy's FreeJoint; a generalised root force is the moment about the pelvis
origin, then the force, in world axes.
"""

from typing import Any, NamedTuple

import numpy as np

from gaitval._internal.numba.compiled import njit, njit_borrowing
from gaitval._internal.numba.lanes import (
    WIDTH,
    arctangent,
    in_lanes,
    magnitude,
    sine_cosine,
    sqrt,
    where,
    with_lanes,
)
from gaitval.arrays import Array, Index
from gaitval.coordinates import ACTUATED, AXES, COORDINATES
from gaitval.model.body import JOINT_COORDINATES, PARENTS, SEGMENTS, BodyModel

ROOT_DOFS = 6
SEGMENT_COUNT = len(SEGMENTS)
COORDINATE_COUNT = len(COORDINATES)
ACTUATED_COUNT = len(ACTUATED)

_INDEX = {name: i for i, name in enumerate(SEGMENTS)}
PARENT: Index = np.array([_INDEX[PARENTS[s]] if s in PARENTS else -1 for s in SEGMENTS])
FIRST_DOF: Index = np.array(
    [ROOT_DOFS + ACTUATED.index(JOINT_COORDINATES[s][0]) if s in PARENTS else 0 for s in SEGMENTS]
)
DOF_COUNT: Index = np.array([len(JOINT_COORDINATES.get(s, ())) for s in SEGMENTS])
_AXES = np.vstack([np.zeros((ROOT_DOFS, 3)), [AXES[name] for name in ACTUATED]])
_COLUMN: Index = np.argmax(np.abs(_AXES), axis=1)
"""Every actuated coordinate turns about x, y or z of its frame (0, 1, 2) ..."""
_SIGN: Array = _AXES.sum(axis=1)
"""... in the positive or, with -1, the negative direction."""


class Tree(NamedTuple):
    """A `BodyModel` as arrays; S = 14 segments in the order of `SEGMENTS`, K = 12 spheres.

    Attributes
    ----------
    joint_position : (S, 3) m, in the parent's frame.
    mass : (S,) kg.
    centre_of_mass : (S, 3) m, in the segment's frame.
    inertia : (S, 3, 3) kg m², about the centre of mass.
    sphere_segment : (K,) index into `SEGMENTS`.
    sphere_position : (K, 3) m, in the segment's frame.
    sphere_radius : (K,) m.
    gravity : (3,) m/s², in the world's axes, which are the ground's (`model.ground`).
    """

    joint_position: Array
    mass: Array
    centre_of_mass: Array
    inertia: Array
    sphere_segment: Index
    sphere_position: Array
    sphere_radius: Array
    gravity: Array


class Frames(NamedTuple):
    """Poses and velocities of all segments, as filled by `forward` and `velocities`.

    Attributes
    ----------
    rotation : (14, 3, 3) segment to world.
    origin : (14, 3) m, joint of each segment to its parent, world.
    axes : (31, 3) axis of every actuated coordinate, world; the root's rows are unused.
    angular, linear : (14, 3) rad/s and m/s of the segment's joint, world.
    """

    rotation: Array
    origin: Array
    axes: Array
    angular: Array
    linear: Array


@njit
def empty_frames() -> Frames:
    """Arrays to be filled by `forward` and `velocities`."""
    return Frames(
        np.empty((SEGMENT_COUNT, 3, 3)),
        np.empty((SEGMENT_COUNT, 3)),
        np.zeros((COORDINATE_COUNT, 3)),
        np.empty((SEGMENT_COUNT, 3)),
        np.empty((SEGMENT_COUNT, 3)),
    )


def tree_arrays(model: BodyModel) -> Tree:
    """The arrays of a body `model`."""
    return Tree(
        joint_position=np.array([s.joint_position for s in model.segments], dtype=float),
        mass=np.array([s.mass for s in model.segments], dtype=float),
        centre_of_mass=np.array([s.centre_of_mass for s in model.segments], dtype=float),
        inertia=np.array([s.inertia for s in model.segments], dtype=float),
        sphere_segment=np.array([_INDEX[c.segment] for c in model.spheres], dtype=np.int64),
        sphere_position=np.array([c.position for c in model.spheres], dtype=float),
        sphere_radius=np.array([c.radius for c in model.spheres], dtype=float),
        gravity=model.ground.gravity,
    )


@njit_borrowing
def enter_rotation(vector: Array, matrix: Array) -> None:
    """Write the matrix (3, 3) of a rotation `vector` (3,) into `matrix`, by Rodrigues' formula."""
    x, y, z = vector[0], vector[1], vector[2]
    square = x * x + y * y + z * z
    angle = sqrt(square)
    small = angle < 1e-7
    divisor = where(small, 1.0, angle)
    sine, cosine = sine_cosine(angle)
    # sin(θ)/θ and (1 - cos θ)/θ², by their series where they are 0/0.
    a = where(small, 1.0 - square / 6.0, sine / divisor)
    b = where(small, 0.5 - square / 24.0, (1.0 - cosine) / (divisor * divisor))
    matrix[0, 0] = 1.0 - b * (y * y + z * z)
    matrix[0, 1] = b * x * y - a * z
    matrix[0, 2] = b * x * z + a * y
    matrix[1, 0] = b * x * y + a * z
    matrix[1, 1] = 1.0 - b * (x * x + z * z)
    matrix[1, 2] = b * y * z - a * x
    matrix[2, 0] = b * x * z - a * y
    matrix[2, 1] = b * y * z + a * x
    matrix[2, 2] = 1.0 - b * (x * x + y * y)


@njit_borrowing
def enter_rotation_vector(matrix: Array, vector: Array) -> None:
    """Write the rotation vector of `matrix` (3, 3) into `vector` (3,), for less than about 179°."""
    # The skew part of R is sin(angle) times the axis; its trace is 1 + 2 cos(angle).
    x = 0.5 * (matrix[2, 1] - matrix[1, 2])
    y = 0.5 * (matrix[0, 2] - matrix[2, 0])
    z = 0.5 * (matrix[1, 0] - matrix[0, 1])
    sine = sqrt(x * x + y * y + z * z)
    small = sine < 1e-4
    angle = arctangent(sine, 0.5 * (matrix[0, 0] + matrix[1, 1] + matrix[2, 2] - 1.0))
    factor = where(small, 1.0 + sine * sine / 6.0, angle / where(small, 1.0, sine))
    vector[0], vector[1], vector[2] = factor * x, factor * y, factor * z


@njit_borrowing
def _half_turn(x: Any, y: Any, z: Any, share: float) -> Any:
    """Quaternion of the rotation by twice `share` of a rotation vector."""
    x, y, z = share * x, share * y, share * z
    half = sqrt(x * x + y * y + z * z)
    small = half < 1e-4
    sine, cosine = sine_cosine(half)
    factor = where(small, 1.0 - half * half / 6.0, sine / where(small, 1.0, half))
    return cosine, factor * x, factor * y, factor * z


@njit_borrowing
def turned_vector(vector: Array, angular_velocity: Array, step: float) -> None:
    """Rotate the rotation vector `vector` (3, …), in and out, with an `angular_velocity` (3, …)
    rad/s, world axes, for a time `step`, s: R ← exp(step ω) R.

    It uses quaternions, so it is exact for angles up to 180 degrees, where the vector is unique;
    the result is no longer than π.
    """
    w, x, y, z = _half_turn(vector[0], vector[1], vector[2], 0.5)
    t, a, b, c = _half_turn(
        angular_velocity[0], angular_velocity[1], angular_velocity[2], 0.5 * step
    )
    # Product of quaternions, the new rotation on the left: ω is in world axes.
    qw = t * w - a * x - b * y - c * z
    qx = t * x + a * w + b * z - c * y
    qy = t * y + b * w + c * x - a * z
    qz = t * z + c * w + a * y - b * x
    negative = qw < 0.0
    sine = sqrt(qx * qx + qy * qy + qz * qz)
    small = sine < 1e-8
    factor = where(small, 2.0, 2.0 * arctangent(sine, magnitude(qw)) / where(small, 1.0, sine))
    # q and -q are one rotation; the one with w ≥ 0 turns by at most π.
    factor = where(negative, -factor, factor)
    vector[0], vector[1], vector[2] = factor * qx, factor * qy, factor * qz


@njit_borrowing
def forward(joint_position: Array, q: Array, frames: Frames, segments: int) -> None:
    """Forward kinematics of the first `segments` segments, counted from the pelvis (9 are pelvis
    and legs), in the position `q` (31,); `joint_position` (14, 3) m is as in `Tree`. Rotations,
    origins and axes of `frames` are out; the root's axes are left.
    """
    rotation, origin, axes = frames.rotation, frames.origin, frames.axes
    enter_rotation(q, rotation[0])
    origin[0, 0], origin[0, 1], origin[0, 2] = q[3], q[4], q[5]
    for s in range(1, segments):
        p = PARENT[s]
        frame = rotation[s]
        for i in range(3):
            origin[s, i] = (
                origin[p, i]
                + rotation[p, i, 0] * joint_position[s, 0]
                + rotation[p, i, 1] * joint_position[s, 1]
                + rotation[p, i, 2] * joint_position[s, 2]
            )
            for j in range(3):
                frame[i, j] = rotation[p, i, j]
        for d in range(FIRST_DOF[s], FIRST_DOF[s] + DOF_COUNT[s]):
            # The axis is a signed column of the frame: the other two columns turn about it.
            k, sign = _COLUMN[d], _SIGN[d]
            i, j = (k + 1) % 3, (k + 2) % 3
            sine, cosine = sine_cosine(q[d])
            sine = sign * sine
            for row in range(3):
                axes[d, row] = sign * frame[row, k]
                a, b = frame[row, i], frame[row, j]
                frame[row, i] = a * cosine + b * sine
                frame[row, j] = b * cosine - a * sine


@njit_borrowing
def velocities(qd: Array, frames: Frames, segments: int) -> None:
    """Angular and linear velocities of the first `segments` segments at `qd` (31,), into `frames`
    as `forward` left them.
    """
    _, origin, axes, angular, linear = frames
    for i in range(3):
        angular[0, i] = qd[i]
        linear[0, i] = qd[3 + i]
    for s in range(1, segments):
        p = PARENT[s]
        r0 = origin[s, 0] - origin[p, 0]
        r1 = origin[s, 1] - origin[p, 1]
        r2 = origin[s, 2] - origin[p, 2]
        linear[s, 0] = linear[p, 0] + angular[p, 1] * r2 - angular[p, 2] * r1
        linear[s, 1] = linear[p, 1] + angular[p, 2] * r0 - angular[p, 0] * r2
        linear[s, 2] = linear[p, 2] + angular[p, 0] * r1 - angular[p, 1] * r0
        for i in range(3):
            angular[s, i] = angular[p, i]
        for d in range(FIRST_DOF[s], FIRST_DOF[s] + DOF_COUNT[s]):
            for i in range(3):
                angular[s, i] += axes[d, i] * qd[d]


@njit
def whole_body_centre_of_mass(tree: Tree, frames: Frames) -> Array:
    """Centre of mass (3,) m, world, of the body `tree` with `frames` as `forward` left them."""
    mass, centre_of_mass = tree.mass, tree.centre_of_mass
    rotation, origin, total = frames.rotation, frames.origin, np.zeros(3)
    for s in range(mass.shape[0]):
        for i in range(3):
            total[i] += mass[s] * (
                origin[s, i]
                + rotation[s, i, 0] * centre_of_mass[s, 0]
                + rotation[s, i, 1] * centre_of_mass[s, 1]
                + rotation[s, i, 2] * centre_of_mass[s, 2]
            )
    total /= mass.sum()
    return total


def centres_of_mass(tree: Tree, positions: Array) -> Array:
    """Centre of mass (T, 3) m, world, of the body `tree` at `positions` (T, 31)."""
    found = np.empty((len(positions), 3))
    rows = map(with_lanes, (np.empty(COORDINATE_COUNT), np.empty(3), empty_frames()))
    _enter_centres_of_mass(tree, np.asarray(positions, dtype=float), *rows, found)
    return found


@njit_borrowing
def _enter_centres_of_mass(
    tree: Tree, positions: Array, q: Array, centre: Array, frames: Frames, found: Array
) -> None:
    """Write into `found` (T, 3), eight rows at a time, with lanes to work in: `q` (31, 8), `centre`
    (3, 8) and `frames`. What is left of the last eight is its last row again.
    """
    lanes, total, last = in_lanes(frames), in_lanes(centre), positions.shape[0] - 1
    whole = tree.mass.sum()
    for first in range(0, positions.shape[0], WIDTH):
        for e in range(WIDTH):
            row = min(first + e, last)
            for i in range(COORDINATE_COUNT):
                q[i, e] = positions[row, i]
        forward(tree.joint_position, in_lanes(q), lanes, SEGMENT_COUNT)
        for i in range(3):
            total[i] = 0.0
        for s in range(SEGMENT_COUNT):
            local = tree.centre_of_mass[s]
            for i in range(3):
                total[i] += tree.mass[s] * (
                    lanes.origin[s, i]
                    + lanes.rotation[s, i, 0] * local[0]
                    + lanes.rotation[s, i, 1] * local[1]
                    + lanes.rotation[s, i, 2] * local[2]
                )
        for i in range(3):
            total[i] = total[i] / whole
            for e in range(min(WIDTH, positions.shape[0] - first)):
                found[first + e, i] = centre[i, e]


@njit_borrowing
def turned_inertia(rotation: Array, inertia: Array, out: Array) -> None:
    """out = R I Rᵀ with R = `rotation` and I = `inertia`, all (3, 3)."""
    for i in range(3):
        r0, r1, r2 = rotation[i, 0], rotation[i, 1], rotation[i, 2]
        a = r0 * inertia[0, 0] + r1 * inertia[1, 0] + r2 * inertia[2, 0]
        b = r0 * inertia[0, 1] + r1 * inertia[1, 1] + r2 * inertia[2, 1]
        c = r0 * inertia[0, 2] + r1 * inertia[1, 2] + r2 * inertia[2, 2]
        for j in range(3):
            out[i, j] = a * rotation[j, 0] + b * rotation[j, 1] + c * rotation[j, 2]


def segment_frames(model: BodyModel, positions: Array) -> Array:
    """Poses of all segments of `model` over a motion, `positions` (T, 31) in the order of
    `coordinates.COORDINATES`: (T, 14, 4, 4) homogeneous transforms, segment to world.
    """
    found = np.zeros((len(positions), SEGMENT_COUNT, 4, 4))
    found[..., 3, 3] = 1.0
    along = np.ascontiguousarray(positions, dtype=float)
    _enter_segment_frames(tree_arrays(model).joint_position, along, empty_frames(), found)
    return found


@njit_borrowing
def _enter_segment_frames(
    joint_position: Array, positions: Array, frames: Frames, found: Array
) -> None:
    """Write the rotations and origins of `segment_frames` into `found` (T, 14, 4, 4)."""
    for t in range(positions.shape[0]):
        forward(joint_position, positions[t], frames, SEGMENT_COUNT)
        for s in range(SEGMENT_COUNT):
            for i in range(3):
                for j in range(3):
                    found[t, s, i, j] = frames.rotation[s, i, j]
                found[t, s, i, 3] = frames.origin[s, i]


def whole_body_path(tree: Tree, frames: Array) -> Array:
    """Whole-body centre of mass (N, 3) m, in the axes of the segments' `frames` (N, 14, 4, 4), by
    the masses (kg) and centres of mass of `tree`.
    """
    local = np.einsum("tsij,sj->tsi", frames[..., :3, :3], tree.centre_of_mass)
    world = local + frames[..., :3, 3]
    return np.asarray(np.einsum("tsi,s->ti", world, tree.mass) / tree.mass.sum())
