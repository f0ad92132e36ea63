"""Steps in series whose truth is known, and how often none is there."""

import numpy as np
import pytest
from scipy.stats import binom, ttest_ind

from gaitval.apps.regression.change_points import CHANCE, LEAST, SIDE, steps


def test_the_chance_is_that_of_students_test_times_the_places_and_series():
    """Before and after known, SciPy's own test of the two parts."""
    values = np.random.default_rng(3).normal(size=12)
    values[7:] += 9.0
    (found,) = steps(values, series=10)
    assert found.index == 7
    chance = ttest_ind(values[:7], values[7:]).pvalue
    places = (12 - 2 * SIDE + 1) + 3 * (6 - 2 * SIDE + 1)  # the whole, and three of six
    assert found.chance == pytest.approx(10 * places * chance, rel=1e-6)
    assert (found.before, found.after) == pytest.approx((values[:7].mean(), values[7:].mean()))


def test_a_loss_that_was_mended_is_found_at_both_ends():
    """Half of the values before or after any place are as the other half: only parts differ."""
    values = np.random.default_rng(0).normal(scale=0.1, size=30)
    values[10:20] += 3.0
    assert [step.index for step in steps(values)] == [10, 20]
    first, second = steps(values)
    assert first.after == second.before == pytest.approx(3.0, abs=0.2)


@pytest.mark.parametrize("size", [1.0, -1e-3])
def test_a_step_without_scatter_is_found_at_once(size):
    """As between checks on one machine, which repeat bit for bit."""
    values = [0.5] * 6 + [0.5 + size] * 2
    (found,) = steps(values, series=1000)
    assert found.index == 6


def test_equal_values_and_the_last_stored_digit_are_no_step():
    assert steps([0.0] * 20) == []
    assert steps([0.123456] * 20) == []
    assert steps([0.123456] * 10 + [0.123457] * 10, series=100) == []


def test_one_outlier_is_no_step_and_few_values_are_not_searched():
    assert steps([1.0] * 7 + [9.0]) == []
    assert steps([9.0] + [1.0] * 7) == []
    assert steps([0.0, 0.0, 0.0, 5.0, 5.0]) == []
    assert len([0.0, 0.0, 0.0, 5.0, 5.0]) < LEAST
    assert steps([]) == []


def test_false_alarms_are_as_rare_as_is_said():
    """400 histories of ten series that only scatter. More alarms than this bound would come with a
    chance of one in a million if each history had `CHANCE` of one."""
    random = np.random.default_rng(1)
    histories, series = 400, 10
    alarms = sum(
        any(steps(values, series) for values in random.normal(size=(series, 15)))
        for _ in range(histories)
    )
    assert 0 < alarms <= binom.isf(1e-6, histories, CHANCE)


def test_a_clear_step_is_found_and_placed():
    """Six times the scatter, in the middle of 20 checks, among 100 series: at least 95 of 100."""
    random = np.random.default_rng(2)
    placed = 0
    for _ in range(100):
        values = random.normal(size=20)
        values[10:] += 6.0
        placed += [step.index for step in steps(values, series=100)] == [10]
    assert placed >= 95
