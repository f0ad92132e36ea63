"""Predictions without a model, on made-up people whose curves are known lines of speed."""

from dataclasses import fields

import numpy as np
import pytest

from gaitval.configuration import RecordSettings
from gaitval.gait.cycle_curves import Curves, recorded_curves
from gaitval.metrics.baselines import (
    anybody,
    change_added,
    line_of_trials,
    nearest_trial,
    others_line,
    predicted_parts,
    predictions,
    skill,
)
from gaitval.metrics.comparison import rms
from gaitval.metrics.curve_results import by_kind
from gaitval.metrics.origin import record_origins
from gaitval.subjects.prediction.population import with_others_kinetics
from gaitval.subjects.prediction.speed_line import dimensionless_speed
from gaitval.subjects.subject_file import builtin_subjects

SUBJECTS = builtin_subjects()


HEIGHTS = [
    {name: float(number) for number, name in enumerate(getattr(recorded, field.name), start=1)}
    for recorded in [recorded_curves(SUBJECTS[0].record())]
    for field in fields(Curves)
]
"""Of the lines of angles, moments and forces."""


def _lines(monkeypatch, at_of, bend: float = 0.0) -> None:
    """Curves of every record are lines of what `at_of` says of it, each at its own height, with a
    bend that no line has."""

    def curves(record):
        at = at_of(record)
        line = 3.0 * at + bend * at**2 + np.linspace(0.0, at, 101)
        return Curves(*({name: own + line for name, own in each.items()} for each in HEIGHTS))

    monkeypatch.setattr("gaitval.metrics.baselines.recorded_curves", curves)


def _straight(monkeypatch, bend: float = 0.0) -> None:
    """Lines of everybody's own speed."""
    speed = {each.record().stride_time: dimensionless_speed(each) for each in SUBJECTS}
    assert len(speed) == 10  # nobody is taken for another
    _lines(monkeypatch, lambda record: speed[record.stride_time], bend)


@pytest.mark.parametrize("person", SUBJECTS, ids=lambda person: person.identifier)
def test_curves_that_are_lines_of_speed_are_predicted_exactly(person, monkeypatch):
    _straight(monkeypatch)
    found = others_line(person, SUBJECTS)
    at = dimensionless_speed(person)
    expected = 1.0 + 3.0 * at + np.linspace(0.0, at, 101)
    assert found.people == 9
    np.testing.assert_allclose(found.curves.angles["hip_flexion_r"], expected, atol=1e-12)


def test_nobody_is_predicted_from_their_own_record(monkeypatch):
    """With a record of one's own among them, whatever it is, the prediction does not change."""
    before = others_line(SUBJECTS[0], SUBJECTS[1:])
    own = {"person": SUBJECTS[0].person, "trial": "T08"}
    again, renamed = (
        SUBJECTS[1].model_copy(update=own | {"identifier": name, "source": name})
        for name in ("S01", "mine")
    )
    after = others_line(SUBJECTS[0], [*SUBJECTS, again, renamed])
    np.testing.assert_array_equal(
        before.curves.forces["vertical_r"], after.curves.forces["vertical_r"]
    )


def test_the_prediction_is_least_squares(monkeypatch):
    _straight(monkeypatch, bend=3.0)
    found = others_line(SUBJECTS[2], SUBJECTS)
    speed = [dimensionless_speed(each) for each in SUBJECTS if each.identifier != "S03"]
    values = [1.0 + 3.0 * at + 3.0 * at**2 for at in speed]
    slope, start = np.polyfit(speed, values, 1)
    expected = start + slope * dimensionless_speed(SUBJECTS[2])
    assert found.curves.angles["hip_flexion_r"][0] == pytest.approx(expected)


def test_too_few_people_predict_nothing():
    assert others_line(SUBJECTS[0], SUBJECTS[:3]) is None
    assert others_line(SUBJECTS[0], SUBJECTS[:4]).people == 3


def test_the_built_in_people_are_about_as_predictable_as_was_found_before():
    """The founders' figures for the ten (another program, 0 to 99 %): 5.0, 1.37 and 1.13 % BW, of
    the records as measured."""
    errors = {name: [] for name in ("vertical", "forward", "medial")}
    measured = [person.model_copy(update={"plates": None}) for person in SUBJECTS]
    for person in measured:
        recorded = recorded_curves(person.record()).forces
        predicted = others_line(person, measured).curves.forces
        for name, found in errors.items():
            found += [
                100.0 * rms(predicted[f"{name}_{side}"] - recorded[f"{name}_{side}"])
                for side in "rl"
            ]
    means = [np.mean(found) for found in errors.values()]
    np.testing.assert_allclose(means, [5.0, 1.37, 1.13], rtol=0.02)


