"""The section on whole curves: its tables and figures say what metrics.json says."""

import copy

import pytest
from synthetic_walk import MODEL, perfect_walk, sharp_filter, synthetic_record, walks_of

from gaitval.datasets.subject_file import load_subject
from gaitval.metrics.gait_profile import load_controls
from gaitval.metrics.validation import validate
from gaitval.reporting.curve_statistics import differences, drawings, profile, tables

CONFIGURATION = sharp_filter(cycles=5, start_phases=(0.0,))


@pytest.fixture(scope="module")
def metrics():
    record = synthetic_record()
    walks = walks_of([perfect_walk(record, cycles=8.0)], CONFIGURATION)
    return validate(load_subject("S05"), record, MODEL, walks, None, CONFIGURATION)


def test_rows_are_those_of_the_metrics(metrics):
    found = tables(metrics)
    curves = metrics["curve_statistics"]["curves"]
    assert len(found["curves"]) == sum(len(each) for each in curves.values()) / 2
    row = next(row for row in found["curves"] if row["name"] == "Knee flexion moment")
    for side, key in zip(row["sides"], ("knee_angle_r", "knee_angle_l"), strict=True):
        stored = curves["moments"][key]
        assert side["multiple_correlation"] == stored["multiple_correlation"]
        points = sum(each["last"] - each["first"] + 1 for each in stored["regions"])
        assert side["share"] == pytest.approx(100.0 * points / 101.0)
    assert [row["name"] for row in found["bands"]][0::3] == ["Hip flexion", "Hip flexion moment"]
    assert found["controls"] is load_controls()


def test_regions_are_drawn(metrics):
    """One line more for each region: all else is equal."""
    without = copy.deepcopy(metrics)
    for curves in without["curve_statistics"]["curves"].values():
        for curve in curves.values():
            curve["regions"] = []
    marked = copy.deepcopy(without)
    region = {"first": 10, "last": 30, "p": 0.01}
    marked["curve_statistics"]["curves"]["angles"]["knee_angle_r"]["regions"] = [region]
    bare, drawn = differences(without), differences(marked)
    assert drawn.count("<path") == bare.count("<path") + 1
    assert differences(marked) == drawn


def test_the_profile_shows_what_it_is_given(metrics):
    profiles = metrics["curve_statistics"]["profiles"]
    fewer = copy.deepcopy(profiles)
    fewer["variables"] = profiles["variables"][:3]
    assert profile(profiles) == profile(profiles)
    # a box, a mean and four markers fewer for each of the others
    assert profile(fewer).count("<use") < profile(profiles).count("<use")


def test_older_metrics_have_no_such_section(metrics):
    older = {name: value for name, value in metrics.items() if name != "curve_statistics"}
    assert tables(older) is None
    assert drawings(older) == {}
