"""What the model markers change with, against differences of forward kinematics."""

from dataclasses import replace

import numpy as np
import pytest
from marked_walk import LEG_SEGMENTS, moving_walk, spread_markers

from gaitval.coordinates import COORDINATES
from gaitval.kinetics.inverse import model_fit_solver
from gaitval.kinetics.inverse.marked_body import place
from gaitval.kinetics.inverse.model_fit_solver import (
    FitProblem,
    FitState,
    _cost,
    _derivatives,
    _equations,
    _normal_equations,
    _reduced,
    model_markers,
    shared_covariance,
    solve,
)
from gaitval.kinetics.inverse.pose_solver import moved
from gaitval.kinetics.inverse.segment_lengths import LENGTH_SD, joint_shifts
from gaitval.model.body import SEGMENTS
from gaitval.model.tree import segment_frames, tree_arrays


@pytest.mark.parametrize("seed", range(2))
def test_the_derivatives_are_those_of_the_model_markers(seed):
    random = np.random.default_rng(seed)
    model, _ = moving_walk()
    markers = spread_markers(model)
    tree = tree_arrays(model)
    shifts = joint_shifts()
    segment = np.array([SEGMENTS.index(m.segment) for m in markers])
    places = np.array([m.position for m in markers])
    pose = random.uniform(-0.9, 0.9, (1, 31))

    def points(pose, lengths):
        out = np.empty((1, len(markers), 3))
        place(tree.joint_position + shifts @ lengths, segment, places, pose, out)
        return out

    zero = np.zeros(len(LENGTH_SD))
    at = points(pose, zero)
    by_place = np.empty((1, len(markers), 3, 3))
    by_pose = np.zeros((1, len(markers), 3, 31))
    by_length = np.zeros((1, len(markers), 3, len(LENGTH_SD)))
    _derivatives(tree.joint_position, shifts, segment, pose, at, by_place, by_pose, by_length)
    h = 1e-6
    wide = np.full(31, np.inf)
    for j in range(31):
        ends = np.empty((2, 1, 31))
        for end, sign in zip(ends, (1, -1), strict=True):
            moved(pose[0], sign * h * np.eye(31)[j], -wide, wide, end[0])
        numeric = (points(ends[0], zero) - points(ends[1], zero)) / (2 * h)
        np.testing.assert_allclose(by_pose[..., j], numeric, atol=1e-8)
    for k in range(len(LENGTH_SD)):
        step = h * np.eye(len(LENGTH_SD))[k]
        numeric = (points(pose, step) - points(pose, -step)) / (2 * h)
        np.testing.assert_allclose(by_length[..., k], numeric, atol=1e-8)
    frames = segment_frames(model, pose)[:, segment]
    np.testing.assert_allclose(by_place, frames[..., :3, :3], atol=1e-12)


WIDE = np.full(31, np.inf)
SHOWN = np.array([i < 20 and "mtp" not in name for i, name in enumerate(COORDINATES)])
"""Coordinates of pelvis and legs but the toes: the others have no markers."""


