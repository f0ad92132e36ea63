"""The derivatives of a pose's cost against differences of the cost."""

from dataclasses import replace

import numpy as np
import pytest
from marked_walk import moving_walk, spread_markers

from gaitval.kinetics.inverse.marked_body import marker_positions, marker_trial
from gaitval.kinetics.inverse.marker_derivatives import evaluate, independent_coordinates, workspace
from gaitval.kinetics.inverse.pose_solver import moved


@pytest.mark.parametrize("seed", range(3))
def test_both_derivatives_are_those_of_the_cost(seed):
    model, positions = moving_walk()
    markers = spread_markers(model)
    measured = marker_positions(model, markers, positions[:1])
    random = np.random.default_rng(seed)
    weighted = [replace(m, weight=float(random.uniform(0.2, 2.0))) for m in markers]
    problem = marker_trial(model, weighted, measured)
    work = workspace()
    pose = random.uniform(-0.8, 0.8, 31)
    wide = np.full(31, np.inf)

    def at(pose):
        """Cost, gradient and Hessian (lower triangle along the branches)."""
        cost = evaluate(problem, 0, pose, work)
        return cost, work.gradient.copy(), work.normal - work.curvature

    def stepped(step):
        out = np.empty(31)
        moved(pose, step, -wide, wide, out)
        return out

    _, gradient, hessian = at(pose)
    hessian = np.tril(hessian) + np.tril(hessian, -1).T
    h = 1e-5
    steps = h * np.eye(31)
    differences = [(at(stepped(s))[0] - at(stepped(-s))[0]) / (2 * h) for s in steps]
    np.testing.assert_allclose(gradient, differences, atol=1e-6 * np.abs(gradient).max())
    h = 1e-4
    steps = h * np.eye(31)
    for i in range(31):
        for j in range(i + 1):
            both = at(stepped(steps[i] + steps[j]))[0] + at(stepped(-steps[i] - steps[j]))[0]
            apart = at(stepped(steps[i] - steps[j]))[0] + at(stepped(steps[j] - steps[i]))[0]
            second = (both - apart) / (4 * h * h)
            assert hessian[i, j] == pytest.approx(second, abs=1e-5 * np.abs(hessian).max())


def test_a_coordinate_counts_by_what_those_before_it_do_not_explain():
    """Three of the pelvis: the second has 50 mm of its own, the third 30, and 40 are asked for."""
    own = {0: (1.0, 0.0, 0.0), 1: (2.0, 0.05, 0.0), 2: (3.0, 0.5, 0.03)}
    columns = np.zeros((3, 31))
    for index, column in own.items():
        columns[:, index] = column
    found, frozen = np.ones(31, dtype=np.bool_), np.zeros(31, dtype=np.bool_)
    independent_coordinates(columns.T @ columns, frozen, 0.04**2, found)
    assert np.flatnonzero(found).tolist() == [0, 1]
    frozen[1] = True  # held, it explains nothing: the third has its 500 mm too
    independent_coordinates(columns.T @ columns, frozen, 0.04**2, found)
    assert np.flatnonzero(found).tolist() == [0, 2]
