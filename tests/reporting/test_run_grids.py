"""The figures of curves of a run."""

import numpy as np
import pytest
from report_run import build_run

from gaitval.datasets.subject_file import load_subject
from gaitval.metrics.results import read_metrics
from gaitval.reporting.figures import centre_of_mass
from gaitval.reporting.run_grids import _recorded, figures, strides_of


@pytest.fixture(scope="module")
def run(tmp_path_factory):
    """Of a person without plates."""
    folder = tmp_path_factory.mktemp("run")
    build_run(folder, not_recorded="expected")
    subject = load_subject(folder / "subject.toml")
    assert not subject.has_kinetics
    return folder, subject, read_metrics(folder)


def test_without_plates_every_figure_is_there(run):
    folder, subject, metrics = run
    draws, tables = figures(metrics, subject, strides_of(folder, metrics))
    assert draws.keys() == {"curves", "kinematics", "kinetics", "forces"}
    assert "<svg" in draws["kinematics"]()
    assert all(tables.values())


def test_without_plates_angles_that_are_not_compared_are_shown_as_they_came(run):
    _, subject, metrics = run
    shown = _recorded(metrics, subject, "angles", "knee_adduction_r")
    phase = np.linspace(0.0, 1.0, 101)
    came = np.degrees(subject.gait.angles["knee_adduction_r"].periodic()(phase))
    assert shown == pytest.approx(came)
    assert _recorded(metrics, subject, "moments", "knee_adduction_r") is None


def test_where_nothing_was_recorded_the_curve_beside_is_the_prediction(run, monkeypatch):
    folder, subject, metrics = run
    strides = strides_of(folder, metrics)

    def texts(name):
        return figures(metrics, subject, strides)[0][name]() + centre_of_mass(metrics)

    assert texts("kinematics").count("<!-- record -->") == 1  # of the centre of mass
    assert "<!-- record, right -->" in texts("kinematics")
    monkeypatch.setattr(type(metrics), "is_recorded_at_all", False)
    drawn = texts("kinematics")
    assert "<!-- record" not in drawn
    assert "<!-- prediction -->" in drawn
    assert "<!-- prediction, right -->" in drawn
