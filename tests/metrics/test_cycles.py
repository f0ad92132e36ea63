from dataclasses import replace

import numpy as np
import pytest
from synthetic_walk import (
    LEFT_PHASE,
    SPEED,
    STANCE,
    STEP_WIDTH,
    STRIDE_TIME,
    perfect_walk,
    sharp_filter,
    synthetic_record,
)

from gaitval.coordinates import SIDES
from gaitval.metrics.cycles import (
    cut,
    find_cycles,
    foot_events,
    spatiotemporal,
    step_of,
    walking_speed,
)

RECORD = synthetic_record()


def _places(walk, cycles):
    """Where the feet of a perfect walk stand: where its centre of pressure begins a stance."""
    return {
        side: walk.centre_of_pressure[cycles.starts[side], column, :2]
        for column, side in enumerate(SIDES)
    }


def _force(*contacts: tuple[int, int], length: int = 3000) -> np.ndarray:
    force = np.zeros(length)
    for begin, end in contacts:
        force[begin:end] = 500.0
    return force


def _events(force: np.ndarray):
    return foot_events(force, step=0.001, threshold=20.0)


def test_heel_strikes_and_toe_offs_are_where_the_force_crosses_the_threshold():
    force = _force((300, 900), (1400, 2000))
    force[250:300] = 20.0  # at the threshold a foot is not yet on the ground
    events = _events(force)
    assert events.heel_strikes.tolist() == [300, 1400]
    assert events.toe_offs.tolist() == [900, 2000]
    assert events.on_ground.sum() == 1200


def test_a_walk_that_begins_or_ends_on_the_ground_has_no_event_there():
    events = _events(_force((0, 600), (1100, 1700), (2200, 3000)))
    assert events.heel_strikes.tolist() == [1100, 2200]
    assert events.toe_offs.tolist() == [600, 1700]


def test_a_scuff_in_swing_is_counted_but_is_no_stance():
    events = _events(_force((300, 900), (1150, 1200), (1400, 2000)))
    assert events.heel_strikes.tolist() == [300, 1400]
    assert events.scuffs == 1
    assert not events.on_ground[1170]


def test_cut_interpolates_between_samples():
    curves = cut(np.arange(1000.0), np.array([0, 101]), np.array([250, 999]))
    assert curves.shape == (2, 101)
    np.testing.assert_allclose(curves[0], np.linspace(0, 250, 101))
    np.testing.assert_allclose(curves[1], np.linspace(101, 999, 101))


@pytest.mark.parametrize("start_phase", [0.0, 0.25, 0.5, 0.75])
def test_cycles_follow_the_settling_ones_on_each_side(start_phase):
    walk = perfect_walk(RECORD, cycles=7, start_phase=start_phase)
    found = find_cycles(walk, sharp_filter())
    cycles = found.first(3)
    assert cycles.count("right") == cycles.count("left") == 3
    assert found.count("right") > 3
    # the walk begins on the ground at phase 0, so the first heel strike is that of phase 1
    np.testing.assert_allclose(walk.phase[cycles.starts["right"]], [2, 3, 4], atol=1e-9)
    np.testing.assert_allclose(walk.phase[cycles.ends["right"]], [3, 4, 5], atol=1e-9)
    np.testing.assert_allclose(walk.phase[cycles.starts["left"]], np.array([2, 3, 4]) + LEFT_PHASE)


@pytest.mark.parametrize("seconds", [0.0, 0.3, 1.5])
def test_a_walk_too_short_for_a_cycle_has_none(seconds):
    walk = perfect_walk(RECORD, cycles=seconds / STRIDE_TIME)
    cycles = find_cycles(walk, sharp_filter())
    assert cycles.count("right") == cycles.count("left") == 0
    assert walking_speed(walk, cycles) is None
    assert all(len(v) == 0 for v in spatiotemporal(walk, cycles, _places(walk, cycles)).values())


def test_spatiotemporal_parameters_are_those_of_the_record():
    walk = perfect_walk(RECORD, cycles=8)
    cycles = find_cycles(walk, sharp_filter())
    found = {
        name: values.mean()
        for name, values in spatiotemporal(walk, cycles, _places(walk, cycles)).items()
    }
    stride = SPEED * STRIDE_TIME
    right, left = STANCE["right"], STANCE["left"]
    assert walking_speed(walk, cycles) == pytest.approx(SPEED)
    expected = {
        "stride_time_right": STRIDE_TIME,
        "stride_time_left": STRIDE_TIME,
        "cadence": 120 / STRIDE_TIME,
        "stance_fraction_right": right,
        "stance_fraction_left": left,
        "double_support_fraction": (LEFT_PHASE + left - 1) + (right - LEFT_PHASE),
        "step_length_left": LEFT_PHASE * stride,
        "step_length_right": (1 - LEFT_PHASE) * stride,
        "step_width": STEP_WIDTH,
    }
    # a stance ends within a sample (1/1100 of the cycle) of the record's
    assert found == pytest.approx(expected, abs=2e-3)


def test_crossed_feet_have_a_negative_step_width():
    walk = perfect_walk(RECORD, cycles=6)
    crossed = replace(walk, centre_of_pressure=walk.centre_of_pressure * [1.0, -1.0, 1.0])
    cycles = find_cycles(crossed, sharp_filter())
    found = spatiotemporal(crossed, cycles, _places(crossed, cycles))
    assert found["step_width"].mean() == pytest.approx(-STEP_WIDTH)


def test_the_step_is_the_time_between_two_samples():
    """One sample has none, and no cycles either."""
    walk = perfect_walk(RECORD)
    two = replace(walk, time=walk.time[:2])
    assert step_of(two) == pytest.approx(walk.time[1] - walk.time[0])
    assert step_of(replace(walk, time=walk.time[:1])) == 1.0
