import math

import numpy as np
import pytest

from gaitval.apps.devices.phase_estimate import PhaseEstimate

STEP = 0.006


def led(estimate, strides, *, seconds=12.0, start=0.0, noise=0.0):
    """Phases of an estimate that sees a foot with strides of `strides` s, 60 % on the ground."""
    random = np.random.default_rng(0)
    times = STEP * np.arange(round(seconds / STEP))
    found = []
    for time in times:
        true = ((time + start) / strides) % 1.0
        load = 600.0 if true < 0.6 else 0.0
        estimate.see(time, load + noise * random.standard_normal())
        found.append((true, estimate.phase))
    return times, np.array(found)


def test_it_finds_the_stride_time_and_the_phase():
    estimate = PhaseEstimate(40.0, 1.0)
    _, found = led(estimate, 1.18, seconds=20.0, start=0.8)
    assert estimate.stride_time == pytest.approx(1.18, abs=0.01)
    true, seen = found[1700:].T
    away = (seen - true + 0.5) % 1.0 - 0.5
    assert np.abs(away).max() < 0.02


def test_the_phase_is_not_known_before_the_first_strike():
    estimate = PhaseEstimate(40.0, 1.0)
    estimate.start(600.0)
    _, found = led(estimate, 1.0, start=0.3, seconds=0.6)
    assert np.isnan(found[:, 1]).all()
    started = PhaseEstimate(40.0, 1.0)
    assert not math.isnan(led(started, 1.0, start=0.9, seconds=0.3)[1][-1, 1])


def test_a_noisy_switch_does_not_strike_twice():
    estimate = PhaseEstimate(40.0, 1.0)
    led(estimate, 1.0, seconds=10.0, noise=8.0)
    assert estimate.stride_time == pytest.approx(1.0, abs=0.01)


def test_a_bounce_of_the_foot_begins_no_stride():
    """The heel lands at 1 s, is off the ground for 60 ms, less than 15 % of the stride, and down
    again; off for 160 ms it has landed anew."""
    for back, phase in ((1.09, 0.5), (1.19, 0.31)):
        estimate = PhaseEstimate(40.0, 1.0)
        for time, load in ((0.5, 600.0), (0.6, 0.0), (1.0, 600.0), (1.03, 0.0), (back, 600.0)):
            estimate.see(time, load)
        estimate.see(1.5, 600.0)
        assert estimate.phase == pytest.approx(phase)


def test_a_stumble_does_not_change_the_stride_time():
    estimate = PhaseEstimate(40.0, 1.0)
    led(estimate, 1.0)
    before = estimate.stride_time
    for time, load in ((20.0, 0.0), (24.0, 600.0)):
        estimate.see(time, load)
    assert estimate.stride_time == before
    assert estimate.phase == 0.0


def test_the_switch_closes_at_its_threshold_and_opens_at_half_of_it():
    estimate, seen = PhaseEstimate(40.0, 1.0), []
    for number, load in enumerate((39.0, 40.0, 21.0, 19.0, 39.0, 40.0)):
        estimate.see(0.2 * number, load)
        seen.append(estimate.loaded)
    assert seen == [False, True, True, False, False, True]


@pytest.mark.parametrize(
    ("stride", "counts"), [(0.5, False), (0.7, True), (1.5, True), (1.7, False)]
)
def test_only_a_plausible_stride_counts(stride, counts):
    estimate = PhaseEstimate(40.0, 1.0)
    for time, load in ((0.0, 600.0), (stride - 0.3, 0.0), (stride, 600.0)):
        estimate.see(time, load)
    # Between the stride time so far and the last one.
    low, high = sorted((1.0, stride))
    assert (low < estimate.stride_time < high) == counts
    assert counts or estimate.stride_time == 1.0
    assert estimate.phase == 0.0


def test_the_phase_waits_at_1_for_a_strike_that_is_late():
    estimate, phases = PhaseEstimate(40.0, 1.0), []
    for time, load in ((0.0, 600.0), (0.7, 0.0), (1.0, 0.0), (1.3, 0.0)):
        estimate.see(time, load)
        phases.append(estimate.phase)
    assert phases == [0.0, 0.7, 1.0, 1.0]
