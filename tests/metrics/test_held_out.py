"""Errors of predictions of trials that are held out: whose trials, and their means."""

import numpy as np
import pytest

from gaitval.configuration import RecordSettings
from gaitval.datasets.subject_file import builtin_subjects, load_subject
from gaitval.gait.cycle_curves import recorded_curves
from gaitval.metrics.comparison import rms
from gaitval.metrics.groups import GROUPS
from gaitval.metrics.held_out import beyond, prediction_errors
from gaitval.metrics.recorded import by_kind
from gaitval.metrics.typed import sided
from gaitval.prediction.known import known_record


@pytest.fixture(scope="module")
def people():
    return builtin_subjects()


def with_trials(people, fewest, most=99):
    return next(each for each in people if fewest <= len(each.trials) <= most)


def expected(person, people):
    """Of each trial, by its definition: RMS of each recorded curve, mean over those of a group."""
    rows = []
    for name in (person.trial, *(trial.name for trial in person.trials)):
        guess = known_record(person, RecordSettings(holdout=name), people, forced=True).record
        predicted = by_kind(recorded_curves(guess))
        recorded = by_kind(recorded_curves(person.on_trial(name).record()))
        rows.append(
            {
                group: np.mean(
                    [rms(predicted[kind][each] - recorded[kind][each]) for each in sided(names)]
                )
                for group, (kind, names) in GROUPS.items()
            }
        )
    return rows


def test_the_persons_own_trials_are_held_out_one_by_one(people):
    person = with_trials(people, 1)
    found = prediction_errors(person, RecordSettings(), people)
    rows = expected(person, people)
    assert found is not None
    assert (found.own, found.people, found.trials) == (True, 1, len(rows))
    for group in found.groups:
        values = [row[group.group] for row in rows]
        assert group.mean == pytest.approx(np.mean(values))
        assert group.sd == pytest.approx(np.std(values, ddof=1))


def test_a_trial_is_not_predicted_from_its_own_repetition(people):
    """Two walks at one speed are alike, which says nothing about another speed: each trial is
    predicted as if it had been walked once.
    """
    person = with_trials(people, 2)
    first = person.trials[0]
    again = first.model_copy(
        update={"name": "again", "walking_speed_m_s": 1.01 * first.walking_speed_m_s}
    )
    twice = person.model_copy(update={"trials": (*person.trials, again)})
    rows = expected(person, people)
    found = prediction_errors(twice, RecordSettings(), people)
    assert found.trials == len(rows) + 1
    # the trial and its copy, predicted from the others: nearly the same error twice
    assert found.groups[0].mean >= 0.9 * np.mean([row["sagittal angles"] for row in rows])


def test_of_somebody_with_one_trial_the_others_are_held_out(people):
    """Those who can be: each by their own other trials."""
    several = [each for each in people if each.trials][:2]
    alone = with_trials(people, 1).model_copy(update={"trials": ()})
    found = prediction_errors(alone, RecordSettings(), several)
    assert found is not None
    assert not found.own
    assert found.people == len(several)
    assert found.trials == sum(1 + len(each.trials) for each in several)


def test_without_anybody_there_is_no_error(people):
    alone = with_trials(people, 1).model_copy(update={"trials": ()})
    assert prediction_errors(alone, RecordSettings(), []) is None


def test_trials_without_kinetics_do_not_count(people, monkeypatch):
    person = with_trials(people, 1)
    monkeypatch.setattr(type(person), "has_kinetics", property(lambda self: False))
    assert prediction_errors(person, RecordSettings(), []) is None


def test_far_beyond_the_trials_only_trials_as_far_count(people):
    person = load_subject("S05")  # 0.78, 1.12 and 1.29 m/s
    between = prediction_errors(person, RecordSettings(speed=0.95), people)
    near = prediction_errors(person, RecordSettings(speed=1.35), people)
    far = prediction_errors(person, RecordSettings(speed=1.6), people)
    assert (between.trials, between.own) == (3, True)
    assert (near.trials, near.own) == (2, True)  # 15 and 30 % beyond the others
    assert near.groups[0].mean > between.groups[0].mean
    assert not far.own  # 24 % beyond: one of hers is no more than chance
    assert prediction_errors(person, RecordSettings(speed=1.93), people) is None


@pytest.mark.parametrize(
    ("speed", "known", "expected"),
    [(1.0, [0.8, 1.2], 0.0), (0.6, [0.8, 1.2], 0.25), (1.5, [0.8, 1.2], 0.25), (1.1, [1.0], 0.1)],
)
def test_how_far_a_speed_is_beyond_those_known(speed, known, expected):
    assert beyond(speed, known) == pytest.approx(expected)