@pytest.mark.parametrize(
    ("error", "baseline", "expected"),
    [(0.0, 2.0, 1.0), (2.0, 2.0, 0.0), (3.0, 2.0, -0.5), (None, 2.0, None), (1.0, 0.0, None)],
)
def test_skill(error, baseline, expected):
    assert skill(error, baseline) == expected


# -- the person's own trials ----------------------------------------------------------------------

TRIED = next(each for each in SUBJECTS if len(each.trials) >= 2)


def trials_of(person):
    return [person.on_trial(trial.name) for trial in person.trials]


def test_the_nearest_trial_is_copied():
    nearest = min(
        trials_of(TRIED), key=lambda t: abs(t.walking_speed_m_s - TRIED.walking_speed_m_s)
    )
    found = nearest_trial(TRIED)
    assert (found.name, found.people) == ("nearest trial copied", 0)
    assert found.known == f"the person's {nearest.trial} at {nearest.walking_speed_m_s:g} m/s"
    expected = recorded_curves(nearest.record())
    for field in fields(Curves):
        for name, curve in getattr(expected, field.name).items():
            np.testing.assert_array_equal(getattr(found.curves, field.name)[name], curve)
    alone = TRIED.model_copy(update={"trials": ()})
    assert nearest_trial(alone) is None
    assert line_of_trials(alone) is None
    assert change_added(alone, SUBJECTS) is None


def test_a_line_through_two_trials_is_exact_on_a_line_of_speed(monkeypatch):
    _lines(monkeypatch, lambda record: record.speed)
    speed = TRIED.walking_speed_m_s
    found = line_of_trials(TRIED)
    near = sorted(trials_of(TRIED), key=lambda t: abs(t.walking_speed_m_s - speed))[:2]
    assert found.known == f"the person's {near[0].trial} and {near[1].trial}"
    assert (found.name, found.people) == ("line through two trials", 0)
    expected = HEIGHTS[1]["knee_angle_l"] + 3.0 * speed + np.linspace(0.0, speed, 101)
    np.testing.assert_allclose(found.curves.moments["knee_angle_l"], expected, atol=1e-9)
    same = TRIED.model_copy(update={"trials": (TRIED.trials[0], TRIED.trials[0])})
    assert line_of_trials(same) is None, "one speed has no line"
    near, far = TRIED.trials[:2]
    twice = near.model_copy(update={"name": "again"})
    three = TRIED.model_copy(update={"trials": (near, twice, far)})
    two = TRIED.model_copy(update={"trials": (near, far)})
    assert line_of_trials(three).known == line_of_trials(two).known, "a speed twice is one"
    one = TRIED.model_copy(update={"trials": TRIED.trials[:1]})
    assert line_of_trials(one) is None


def test_other_peoples_change_is_added_to_the_nearest_trial(monkeypatch):
    """Exact where everybody's curves are lines of dimensionless speed with the same slope, whatever
    the person's own level."""
    people = {
        each.record().stride_time: each
        for subject in SUBJECTS
        for each in (subject, *trials_of(subject))
    }

    def at(record):
        person = people[record.stride_time]
        own = 0.7 if person.is_person_of(TRIED) else 0.0
        return dimensionless_speed(person) + own

    _lines(monkeypatch, at)
    found = change_added(TRIED, SUBJECTS)
    others = [each for each in SUBJECTS if not TRIED.is_person_of(each)]
    assert (found.name, found.people) == ("other people's change added", len(others))
    assert found.known == nearest_trial(TRIED).known
    here = dimensionless_speed(TRIED)
    nearest = min(
        trials_of(TRIED), key=lambda t: abs(t.walking_speed_m_s - TRIED.walking_speed_m_s)
    )
    level = dimensionless_speed(nearest) + 0.7
    change = here - dimensionless_speed(nearest)
    at = level + change
    expected = HEIGHTS[0]["knee_angle_r"] + 3.0 * at + np.linspace(0.0, at, 101)
    np.testing.assert_allclose(found.curves.angles["knee_angle_r"], expected, atol=1e-9)
    assert change_added(TRIED, SUBJECTS[:2]) is None
    assert [each.name for each in predictions(TRIED, SUBJECTS)] == [
        "line through others", "expected of anybody", "nearest trial copied",
        "line through two trials", "other people's change added",
    ]  # fmt: skip
    alone = TRIED.model_copy(update={"trials": ()})
    names = [each.name for each in predictions(alone, SUBJECTS)]
    assert names == ["line through others", "expected of anybody"]
    assert not any(each.own for each in predictions(alone, SUBJECTS))


