"""The sharing of moments is the minimum that it says, whoever computes it."""

import numpy as np
import pytest
from scipy.optimize import minimize

from gaitval.kinetics.musculature.sharing import solve


def problem(seed: int = 3, frames: int = 4, muscles: int = 12, rows: int = 3):
    random = np.random.default_rng(seed)
    arms = 40 * random.normal(size=(frames, rows, muscles))
    arms[random.random(arms.shape) < 0.5] = 0.0
    able = random.random((frames, muscles))
    return arms, np.einsum("nri,ni->nr", arms, able), 0.5 + random.random(muscles)


@pytest.mark.parametrize("exponent", [2.0, 3.0, 2.5])
def test_it_is_the_minimum(exponent):
    arms, wanted, weights = problem()
    least = 1e-3  # above squares there is always some
    found = solve(arms, wanted, 2.0, weights, exponent=exponent, lowest=least)
    assert found.solved.all()
    for a, row, b in zip(found.activations, arms, wanted, strict=True):

        def cost(x, row=row, b=b):
            return (weights * x**exponent).sum() + ((b - row @ x) ** 2).sum()

        def slope(x, row=row, b=b):
            return exponent * weights * x ** (exponent - 1) - 2 * row.T @ (b - row @ x)

        best = minimize(
            cost,
            np.full(len(a), 0.3),
            jac=slope,
            method="L-BFGS-B",
            bounds=[(least, 1.0)] * len(a),
            options={"ftol": 1e-15, "gtol": 1e-10, "maxiter": 5000},
        )
        assert cost(a) <= best.fun * (1 + 1e-9)
        assert np.abs(a - best.x).max() < 2e-3


def test_what_is_left_is_what_the_activations_do_not_make():
    arms, wanted, weights = problem()
    found = solve(arms, wanted * [1.0, 30.0, 1.0], 2.0, weights)
    made = np.einsum("nri,ni->nr", arms, found.activations)
    np.testing.assert_allclose(found.left, wanted * [1.0, 30.0, 1.0] - made, atol=1e-9)
    # Thirty times the moment is too much: the reserve says so.
    assert np.abs(found.left[:, 1]).min() > 10.0
    assert found.activations.max() == 1.0


def test_a_frame_does_not_depend_on_the_others_or_on_the_start():
    arms, wanted, weights = problem(frames=6)
    together = solve(arms, wanted, 2.0, weights)
    alone = solve(arms[2:3], wanted[2:3], 2.0, weights, start=np.full((1, 3), 5.0))
    np.testing.assert_allclose(alone.activations[0], together.activations[2], atol=1e-9)


def test_a_soft_row_lowers_what_it_counts():
    arms, wanted, weights = problem(rows=2)
    load = np.ones((len(arms), 1, arms.shape[2]))
    rows = np.concatenate([arms, load], axis=1)
    target = np.concatenate([wanted, np.zeros((len(arms), 1))], axis=1)
    loads = [
        solve(rows, target, np.array([2e3, 2e3, soft]), weights).activations.sum()
        for soft in (1e-9, 0.1, 1.0)
    ]
    assert loads[0] > loads[1] > loads[2]


@pytest.mark.parametrize(
    ("rows", "wanted", "exponent"),
    [
        (np.full((1, 2, 3), np.nan), np.zeros((1, 2)), 2.0),
        (np.zeros((1, 2, 3)), np.zeros((1, 3)), 2.0),
        (np.zeros((1, 2, 3)), np.zeros((1, 2)), 1.5),
    ],
)
def test_what_cannot_be_solved_is_refused(rows, wanted, exponent):
    with pytest.raises(ValueError, match="must"):
        solve(rows, wanted, 2.0, np.ones(3), exponent=exponent)
