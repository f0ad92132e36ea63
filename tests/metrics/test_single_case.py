import numpy as np
import pytest

from experiments import healthy_cases
from gaitval.gait.healthy_controls import PROFILE_ANGLES, load_controls
from gaitval.metrics.single_case import (
    RANK,
    compare_with_group,
    group_of,
    load_cases,
    modified_t,
)


def test_t_is_that_of_crawford_and_howell():
    """A person in a sample of n whose mean is 0: the two-sample t with one case."""
    from scipy import stats

    group = np.random.default_rng(0).normal(size=12)
    found = modified_t(np.array(2.0), group.mean(), group.std(ddof=1), 12)
    # with one person in a group the pooled variance is the other group's
    assert found == pytest.approx(stats.ttest_ind([2.0], group).statistic)


def test_healthy_adults_are_out_as_often_as_said(gait_data):
    """Each of the 42 is left out of the group and of the threshold: 2 of 42 is 4.8 %, within 5 ±
    1.5 %; 1 or 3 are not."""
    curves = healthy_cases.curves_of(gait_data)
    assert curves.shape == (42, 2, 9, 101)
    alarms = 0
    for i, person in enumerate(curves):
        rest = np.delete(curves, i, axis=0)
        threshold = np.sort(healthy_cases.left_out_scores(rest))[-RANK]
        alarms += np.abs(modified_t(person, *group_of(rest), 41)).max() > threshold
    assert 100 * alarms / 42 == pytest.approx(5.0, abs=1.5)


def test_every_amputee_is_out_of_the_ordinary(gait_data):
    people = healthy_cases.curves_of(gait_data, "transfemoral_amputee")
    for person in people:
        angles = {
            f"{name}_{side}": person[s, i]
            for i, name in enumerate(PROFILE_ANGLES)
            for s, side in enumerate("rl")
        }
        found = compare_with_group(angles)
        assert found.regions
        assert found.p <= 0.05


def test_the_shipped_file_is_what_the_data_give(gait_data):
    assert healthy_cases.cases_file(gait_data) == healthy_cases.FILE.read_text("utf-8")


def test_the_group_is_that_of_the_gait_profile_score():
    cases = load_cases()
    assert cases.people == load_controls().people
    for name, mean in load_controls().curves.items():
        assert np.allclose(cases.mean[name], mean, atol=0.06)  # rounded to .1 there


def test_where_a_knee_is_stiff_is_said():
    mean = load_cases().mean
    angles = {f"{name}_{side}": mean[name].copy() for name in PROFILE_ANGLES for side in "rl"}
    assert not compare_with_group(angles).regions
    angles["knee_angle_l"][60:80] -= 45.0
    found = compare_with_group(angles)
    assert list(found.regions) == ["knee_angle_l"]
    (region,) = found.regions["knee_angle_l"]
    assert 60 <= region.first <= region.last <= 79
    assert found.t["knee_angle_l"][70] < -found.threshold
    assert found.p == pytest.approx(1 / 43)


def test_nothing_recorded_is_nothing_said():
    assert compare_with_group({"elbow_r": np.zeros(101)}) is None
    assert compare_with_group({"knee_angle_r": np.full(101, np.nan)}) is None
