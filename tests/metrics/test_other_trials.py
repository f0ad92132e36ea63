"""Trials that are held out, at other speeds and at the same: whose they are, and their errors."""

from itertools import combinations, product

import numpy as np
import pytest
from ankle_gaits import ankles

from gaitval.configuration import RecordSettings
from gaitval.gait.cycle_curves import recorded_curves
from gaitval.metrics.baselines import GROUPS
from gaitval.metrics.comparison import multiple_correlation, rms
from gaitval.metrics.curve_results import MeanCurve, by_kind
from gaitval.metrics.other_trials import (
    FAR,
    beyond,
    half_widths,
    held_out_trials,
    predicted_curves,
    prediction_errors,
    repetitions,
    unseen,
)
from gaitval.metrics.results import WalkedCurves
from gaitval.metrics.typed import numbers, sided
from gaitval.subjects.prediction.known import known_record
from gaitval.subjects.prediction.population import change_with_speed
from gaitval.subjects.prediction.speed import SPEED, _moved
from gaitval.subjects.subject_file import builtin_subjects, load_subject


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
    person = with_trials(people, 2)
    found = prediction_errors(person, RecordSettings(), people)
    rows = expected(person, people)
    assert found is not None
    assert (found.own, found.people, found.trials) == (True, 1, len(rows))
    for group in found.groups:
        values = [row[group.group] for row in rows]
        assert group.mean == pytest.approx(np.mean(values))
        assert group.sd == pytest.approx(np.std(values, ddof=1))


def test_two_trials_are_one_difference(people):
    """Each is predicted from the other by the same change, so both errors are one number: it has no
    spread, and is no reason to prefer a person's own trials to other people's.
    """
    person = with_trials(people, 1, 1)
    rows = expected(person, people)
    assert rows[0]["sagittal angles"] == pytest.approx(rows[1]["sagittal angles"], rel=1e-6)
    # without other people's errors it is all that is known
    rest = [each for each in people if not each.trials]
    alone = prediction_errors(person, RecordSettings(), rest)
    assert (alone.trials, alone.own) == (1, True)
    assert all(group.sd is None for group in alone.groups)
    among = prediction_errors(person, RecordSettings(), people)
    assert not among.own
    # the pairs of two people and three trials of a third
    assert (among.trials, among.people) == (5, 3)
    assert all(group.sd > 0.05 * group.mean for group in among.groups)


def test_a_trial_is_not_predicted_from_its_own_repetition(people):
    """Two walks at one speed are alike, which says nothing about another speed: each trial is
    predicted as if it had been walked once, and both errors count as one.
    """
    person = with_trials(people, 2)
    first = person.trials[0]
    again = first.model_copy(
        update={"name": "again", "walking_speed_m_s": 1.01 * first.walking_speed_m_s}
    )
    twice = person.model_copy(update={"trials": (*person.trials, again)})
    rows = expected(person, people)
    found = prediction_errors(twice, RecordSettings(), people)
    assert found.trials == len(rows)
    once = np.mean([row["sagittal angles"] for row in rows])
    assert found.groups[0].mean == pytest.approx(once, rel=0.05)


def test_of_somebody_with_one_trial_the_others_are_held_out(people):
    """Those who can be: each by their own other trials."""
    several = [each for each in people if each.trials]
    alone = with_trials(people, 1).model_copy(update={"trials": ()})
    found = prediction_errors(alone, RecordSettings(), several)
    assert found is not None
    assert not found.own
    assert found.people == len(several)
    counts = [1 + len(each.trials) for each in several]
    assert found.trials == sum(1 if count == 2 else count for count in counts)


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


def share_inside(width, error):
    """Of the points where something is predicted: forces are zero in swing."""
    says = width > 1e-3 * width.max()
    return np.mean(np.abs(error[says]) <= width[says])


