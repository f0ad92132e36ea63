"""Inverse kinematics: the poses of a body model that fit measured markers best.

Every frame is a weighted least-squares problem, min f(q) = ½ Σ w |m − p(q)|² over the markers
that were seen (Lu and O'Connor 1999, J Biomech 32:129-134), with the coordinates' ranges as
bounds. It is solved by Newton's method with the exact second derivative, from the pose of the
frame before.

Both derivatives cost no more than forward kinematics, and hardly depend on how many markers
there are. JᵀWJ is the joint-space inertia of the tree if each marker were a point mass w, so the
composite-rigid-body algorithm gives it from the sums Σw, Σwp and Σwppᵀ of the markers outboard
of a joint; JᵀWr and the second-order term follow from Σwr and Σwprᵀ in the same way; and the
sparsity that branches leave is used by Featherstone's LᵀL factorisation (Featherstone 2008,
Rigid Body Dynamics Algorithms, sections 6.2 and 6.5).

The pelvis turns by increments R ← exp(δ)R, so no heading is special. In results its rotation
vector runs on continuously beyond 180° instead of jumping to the opposite one.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from gaitval.arrays import Array, Flags, Index
from gaitval.compiled import njit
from gaitval.coordinates import ACTUATED, COORDINATES, RANGES
from gaitval.errors import ModelError, RecordError
from gaitval.model.body import SEGMENTS, BodyModel
from gaitval.model.markers import ModelMarker
from gaitval.model.tree import DOF_COUNT, FIRST_DOF, PARENT, ROOT_DOFS, forward, tree_arrays

SMALLEST_LEVER = 0.010
"""m: a coordinate that moves the seen markers by less than this per radian, once the coordinates
nearer to the pelvis have done what they can, is not determined: 3 mm of noise are 17° of it."""

GENERIC_ANGLE = 0.3
"""rad, of every coordinate in the pose at which `SMALLEST_LEVER` is looked at: straight legs and
arms would hide some coordinates."""

HEADINGS = 8
"""Headings from which a frame is started that has no good one before it."""

LARGEST_DISTANCE = 50.0
"""m, of a marker from the laboratory's origin; beyond it the markers are in millimetres."""

LARGEST_TURN = np.deg2rad(320.0)
"""Of the pelvis away from the laboratory's axes; a rotation vector ends at 360°."""

_LONGEST_STEP = 0.5  # rad or m in one iteration
_NEWTON_TOLERANCE = 1e-6  # rad or m: an undamped Newton step this long leaves about its square
_DAMPED_TOLERANCE = 1e-9  # rad or m: for steps that converge linearly
_SMALLEST_PIVOT = 1e-6  # of the diagonal; below, the matrix counts as not positive definite
_MOST_ITERATIONS = 100
_SUDDEN_ERROR = 0.005  # m, weighted RMS that is not yet taken for a jump

_LAST_DOF = np.array(
    [FIRST_DOF[s] + DOF_COUNT[s] - 1 if s else ROOT_DOFS - 1 for s in range(len(SEGMENTS))]
)
_SEGMENT_OF_DOF: Index = np.array(
    [0] * ROOT_DOFS
    + [
        next(s for s in range(1, len(SEGMENTS)) if FIRST_DOF[s] <= d <= _LAST_DOF[s])
        for d in range(ROOT_DOFS, len(COORDINATES))
    ]
)
"""(31,) segment that a coordinate moves first."""
_PARENT_DOF: Index = np.array(
    [
        d - 1
        if d < ROOT_DOFS or d > FIRST_DOF[_SEGMENT_OF_DOF[d]]
        else _LAST_DOF[PARENT[_SEGMENT_OF_DOF[d]]]
        for d in range(len(COORDINATES))
    ]
)
"""(31,) next coordinate towards the pelvis; -1 for the first."""


@dataclass(frozen=True)
class InverseKinematics:
    """Poses that fit measured markers; T frames, M markers.

    Attributes
    ----------
    names : of the M markers.
    positions : (T, 31) in the order of `coordinates.COORDINATES`, rad and m; the rotation vector
        of the pelvis is continuous and may be longer than π.
    marker_errors : (T, M) m, distance of measured and model marker; NaN where it was not seen.
    determined : (T, 31) False for a coordinate that was held, or that the markers seen in this
        frame do not show: it has the given or neutral value if no frame shows it, and else runs
        linearly from the last frame that does to the next.
    at_limit : (T, 31) True where a coordinate is at an end of its range.
    iterations : (T,) of Newton's method.
    converged : (T,) False where these did not suffice, or the markers do not show the pelvis.
    """

    names: tuple[str, ...]
    positions: Array
    marker_errors: Array
    determined: Flags
    at_limit: Flags
    iterations: Index
    converged: Flags


