"""Gauss-Newton with Marquardt's damping for the sum of squares of `model_fit`.

In the normal matrix a frame's pose is coupled only with the shared lengths and positions (a block
arrow), so the poses are eliminated frame by frame (Schur complement), and an iteration takes a few
hundredths of a second.
"""

from dataclasses import dataclass
from typing import Final, NamedTuple

import numpy as np

from gaitval._internal.numba.compiled import njit
from gaitval.arrays import Array, Flags, Index
from gaitval.coordinates import COORDINATES
from gaitval.kinetics.inverse.marked_body import place
from gaitval.kinetics.inverse.pose_solver import moved
from gaitval.kinetics.inverse.segment_lengths import LENGTHS
from gaitval.model.tree import DOF_COUNT, FIRST_DOF, PARENT, SEGMENT_COUNT, empty_frames, forward


@dataclass(frozen=True)
class SolverSettings:
    """When the fit has converged."""

    most_iterations: int = 100
    step_tolerance: float = 1e-6  # m and rad
    cost_tolerance: float = 1e-4
    """By which the last iteration lowers the cost, minus the logarithm of a density, if they were
    enough: an arm that is straight creeps round its axis for long, and a standard error changes the
    cost by 0.5."""


SOLVER: Final = SolverSettings()


class FitProblem(NamedTuple):
    """The problem as arrays: K lengths, M markers, F frames of which the first is standing."""

    joint_position: Array  # (14, 3) m, before
    shifts: Array  # (14, 3, K) of joints per length
    segment: Index  # (M,)
    placement: Array  # (M, 3) m, x₀
    coupling: Array  # (M, 3, K), C
    placement_precision: Array  # (M,) 1/m²
    length_precision: Array  # (K, K) 1/m²
    length_limit: Array  # (K,) m
    measured: Array  # (F, M, 3) m
    weight: Array  # (F, M), 0 where not seen
    free: Flags  # (F, 31)
    low: Array  # (31,)
    high: Array  # (31,)


class FitState(NamedTuple):
    """The unknowns: changes of the lengths (K,), positions of the markers (M, 3), poses (F, 31)."""

    lengths: Array
    places: Array
    poses: Array


def model_markers(fit: FitProblem, state: FitState) -> Array:
    """Positions (F, M, 3) m, world axes, of the markers of the problem `fit` with the lengths,
    positions on the segments and poses of `state`.
    """
    points = np.empty_like(fit.measured)
    joints = fit.joint_position + fit.shifts @ state.lengths
    place(joints, fit.segment, state.places, state.poses, points)
    return points


@njit
def _derivatives(
    joint_position: Array,
    shifts: Array,
    segment: Index,
    poses: Array,
    points: Array,
    place_derivative: Array,
    pose_derivative: Array,
    length_derivative: Array,
) -> None:
    """Derivatives of the model markers (F, M, 3): by their positions (F, M, 3, 3), by the
    coordinates (F, M, 3, 31; the pelvis' rotation as a rotation vector in world axes), and by the
    lengths (F, M, 3, K); the last two are zero on entry.
    """
    frames = empty_frames()
    rotation, origin, axes = frames.rotation, frames.origin, frames.axes
    for i in range(3):
        # The pelvis' rotation is a rotation vector in world axes; `forward` fills the other axes.
        axes[i, i] = 1.0
    for f in range(len(poses)):
        forward(joint_position, poses[f], frames, SEGMENT_COUNT)
        for m in range(len(segment)):
            s = segment[m]
            place_derivative[f, m] = rotation[s]
            point = points[f, m]
            # Every joint between the marker and the world moves it: ∂p/∂q = a × (p − o).
            while s >= 0:
                x = point[0] - origin[s, 0]
                y = point[1] - origin[s, 1]
                z = point[2] - origin[s, 2]
                first = FIRST_DOF[s]
                for d in range(first, first + (DOF_COUNT[s] if s > 0 else 3)):
                    pose_derivative[f, m, 0, d] = axes[d, 1] * z - axes[d, 2] * y
                    pose_derivative[f, m, 1, d] = axes[d, 2] * x - axes[d, 0] * z
                    pose_derivative[f, m, 2, d] = axes[d, 0] * y - axes[d, 1] * x
                if s > 0:
                    # A length moves a joint in its parent's frame, and all that is outboard with
                    # it.
                    parent = rotation[PARENT[s]]
                    for k in range(shifts.shape[2]):
                        for i in range(3):
                            for j in range(3):
                                length_derivative[f, m, i, k] += parent[i, j] * shifts[s, j, k]
                s = PARENT[s]
            for i in range(3):
                pose_derivative[f, m, i, 3 + i] = 1.0


