"""Of the ten stored walks no curve is accepted that a prediction without a model is nearer to."""

from pathlib import Path

import numpy as np
import pytest

from gaitval.metrics.curve_results import OF_SKILL, RMSE
from gaitval.metrics.results import read_metrics
from gaitval.metrics.tolerances import load_registry
from gaitval.subjects.subject_file import builtin_subjects, load_subject

REPORTS = Path(__file__).parents[2] / "reports"
STORED = {
    each.identifier: read_metrics(REPORTS / each.identifier / "baseline")
    for each in builtin_subjects()
}
OWN = {each.id: each for each in load_registry().tolerance
       if each.measure in RMSE.values() and each.citation == "gaitval"}  # fmt: skip


@pytest.mark.parametrize("name", STORED)
def test_no_accepted_curve_is_farther_than_a_prediction(name):
    """Each error of a prediction is worked out again, but for the free hips."""
    metrics = STORED[name]
    rows = [row for row in metrics.tolerances if row.measure in OF_SKILL]
    assert len(rows) == 32
    for row in rows:
        kind = OF_SKILL[row.measure]
        walk = metrics.walk.errors.of(kind)[row.target].rmse
        others = [
            guess.about_nearest_hips.get(row.target, error) if kind == "moments" else error
            for guess in metrics.predictions
            if (error := guess.rmse.of(kind)[row.target]) is not None
        ]
        assert row.passed == (walk < min(others)), row.target
        assert row.value == pytest.approx(1.0 - walk / min(others), abs=2e-4)


def test_a_line_through_two_own_trials_is_among_the_predictions():
    """By hand: knee of S05, whose two other trials are on either side of the walk's speed."""
    person, metrics = load_subject("S05"), STORED["S05"]
    trials = [person.on_trial(trial.name) for trial in person.trials]
    speeds = np.array([trial.walking_speed_m_s for trial in trials])
    phase = np.linspace(0.0, 1.0, 101)
    knees = [np.degrees(trial.record().angles["knee_angle_r"](phase)) for trial in trials]
    share = (person.walking_speed_m_s - speeds[0]) / (speeds[1] - speeds[0])
    line = (1.0 - share) * knees[0] + share * knees[1]
    error = np.sqrt(np.mean((line - np.array(metrics.record.curves.angles["knee_angle_r"])) ** 2))
    found = {guess.name: guess.rmse.angles["knee_angle_r"] for guess in metrics.predictions}
    assert found["line through two trials"] == pytest.approx(error, abs=2e-3)


@pytest.mark.parametrize("name", OWN)
def test_a_limit_decides_only_if_a_prediction_misses_it_more_often_than_not(name):
    rows = [row for metrics in STORED.values() for row in metrics.tolerances if row.id == name]
    met = sum(bool(row.guess_within) for row in rows) / len(rows)
    assert (OWN[name].role == "acceptance") == (met <= 0.5), f"{name}: met in {100 * met:.0f} %"
