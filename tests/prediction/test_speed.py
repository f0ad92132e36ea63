"""A person's gait at another speed."""

import csv
from dataclasses import replace

import numpy as np
import pytest

from gaitval.configuration import RecordSettings
from gaitval.constants import GRAVITY
from gaitval.errors import SubjectError
from gaitval.gait.cycle_curves import recorded_curves
from gaitval.gait.record import HARMONICS, REQUIRED_MOMENTS, periodic_through
from gaitval.metrics.comparison import rms
from gaitval.subjects.prediction.known import known_record
from gaitval.subjects.prediction.normal_form import normal_form, symmetric
from gaitval.subjects.prediction.population import (
    change_with_speed,
    expected,
    gaits_of,
    other_people,
)
from gaitval.subjects.prediction.speed import (
    SPEED,
    _by_all_trials,
    at_speed,
    trials_known,
)
from gaitval.subjects.subject_file import builtin_subjects, load_subject

SUBJECTS = builtin_subjects()
HELD_OUT = [("S05", "T03"), ("S05", "T06"), ("S01", "T03"), ("S04", "T02")]
PHASE = np.arange(100) / 100
SAGITTAL = [
    f"{name}_{side}" for name in ("hip_flexion", "knee_angle", "ankle_angle") for side in "rl"
]


def predicted(name, trial):
    return known_record(load_subject(name), RecordSettings(holdout=trial), SUBJECTS).record


def test_at_a_speed_that_was_recorded_it_is_that_record():
    person = load_subject("S05")
    records = [trial.record() for trial in trials_known(person)]
    for record in records:
        found = at_speed(person, records, record.speed, SUBJECTS)
        np.testing.assert_allclose(
            found.angles["knee_angle_r"](PHASE), record.angles["knee_angle_r"](PHASE), atol=1e-3
        )
        assert found.stride_time == pytest.approx(record.stride_time)
        name = "hip_adduction_l"
        np.testing.assert_allclose(
            found.moments[name](PHASE), record.moments[name](PHASE), atol=1e-3
        )


def test_between_two_trials_it_is_their_straight_line():
    person = load_subject("S05")
    slow, fast = (person.on_trial(name).record() for name in ("T03", "T05"))
    found = at_speed(person, [slow, fast], 0.5 * (slow.speed + fast.speed), SUBJECTS)
    middle = 0.5 * (slow.moments["ankle_angle_l"](PHASE) + fast.moments["ankle_angle_l"](PHASE))
    np.testing.assert_allclose(found.moments["ankle_angle_l"](PHASE), middle, atol=0.02)
    assert slow.stride_time > found.stride_time > fast.stride_time


@pytest.mark.parametrize(("name", "trial"), HELD_OUT)
def test_a_held_out_trial_is_predicted_better_than_by_copying(name, trial):
    """Of a change of a third of the speed; over 15 % a copy is hard to beat, but not worse."""
    person = load_subject(name)
    found = recorded_curves(predicted(name, trial))
    truth = recorded_curves(person.on_trial(trial).record())
    copy = recorded_curves(trials_known(person, trial)[0].record())

    def error(curves, kind, names):
        return np.mean([rms(getattr(curves, kind)[n] - getattr(truth, kind)[n]) for n in names])

    forces = [f"{n}_{side}" for n in ("vertical", "forward") for side in "rl"]
    for kind, names, share in (
        ("angles", SAGITTAL, 0.9),
        ("moments", SAGITTAL, 0.85),
        ("forces", forces, 0.6),
    ):
        bound = share if trial != "T06" else 1.0
        assert error(found, kind, names) < bound * error(copy, kind, names), kind


def test_a_faster_walk_has_shorter_strides_in_time_and_larger_forces():
    person = load_subject("S02")
    record = person.record()
    fast = at_speed(person, [record], 1.2 * record.speed, SUBJECTS)
    assert fast.speed == pytest.approx(1.2 * record.speed)
    assert fast.stride_time == pytest.approx(record.stride_time * 1.2**SPEED.stride_time_exponent)
    peak = [r.ground_reaction("right", PHASE)[:, 2].max() for r in (record, fast)]
    assert peak[1] > peak[0]


@pytest.mark.parametrize("speed", [0.2, 2.4])
def test_a_speed_far_from_every_trial_is_refused_unless_forced(speed):
    person = load_subject("S05")
    settings = RecordSettings(speed=speed)
    with pytest.raises(SubjectError, match=r"from the nearest speed that was walked .*--force"):
        known_record(person, settings, SUBJECTS)
    assert known_record(person, settings, SUBJECTS, forced=True).record.speed == speed


def test_the_only_trial_and_an_unknown_one_cannot_be_held_out():
    with pytest.raises(SubjectError, match="T06 is the only trial"):
        trials_known(load_subject("S02"), "T06")
    with pytest.raises(SubjectError, match=r"no trial 'T09'\. It has T05, T03, T06"):
        trials_known(load_subject("S05"), "T09")


def test_the_exponent_of_stride_time_is_that_of_the_published_people(gait_data):
    people: dict[str, list[tuple[float, float]]] = {}
    with (gait_data / "wbds" / "h2a_allspeeds_43subs.csv").open(encoding="utf-8") as file:
        for row in csv.DictReader(file):
            point = np.log(float(row["Speed"])), np.log(120.0 / float(row["Cadence"]))
            people.setdefault(row["Subject"], []).append(point)
    slopes = [
        np.polyfit(*np.array(points).T, 1)[0] for points in people.values() if len(points) > 2
    ]
    assert len(slopes) == 43
    assert np.mean(slopes) == pytest.approx(SPEED.stride_time_exponent, abs=0.005)
    assert np.std(slopes, ddof=1) == pytest.approx(0.08, abs=0.005)