@dataclass(frozen=True)
class MarkerErrors:
    """Distances between measured and model markers over a trial, m.

    Attributes
    ----------
    rms : (M,) of each marker over the frames that show it; NaN for one that is never seen.
    largest : (M,) of each marker.
    whole_rms, whole_largest : over all markers and frames.
    worst_marker, worst_frame : name and index of the frame of `whole_largest`.
    """

    names: tuple[str, ...]
    rms: Array
    largest: Array
    whole_rms: float
    whole_largest: float
    worst_marker: str
    worst_frame: int


def marker_errors(result: InverseKinematics) -> MarkerErrors:
    """Root-mean-square and largest error, of each marker and of all."""
    errors = result.marker_errors
    seen = np.isfinite(errors)
    filled = np.where(seen, errors, 0.0)
    count = seen.sum(axis=0)
    with np.errstate(invalid="ignore"):
        rms = np.sqrt((filled**2).sum(axis=0) / count)
    largest = np.where(count > 0, filled.max(axis=0), np.nan)
    frame, marker = np.unravel_index(int(filled.argmax()), filled.shape)
    return MarkerErrors(
        names=result.names,
        rms=rms,
        largest=largest,
        whole_rms=float(np.sqrt((filled**2).sum() / count.sum())),
        whole_largest=float(filled[frame, marker]),
        worst_marker=result.names[marker],
        worst_frame=int(frame),
    )


def inverse_kinematics(
    model: BodyModel,
    markers: Sequence[ModelMarker],
    measured: Array,
    *,
    held: Mapping[str, float] | None = None,
    ranges: Mapping[str, tuple[float, float]] = RANGES,
) -> InverseKinematics:
    """Poses of the model that fit measured markers best, frame by frame.

    Parameters
    ----------
    model : the scaled model.
    markers : M markers on its segments, with their weights.
    measured : (T, M, 3) m, project axes, in the order of `markers`; NaN where not seen.
    held : value (rad) of actuated coordinates that are not to be found.
    ranges : lowest and highest value of actuated coordinates, rad; others are free.

    Raises
    ------
    ModelError : markers on unknown segments, of one name, or with unusable positions or weights;
        unknown coordinates.
    RecordError : `measured` has another shape, is not in metres or shows the pelvis in no frame,
        or the pelvis turns by more than `LARGEST_TURN`.
    """
    problem = _problem(model, markers, measured)
    held = held or {}
    frozen, start = _held(held)
    low, high = bounds({name: ranges[name] for name in ranges if name not in held})
    start = np.clip(start, low, high)
    determined = _determined(problem, frozen)
    solvable = np.asarray(determined[:, :ROOT_DOFS].all(axis=1))
    if not solvable.any():
        raise RecordError(_why_unsolvable(problem, markers))

    count = determined.sum(axis=1) * len(markers) + (problem.weight > 0).sum(axis=1)
    first = int(np.argmax(np.where(solvable, count, -1)))
    positions = np.tile(start, (len(determined), 1))
    iterations = np.zeros(len(positions), dtype=np.int64)
    converged = np.zeros(len(positions), dtype=np.bool_)
    free = determined & solvable[:, None]
    work = _work()
    _solve_from_all_sides(
        problem,
        problem.weight[first],
        problem.measured[first],
        start,
        positions[first],
        free[first],
        low,
        high,
        work,
    )
    for way in (1, -1):
        _solve_trial(
            problem, positions, start, free, low, high, first, way, iterations, converged, work
        )
    gaps = _interpolate(positions, free)
    if gaps.any():  # the rest of the body has to fit what was put in
        _solve_frames(problem, positions, free, low, high, gaps, iterations, converged, work)

    positions[:, :3] = _continuous(positions[:, :3])
    edge = 1e-9
    at_limit = determined & ((positions <= low + edge) | (positions >= high - edge))
    points = np.empty_like(problem.measured)
    place(problem.joint_position, problem.segment, problem.position, positions, points)
    seen = np.isfinite(measured).all(axis=2)
    errors = np.where(seen, np.linalg.norm(problem.measured - points, axis=2), np.nan)
    return InverseKinematics(
        names=tuple(marker.name for marker in markers),
        positions=positions,
        marker_errors=errors,
        determined=free,
        at_limit=at_limit,
        iterations=iterations,
        converged=converged & solvable,
    )


def marker_positions(model: BodyModel, markers: Sequence[ModelMarker], positions: Array) -> Array:
    """Where the model's markers are, (T, M, 3) m in world axes, at `positions` (T, 31)."""
    poses = np.array(positions, dtype=float)
    points = np.zeros((len(poses), len(markers), 3))
    problem = _problem(model, markers, points)
    place(problem.joint_position, problem.segment, problem.position, poses, points)
    return points


class _Problem(NamedTuple):
    """A trial as arrays; what was not seen has weight 0 and any position."""

    joint_position: Array
    segment: Index
    position: Array
    weight: Array
    measured: Array


