"""Joint power of curves whose power is known."""

from dataclasses import replace

import numpy as np
import pytest
from synthetic_walk import MASS, perfect_walk, sharp_filter, synthetic_record

from gaitval.gait.cycle_curves import Curves, recorded_curves
from gaitval.metrics.comparison import low_pass_of, simulated_curves
from gaitval.metrics.cycles import find_cycles
from gaitval.metrics.walk_quantities import quantity_measures
from gaitval.quantities.joint_power import (
    BURSTS,
    JOINT_POWER,
    JOINTS,
    burst_places,
    joint_power,
)
from gaitval.subjects.subject_file import builtin_subjects

PERCENT = np.arange(101)
NAMES = [f"{joint}_{side}" for joint in JOINTS for side in "rl"]


def curves_of(angle, moment):
    return Curves({name: angle for name in NAMES}, {name: moment for name in NAMES}, {})


def test_a_constant_moment_on_a_swinging_joint_gives_and_takes_the_same_work():
    """An angle of 0.5 cos 2πφ goes through 1 rad and back: 2 Nm/kg do 2 J/kg each way."""
    angle = 0.5 * np.cos(2 * np.pi * PERCENT / 100)
    found = joint_power(curves_of(angle, np.full(101, 2.0)), {"r": 1.1, "l": 0.9})
    for name in NAMES:
        assert found.figures["generated"][name] == pytest.approx(2.0, rel=2e-3)
        assert found.figures["absorbed"][name] == pytest.approx(2.0, rel=2e-3)
        time = {"r": 1.1, "l": 0.9}[name[-1]]
        assert max(found.curves[name]) == pytest.approx(2.0 * np.pi / time, rel=2e-3)


def test_power_is_positive_where_the_moment_goes_with_the_motion():
    rising = np.linspace(0.0, 1.0, 101)
    found = joint_power(curves_of(rising, np.full(101, -3.0)), {"r": 1.0, "l": 2.0})
    np.testing.assert_allclose(found.curves["knee_angle_r"], -3.0, atol=1e-9)
    np.testing.assert_allclose(found.curves["knee_angle_l"], -1.5, atol=1e-9)


def test_cycles_are_averaged_after_the_product():
    """Two cycles whose angles and moments cancel in the mean, but not their power."""
    angle = np.stack([np.linspace(0, 1, 101), -np.linspace(0, 1, 101)])
    moment = np.stack([np.ones(101), -np.ones(101)])
    found = joint_power(curves_of(angle, moment), {"r": 1.0, "l": 1.0})
    np.testing.assert_allclose(found.curves["ankle_angle_r"], 1.0, atol=1e-9)


def with_bursts(power, bursts):
    return replace(power, figures={**power.figures, "bursts": bursts})


def power_measures(walked, recorded):
    here = {} if walked is None else {JOINT_POWER.name: walked}
    return list(quantity_measures(here, {JOINT_POWER.name: recorded}))


def powers_of(burst, curve):
    """The power of a burst's joint; that of the others is zero."""
    return {joint: curve if joint == burst.joint else np.zeros(101) for joint in JOINTS}


def bump(at, size):
    """A smooth peak of 4 % half width."""
    return size * np.exp(-(((PERCENT - at) / 4.0) ** 2))


@pytest.mark.parametrize("name", BURSTS)
def test_each_burst_is_the_largest_peak_of_its_joint_in_its_part_of_the_cycle(name):
    burst = BURSTS[name]
    middle = (burst.first + burst.last) // 2
    curve = bump(middle, 1.7 * burst.sign)
    assert burst_places(powers_of(burst, curve))[name] == middle
    # a smaller peak beside it changes nothing
    beside = curve + bump(middle + 8, 0.3 * burst.sign)
    assert burst_places(powers_of(burst, beside))[name] == pytest.approx(middle, abs=1)


@pytest.mark.parametrize("name", BURSTS)
def test_a_peak_outside_its_part_is_no_burst_though_its_flank_is_inside(name):
    """The edge of the part has the largest power then, and is not taken for a peak."""
    burst = BURSTS[name]
    flank = bump(burst.first - 2 if burst.first else burst.last + 2, 1.7 * burst.sign)
    assert burst_places(powers_of(burst, flank))[name] is None
    assert burst_places(powers_of(burst, -np.abs(flank) * burst.sign))[name] is None


def test_knee_generation_is_looked_for_after_the_absorption_that_it_follows():
    """K2 of a knee that generates at 11 % too, before K1 at 18 %: its windows overlap."""
    knee = bump(12, 0.6) + bump(18, -1.2) + bump(27, 0.2)
    places = burst_places(powers_of(BURSTS["K1"], knee))
    assert places["K1"] == pytest.approx(18, abs=1)
    assert places["K2"] == pytest.approx(27, abs=1)
    # the larger peak is inside the window of K2, not at its edge, and is not taken
    assert BURSTS["K2"].first < np.argmax(knee) < places["K1"]