@pytest.mark.slow
@pytest.mark.parametrize("name", ["S01", "S05", "S06"])
def test_far_slower_the_steps_do_not_become_ever_longer(name):
    """A power of speed would have given S01 a stride of 2.7 s at 0.3 m/s; others take 1.5."""
    person = load_subject(name)
    records = [trial.record() for trial in trials_known(person)]
    slowest = min(record.speed for record in records)
    speeds = np.linspace(0.95 * slowest, 0.3, 12)
    times = [
        at_speed(person, records, speed, SUBJECTS, forced=True).stride_time for speed in speeds
    ]
    assert max(times) < 2.0
    assert max(np.abs(np.diff(times))) < 0.25  # it passes from one to the other


def test_far_slower_a_person_differs_from_others_as_before():
    person = load_subject("S04")
    records = [trial.record() for trial in trials_known(person)]
    slowest = min(records, key=lambda record: record.speed)
    people = other_people(person, SUBJECTS)
    legs = person.leg_length_m
    speed = 0.4 * slowest.speed
    found = normal_form(at_speed(person, records, speed, SUBJECTS, forced=True), legs)
    now, before = (
        symmetric(expected(people, each / np.sqrt(GRAVITY * legs)))
        for each in (speed, slowest.speed)
    )
    own = normal_form(slowest, legs)
    np.testing.assert_allclose(found.angles - now.angles, own.angles - before.angles, atol=5e-3)
    assert found.stride_time / now.stride_time == pytest.approx(
        own.stride_time / before.stride_time
    )


def test_two_trials_at_one_speed_are_as_their_mean():
    """They say nothing of the change with speed; a laboratory repeats a trial on a belt."""
    person = load_subject("S05")
    slow, own = (person.on_trial(name).record() for name in ("T03", "T05"))
    again = replace(person.on_trial("T06").record(), speed=own.speed + 0.001)
    found = at_speed(person, [slow, own, again], 1.2, SUBJECTS)
    assert np.isfinite([found.stride_time, *found.angles["knee_angle_r"](PHASE)]).all()
    here = at_speed(person, [own, again], own.speed, SUBJECTS)
    for name in SAGITTAL:
        mean = 0.5 * (own.angles[name](PHASE) + again.angles[name](PHASE))
        np.testing.assert_allclose(here.angles[name](PHASE), mean, atol=2e-3)


def test_what_is_a_trials_own_in_the_hip_adduction_moment_is_divided_by_the_trials():
    """Less of a ripple of one of two trials than a half reaches another speed, because people
    differ less in ripples than trials do, and its own speed by the whole; that of a hip flexion
    moment comes from the trial that is copied.
    """
    subject = load_subject("S05")
    trials = [each.record() for each in trials_known(subject, "T05")]
    near = max(trials, key=lambda each: each.speed)
    for name, least, most in (("hip_adduction_r", 0.0, 0.4), ("hip_flexion_r", 0.8, 1.2)):
        rippled = replace(near, moments=near.moments | {name: _rippled(near.moments[name])})
        others = [each for each in trials if each is not near]
        for speed, shares in ((1.15 * near.speed, (least, most)), (near.speed, (0.8, 1.2))):
            one, other = (
                at_speed(subject, [*others, each], speed, builtin_subjects()).moments[name]
                for each in (near, rippled)
            )
            ripple = (other(PHASE) - one(PHASE)) @ np.cos(20 * np.pi * PHASE) / 50.0
            assert shares[0] <= ripple / 0.1 <= shares[1]


def test_a_plate_that_ripples_does_not_move_the_prediction_from_another_trial():
    """S05's right plate ripples at 10 Hz in T05 alone, and no other of 28 feet in 14 recordings
    does. With T05 the right hip of T06 is predicted hardly worse than from T03 by itself.
    """
    person = load_subject("S05")
    slow, rippling, held = (
        normal_form(person.on_trial(name).record(), person.leg_length_m)
        for name in ("T03", "T05", "T06")
    )
    people, row = other_people(person, SUBJECTS), REQUIRED_MOMENTS.index("hip_adduction_r")
    both, alone = (
        rms((_by_all_trials(known, held.speed, people) - held.moments)[row])
        for known in ([slow, rippling], [slow])
    )
    assert both < 1.1 * alone


@pytest.mark.parametrize("name", ["S01", "S04", "S05"])
def test_the_hip_adduction_moment_is_nearer_by_all_trials_and_other_people(name):
    """Than the mean of what each of the person's trials says with others' change alone, and than
    what is expected of anybody; over all trials that can be held out.
    """
    person = load_subject(name)
    own = gaits_of(person)
    people = other_people(person, SUBJECTS)
    rows = [REQUIRED_MOMENTS.index(f"hip_adduction_{side}") for side in "rl"]
    change = SPEED.trust * change_with_speed(people).moments
    errors = []
    for held in own:
        known = [each for each in own if each is not held]
        moved = [each.moments + (held.speed - each.speed) * change for each in known]
        guesses = (
            _by_all_trials(known, held.speed, people),
            np.mean(moved, axis=0),
            symmetric(expected(people, held.speed)).moments,
        )
        errors.append([np.mean([rms(g[r] - held.moments[r]) for r in rows]) for g in guesses])
    ours, mean, anybody = np.mean(errors, axis=0)
    assert ours < 1.01 * mean
    assert ours < 0.8 * anybody


def _rippled(moment):
    return periodic_through(
        moment(PHASE) + 0.1 * np.cos(20 * np.pi * PHASE), HARMONICS.harmonics_cap
    )