def _cost(fit: FitProblem, state: FitState, precision: Array) -> float:
    errors = fit.measured - model_markers(fit, state)
    misplaced = state.places - fit.placement - fit.coupling @ state.lengths
    return 0.5 * float(
        (precision[..., None] * errors**2).sum()
        + (fit.placement_precision[:, None] * misplaced**2).sum()
        + state.lengths @ fit.length_precision @ state.lengths
    )


class NormalEquations(NamedTuple):
    """Gauss-Newton's normal equations in blocks: poses (q) and shared unknowns (s: lengths, then
    positions marker by marker).
    """

    pose: Array  # (F, 31, 31)
    mixed: Array  # (F, 31, K + 3M)
    shared: Array  # (K + 3M, K + 3M)
    pose_gradient: Array  # (F, 31)
    shared_gradient: Array  # (K + 3M,)


def _normal_equations(fit: FitProblem, state: FitState, precision: Array) -> NormalEquations:
    frames, count = precision.shape
    lengths = len(LENGTHS)
    points = model_markers(fit, state)
    turns = np.empty((*points.shape, 3))
    poses = np.zeros((*points.shape, len(COORDINATES)))
    stretches = np.zeros((*points.shape, lengths))
    joints = fit.joint_position + fit.shifts @ state.lengths
    _derivatives(joints, fit.shifts, fit.segment, state.poses, points, turns, poses, stretches)
    errors = fit.measured - points
    misplaced = state.places - fit.placement - fit.coupling @ state.lengths

    rows = (frames, 3 * count, -1)
    stretches_weighted = precision[..., None, None] * stretches
    poses_weighted = precision[..., None, None] * poses
    # Gauss-Newton: products JᵀWJ of first derivatives, without the second derivatives.
    by_pose = poses_weighted.reshape(rows).transpose(0, 2, 1)  # (F, 31, 3M)
    by_place = poses_weighted.transpose(0, 1, 3, 2) @ turns  # (F, M, 31, 3)
    by_place = by_place.transpose(0, 2, 1, 3).reshape(frames, len(COORDINATES), -1)
    mixed = np.concatenate([by_pose @ stretches.reshape(rows), by_place], axis=2)

    prior = fit.placement_precision
    coupled = prior[:, None, None] * fit.coupling  # (M, 3, K)
    weighted_errors = precision[..., None] * errors
    shared = np.zeros((lengths + 3 * count, lengths + 3 * count))
    shared[:lengths, :lengths] = (
        _product(stretches, stretches_weighted)
        + _product(fit.coupling, coupled)
        + fit.length_precision
    )
    crossed = (stretches_weighted.transpose(0, 1, 3, 2) @ turns).sum(axis=0)  # (M, K, 3)
    # The prior's residual x − x₀ − Cλ has the derivative −C by the lengths.
    crossed -= coupled.transpose(0, 2, 1)
    shared[:lengths, lengths:] = crossed.transpose(1, 0, 2).reshape(lengths, -1)
    shared[lengths:, :lengths] = shared[:lengths, lengths:].T
    # A rotation R takes a marker's position to the world, and RᵀR is the identity.
    shared[lengths:, lengths:] = np.diag(np.repeat(precision.sum(axis=0) + prior, 3))
    to_places = (turns.transpose(0, 1, 3, 2) @ weighted_errors[..., None])[..., 0].sum(axis=0)
    gradient = np.concatenate(
        [
            fit.length_precision @ state.lengths
            - _product(stretches, weighted_errors[..., None])[:, 0]
            - _product(coupled, misplaced[..., None])[:, 0],
            (prior[:, None] * misplaced - to_places).reshape(-1),
        ]
    )
    return NormalEquations(
        pose=by_pose @ poses.reshape(rows),
        mixed=mixed,
        shared=shared,
        pose_gradient=-(by_pose @ errors.reshape(rows))[..., 0],
        shared_gradient=gradient,
    )


def _product(a: Array, b: Array) -> Array:
    """aᵀb of arrays (…, p) and (…, q), as matrices of p and q columns."""
    return np.asarray(a.reshape(-1, a.shape[-1]).T @ b.reshape(-1, b.shape[-1]))