class _Work(NamedTuple):
    """Arrays that the solver writes into, so that it allocates none per frame."""

    rotation: Array
    origin: Array
    axes: Array
    weight_sum: Array  # of the markers outboard of each segment: Σw
    first: Array  # Σ w p
    second: Array  # Σ w p pᵀ
    force: Array  # Σ w r
    torque: Array  # Σ w p rᵀ
    normal: Array  # JᵀWJ, lower triangle along each branch
    curvature: Array  # Σ w r ∂²p/∂q²
    gradient: Array
    matrix: Array
    step: Array
    trial: Array
    fixed: Flags
    other: Array  # another pose
    stiff: Flags
    cost: Array  # (1,) of the last pose that was solved


def _problem(model: BodyModel, markers: Sequence[ModelMarker], measured: Array) -> _Problem:
    measured = np.asarray(measured, dtype=float)
    problems = []
    names = [marker.name for marker in markers]
    for name in sorted({name for name in names if names.count(name) > 1}):
        problems.append(f"{name}: {names.count(name)} markers of this name")
    for marker in markers:
        if marker.segment not in SEGMENTS:
            problems.append(f"{marker.name}: on {marker.segment!r}, no segment of the model")
        position = np.asarray(marker.position, dtype=float)
        if position.shape != (3,) or not np.isfinite(position).all():
            problems.append(f"{marker.name}: position {marker.position} is not three numbers")
        elif np.abs(position).max() > 2.0:
            problems.append(f"{marker.name}: {position} is over 2 m from its joint (millimetres?)")
        if not (np.isfinite(marker.weight) and marker.weight >= 0):
            problems.append(f"{marker.name}: weight {marker.weight} is not 0 or more")
    if problems or not markers:
        raise ModelError(
            "the model's markers cannot be used:\n  "
            + "\n  ".join(problems or ["there are none"])
            + f"\nSegments are {', '.join(SEGMENTS)}; positions are in metres."
        )
    if measured.ndim != 3 or measured.shape[1:] != (len(markers), 3) or not len(measured):
        raise RecordError(
            f"measured markers must have shape (frames, {len(markers)}, 3) for the "
            f"{len(markers)} markers of the model, but it is {measured.shape}."
        )
    seen = np.asarray(np.isfinite(measured).all(axis=2))
    filled = np.where(seen[..., None], measured, 0.0)
    far = np.abs(filled).max(axis=(0, 2))
    if far.max() > LARGEST_DISTANCE:
        raise RecordError(
            f"marker {names[int(far.argmax())]} is {far.max():.0f} m from the laboratory's origin "
            f"(more than {LARGEST_DISTANCE:g} m): the markers look like millimetres; divide by "
            "1000."
        )
    weight = seen * np.array([marker.weight for marker in markers], dtype=float)
    return _Problem(
        joint_position=tree_arrays(model).joint_position,
        segment=np.array([SEGMENTS.index(marker.segment) for marker in markers], dtype=np.int64),
        position=np.array([marker.position for marker in markers], dtype=float),
        weight=np.ascontiguousarray(weight),
        measured=np.ascontiguousarray(filled),
    )


def _check_coordinates(names: Mapping[str, object]) -> None:
    unknown = [name for name in names if name not in ACTUATED]
    if unknown:
        raise ModelError(
            f"no joint has the coordinates {', '.join(unknown)}. They are {', '.join(ACTUATED)}."
        )


def _held(held: Mapping[str, float]) -> tuple[Flags, Array]:
    """Which coordinates are held (31,) and the pose (31,) to start from."""
    _check_coordinates(held)
    frozen, start = np.zeros(len(COORDINATES), dtype=np.bool_), np.zeros(len(COORDINATES))
    for name, value in held.items():
        frozen[COORDINATES.index(name)] = True
        start[COORDINATES.index(name)] = value
    return frozen, start


def bounds(ranges: Mapping[str, tuple[float, float]]) -> tuple[Array, Array]:
    """Lowest and highest value (31,) of each coordinate; infinite where no range is given.

    Raises
    ------
    ModelError : a range that is empty, or of a coordinate that no joint has.
    """
    _check_coordinates(ranges)
    low, high = np.full(len(COORDINATES), -np.inf), np.full(len(COORDINATES), np.inf)
    for name, (lowest, highest) in ranges.items():
        if not lowest < highest:
            raise ModelError(f"the range of {name} is empty: from {lowest} to {highest}.")
        low[COORDINATES.index(name)] = lowest
        high[COORDINATES.index(name)] = highest
    return low, high