def test_no_burst_of_the_ten_records_is_at_the_edge_of_its_part():
    """K2 was, in ten of forty of record and walk; it is a peak after K1, or not found."""
    found = 0
    for subject in builtin_subjects():
        record = subject.record()
        power = joint_power(recorded_curves(record), dict.fromkeys("rl", record.stride_time))
        for side in "rl":
            powers = {joint: power.curves[f"{joint}_{side}"] for joint in JOINTS}
            places = burst_places(powers)
            for name, at in places.items():
                burst = BURSTS[name]
                value = power.figures["bursts"][f"{name}_{side}"]
                if at is None:
                    assert value is None
                    continue
                found += 1
                assert burst.first < at < burst.last, (subject.identifier, side, name)
                curve = burst.sign * powers[burst.joint]
                assert curve[at] > max(curve[at - 1], curve[at + 1], 0.0)
                assert value == powers[burst.joint][at]
            if None not in (places["K1"], places["K2"]):
                assert places["K1"] < places["K2"]
    assert found == 178  # S07 has no K2 on the left, S10 no H2


def test_a_burst_that_the_record_lacks_is_not_compared_and_one_that_the_walk_lacks_is_zero():
    record = synthetic_record()
    full = joint_power(recorded_curves(record), dict.fromkeys("rl", record.stride_time))
    full.figures["bursts"]["A2_r"] = 2.5
    lacks = with_bursts(full, {**full.figures["bursts"], "A2_r": None})
    assert "A2_r" not in {each.target for each in power_measures(full, lacks)}
    (walk_lacks,) = (each for each in power_measures(lacks, full) if each.target == "A2_r")
    assert walk_lacks.value == pytest.approx(2.5 / BURSTS["A2"].spread)


def test_people_have_the_bursts_that_gait_analysis_names():
    """All ten records: push-off, knee extension and hip pull-off have their signs and sizes."""
    for subject in builtin_subjects():
        record = subject.record()
        found = joint_power(recorded_curves(record), dict.fromkeys("rl", record.stride_time))
        for side in "rl":
            assert 0.3 < found.figures["bursts"][f"A2_{side}"] < 6.0
            assert -3.0 < found.figures["bursts"][f"K4_{side}"] < -0.2
            assert 0.1 < found.figures["bursts"][f"H3_{side}"] < 3.0
            assert found.figures["bursts"][f"A1_{side}"] < -0.1


def test_a_walk_that_follows_the_record_has_its_power():
    record, configuration = synthetic_record(), sharp_filter()
    walk = perfect_walk(record, cycles=6)
    cycles = find_cycles(walk, configuration)
    walked = simulated_curves(walk, cycles, mass=MASS, filters=low_pass_of(record, 100.0))
    stride_time = dict.fromkeys("rl", record.stride_time)
    recorded = joint_power(recorded_curves(record), stride_time)
    measures = power_measures(joint_power(walked, stride_time), recorded)
    assert max(each.value for each in measures) < 0.02


def test_without_a_cycle_nothing_is_measured():
    empty = curves_of(np.empty((0, 101)), np.empty((0, 101)))
    assert joint_power(empty, {"r": 1.0, "l": 1.0}) is None
    record = synthetic_record()
    recorded = joint_power(recorded_curves(record), dict.fromkeys("rl", record.stride_time))
    measures = power_measures(None, recorded)
    shown = [name for name, value in recorded.figures["bursts"].items() if value is not None]
    assert shown
    assert len(measures) == len(shown) + 2 * len(JOINTS)
    assert {each.value for each in measures} == {None}


WINDOWS = {
    "H1": ("hip_flexion", 0, 35, 1), "H2": ("hip_flexion", 20, 60, -1),
    "H3": ("hip_flexion", 45, 85, 1), "K1": ("knee_angle", 2, 20, -1),
    "K2": ("knee_angle", 8, 35, 1), "K3": ("knee_angle", 45, 75, -1),
    "K4": ("knee_angle", 75, 99, -1), "A1": ("ankle_angle", 5, 50, -1),
    "A2": ("ankle_angle", 40, 70, 1),
}  # fmt: skip
"""% of the cycle, ends included."""
SPREADS = {"H1": 0.34, "H2": 0.26, "H3": 0.41, "K1": 0.46, "K2": 0.27, "K3": 0.42, "K4": 0.40}
SPREADS |= {"A1": 0.48, "A2": 1.01}
"""W/kg: half the width of the bands that come with Schwartz et al. 2008."""


def test_a_difference_is_told_in_deviations_between_people():
    silent = joint_power(curves_of(np.zeros(101), np.zeros(101)), {"r": 1.0, "l": 1.0})
    messages = {f"{name}_{side}": 0.0 for name in WINDOWS for side in "rl"}
    recorded = with_bursts(silent, messages)
    for name, spread in SPREADS.items():
        walked = with_bursts(silent, messages | {f"{name}_l": 2.0 * spread})
        found = {each.target: each.value for each in power_measures(walked, recorded)}
        assert found[f"{name}_l"] == pytest.approx(2.0)
        assert found[f"{name}_r"] == 0.0
