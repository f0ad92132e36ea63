"""Intervals and repeats of verdicts."""

import math

import numpy as np
import pytest
from scipy import stats

from gaitval.metrics.results import Repeat
from gaitval.metrics.tolerances import evaluate, measured
from gaitval.metrics.verdict_rows import (
    CONFIDENCE,
    prediction_interval,
    repeated_values,
    share_interval,
    spread_of,
    spread_of_falls,
    spread_of_pushes,
)


def verdict_of(measure, target, value, role="acceptance"):
    [found] = [each for each in evaluate([measured(measure, target, value)]) if each.role == role]
    return found


def test_one_more_value_falls_into_the_interval_as_often_as_it_says():
    """A property of the interval, whatever the walks: 90 % of further draws are inside."""
    random = np.random.default_rng(20261123)
    inside = 0
    for _ in range(4000):
        *known, further = random.normal(3.0, 0.4, 9)
        low, high = prediction_interval(known)
        inside += low <= further <= high
    assert inside / 4000 == pytest.approx(CONFIDENCE, abs=0.015)


def test_two_values_have_no_interval():
    assert prediction_interval([1.0, 2.0]) is None


@pytest.mark.parametrize(("kept", "count"), [(0, 8), (20, 25), (25, 25), (1, 3)])
def test_the_share_at_each_end_is_at_the_score_tests_boundary(kept, count):
    """Wilson's interval holds the shares from which the seen one is within z standard errors."""
    z = stats.norm.ppf(0.5 + 0.5 * CONFIDENCE)
    for end in share_interval(kept, count):
        if 0.0 < end < 1.0:
            distance = abs(kept / count - end) / math.sqrt(end * (1.0 - end) / count)
            assert distance == pytest.approx(z)
    low, high = share_interval(kept, count)
    assert 0.0 <= low <= kept / count <= high <= 1.0


@pytest.mark.parametrize(
    ("survived", "passed", "close"),
    [(25, True, False), (21, True, False), (20, True, True), (19, False, False)],
)
def test_a_share_that_one_push_less_would_fail_is_said_to_be_close(survived, passed, close):
    verdict = verdict_of("push_survival", "phase 0.5", 100.0 * survived / 25)
    found = spread_of_pushes(verdict, survived, 25)
    assert (verdict.passed, found.close) == (passed, close)
    assert (found.repeats, found.kept) == (25, survived)
    assert found.low < verdict.value <= found.high or survived == 25


@pytest.mark.parametrize(
    ("values", "kept", "close"),
    [
        ([1.0, 1.1, 0.9, 1.0], 4, False),
        ([1.0, 1.1, 0.9, 2.5], 3, True),  # one repeat does not meet 2 degrees
        ([1.8, 1.95, 1.6, 1.5], 4, True),  # all do, but one more may not
        ([1.0, None, 1.1, 0.9], 3, True),  # one fell before a gait cycle was whole
    ],
)
def test_a_pass_that_repeats_do_not_all_share_is_close(values, kept, close):
    found = spread_of(verdict_of("angle_rmse", "knee_angle_r", 1.0), values)
    assert (found.repeats, found.kept, found.close) == (4, kept, close)
    assert found.low >= 0.0


def test_what_failed_is_not_close():
    found = spread_of(verdict_of("angle_rmse", "knee_angle_r", 2.1), [2.1, 1.95, 2.2])
    assert found.kept == 1
    assert not found.close


def test_without_repeats_there_is_no_spread():
    assert spread_of(verdict_of("angle_rmse", "knee_angle_r", 1.0), []) is None


def test_no_fall_in_eight_walks_does_not_mean_that_none_falls():
    found = spread_of_falls(0, 8)
    assert (found.kept, found.low) == (8, 0.0)
    assert 1.0 < found.high < 3.0


def test_values_are_collected_by_measure_and_target():
    rows = [
        Repeat(
            start_phase=0.0,
            noise=0.01,
            seed=seed,
            fell=False,
            measures={"angle_rmse": {"knee_angle_r": value}},
        )
        for seed, value in enumerate((1.0, None))
    ]
    assert repeated_values(rows) == {("angle_rmse", "knee_angle_r"): [1.0, None]}


def test_the_interval_of_three_values_is_students():
    """t of two degrees of freedom at 95 % is 2.91999 (any table)."""
    low, high = prediction_interval([1.0, 2.0, 3.0])
    half = 2.919986 * 1.0 * math.sqrt(1.0 + 1.0 / 3.0)
    assert (low, high) == (pytest.approx(2.0 - half), pytest.approx(2.0 + half))


@pytest.mark.parametrize(("values", "low"), [((0.0, 1.0, 2.0), 0.0), ((-0.1, 1.0, 2.0), None)])
def test_the_size_of_an_error_cannot_be_below_zero(values, low):
    found = spread_of(verdict_of("angle_rmse", "knee_angle_r", 1.0), values)
    assert found.low == (
        pytest.approx(prediction_interval(values)[0], rel=1e-4) if low is None else low
    )
    small = spread_of(verdict_of("angle_rmse", "knee_angle_r", 0.3), (0.2, 0.3, 0.4))
    assert 0.0 <= small.low < 0.2


def test_a_skill_that_may_be_below_zero_is_close():
    """The prediction interval of the reviewer's five walks; errors end at zero, skills do not."""
    values = [0.02, 0.31, 0.05, 0.22, 0.11]
    low, high = prediction_interval(values)
    assert low < 0.0
    skill = spread_of(verdict_of("angle_skill", "hip_flexion_r", 0.05), values)
    assert (skill.low, skill.high) == (pytest.approx(low), pytest.approx(high))
    assert skill.close
    error = spread_of(verdict_of("moment_rmse", "hip_flexion_r", 0.05, "context"), values)
    assert error.low == 0.0
