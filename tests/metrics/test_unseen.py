"""Trials at the same speed that were held out."""

import numpy as np
import pytest

from gaitval.datasets.subject_file import load_subject
from gaitval.gait.cycle_curves import recorded_curves
from gaitval.metrics.recorded import by_kind
from gaitval.metrics.repetitions import repetitions
from gaitval.metrics.results import WalkedCurves
from gaitval.metrics.typed import numbers
from gaitval.metrics.unseen import unseen
from gaitval.metrics.walk_results import MeanCurve
from gaitval.metrics.walk_statistics import multiple_correlation

PERSON = load_subject("S05")
T = np.linspace(0.0, 2.0 * np.pi, 101)


def test_equal_curves_are_perfectly_correlated_and_noise_is_not():
    curve = np.sin(T)
    assert multiple_correlation([curve, curve]) == 1.0
    assert multiple_correlation([curve, -curve]) is None
    assert multiple_correlation([0.0 * T, 0.0 * T]) is None
    noise = 0.1 * np.random.default_rng(0).standard_normal((2, 101))
    assert 0.97 < multiple_correlation(curve + noise) < 1.0


def test_it_is_kadabas_formula():
    """Written out for three curves: Kadaba 1989, equation of the within-day coefficient."""
    y = np.random.default_rng(1).standard_normal((3, 101)) * 0.3 + np.cos(T)
    within = sum((y[j, t] - y[:, t].mean()) ** 2 for j in range(3) for t in range(101)) / (101 * 2)
    total = sum((y[j, t] - y.mean()) ** 2 for j in range(3) for t in range(101)) / (303 - 1)
    assert multiple_correlation(y) == pytest.approx(np.sqrt(1 - within / total))


def test_only_trials_at_the_same_speed_are_repetitions():
    assert repetitions(PERSON) == []
    (trial, other) = PERSON.trials
    same = trial.model_copy(update={"walking_speed_m_s": 1.01 * PERSON.walking_speed_m_s})
    person = PERSON.model_copy(update={"trials": (same, other)})
    assert [each.trial for each in repetitions(person)] == ["T03"]


def test_a_walk_like_the_told_trial_is_as_far_from_the_other_as_the_trials_are():
    (trial, _) = PERSON.trials
    same = trial.model_copy(update={"walking_speed_m_s": PERSON.walking_speed_m_s})
    person = PERSON.model_copy(update={"trials": (same,)})
    own = by_kind(recorded_curves(person.record()))
    walked = WalkedCurves(
        **{
            kind: {name: MeanCurve(mean=numbers(curve), sd=None) for name, curve in curves.items()}
            for kind, curves in own.items()
        }
    )
    (found,) = unseen(person, walked)
    row = found.as_dict()
    assert row["trial"] == "T03"
    for kind in ("angles", "moments", "forces"):
        assert row["rmse"][kind] == pytest.approx(row["between"][kind])
    assert 0.9 < row["multiple_correlation"]["angles"]["knee_angle_r"] < 1.0