def _determined(problem: _Problem, frozen: Flags) -> Flags:
    """Which coordinates (T, 31) the markers of each frame determine."""
    seen = np.asarray(problem.weight > 0)
    patterns, pattern = np.unique(seen, axis=0, return_inverse=True)
    found = np.empty((len(patterns), len(COORDINATES)), dtype=np.bool_)
    work = _work()
    pose = np.full(len(COORDINATES), GENERIC_ANGLE)
    pose[:ROOT_DOFS] = 0.0
    measured = problem.measured[0]
    for row, present in zip(found, patterns.astype(float), strict=True):
        _evaluate(problem, present, measured, pose, work)
        _independent(work.normal, frozen, SMALLEST_LEVER**2, row)
    return np.asarray(found[pattern.reshape(-1)])


def _why_unsolvable(problem: _Problem, markers: Sequence[ModelMarker]) -> str:
    most = problem.weight.max(axis=0)
    names = [marker.name for marker, weight in zip(markers, most, strict=True) if weight > 0]
    return (
        "no frame shows enough markers to find the pelvis: it takes three that are not in one line "
        f"on the pelvis, or as many on both thighs. Of the model's {len(markers)} markers, the "
        f"trial shows with a weight above 0: {', '.join(names) or 'none'}."
    )


def _interpolate(positions: Array, free: Flags) -> Flags:
    """Fill coordinates of frames that do not determine them from those that do, in place.

    Returns
    -------
    (T,) frames in which something was filled.
    """
    touched = np.zeros(len(positions), dtype=np.bool_)
    frames = np.arange(len(positions))
    known = free[:, :ROOT_DOFS].all(axis=1)
    if known.any() and not known.all():
        vectors = _continuous(positions[known, :3])
        for d in range(ROOT_DOFS):
            values = vectors[:, d] if d < 3 else positions[known, d]
            positions[~known, d] = np.interp(frames[~known], frames[known], values)
        touched |= ~known
    for d in range(ROOT_DOFS, positions.shape[1]):
        known = free[:, d]
        if known.any() and not known.all():
            positions[~known, d] = np.interp(frames[~known], frames[known], positions[known, d])
            touched |= ~known
    return touched


def _continuous(vectors: Array) -> Array:
    """Rotation vectors (T, 3) of the same rotations without jumps: v and v − 2πv/|v| are one
    rotation, and each frame takes that which is nearer to the frame before.
    """
    vectors = vectors.copy()
    turn = 2 * np.pi
    jumps = np.flatnonzero(np.linalg.norm(np.diff(vectors, axis=0), axis=1) > 1.0)
    for t in range(jumps[0] + 1 if len(jumps) else len(vectors), len(vectors)):
        length = float(np.linalg.norm(vectors[t]))
        if length < 1e-6:
            continue
        axis = vectors[t] / length
        # Whole turns along this axis that bring the vector nearest to the last one.
        vectors[t] += turn * np.round((axis @ vectors[t - 1] - length) / turn) * axis
    lengths = np.linalg.norm(vectors, axis=1)
    if lengths.max() > np.pi and lengths.min() > 1e-6:
        other = vectors * (1.0 - turn / lengths)[:, None]
        if np.linalg.norm(other, axis=1).max() < lengths.max():
            vectors = other
    largest = float(np.linalg.norm(vectors, axis=1).max())
    if largest > LARGEST_TURN:
        raise RecordError(
            f"the pelvis turns {np.degrees(largest):.0f}° away from the laboratory's axes (at most "
            f"{np.degrees(LARGEST_TURN):.0f}°): cut the trial where the person turns round."
        )
    return vectors


def _work() -> _Work:
    n, segments = len(COORDINATES), len(SEGMENTS)
    return _Work(
        rotation=np.zeros((segments, 3, 3)),
        origin=np.zeros((segments, 3)),
        axes=np.zeros((n, 3)),
        weight_sum=np.zeros(segments),
        first=np.zeros((segments, 3)),
        second=np.zeros((segments, 3, 3)),
        force=np.zeros((segments, 3)),
        torque=np.zeros((segments, 3, 3)),
        normal=np.zeros((n, n)),
        curvature=np.zeros((n, n)),
        gradient=np.zeros(n),
        matrix=np.zeros((n, n)),
        step=np.zeros(n),
        trial=np.zeros(n),
        fixed=np.zeros(n, dtype=np.bool_),
        other=np.zeros(n),
        stiff=np.zeros(n, dtype=np.bool_),
        cost=np.zeros(1),
    )