def test_what_is_expected_of_anybody_is_what_a_walk_told_angles_alone_is_given():
    found = anybody(TRIED, SUBJECTS)
    given = recorded_curves(with_others_kinetics(TRIED, SUBJECTS))
    assert found.curves.angles == {}
    for kind in ("moments", "forces"):
        for name, curve in getattr(given, kind).items():
            np.testing.assert_array_equal(getattr(found.curves, kind)[name], curve)
    assert anybody(TRIED, SUBJECTS[:2]) is None


def test_guesses_have_stance_and_steps_too():
    """Of the nearest trial those of its record; a line through two trials goes through both."""
    near, far = sorted(
        trials_of(TRIED), key=lambda t: abs(t.walking_speed_m_s - TRIED.walking_speed_m_s)
    )
    stance = [record.stance_fraction["right"] for record in (near.record(), far.record())]
    assert nearest_trial(TRIED).steps[0] == stance[0]
    share = (TRIED.walking_speed_m_s - near.walking_speed_m_s) / (
        far.walking_speed_m_s - near.walking_speed_m_s
    )
    expected = stance[0] + share * (stance[1] - stance[0])
    assert line_of_trials(TRIED).steps[0] == pytest.approx(expected)
    origins = record_origins(TRIED, RecordSettings())
    recorded = by_kind(recorded_curves(TRIED.record()))
    (_, _, copied, *_) = predicted_parts(TRIED, SUBJECTS, recorded, origins)
    away = 100.0 * abs(stance[0] - TRIED.record().stance_fraction["right"])
    assert copied.figures["stance_fraction_error"]["right"] == pytest.approx(away)
    assert copied.figures["speed_error"] == {"walk": 0.0}


def without_forces(trial):
    """A subject or trial as it would be with angles and times alone."""
    gait = trial.gait.model_copy(update={"moments": {}, "forces": None})
    return trial.model_copy(update={"gait": gait, "plates": None})


def test_trials_without_forces_predict_angles_alone():
    """A person whom cameras recorded at several speeds: nothing is made up, and nothing fails."""
    angles_only = tuple(without_forces(trial) for trial in TRIED.trials)
    for person in (TRIED, without_forces(TRIED)):
        of_cameras = person.model_copy(update={"trials": angles_only})
        found, full = (predictions(each, SUBJECTS) for each in (of_cameras, TRIED))
        assert [each.name for each in found] == [each.name for each in full]
        for mine, theirs in zip(found, full, strict=True):
            assert mine.known == theirs.known
            for name, curve in theirs.curves.angles.items():
                np.testing.assert_array_equal(mine.curves.angles[name], curve)
        assert [bool(each.curves.moments) for each in found] == [True, True, False, False, False]
    of_cameras = TRIED.model_copy(update={"trials": angles_only})
    recorded = by_kind(recorded_curves(TRIED.record()))
    origins = record_origins(TRIED, RecordSettings())
    nearest = predicted_parts(of_cameras, SUBJECTS, recorded, origins)[2].rmse
    assert nearest.angles["knee_angle_r"] > 0.0
    assert set(nearest.forces) == set(recorded["forces"])
    assert {*nearest.moments.values(), *nearest.forces.values()} == {None}


def test_a_trial_with_forces_is_copied_before_a_nearer_one_without():
    """Else moments and forces would be compared with no trial at all."""
    near, far = sorted(
        TRIED.trials, key=lambda t: abs(t.walking_speed_m_s - TRIED.walking_speed_m_s)
    )
    mixed = TRIED.model_copy(update={"trials": (without_forces(near), far)})
    assert nearest_trial(mixed).known.startswith(f"the person's {far.name} ")
    assert nearest_trial(without_forces(mixed)).known.startswith(f"the person's {near.name} ")
    # the angles of both, and no moments of only one of them
    assert line_of_trials(mixed) is None
    assert not line_of_trials(without_forces(mixed)).curves.moments
