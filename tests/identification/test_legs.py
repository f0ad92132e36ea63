"""Legs that differ: what a fit's prior draws in is taken out again; weighed against people's."""

import numpy as np
import pytest

from gaitval.identification.legs import ODDS, LegDifference

PRIOR, NOISE = 0.0086, 0.004


def of(alone: float) -> LegDifference:
    """What a fit with its prior makes of a record that alone says `alone` m."""
    kept = PRIOR**2 / (PRIOR**2 + NOISE**2)
    return LegDifference(kept * alone, NOISE * np.sqrt(kept), PRIOR)


@pytest.mark.parametrize("alone", [-0.03, 0.0, 0.012])
def test_what_the_record_alone_says_is_found_again(alone):
    assert of(alone).alone == pytest.approx((alone, NOISE))


def test_odds_are_the_ratio_of_two_gaussians():
    from scipy.stats import norm

    from gaitval.identification.legs import MORE

    usual = np.hypot(PRIOR, NOISE)
    expected = norm.pdf(0.02, 0.0, np.hypot(usual, MORE)) / norm.pdf(0.02, 0.0, usual)
    assert of(0.02).odds == pytest.approx(expected)
    assert of(-0.02).odds == of(0.02).odds


def test_what_people_differ_by_is_no_difference_and_28_mm_are_left_as_they_are():
    assert not of(0.008).differ
    wide = of(-0.028)
    assert wide.differ
    mean, sd = wide.estimate
    assert mean == pytest.approx(-0.027, abs=0.001)
    assert abs(wide.found) < 0.024
    assert 0.003 < sd < 0.005


def test_near_the_limit_the_estimate_has_both_suppositions_and_does_not_jump():
    means = np.array([of(each).estimate[0] for each in np.linspace(0.0, 0.03, 61)])
    assert (np.diff(means) > 0.0).all()
    assert np.diff(means).max() < 0.0015


def test_a_record_that_says_nothing_of_the_legs_does_not_call_them_different():
    """Both suppositions are then as likely."""
    blind = LegDifference(1e-6, 0.9999 * PRIOR, PRIOR)
    assert blind.odds > ODDS
    assert not blind.differ