def test_bands_hold_what_they_say_of_every_trial_that_is_held_out(people):
    """Each by the band of all the others, near and far in speed. A band of half the width would
    hold half of them.
    """
    rows = list(held_out_trials(people, RecordSettings()))
    near, far, narrow = [], [], []
    for row in rows:
        others = [each for each in rows if each.independent != row.independent]
        widths = half_widths(others, row.away)
        of = near if row.away < 0.1 else far
        for (kind, name), error in row.errors.items():
            of.append(share_inside(widths[kind, name[:-2]], error))
            narrow.append(share_inside(0.5 * widths[kind, name[:-2]], error))
    assert {len(near), len(far)} == {2 * 32, 5 * 32}
    assert 0.80 < np.mean(near) < 0.97
    assert 0.80 < np.mean(far) < 0.97
    assert 0.85 < np.mean([*near, *far]) < 0.95
    assert np.mean(narrow) < 0.8


@pytest.mark.slow
def test_bands_of_the_ankle_hold_thirty_people_who_have_no_part_in_them(gait_data, people):
    """Known at one to three speeds and predicted at another; and how their errors grow with the
    distance is what the bands suppose.
    """
    rows = list(held_out_trials(people, RecordSettings()))
    here = half_widths(rows, 0.0)
    places = {"angles": np.degrees(1.0), "moments": 1.0}
    walked = ankles(gait_data)
    inside = {kind: [] for kind in places}
    squares = {kind: [] for kind in places}
    distances = []
    for i, person in enumerate(walked):
        change = change_with_speed([*walked[:i], *walked[i + 1 :]])
        for held, count in product(range(len(person)), (1, 2, 3)):
            rest, wanted = [*person[:held], *person[held + 1 :]], person[held]
            for own in combinations(rest, count):
                if min(abs(wanted.speed / each.speed - 1.0) for each in own) > SPEED.largest_change:
                    continue
                away = min(abs(wanted.speed - each.speed) for each in own)
                there = _moved(list(own), wanted.speed, change)
                distances.append(away)
                for kind, unit in places.items():
                    error = unit * (getattr(there, kind)[0] - getattr(wanted, kind)[0])
                    squares[kind].append(np.mean(error**2))
                    width = here[kind, "ankle_angle"][:-1] * np.sqrt(1.0 + (away / FAR) ** 2)
                    inside[kind].append(np.mean(np.abs(error) <= width))
    for kind in places:
        assert 0.80 < np.mean(inside[kind]) < 0.97, kind
        design = np.column_stack([np.ones(len(distances)), np.square(distances)])
        near, growth = np.linalg.lstsq(design, np.array(squares[kind]), rcond=None)[0]
        assert 0.75 * FAR < np.sqrt(near / growth) < 1.3 * FAR


def test_the_band_is_wider_the_further_the_speed_is(people):
    person = load_subject("S05")
    near, far = (
        predicted_curves(person, RecordSettings(speed=speed), people) for speed in (1.10, 0.60)
    )
    assert near.band.share == 0.9
    assert (near.band.trials, near.band.people) == (5, 3)
    assert near.band.away < far.band.away
    for kind, name, curve in near.curves.items():
        assert len(curve) == 101
        here, there = (np.array(each.band.half_width.of(kind)[name]) for each in (near, far))
        ratio = np.sqrt((1 + (far.band.away / FAR) ** 2) / (1 + (near.band.away / FAR) ** 2))
        np.testing.assert_allclose(there, ratio * here, atol=1e-9)


def test_what_is_held_out_has_no_part_in_its_curves_and_band(people):
    """Neither through the person nor through what others are compared with."""
    person = load_subject("S05")
    settings = RecordSettings(holdout="T03")
    slow = next(trial for trial in person.trials if trial.name == "T03")
    other = person.trials[1].model_copy(
        update={"name": slow.name, "walking_speed_m_s": slow.walking_speed_m_s}
    )
    trials = tuple(other if each is slow else each for each in person.trials)
    swapped = person.model_copy(update={"trials": trials})
    assert predicted_curves(person, settings, people) == predicted_curves(
        swapped, settings, [swapped if each.is_person_of(person) else each for each in people]
    )


def test_without_trials_of_anybody_there_is_no_band(people):
    alone = load_subject("S02")
    assert predicted_curves(alone, RecordSettings(speed=1.3), [alone, *people[5:]]).band is None


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