@njit
def _evaluate(problem: _Problem, weight: Array, measured: Array, q: Array, work: _Work) -> float:
    """Cost ½ Σ w r² at q with its derivatives, into `work.normal`, `.curvature`, `.gradient`.

    Points are taken from the pelvis origin. With p(q) outboard of a coordinate that turns about
    the axis a through o, ∂p/∂q = a × (p − o), and with i nearer to the pelvis than j,
    ∂²p/∂qᵢ∂qⱼ = aᵢ × (aⱼ × (p − oⱼ)).
    """
    forward(problem.joint_position, q, work.rotation, work.origin, work.axes, len(work.weight_sum))
    rotation, origin, axes = work.rotation, work.origin, work.axes
    weight_sum, first, second = work.weight_sum, work.first, work.second
    force, torque = work.force, work.torque
    weight_sum[:] = 0.0
    first[:] = 0.0
    second[:] = 0.0
    force[:] = 0.0
    torque[:] = 0.0
    cost = 0.0
    p = np.empty(3)
    r = np.empty(3)
    for m in range(len(weight)):
        w = weight[m]
        if w == 0.0:
            continue
        s = problem.segment[m]
        for i in range(3):
            p[i] = (
                origin[s, i]
                - origin[0, i]
                + rotation[s, i, 0] * problem.position[m, 0]
                + rotation[s, i, 1] * problem.position[m, 1]
                + rotation[s, i, 2] * problem.position[m, 2]
            )
            r[i] = measured[m, i] - origin[0, i] - p[i]
        weight_sum[s] += w
        for i in range(3):
            cost += 0.5 * w * r[i] * r[i]
            first[s, i] += w * p[i]
            force[s, i] += w * r[i]
            for j in range(3):
                second[s, i, j] += w * p[i] * p[j]
                torque[s, i, j] += w * p[i] * r[j]
    for s in range(len(weight_sum) - 1, 0, -1):
        parent = PARENT[s]
        weight_sum[parent] += weight_sum[s]
        for i in range(3):
            first[parent, i] += first[s, i]
            force[parent, i] += force[s, i]
            for j in range(3):
                second[parent, i, j] += second[s, i, j]
                torque[parent, i, j] += torque[s, i, j]

    normal, curvature, gradient = work.normal, work.curvature, work.gradient
    _root_derivatives(weight_sum[0], first[0], second[0], force[0], torque[0], work)
    for j in range(ROOT_DOFS, len(q)):
        s = _SEGMENT_OF_DOF[j]
        a0, a1, a2 = axes[j, 0], axes[j, 1], axes[j, 2]
        o0 = origin[s, 0] - origin[0, 0]
        o1 = origin[s, 1] - origin[0, 1]
        o2 = origin[s, 2] - origin[0, 2]
        # resultant and moment about the pelvis origin of the forces w a × (p − o)
        d0 = first[s, 0] - weight_sum[s] * o0
        d1 = first[s, 1] - weight_sum[s] * o1
        d2 = first[s, 2] - weight_sum[s] * o2
        f0, f1, f2 = a1 * d2 - a2 * d1, a2 * d0 - a0 * d2, a0 * d1 - a1 * d0
        along = first[s, 0] * a0 + first[s, 1] * a1 + first[s, 2] * a2
        spread = second[s, 0, 0] + second[s, 1, 1] + second[s, 2, 2]
        spread -= first[s, 0] * o0 + first[s, 1] * o1 + first[s, 2] * o2
        n0 = spread * a0 + along * o0
        n1 = spread * a1 + along * o1
        n2 = spread * a2 + along * o2
        n0 -= second[s, 0, 0] * a0 + second[s, 0, 1] * a1 + second[s, 0, 2] * a2
        n1 -= second[s, 1, 0] * a0 + second[s, 1, 1] * a1 + second[s, 1, 2] * a2
        n2 -= second[s, 2, 0] * a0 + second[s, 2, 1] * a1 + second[s, 2, 2] * a2
        # Q = Σ w (p − o) rᵀ, and Qa − tr(Q) a
        e = force[s]
        t = torque[s]
        lever = o0 * e[0] + o1 * e[1] + o2 * e[2]
        trace = t[0, 0] + t[1, 1] + t[2, 2] - lever
        turned = e[0] * a0 + e[1] * a1 + e[2] * a2
        c0 = t[0, 0] * a0 + t[0, 1] * a1 + t[0, 2] * a2 - turned * o0 - trace * a0
        c1 = t[1, 0] * a0 + t[1, 1] * a1 + t[1, 2] * a2 - turned * o1 - trace * a1
        c2 = t[2, 0] * a0 + t[2, 1] * a1 + t[2, 2] * a2 - turned * o2 - trace * a2
        gradient[j] = -(
            a0 * (t[1, 2] - t[2, 1] - o1 * e[2] + o2 * e[1])
            + a1 * (t[2, 0] - t[0, 2] - o2 * e[0] + o0 * e[2])
            + a2 * (t[0, 1] - t[1, 0] - o0 * e[1] + o1 * e[0])
        )
        i = j
        while i >= ROOT_DOFS:
            u = _SEGMENT_OF_DOF[i]
            b0, b1, b2 = axes[i, 0], axes[i, 1], axes[i, 2]
            x0 = origin[u, 0] - origin[0, 0]
            x1 = origin[u, 1] - origin[0, 1]
            x2 = origin[u, 2] - origin[0, 2]
            normal[j, i] = (
                b0 * (n0 - x1 * f2 + x2 * f1)
                + b1 * (n1 - x2 * f0 + x0 * f2)
                + b2 * (n2 - x0 * f1 + x1 * f0)
            )
            curvature[j, i] = b0 * c0 + b1 * c1 + b2 * c2
            i = _PARENT_DOF[i]
        normal[j, 0], normal[j, 1], normal[j, 2] = n0, n1, n2
        normal[j, 3], normal[j, 4], normal[j, 5] = f0, f1, f2
        curvature[j, 0], curvature[j, 1], curvature[j, 2] = c0, c1, c2
    return cost


