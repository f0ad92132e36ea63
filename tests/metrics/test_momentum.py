"""The balance of momentum of a walk, on made-up walks whose hidden force is known."""

import numpy as np
import pytest
from newton_walk import MASS, newton_walk

from gaitval.constants import GRAVITY
from gaitval.metrics.momentum import momentum_residual


@pytest.mark.parametrize("axis", [0, 1, 2])
def test_a_hidden_force_is_told_in_percent_of_the_weight(axis):
    hidden = np.zeros(3)
    hidden[axis] = 0.01 * MASS * GRAVITY
    assert momentum_residual(newton_walk(hidden), MASS) == pytest.approx(1.0, abs=0.05)
    assert momentum_residual(newton_walk(np.zeros(3)), MASS) < 0.05


def test_a_push_is_no_hidden_force():
    """Here a push that lasts: it is recorded as an external force."""
    pushed = newton_walk(np.array([0.0, 100.0, 0.0]))
    pushed.root_force[:, 4] = 100.0
    assert momentum_residual(pushed, MASS) < 0.05


def test_a_wrong_mass_is_seen():
    assert momentum_residual(newton_walk(np.zeros(3)), 1.02 * MASS) > 1.0


def test_a_short_walk_has_no_balance():
    assert momentum_residual(newton_walk(np.zeros(3), seconds=1.9), MASS) is None
