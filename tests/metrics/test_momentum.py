"""The balance of momentum of a walk, on made-up walks whose hidden force is known."""

from dataclasses import replace

import numpy as np
import pytest
from newton_walk import MASS, STEP, newton_walk

from gaitval.constants import GRAVITY
from gaitval.metrics.momentum import momentum_residual
from gaitval.model.ground import Ground


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


@pytest.mark.parametrize("begin", [500, 625, 750, 875])
def test_a_hidden_force_of_a_window_s_length_is_seen_wherever_it_begins(begin):
    """1 % of the weight for 1 s: no window is off it by more than a quarter of its length."""
    hidden = np.zeros((2500, 3))
    hidden[begin : begin + 500, 0] = 0.01 * MASS * GRAVITY
    assert 0.7 < momentum_residual(newton_walk(hidden), MASS) < 1.05


def test_a_wrong_mass_is_seen():
    assert momentum_residual(newton_walk(np.zeros(3)), 1.02 * MASS) > 1.0


@pytest.mark.parametrize("seconds", [1.998, 1.9, 2 * STEP, STEP])
def test_a_short_walk_has_no_balance(seconds):
    assert momentum_residual(newton_walk(np.zeros(3), seconds=seconds), MASS) is None
    assert momentum_residual(newton_walk(np.zeros(3), seconds=2.004), MASS) < 0.05


def test_a_blow_within_one_step_is_no_hidden_force():
    """Its impulse of 42 Ns, 6 % of the weight over a window, is of the step that follows it, on
    whatever side of a window's edge that is."""
    for sample in (400, 500, 501, 502, 750, 751, 1001, 1002):
        struck = newton_walk(np.zeros(3))
        blow = 21_000.0  # N
        struck.ground_reaction[sample, 0, 0] += blow
        since = np.clip(np.arange(len(struck.time)) - sample, 0, None)
        struck.centre_of_mass[:, 0] += (blow * STEP / MASS * STEP * since).astype(np.float32)
        assert momentum_residual(struck, MASS) < 0.1


def test_on_a_slope_gravity_is_the_ground_s():
    """A walk whose ground pushes against turned gravity; on level ground it would need 5 % more."""
    ground = Ground(5.0, -3.0)
    level = newton_walk(np.zeros(3))
    turned = replace(
        level,
        ground_reaction=level.ground_reaction @ ground.from_level.T,
        centre_of_mass=(level.centre_of_mass @ ground.from_level.T).astype(np.float32),
    )
    assert momentum_residual(turned, MASS, ground) < 0.05
    assert momentum_residual(turned, MASS) == pytest.approx(
        100.0 * np.linalg.norm(ground.up - [0.0, 0.0, 1.0]), rel=0.02
    )
