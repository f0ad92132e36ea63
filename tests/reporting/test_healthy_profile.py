"""The section on healthy people: its words and figure say what metrics.json says."""

import copy

import pytest
from seen_figures import figure_of
from synthetic_walk import MODEL, perfect_walk, sharp_filter, synthetic_record, walks_of

from gaitval.gait.healthy_controls import load_controls
from gaitval.metrics.curve_results import GaitProfiles
from gaitval.metrics.gait_profile import is_control
from gaitval.metrics.results import metrics_from
from gaitval.metrics.validation import validate
from gaitval.reporting.figures import COLOURS, RECORD_COLOUR
from gaitval.reporting.healthy_profile import Healthy, profile
from gaitval.reporting.report import _drawings
from gaitval.subjects.subject_file import load_subject

CONFIGURATION = sharp_filter(cycles=5, start_phases=(0.0,))
PERSON = load_subject("S05")


@pytest.fixture(scope="module")
def metrics():
    record = synthetic_record()
    walks = walks_of([perfect_walk(record, cycles=8.0)], CONFIGURATION)
    return validate(PERSON, record, MODEL, walks, None, CONFIGURATION).as_dict()


def read(values):
    """Metrics from the contents of a file."""
    return metrics_from(values, "here")


def _tables(values):
    return Healthy(read(values).gait_profiles, is_control(PERSON))


def test_the_side_that_differs_more_comes_first_and_is_held_against_what_matters(metrics):
    """A mean of both sides would be under 1.6 degrees."""
    changed = copy.deepcopy(metrics)
    profiles = changed["gait_profiles"]
    profiles["record"] |= {"right": 5.0, "left": 5.1, "total": 5.1}
    profiles["walk"] |= {"right": 5.1, "left": 7.0, "total": 6.1}
    profiles["walk"]["scores"]["hip_flexion_l"] = profiles["record"]["scores"]["hip_flexion_l"] + 9
    found = _tables(changed)
    assert [(row.side, row.matters) for row in found.sides] == [
        ("left", True),
        ("right", False),
    ]
    assert found.sides[0].difference == pytest.approx(1.9)
    assert (found.furthest.name, found.furthest.side) == ("hip_flexion", "left")
    profiles["walk"] |= {"left": 3.4}  # nearer to healthy people than the record is: different too
    assert _tables(changed).sides[0].matters


def test_older_metrics_have_no_such_section(metrics):
    older = {name: value for name, value in metrics.items() if name != "gait_profiles"}
    assert read(older).gait_profiles is None
    assert "gait_profile" in _drawings(read(metrics), None)
    assert "gait_profile" not in _drawings(read(older), None)


def test_sides_of_the_profile_differ_in_shape_and_the_record_is_hollow_in_both_modes(metrics):
    """Hollow, not white: white is the page's colour and would be a dark dot on a dark page."""
    found = GaitProfiles.model_validate(metrics["gait_profiles"])
    (axes,) = figure_of(lambda: profile(found)).axes
    marks = {each.get_label(): each for each in axes.lines if each.get_marker() in "<>"}
    assert {name: each.get_marker() for name, each in marks.items()} == {
        f"{which}, {side}": symbol
        for which in ("measured", "walk")
        for side, symbol in (("right", ">"), ("left", "<"))
    }
    hollow = {name for name, each in marks.items() if each.get_markerfacecolor() == "none"}
    assert hollow == {"measured, right", "measured, left"}
    drawn = profile(found)
    assert "#ffffff" not in drawn
    assert "#d9d9d9" in drawn  # which the style sheet has for dark pages


def test_the_profile_draws_each_score_on_its_side_in_its_column(metrics):
    given = copy.deepcopy(metrics["gait_profiles"])
    found = GaitProfiles.model_validate(given)
    (axes,) = figure_of(lambda: profile(found)).axes
    controls = load_controls()
    names = [*found.variables, "total"]
    places = dict(zip(axes.get_xticks(), names, strict=True))
    bars = [each for each in axes.patches if each.get_height() > 0]
    for bar, (place, name) in zip(bars, places.items(), strict=True):
        mean, sd = controls.side if name == "total" else controls.scores[name]
        assert bar.get_x() + 0.5 * bar.get_width() == pytest.approx(place)
        assert (bar.get_y(), bar.get_height()) == pytest.approx((mean - sd, 2 * sd))
    assert axes.get_ylim()[0] == 0 < axes.get_ylim()[1]
    assert axes.get_ylabel().endswith("°")
    for which, scores in (("measured", found.record), ("walk", found.walk)):
        for side, symbol in (("right", ">"), ("left", "<")):
            (line,) = [each for each in axes.lines if each.get_label() == f"{which}, {side}"]
            own = [
                *(scores.scores[f"{name}_{side[0]}"] for name in found.variables),
                scores.of(side),
            ]
            assert list(line.get_ydata()) == own
            assert line.get_marker() == symbol
            assert (line.get_xdata() - list(places) > 0).all() == (side == "right")
            assert line.get_color() == (COLOURS[side] if which == "walk" else RECORD_COLOUR)
