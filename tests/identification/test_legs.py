"""Legs that differ: what a fit's prior draws in is taken out again; weighed against people's."""

from dataclasses import replace

import numpy as np
import pytest

from gaitval.identification.legs import LEG_ODDS, LegDifference, causes, held

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

    from gaitval.identification.legs import LEG_ODDS

    usual = np.hypot(PRIOR, NOISE)
    expected = norm.pdf(0.02, 0.0, np.hypot(usual, LEG_ODDS.more)) / norm.pdf(0.02, 0.0, usual)
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
    assert blind.odds > LEG_ODDS.odds
    assert not blind.differ


def test_causes_widen_what_the_record_alone_says_and_draw_its_estimate_in():
    sharp, honest = of(0.018), replace(of(0.018), causes=0.01)
    assert honest.alone[0] == sharp.alone[0]
    assert honest.alone[1] == pytest.approx(np.hypot(NOISE, 0.01))
    assert honest.estimate[1] > 1.5 * sharp.estimate[1]
    assert abs(honest.estimate[0]) < abs(sharp.estimate[0])


def test_a_knee_held_flexed_is_a_cause_where_the_other_is_not():
    """S08's: 20 and 4 degrees at most extended, half a leg of 42 cm."""
    bent, straight = np.radians(20.0), np.radians(4.0)
    alone = held({"l": bent, "r": straight}, 0.84, 0.0)
    assert alone == pytest.approx(0.42 * np.sin(bent / 2) * 0.5 * (bent - straight))
    assert 0.008 < alone < 0.012
    assert held({"l": bent, "r": bent}, 0.84, 0.0) == 0.0
    assert held({"l": -0.1, "r": -0.2}, 0.84, 0.0) == 0.0


def test_zeros_that_a_fit_has_among_its_unknowns_are_not_counted_again():
    """8 degrees of which a fit knows 4 leave √(8² - 4²)."""
    knees, degree = {"l": np.radians(20.0), "r": np.radians(4.0)}, np.radians(1.0)
    all_of_it = held(knees, 0.84, 0.0)
    assert held(knees, 0.84, 4 * degree) == pytest.approx(all_of_it * np.sqrt(8**2 - 4**2) / 8)
    assert held(knees, 0.84, 9 * degree) == 0.0


def test_only_real_laboratories_err_on_everybody():
    even = {"l": 0.1, "r": 0.1}
    assert causes(even, 0.84, laboratory=False, fitted=0.0) == 0.0
    assert causes(even, 0.84, laboratory=True, fitted=0.0) == pytest.approx(LEG_ODDS.laboratory)


def test_a_record_of_which_nothing_counts_leaves_what_people_s_legs_are():
    silent = LegDifference(0.0, PRIOR, PRIOR, causes=0.005)
    mean, sd = silent.estimate
    assert mean == 0.0
    assert PRIOR < sd < 0.025  # between people's and legs that differ by 2 cm beside
    assert not silent.differ