def problem(seed=0, *, frames=3, noise=0.002, limit=0.1):
    """A body with markers on legs and pelvis in a few poses, its measured markers, and where they
    were made: (problem, precision, true state)."""
    random = np.random.default_rng(seed)
    model, walked = moving_walk()
    markers = spread_markers(model, LEG_SEGMENTS)
    lengths = len(LENGTH_SD)
    tree = tree_arrays(model)
    true = FitState(
        lengths=random.normal(0.0, 0.01, lengths),
        places=np.array([m.position for m in markers]) + random.normal(0, 0.005, (len(markers), 3)),
        poses=walked[:: len(walked) // frames][:frames].copy(),
    )
    fit = FitProblem(
        joint_position=tree.joint_position,
        shifts=joint_shifts(),
        segment=np.array([SEGMENTS.index(m.segment) for m in markers]),
        placement=np.array([m.position for m in markers]),
        coupling=random.normal(0.0, 0.3, (len(markers), 3, lengths)),
        placement_precision=random.uniform(1.0, 3.0, len(markers)) / 0.005**2,
        length_precision=np.diag(random.uniform(1.0, 3.0, lengths)) / 0.01**2 + 500.0,
        length_limit=np.full(lengths, limit),
        measured=np.zeros((frames, len(markers), 3)),
        weight=np.ones((frames, len(markers))),
        free=np.tile(SHOWN, (frames, 1)),
        low=-WIDE,
        high=WIDE,
    )
    measured = model_markers(fit, true)
    fit = fit._replace(measured=measured + random.normal(0.0, noise, measured.shape))
    precision = random.uniform(0.5, 1.5, (frames, len(markers))) / 0.002**2
    precision[1, 3] = 0.0  # not seen
    return fit, precision, true


def stepped(state, poses, shared):
    """A state after small steps of the poses (F, 31) and the shared unknowns (K + 3M,)."""
    new = np.empty_like(state.poses)
    for pose, step, out in zip(state.poses, poses, new, strict=True):
        moved(pose, step, -WIDE, WIDE, out)
    lengths = len(state.lengths)
    return FitState(
        state.lengths + shared[:lengths], state.places + shared[lengths:].reshape(-1, 3), new
    )


def errors_of(fit, precision, state):
    """What is squared and added: measurements, then both priors, each over its deviation."""
    off = np.sqrt(precision)[..., None] * (model_markers(fit, state) - fit.measured)
    placed = state.places - fit.placement - np.einsum("mik,k->mi", fit.coupling, state.lengths)
    root = np.linalg.cholesky(fit.length_precision).T
    return np.concatenate(
        [
            off.ravel(),
            (np.sqrt(fit.placement_precision)[:, None] * placed).ravel(),
            root @ state.lengths,
        ]
    )


def slopes(fit, precision, state, h=1e-6):
    """Derivatives of `errors_of` by all poses, then all shared unknowns, by central differences."""
    poses, shared = state.poses.size, len(state.lengths) + state.places.size
    columns = []
    for i in range(poses + shared):
        unit = np.zeros(poses + shared)
        unit[i] = h
        ends = [
            errors_of(
                fit, precision,
                stepped(state, sign * unit[:poses].reshape(state.poses.shape), sign * unit[poses:]),
            )
            for sign in (1.0, -1.0)
        ]  # fmt: skip
        columns.append((ends[0] - ends[1]) / (2 * h))
    return np.column_stack(columns)


def whole(normal):
    """The normal matrix of all unknowns, poses first, and the gradient."""
    frames, size = normal.pose_gradient.shape
    poses, shared = frames * size, len(normal.shared_gradient)
    matrix = np.zeros((poses + shared, poses + shared))
    for f in range(frames):
        own = slice(f * size, (f + 1) * size)
        matrix[own, own] = normal.pose[f]
        matrix[own, poses:] = normal.mixed[f]
        matrix[poses:, own] = normal.mixed[f].T
    matrix[poses:, poses:] = normal.shared
    return matrix, np.concatenate([normal.pose_gradient.ravel(), normal.shared_gradient])


def away(true, seed=1, size=0.02):
    """A state a little beside another one."""
    random = np.random.default_rng(seed)
    shared = random.normal(0.0, size, len(true.lengths) + true.places.size)
    return stepped(true, random.normal(0.0, size, true.poses.shape) * SHOWN, shared)


def test_cost_gradient_and_normal_matrix_are_those_of_the_sum_of_squares():
    fit, precision, true = problem(frames=2)
    state = away(true)
    errors, jacobian = errors_of(fit, precision, state), slopes(fit, precision, state)
    assert _cost(fit, state, precision) == pytest.approx(0.5 * float(errors @ errors), rel=1e-9)
    matrix, gradient = whole(_normal_equations(fit, state, precision))
    expected = jacobian.T @ jacobian
    np.testing.assert_allclose(gradient, jacobian.T @ errors, atol=1e-5 * np.abs(gradient).max())
    np.testing.assert_allclose(matrix, expected, atol=1e-6 * np.abs(expected).max())


@pytest.mark.parametrize("damping", [0.0, 0.3])
def test_eliminated_poses_give_the_step_of_all_unknowns_together(damping):
    """Marquardt's step of the whole matrix, whose diagonal grows by the damping."""
    fit, precision, true = problem()
    normal = _equations(fit, away(true), precision)
    matrix, gradient = whole(normal)
    step = np.linalg.solve(matrix + damping * np.diag(np.diag(matrix)), -gradient)
    shared, inverse = _reduced(normal, damping)
    right = np.einsum("fpi,fp->i", normal.mixed, inverse[..., -1]) - normal.shared_gradient
    poses = normal.pose_gradient.size
    np.testing.assert_allclose(np.linalg.solve(shared, right), step[poses:], atol=1e-9)
    own = -inverse[..., -1] - inverse[..., :-1] @ step[poses:]
    np.testing.assert_allclose(own.ravel(), step[:poses], atol=1e-9)


def test_the_covariance_is_the_shared_part_of_the_inverse_of_the_whole_matrix():
    fit, precision, true = problem()
    matrix, _ = whole(_equations(fit, true, precision))
    poses = true.poses.size
    expected = np.linalg.inv(matrix)[poses:, poses:]
    np.testing.assert_allclose(
        shared_covariance(fit, true, precision), expected, atol=1e-9 * np.abs(expected).max()
    )


@pytest.mark.parametrize("size", [0.02, 0.25])
def test_the_solution_is_the_least_sum_of_squares(size):
    """Found from near, and from where a whole step of Gauss-Newton would make it worse."""
    fit, precision, true = problem()
    found, iterations, converged = solve(fit, away(true, size=size), precision)
    assert converged
    assert 2 <= iterations < 40
    _, gradient = whole(_equations(fit, found, precision))
    matrix, _ = whole(_equations(fit, found, precision))
    assert np.abs(np.linalg.solve(matrix, gradient)).max() < 1e-5
    assert _cost(fit, found, precision) < _cost(fit, true, precision)
    again, more, _ = solve(fit, found, precision)
    assert more == 1
    np.testing.assert_allclose(again.lengths, found.lengths, atol=1e-6)


def test_a_start_that_is_far_away_is_damped_and_one_iteration_is_not_enough(monkeypatch):
    fit, precision, true = problem()
    start = away(true, size=0.25)
    monkeypatch.setattr(
        model_fit_solver, "SOLVER", replace(model_fit_solver.SOLVER, most_iterations=1)
    )
    found, iterations, converged = solve(fit, start, precision)
    assert (iterations, converged) == (1, False)
    assert _cost(fit, found, precision) < _cost(fit, start, precision)


def test_what_is_fixed_stays_and_what_is_bounded_stops_at_its_bound():
    fit, precision, true = problem()
    start = away(true)
    start.poses[:, ~SHOWN] = 0.1
    start.lengths[:] = 0.0
    free, _, _ = solve(fit, start, precision)
    limit = np.full(len(LENGTH_SD), 0.1)
    limit[0], limit[1] = 0.0, 0.5 * abs(free.lengths[1])
    knee = COORDINATES.index("knee_angle_r")
    high, low = WIDE.copy(), -WIDE
    high[knee] = free.poses[:, knee].mean()
    hip = COORDINATES.index("hip_flexion_l")
    low[hip] = free.poses[:, hip].mean()
    start.poses[:, knee] = np.minimum(start.poses[:, knee], high[knee])
    start.poses[:, hip] = np.maximum(start.poses[:, hip], low[hip])
    bound = fit._replace(length_limit=limit, high=high, low=low)
    found, _, converged = solve(bound, start, precision)
    assert converged
    assert found.lengths[0] == 0.0
    assert abs(found.lengths[1]) == limit[1]
    np.testing.assert_array_equal(found.poses[:, ~SHOWN], 0.1)
    over, under = free.poses[:, knee] > high[knee] + 0.02, free.poses[:, hip] < low[hip] - 0.02
    assert over.any()
    assert under.any()
    np.testing.assert_array_equal(found.poses[over, knee], high[knee])
    np.testing.assert_array_equal(found.poses[under, hip], low[hip])
    assert (found.poses[:, knee] <= high[knee]).all()
    assert (found.poses[:, hip] >= low[hip]).all()
    # nothing that may move would still make it better
    matrix, gradient = whole(_equations(bound, found, precision))
    assert np.abs(np.linalg.solve(matrix, gradient)).max() < 1e-5
