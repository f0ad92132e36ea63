"""A person's gait at another speed."""

import csv
from dataclasses import replace
from itertools import combinations

import numpy as np
import pytest
from ankle_gaits import ankles

from gaitval.configuration import RecordSettings
from gaitval.constants import GRAVITY
from gaitval.datasets.subject_file import builtin_subjects, load_subject
from gaitval.errors import SubjectError
from gaitval.gait.cycle_curves import recorded_curves
from gaitval.gait.record import HARMONICS, REQUIRED_MOMENTS, periodic_through
from gaitval.metrics.comparison import rms
from gaitval.prediction import speed as speed_module
from gaitval.prediction.known import known_record
from gaitval.prediction.normal_form import normal_form, symmetric
from gaitval.prediction.population import change_with_speed, expected, gaits_of, other_people
from gaitval.prediction.speed import (
    SPEED,
    _beyond,
    _by_all_trials,
    _moved,
    _own_shares,
    _variances,
    _weights,
    at_speed,
    trials_known,
)

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


def test_a_harmonic_counts_by_how_much_people_differ_in_it_and_their_trials_do():
    """Made-up people who differ by 0.3 in the second harmonic, and by 0.2 in the third, in which
    their trials differ by as much; trials alone differ in the fourth.
    """
    random, cycle = np.random.default_rng(3), 2.0 * np.pi * PHASE
    base = normal_form(SUBJECTS[4].record(), SUBJECTS[4].leg_length_m)

    def trial(second, third, speed):
        own = np.array([[second], [third + random.normal(0.0, 0.2)], [random.normal(0.0, 0.2)]])
        wave = own * np.cos(np.outer([2, 3, 4], cycle))
        return replace(base, speed=speed, moments=0.0 * base.moments + wave.sum(axis=0))

    people = []
    for _ in range(60):
        own = random.normal(0.0, [0.3, 0.2])
        people.append([trial(*own, 0.4), trial(*own, 0.5)])
    for trials in (1, 3):
        share = _own_shares(_variances(people), np.ones((trials, 8, 1)))
        np.testing.assert_allclose(share[:, 2], 1.0, atol=0.01)
        np.testing.assert_allclose(share[:, 3], trials / (trials + 1.0), atol=0.15)
        np.testing.assert_allclose(share[:, 4], 0.0, atol=0.25)
    assert _variances([person[:1] for person in people]) is None


def test_a_trial_whose_moment_ripples_says_less(gait_data):
    """The ankle's moment of people of whom two trials are known beside what is expected of anybody:
    where one of the two ripples three times as much as the other, it is nearer by a twentieth or
    more than when both count alike, and no further over all pairs.
    """
    people = [
        [replace(gait, moments=np.tile(gait.moments[:4], (2, 1))) for gait in person]
        for person in ankles(gait_data)
    ]
    rows = []
    for person in people[::3]:
        others = [each for each in people if each is not person]
        variances, trials = _variances(others), np.fft.rfft(_beyond(person, others))
        for held in range(len(person)):
            for pair in combinations([k for k in range(len(person)) if k != held], 2):
                known = trials[list(pair)]
                errors = []
                for weights in (_weights(known, variances.of_trial), np.ones((2, 8, 1))):
                    mean = np.sum(weights * known, axis=0) / weights.sum(axis=0)
                    said = _own_shares(variances, weights) * mean
                    errors.append(np.linalg.norm((said - trials[held])[0]))
                ripples = np.linalg.norm(known[:, 0, SPEED.ripples_from :], axis=-1) ** 2
                rows.append((*errors, max(ripples) > 3.0 * min(ripples)))
    weighted, alike, louder = np.array(rows).T
    assert weighted.sum() < alike.sum()
    assert louder.sum() > 300
    assert weighted[louder > 0].sum() < 0.95 * alike[louder > 0].sum()


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


@pytest.mark.parametrize("span", [0.05, 0.3])
def test_beyond_two_trials_their_own_change_counts_by_how_far_they_are_apart(span):
    """Of what this person's change says and what others' does, the first by span² over span² and
    that of `SPEED.own_change_span`; the others' is trusted to 0.8.
    """
    base = normal_form(SUBJECTS[4].record(), SUBJECTS[4].leg_length_m)
    slow = replace(base, speed=0.4, stride_time=2.0, forces=0.0 * base.forces)
    fast = replace(slow, speed=0.4 + span, stride_time=1.6, forces=slow.forces + 1.0)
    others = replace(slow, speed=1.0, forces=slow.forces + 5.0)
    away = 0.2
    found = _moved([slow, fast], fast.speed + away, others)
    share = span**2 / (span**2 + SPEED.own_change_span**2)
    rise = share * away / span + (1.0 - share) * 0.8 * 5.0 * away
    np.testing.assert_allclose(found.forces, 1.0 + rise)
    own = np.log(1.6 / 2.0) / np.log(fast.speed / 0.4)
    exponent = share * own + (1.0 - share) * SPEED.stride_time_exponent
    assert found.stride_time == pytest.approx(1.6 * ((fast.speed + away) / fast.speed) ** exponent)


def test_how_much_the_own_change_counts_is_what_predicts_other_peoples_ankles(
    gait_data, monkeypatch
):
    """Two trials of a person, a third one beyond them; what speed changes comes from two others,
    of two trials each, as the built-in people have. No other span is nearer by 1 % in both.
    """
    people = ankles(gait_data)
    assert len(people) >= 28
    errors = {}
    for span in (0.05, 0.1, SPEED.own_change_span, 0.6):
        monkeypatch.setattr(speed_module, "SPEED", replace(SPEED, own_change_span=span))
        squares = []
        for i, person in enumerate(people):
            others = [people[(i + step) % len(people)] for step in (7, 13)]
            change = change_with_speed([(each[1], each[4]) for each in others])
            for held in range(len(person)):
                for pair in combinations([k for k in range(len(person)) if k != held], 2):
                    own, wanted = [person[k] for k in pair], person[held]
                    nearest = min(abs(wanted.speed / each.speed - 1.0) for each in own)
                    if pair[0] < held < pair[1] or nearest > speed_module.SPEED.largest_change:
                        continue
                    there = _moved(own, wanted.speed, change)
                    squares.append(
                        [
                            np.mean((getattr(there, name)[0] - getattr(wanted, name)[0]) ** 2)
                            for name in ("angles", "moments")
                        ]
                    )
        errors[span] = np.sqrt(np.mean(squares, axis=0))
    chosen = errors.pop(SPEED.own_change_span)
    assert all((each > 0.99 * chosen).any() for each in errors.values())
    assert (errors[0.1] > 1.05 * chosen).all()  # what it was before