@njit
def _root_derivatives(
    weight_sum: float, first: Array, second: Array, force: Array, torque: Array, work: _Work
) -> None:
    """The pelvis's part of `_evaluate`: turns exp(δ) about its origin, then translations."""
    normal, curvature, gradient = work.normal, work.curvature, work.gradient
    spread = second[0, 0] + second[1, 1] + second[2, 2]
    trace = torque[0, 0] + torque[1, 1] + torque[2, 2]
    for i in range(3):
        for j in range(i + 1):
            normal[i, j] = -second[i, j]
            curvature[i, j] = 0.5 * (torque[i, j] + torque[j, i])
            normal[3 + i, 3 + j] = 0.0
        normal[i, i] += spread
        curvature[i, i] -= trace
        normal[3 + i, 3 + i] = weight_sum
        normal[3 + i, i] = 0.0
        gradient[3 + i] = -force[i]
    # e_j × Σwp for the turn about axis j
    normal[3, 1], normal[3, 2] = first[2], -first[1]
    normal[4, 0], normal[4, 2] = -first[2], first[0]
    normal[5, 0], normal[5, 1] = first[1], -first[0]
    gradient[0] = -(torque[1, 2] - torque[2, 1])
    gradient[1] = -(torque[2, 0] - torque[0, 2])
    gradient[2] = -(torque[0, 1] - torque[1, 0])


@njit
def _independent(normal: Array, frozen: Flags, smallest: float, found: Flags) -> None:
    """Which columns of J, in their order, are independent of those before, from JᵀJ: Cholesky's
    pivots are the squared parts of a column that the earlier columns leave over.
    """
    n = len(found)
    factor = np.zeros((n, n))
    on_branch = np.zeros((n, n), dtype=np.bool_)
    for j in range(n):
        i = j
        while i >= 0:
            on_branch[j, i] = True
            i = _PARENT_DOF[i]
    for j in range(n):
        found[j] = False
        if frozen[j]:
            continue
        for i in range(j):
            if not found[i]:
                continue
            total = normal[j, i] if on_branch[j, i] else 0.0
            for k in range(i):
                total -= factor[j, k] * factor[i, k]
            factor[j, i] = total / factor[i, i]
        pivot = normal[j, j]
        for k in range(j):
            pivot -= factor[j, k] ** 2
        if pivot >= smallest:
            found[j] = True
            factor[j, j] = np.sqrt(pivot)


@njit
def _newton_step(work: _Work, damping: float, second_order: bool) -> bool:
    """Solve (H + damping · diag) step = −gradient over what is not fixed, into `work.step`.

    Featherstone's LᵀL factorisation, along the branches only. False if H is not positive
    definite.
    """
    matrix, step = work.matrix, work.step
    n = len(step)
    for j in range(n):
        i = j
        while i >= 0:
            if work.fixed[j] or work.fixed[i]:
                matrix[j, i] = 0.0
            elif second_order:
                matrix[j, i] = work.normal[j, i] - work.curvature[j, i]
            else:
                matrix[j, i] = work.normal[j, i]
            i = _PARENT_DOF[i]
        if work.fixed[j]:
            matrix[j, j] = 1.0
            step[j] = 0.0
        else:
            matrix[j, j] += damping * work.normal[j, j]
            step[j] = -work.gradient[j]
    for k in range(n - 1, -1, -1):
        smallest = 0.0 if work.fixed[k] else _SMALLEST_PIVOT * work.normal[k, k]
        if not matrix[k, k] > smallest:
            return False
        pivot = np.sqrt(matrix[k, k])
        matrix[k, k] = pivot
        i = _PARENT_DOF[k]
        while i >= 0:
            matrix[k, i] /= pivot
            i = _PARENT_DOF[i]
        i = _PARENT_DOF[k]
        while i >= 0:
            j = i
            while j >= 0:
                matrix[i, j] -= matrix[k, i] * matrix[k, j]
                j = _PARENT_DOF[j]
            i = _PARENT_DOF[i]
    for k in range(n - 1, -1, -1):  # Lᵀ y = −g
        step[k] /= matrix[k, k]
        i = _PARENT_DOF[k]
        while i >= 0:
            step[i] -= matrix[k, i] * step[k]
            i = _PARENT_DOF[i]
    for k in range(n):  # L x = y
        i = _PARENT_DOF[k]
        while i >= 0:
            step[k] -= matrix[k, i] * step[i]
            i = _PARENT_DOF[i]
        step[k] /= matrix[k, k]
    return True