def _equations(fit: FitProblem, state: FitState, precision: Array) -> NormalEquations:
    """The normal equations, with a step of zero for unknowns that are fixed or at a bound they
    would cross.
    """
    normal = _normal_equations(fit, state, precision)
    gradient = normal.pose_gradient
    fixed = ~fit.free
    # At its lowest value, a positive gradient would push the coordinate out.
    fixed |= (state.poses <= fit.low) & (gradient > 0)
    fixed |= (state.poses >= fit.high) & (gradient < 0)
    kept = (~fixed).astype(float)
    pose = normal.pose * kept[:, :, None] * kept[:, None, :]
    # Rows of fixed coordinates become 1 · step = 0, which keeps the block invertible.
    pose += (1.0 - kept)[:, :, None] * np.eye(kept.shape[1])

    lengths = len(LENGTHS)
    shared_gradient = normal.shared_gradient
    still = np.zeros(len(shared_gradient), dtype=np.bool_)
    still[:lengths] = fit.length_limit == 0
    still[:lengths] |= (state.lengths <= -fit.length_limit) & (shared_gradient[:lengths] > 0)
    still[:lengths] |= (state.lengths >= fit.length_limit) & (shared_gradient[:lengths] < 0)
    going = (~still).astype(float)
    return NormalEquations(
        pose=pose,
        mixed=normal.mixed * kept[:, :, None] * going,
        shared=normal.shared * going[:, None] * going + np.diag(1.0 - going),
        pose_gradient=gradient * kept,
        shared_gradient=shared_gradient * going,
    )


def _reduced(normal: NormalEquations, damping: float) -> tuple[Array, Array]:
    """The equations with the poses eliminated: the Schur complement (K + 3M, K + 3M), and the map
    from the shared step to those of the poses (F, 31, K + 3M + 1).
    """
    diagonal = np.arange(normal.pose.shape[1])
    pose = normal.pose.copy()
    # Marquardt damps in proportion to the diagonal, so metres and radians need no common scale.
    pose[:, diagonal, diagonal] *= 1.0 + damping
    # For A q + B s = −g of one frame: A⁻¹B and A⁻¹g, so that q = −A⁻¹g − A⁻¹B s.
    inverse = np.linalg.solve(
        pose, np.concatenate([normal.mixed, normal.pose_gradient[..., None]], axis=2)
    )
    shared = normal.shared + damping * np.diag(np.diag(normal.shared))
    shared -= _product(normal.mixed, inverse[..., :-1])
    return shared, inverse


def solve(fit: FitProblem, state: FitState, precision: Array) -> tuple[FitState, int, bool]:
    """The state of the problem `fit`, from `state` on, with the least sum of squares; the number of
    iterations; and whether they were enough: the last step was small, or hardly lowered the cost.
    `precision` (F, M) 1/m² is the inverse variance of a coordinate of each measured marker; 0 if
    not seen.
    """
    damping = fall = 0.0
    cost = _cost(fit, state, precision)
    for iteration in range(1, SOLVER.most_iterations + 1):
        normal = _equations(fit, state, precision)
        while True:
            shared, inverse = _reduced(normal, damping)
            # The poses put into Bᵀq + D s = −h give (D − BᵀA⁻¹B) s = BᵀA⁻¹g − h.
            right = _product(normal.mixed, inverse[..., -1:])[:, 0] - normal.shared_gradient
            step = np.asarray(np.linalg.solve(shared, right), dtype=float)
            poses = -inverse[..., -1] - inverse[..., :-1] @ step
            longest = max(float(np.abs(step).max()), float(np.abs(poses).max()))
            trial = _stepped(fit, state, step, poses)
            trial_cost = _cost(fit, trial, precision)
            # The factor allows for rounding near the minimum, where the cost no longer falls.
            if trial_cost <= cost * (1.0 + 1e-12):
                break
            if longest < SOLVER.step_tolerance or damping > 1e9:
                return state, iteration, longest < SOLVER.step_tolerance
            damping = max(1e-4, 10.0 * damping)
        state, cost, fall = trial, trial_cost, cost - trial_cost
        if longest < SOLVER.step_tolerance:
            return state, iteration, True
        damping = 0.0 if damping < 1e-6 else 0.1 * damping
    return state, SOLVER.most_iterations, fall < SOLVER.cost_tolerance


def shared_covariance(fit: FitProblem, state: FitState, precision: Array) -> Array:
    """Covariance (K + 3M, K + 3M) m² of lengths, then of positions marker by marker, given all
    measurements and priors, at the solution `state` of the problem `fit`; `precision` is as for
    `solve`.

    It is the inverse of the undamped Schur complement: the poses are unknown, not given.
    """
    return np.asarray(np.linalg.inv(_reduced(_equations(fit, state, precision), 0.0)[0]))


def _stepped(fit: FitProblem, state: FitState, step: Array, pose_steps: Array) -> FitState:
    """The state after a step, within the bounds."""
    lengths = len(LENGTHS)
    poses = np.empty_like(state.poses)
    for pose, pose_step, out in zip(state.poses, pose_steps, poses, strict=True):
        moved(pose, pose_step, fit.low, fit.high, out)
    return FitState(
        lengths=np.clip(state.lengths + step[:lengths], -fit.length_limit, fit.length_limit),
        places=state.places + step[lengths:].reshape(-1, 3),
        poses=poses,
    )
