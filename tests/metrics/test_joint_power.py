"""Joint power of curves whose power is known."""

import numpy as np
import pytest
from synthetic_walk import MASS, perfect_walk, sharp_filter, synthetic_record

from gaitval.datasets.subject_file import builtin_subjects
from gaitval.metrics.comparison import Curves, low_pass_of, recorded_curves, simulated_curves
from gaitval.metrics.cycles import find_cycles
from gaitval.metrics.joint_power import BURSTS, JOINTS, joint_power, power_measures

PERCENT = np.arange(101)
NAMES = [f"{joint}_{side}" for joint in JOINTS for side in "rl"]


def curves_of(angle, moment):
    return Curves({name: angle for name in NAMES}, {name: moment for name in NAMES}, {})


def test_a_constant_moment_on_a_swinging_joint_gives_and_takes_the_same_work():
    """An angle of 0.5 cos 2πφ goes through 1 rad and back: 2 Nm/kg do 2 J/kg each way."""
    angle = 0.5 * np.cos(2 * np.pi * PERCENT / 100)
    found = joint_power(curves_of(angle, np.full(101, 2.0)), {"r": 1.1, "l": 0.9})
    for name in NAMES:
        assert found.generated[name] == pytest.approx(2.0, rel=2e-3)
        assert found.absorbed[name] == pytest.approx(2.0, rel=2e-3)
        time = {"r": 1.1, "l": 0.9}[name[-1]]
        assert found.power[name].max() == pytest.approx(2.0 * np.pi / time, rel=2e-3)


def test_power_is_positive_where_the_moment_goes_with_the_motion():
    rising = np.linspace(0.0, 1.0, 101)
    found = joint_power(curves_of(rising, np.full(101, -3.0)), {"r": 1.0, "l": 2.0})
    np.testing.assert_allclose(found.power["knee_angle_r"], -3.0, atol=1e-9)
    np.testing.assert_allclose(found.power["knee_angle_l"], -1.5, atol=1e-9)


def test_cycles_are_averaged_after_the_product():
    """Two cycles whose angles and moments cancel in the mean, but not their power."""
    angle = np.stack([np.linspace(0, 1, 101), -np.linspace(0, 1, 101)])
    moment = np.stack([np.ones(101), -np.ones(101)])
    found = joint_power(curves_of(angle, moment), {"r": 1.0, "l": 1.0})
    np.testing.assert_allclose(found.power["ankle_angle_r"], 1.0, atol=1e-9)


@pytest.mark.parametrize("name", BURSTS)
def test_each_burst_is_the_extremum_of_its_joint_in_its_part_of_the_cycle(name):
    burst = BURSTS[name]
    power = np.zeros(101)
    power[burst.first : burst.last + 1] = 0.3 * burst.sign
    power[burst.last] = burst.sign * 1.7
    outside = [percent for percent in (0, 100) if not burst.first <= percent <= burst.last]
    power[outside] = burst.sign * 9.0
    angle = np.concatenate([[0.0], np.cumsum(0.5 * (power[1:] + power[:-1]))]) * 0.01
    found = joint_power(curves_of(angle, np.ones(101)), {"r": 1.0, "l": 1.0})
    rate = np.gradient(angle, 0.01, edge_order=2)[burst.first : burst.last + 1]
    expected = burst.sign * np.max(burst.sign * rate)
    assert found.bursts[f"{name}_r"] == pytest.approx(expected)
    assert np.sign(found.bursts[f"{name}_l"]) == burst.sign


def test_people_have_the_bursts_that_gait_analysis_names():
    """All ten records: push-off, knee extension and hip pull-off have their signs and sizes."""
    for subject in builtin_subjects():
        record = subject.record()
        found = joint_power(recorded_curves(record), dict.fromkeys("rl", record.stride_time))
        for side in "rl":
            assert 0.3 < found.bursts[f"A2_{side}"] < 6.0
            assert -3.0 < found.bursts[f"K4_{side}"] < -0.2
            assert 0.1 < found.bursts[f"H3_{side}"] < 3.0
            assert found.bursts[f"A1_{side}"] < -0.1


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
    assert len(measures) == 2 * len(BURSTS) + 2 * len(JOINTS)
    assert {each.value for each in measures} == {None}