@njit
def _turned(vector: Array, turn: Array, out: Array) -> None:
    """out = rotation vector, at most π long, of exp(turn) exp(vector), through quaternions."""
    a = np.sqrt(vector[0] ** 2 + vector[1] ** 2 + vector[2] ** 2)
    b = np.sqrt(turn[0] ** 2 + turn[1] ** 2 + turn[2] ** 2)
    fa = np.sin(0.5 * a) / a if a > 1e-9 else 0.5
    fb = np.sin(0.5 * b) / b if b > 1e-9 else 0.5
    w, x, y, z = np.cos(0.5 * a), fa * vector[0], fa * vector[1], fa * vector[2]
    c, d, e, f = np.cos(0.5 * b), fb * turn[0], fb * turn[1], fb * turn[2]
    qw = c * w - d * x - e * y - f * z
    qx = c * x + d * w + e * z - f * y
    qy = c * y - d * z + e * w + f * x
    qz = c * z + d * y - e * x + f * w
    if qw < 0.0:
        qw, qx, qy, qz = -qw, -qx, -qy, -qz
    sine = np.sqrt(qx * qx + qy * qy + qz * qz)
    factor = 2.0 * np.arctan2(sine, qw) / sine if sine > 1e-9 else 2.0
    out[0], out[1], out[2] = factor * qx, factor * qy, factor * qz


@njit
def moved(q: Array, step: Array, low: Array, high: Array, out: Array) -> None:
    """out = pose q (31,) moved by `step` (31,), within the bounds: the pelvis turned by the
    rotation vector step[:3] in world axes, the rest added.
    """
    _turned(q[:3], step[:3], out[:3])
    for i in range(3, len(q)):
        out[i] = min(max(q[i] + step[i], low[i]), high[i])


@njit
def _solve(
    problem: _Problem,
    weight: Array,
    measured: Array,
    q: Array,
    free: Flags,
    low: Array,
    high: Array,
    work: _Work,
) -> int:
    """Find the best pose of one frame from q, in place.

    Bounds by Bertsekas' projected Newton method (1982, SIAM J Control Optim 20:221-246): what is
    at a bound and would go beyond stays there. Where the exact Hessian is not positive definite
    the Gauss-Newton one is taken, with Marquardt's damping where that step does not lower the
    cost.

    Returns
    -------
    Number of iterations, negative if these did not suffice.
    """
    n = len(q)
    damping = 0.0
    cost = _evaluate(problem, weight, measured, q, work)
    work.cost[0] = cost
    for iteration in range(1, _MOST_ITERATIONS + 1):
        for j in range(n):
            work.fixed[j] = (
                not free[j]
                or (q[j] <= low[j] and work.gradient[j] > 0.0)
                or (q[j] >= high[j] and work.gradient[j] < 0.0)
            )
        exact = damping == 0.0
        if exact:
            exact = _newton_step(work, 0.0, True)
        while not exact and not _newton_step(work, damping, False):
            damping = max(1e-6, 10.0 * damping)
            if damping > 1e12:
                return -iteration
        longest = 0.0
        for j in range(n):
            longest = max(longest, abs(work.step[j]))
        if longest > _LONGEST_STEP:
            for j in range(n):
                work.step[j] *= _LONGEST_STEP / longest
        moved(q, work.step, low, high, work.trial)
        # A Newton step that a bound cuts short is not one.
        inside = True
        for j in range(3, n):
            if free[j] and work.trial[j] != q[j] + work.step[j]:
                inside = False
        if longest < (_NEWTON_TOLERANCE if exact and inside else _DAMPED_TOLERANCE):
            q[:] = work.trial
            return iteration
        # A trial that is no better leaves derivatives of another pose behind.
        new = _evaluate(problem, weight, measured, work.trial, work)
        if new <= cost * (1.0 + 1e-13):
            q[:] = work.trial
            cost = new
            work.cost[0] = cost
            damping = 0.0 if damping < 1e-6 else 0.1 * damping
        else:
            if damping > 1e12:
                return -iteration
            damping = max(1e-4, 10.0 * damping)
            _evaluate(problem, weight, measured, q, work)
    return -_MOST_ITERATIONS


