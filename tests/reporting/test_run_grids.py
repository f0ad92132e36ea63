"""The figures of curves of a run."""

from pathlib import Path

import numpy as np
import pytest
from report_run import build_run
from seen_figures import figure_of, lines

from gaitval.configuration import ReportSettings
from gaitval.metrics.curve_results import KINDS
from gaitval.metrics.results import read_metrics
from gaitval.reporting.figures import COLOURS, WALK_WIDTH
from gaitval.reporting.run_grids import (
    NARROW,
    _recorded,
    _walked,
    figures,
    strides_in,
)
from gaitval.subjects.subject_file import load_subject

BASELINE = Path(__file__).parents[2] / "reports" / "S05" / "baseline"


@pytest.fixture(scope="module")
def run(tmp_path_factory):
    """Of a person without plates."""
    folder = tmp_path_factory.mktemp("run")
    build_run(folder, not_recorded="expected")
    subject = load_subject(folder / "subject.toml")
    assert not subject.has_kinetics
    return folder, subject, read_metrics(folder)


@pytest.fixture(scope="module")
def walked(tmp_path_factory):
    """Of a person with plates, whose sides differ."""
    folder = tmp_path_factory.mktemp("walked")
    build_run(folder)
    return folder, load_subject(folder / "subject.toml"), read_metrics(folder)


def test_without_plates_every_figure_is_there(run):
    folder, subject, metrics = run
    draws, tables = figures(metrics, subject, strides_in(folder, metrics), ReportSettings())
    muscles = {"activations", "contacts"}
    assert draws.keys() == {"curves", NARROW, "kinematics", "kinetics", "forces"} | muscles
    assert "<svg" in draws["kinematics"]()
    assert all(tables.values())


@pytest.mark.parametrize("name", ["curves", NARROW, "kinematics", "kinetics", "forces"])
def test_curves_are_those_of_the_metrics_of_their_own_side(walked, name):
    """Of both sides, mean and SD, record and walk, in the unit of the grid."""
    _, subject, metrics = walked
    (rows,) = figures(metrics, subject, {}, ReportSettings())[0][name].args
    checked = 0
    for panel in (panel for row in rows for panel in row if panel.kind in KINDS):
        curve = panel.name.partition("/")[2]
        for drawn in panel.curves:
            key = f"{curve}_{drawn.side[0]}"
            if drawn.which == "record":
                stored = metrics.record.curves.of(panel.kind).get(key)
            else:
                found = metrics.walk.curves.of(panel.kind).get(key)
                stored = found and found.mean
                if found:
                    np.testing.assert_array_equal(drawn.sd, found.sd)
            if stored:
                checked += 1
                np.testing.assert_array_equal(drawn.mean, stored)
        stance = metrics.record.spatiotemporal
        assert panel.toe_off == {
            "right": 100 * stance.stance_fraction_right,
            "left": 100 * stance.stance_fraction_left,
        }
    assert checked >= 12


def test_strides_are_in_the_unit_of_their_mean(walked):
    """Degrees, Nm/kg and % of body weight; those of a walk without noise are their mean."""
    folder, _, metrics = walked
    strides = strides_in(folder, metrics)
    checked = dict.fromkeys(KINDS, 0)
    for kind in KINDS:
        for key, found in metrics.walk.curves.of(kind).items():
            own, mean = strides[f"{kind}/{key}"], np.array(found.mean)
            assert own.shape[1] == 101
            size = np.abs(mean).max() + 5.0 * np.max(found.sd)
            assert np.abs(own.mean(axis=0) - mean).max() < 0.5 * size + 1e-6, key
            assert np.abs(own).max() > 0.5 * np.abs(mean).max(), key
            checked[kind] += 1
    assert min(checked.values()) >= 6


def test_without_plates_angles_that_are_not_compared_are_shown_as_they_came(run):
    _, subject, metrics = run
    shown = _recorded(metrics, subject, "angles", "knee_adduction_r")
    phase = np.linspace(0.0, 1.0, 101)
    came = np.degrees(subject.gait.angles["knee_adduction_r"].periodic()(phase))
    assert shown == pytest.approx(came)
    assert _recorded(metrics, subject, "moments", "knee_adduction_r") is None


def test_where_nothing_was_recorded_the_curve_beside_is_the_prediction(run, monkeypatch):
    folder, subject, metrics = run
    strides = strides_in(folder, metrics)

    def texts(name):
        return figures(metrics, subject, strides, ReportSettings())[0][name]()

    assert ">measured, right<" in texts("kinematics")
    monkeypatch.setattr(type(metrics), "is_recorded_at_all", False)
    drawn = texts("kinematics")
    assert ">measured" not in drawn
    assert ">predicted, right<" in drawn


def test_of_what_is_not_compared_the_strides_that_are_drawn_give_mean_and_deviation():
    """Of 1, 2 and 6 degrees: mean 3, SD (n - 1) the root of 7; a single stride has none."""
    metrics = read_metrics(BASELINE)
    strides = {"angles/knee_adduction_r": np.array([1.0, 2.0, 6.0])[:, None] * np.ones(101)}
    mean, deviation = _walked(metrics, strides, "angles", "knee_adduction_r")
    np.testing.assert_allclose(mean, 3.0)
    np.testing.assert_allclose(deviation, np.sqrt(7.0))
    one = {name: each[:1] for name, each in strides.items()}
    assert _walked(metrics, one, "angles", "knee_adduction_r")[1] is None


@pytest.mark.parametrize("extensor_positive", [False, True])
def test_moments_are_drawn_either_way_round_and_tables_keep_their_sign(walked, extensor_positive):
    """Knee extensor, hip extensor, plantarflexor and abductor up; power and angles as they are."""
    _, subject, metrics = walked
    looks = ReportSettings(extensor_positive=extensor_positive)
    draws, tables = figures(metrics, subject, {}, looks)
    assert tables == figures(metrics, subject, {}, ReportSettings())[1]
    titles = {
        "hip_flexion": ("Hip flexion", "Hip extension"),
        "hip_adduction": ("Hip adduction", "Hip abduction"),
        "knee_angle": ("Knee flexion", "Knee extension"),
        "ankle_angle": ("Ankle dorsiflexion", "Ankle plantarflexion"),
    }
    panels = {each.get_title(loc="left"): each for each in figure_of(draws["kinetics"]).axes}
    for name, each in titles.items():
        assert each[not extensor_positive] not in panels
        (line,) = lines(panels[each[extensor_positive]], COLOURS["right"], WALK_WIDTH)
        mean = np.array(metrics.walk.curves.moments[f"{name}_r"].mean)
        np.testing.assert_allclose(line[:, 1], -mean if extensor_positive else mean)
    power = np.array(metrics.walk.joint_power.power["ankle_angle_r"])
    (line,) = lines(panels["Ankle power"], COLOURS["right"], WALK_WIDTH)
    np.testing.assert_allclose(line[:, 1], power)
    angles = {each.get_title(loc="left") for each in figure_of(draws["kinematics"]).axes}
    assert {"Hip flexion", "Knee flexion", "Ankle dorsiflexion"} <= angles