@njit
def _solve_from_all_sides(
    problem: _Problem,
    weight: Array,
    measured: Array,
    start: Array,
    q: Array,
    free: Flags,
    low: Array,
    high: Array,
    work: _Work,
) -> int:
    """As `_solve`, but from `start` at headings all around, for the best of the poses that these
    lead to, into q: the stiff body is put onto the markers first, then the joints are freed.
    """
    total = weight.sum()
    best, iterations = np.inf, 0
    for j in range(len(q)):
        work.stiff[j] = free[j] and j < ROOT_DOFS
    for heading in range(HEADINGS):
        for j in range(len(q)):
            work.other[j] = start[j] if free[j] else q[j]
        if free[0]:
            work.other[0], work.other[1] = 0.0, 0.0
            work.other[2] = 2.0 * np.pi * heading / HEADINGS
            for i in range(3):
                work.other[3 + i] = 0.0
                for m in range(len(weight)):
                    work.other[3 + i] += weight[m] * measured[m, i] / total
        _solve(problem, weight, measured, work.other, work.stiff, low, high, work)
        count = _solve(problem, weight, measured, work.other, free, low, high, work)
        if work.cost[0] < best:
            best, iterations = work.cost[0], count
            q[:] = work.other
    work.cost[0] = best
    return iterations


@njit
def _solve_trial(
    problem: _Problem,
    positions: Array,
    start_pose: Array,
    free: Flags,
    low: Array,
    high: Array,
    start: int,
    direction: int,
    iterations: Index,
    converged: Flags,
    work: _Work,
) -> None:
    """Solve all frames from `start` forwards (direction 1) or backwards (-1), each from where
    the motion of the last two leads; `positions[start]` is solved already. Where the markers
    jump, this may lead into another minimum: if the error of a frame is suddenly large, it is
    solved from all sides as well.
    """
    q = positions[start].copy()
    last = q.copy()
    turn = np.zeros(3)
    guess = np.empty_like(q)
    another = np.empty_like(q)
    inverse = np.empty(3)
    good_error = np.inf
    known = 0
    t = start
    while 0 <= t < len(positions):
        root_free = True
        for i in range(ROOT_DOFS):
            root_free = root_free and free[t, i]
        any_free = False
        for i in range(len(q)):
            any_free = any_free or free[t, i]
        guess[:] = q
        if known >= 2 and root_free:
            _turned(q[:3], turn, guess[:3])
            for i in range(3, len(q)):
                if free[t, i]:
                    guess[i] = min(max(2.0 * q[i] - last[i], low[i]), high[i])
        if any_free:
            count = _solve(
                problem, problem.weight[t], problem.measured[t], guess, free[t], low, high, work
            )
            total = problem.weight[t].sum()
            if count < 0 or work.cost[0] > total * (4.0 * good_error + _SUDDEN_ERROR**2):
                cost = work.cost[0]
                another[:] = guess
                other_count = _solve_from_all_sides(
                    problem,
                    problem.weight[t],
                    problem.measured[t],
                    start_pose,
                    another,
                    free[t],
                    low,
                    high,
                    work,
                )
                if work.cost[0] < 0.99 * cost:
                    guess[:] = another
                    count = other_count
                    known = 0
                else:
                    work.cost[0] = cost
            # A good error is forgotten slowly, so that a wrong minimum is left again soon.
            error = work.cost[0] / total
            good_error = min(error, 1.1 * good_error + 1e-6)  # m²
            iterations[t] = abs(count)
            converged[t] = count > 0
            known += 1
        else:
            known = 0
        last[:] = q
        q[:] = guess
        for i in range(3):
            inverse[i] = -last[i]
        _turned(inverse, q[:3], turn)
        positions[t] = q
        t += direction


@njit
def _solve_frames(
    problem: _Problem,
    positions: Array,
    free: Flags,
    low: Array,
    high: Array,
    chosen: Flags,
    iterations: Index,
    converged: Flags,
    work: _Work,
) -> None:
    """Solve the chosen frames again from where they are."""
    for t in range(len(positions)):
        if chosen[t] and free[t].any():
            count = _solve(
                problem,
                problem.weight[t],
                problem.measured[t],
                positions[t],
                free[t],
                low,
                high,
                work,
            )
            iterations[t] += abs(count)
            converged[t] = count > 0


@njit
def place(
    joint_position: Array, segment: Index, position: Array, poses: Array, points: Array
) -> None:
    """Markers (T, M, 3) in world axes, into `points`.

    Parameters
    ----------
    joint_position : (14, 3) m, as in `tree.Tree`.
    segment : (M,) index into `SEGMENTS`.
    position : (M, 3) m, in the frames of the segments.
    poses : (T, 31).
    """
    rotation = np.empty((len(PARENT), 3, 3))
    origin = np.empty((len(PARENT), 3))
    axes = np.zeros((poses.shape[1], 3))
    for t in range(len(poses)):
        forward(joint_position, poses[t], rotation, origin, axes, len(PARENT))
        for m in range(len(segment)):
            s = segment[m]
            for i in range(3):
                points[t, m, i] = (
                    origin[s, i]
                    + rotation[s, i, 0] * position[m, 0]
                    + rotation[s, i, 1] * position[m, 1]
                    + rotation[s, i, 2] * position[m, 2]
                )
