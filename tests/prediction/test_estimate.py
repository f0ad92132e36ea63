"""The estimate reads no kinetics of the person, learns who is right, and its bands hold."""

from dataclasses import replace

import numpy as np
import pytest

from gaitval.subjects.prediction import estimate as estimate_module
from gaitval.subjects.prediction.ankles import ankle_moment
from gaitval.subjects.prediction.deviations import (
    KINETICS,
    Deviation,
    DeviationTrial,
    kinetics_of,
    learned_from,
    stored_fits,
)
from gaitval.subjects.prediction.estimate import (
    LEVERS,
    _levered,
    estimate,
)
from gaitval.subjects.prediction.laboratories import of_rows, stored, to_rows
from gaitval.subjects.prediction.normal_form import SAMPLES, NormalForm, normal_form
from gaitval.subjects.subject_file import builtin_subjects, load_subject

NAN = float("nan")


def hidden(gait: NormalForm) -> NormalForm:
    return replace(
        gait, moments=NAN * gait.moments, forces=NAN * gait.forces, stance=NAN * gait.stance
    )


def trial_of(name: str) -> DeviationTrial:
    subject = load_subject(name)
    gait = normal_form(subject.record(), subject.leg_length_m)
    fit = stored_fits()[f"{subject.identifier} {subject.trial}"]
    return DeviationTrial(gait, fit, person=subject.person)


@pytest.fixture
def made_up_ankles(monkeypatch):
    """People who are made up do not have the ankles of real ones, nor others in laboratories."""
    monkeypatch.setattr(
        estimate_module, "ESTIMATE", replace(estimate_module.ESTIMATE, ankle_share=0.0)
    )
    nobody = of_rows(np.zeros((0, to_rows(stored()).shape[1])))
    monkeypatch.setattr("gaitval.subjects.prediction.estimate.stored", lambda: nobody)


def planted(seed: int, of_angles: float, of_fit: float):
    """Twelve people whose kinetics are what angles and fit say, each its share, and noise."""
    rng = np.random.default_rng(seed)
    phase = 2.0 * np.pi * np.arange(SAMPLES) / SAMPLES
    waves = np.array([np.ones(SAMPLES), np.sin(phase), np.cos(2.0 * phase)])
    to_kinetics = rng.normal(size=(9, 3, 7))
    people = []
    for _ in range(12):
        amount = rng.normal(size=(2, 9, 3))
        fit = np.einsum("skw,wn->skn", rng.normal(size=(2, 7, 3)), waves)
        message = np.einsum("sjw,jwk,wn->skn", amount, to_kinetics, waves) / 5.0
        noise = 0.1 * np.einsum("skw,wn->skn", rng.normal(size=(2, 7, 3)), waves)
        kinetics = 10.0 + of_angles * message + of_fit * fit + noise
        gait = NormalForm(
            rng.uniform(0.2, 0.5),
            3.5,
            0.5,
            np.full(2, 0.6),
            np.einsum("sjw,wn->sjn", amount, waves).reshape(18, SAMPLES),
            kinetics[:, :4].reshape(8, SAMPLES),
            kinetics[:, 4:].transpose(0, 2, 1),
        )
        people.append([DeviationTrial(gait, fit)])
    return people


def error(found, trial):
    return np.sqrt(np.mean((found - kinetics_of(trial.gait)) ** 2, axis=(0, 2)))


@pytest.mark.parametrize("angles", [True, False])
def test_kinetics_of_the_person_are_not_read(angles):
    people = learned_from(load_subject("5"), builtin_subjects())
    trial = trial_of("5")
    plain = estimate(trial, people, angles=angles)
    poisoned = estimate(trial._replace(gait=hidden(trial.gait)), people, angles=angles)
    for name in ("kinetics", "expected", "half_width", "weights"):
        assert np.array_equal(getattr(plain, name), getattr(poisoned, name))


def test_nobody_is_learned_from_for_themselves():
    subject = load_subject("5")
    others = [each for each in builtin_subjects() if not subject.is_person_of(each)]
    known = learned_from(subject, builtin_subjects())
    assert len(known) == len(others) == 9
    assert len(learned_from(subject, others)) == 9


@pytest.mark.usefixtures("made_up_ankles")
def test_mechanics_weigh_as_much_as_they_know():
    people = planted(3, of_angles=0.0, of_fit=1.0)
    assert np.all(estimate(people[0][0], people[1:]).weights > 0.6)
    people = planted(4, of_angles=0.0, of_fit=0.0)
    assert np.all(estimate(people[0][0], people[1:]).weights < 0.15)


@pytest.mark.usefixtures("made_up_ankles")
def test_angles_that_say_something_are_learned_from():
    people = planted(5, of_angles=1.0, of_fit=0.0)
    with_angles, without = (estimate(people[0][0], people[1:], angles=a) for a in (True, False))
    assert (
        error(with_angles.kinetics, people[0][0]).sum()
        < error(without.kinetics, people[0][0]).sum()
    )


@pytest.mark.slow
@pytest.mark.usefixtures("made_up_ankles")
@pytest.mark.parametrize("others", [4, 9])
def test_bands_of_a_few_people_hold_what_they_say(others):
    """Of people whose kinetics are noise about a mean, nine points in ten: with four people 95 % of
    Student's t with three degrees is 2.35 standard deviations, of the normal distribution 1.64."""
    inside = []
    for seed in range(40):
        people = planted(seed, of_angles=0.0, of_fit=0.0)
        found = estimate(people[0][0], people[1 : others + 1])
        away = np.abs(found.kinetics - kinetics_of(people[0][0].gait))
        inside.append(np.mean(away <= found.half_width))
    assert 0.895 < np.mean(inside) < 0.95


@pytest.mark.slow
def test_the_ten_are_estimated_better_than_expected_and_within_the_bands():
    errors, guesses, inside = [], [], []
    for subject in builtin_subjects():
        trial = trial_of(subject.identifier)
        found = estimate(trial, learned_from(subject, builtin_subjects()))
        truth = kinetics_of(trial.gait)
        errors.append(error(found.kinetics, trial))
        guesses.append(error(found.expected, trial))
        inside.append(np.mean(np.abs(found.kinetics - truth) <= found.half_width))
        assert found.kinetics[:, -1].min() >= 0.0
    gained = 1.0 - np.mean(errors, axis=0) / np.mean(guesses, axis=0)
    assert np.all(gained > 0.0), dict(zip(KINETICS, gained, strict=True))
    assert 0.85 < np.mean(inside) < 0.97


def test_without_angles_it_is_expectation_ankle_and_mechanics():
    trial, people = trial_of("2"), learned_from(load_subject("2"), builtin_subjects())
    found = estimate(trial, people, angles=False)
    whole = found.expected + found.weights * trial.fit
    ankle = KINETICS.index(("moments", "ankle_angle"))
    whole[:, ankle] += (
        0.5 * ankle_moment(trial.ankle_angles, trial.gait.speed, {trial.person}).change
    )
    whole[:, -1] = np.maximum(whole[:, -1], 0.0)
    by_all = [
        KINETICS.index(("moments", name)) for name in ("hip_flexion", "hip_adduction", "knee_angle")
    ]
    rest = [i for i in range(len(KINETICS)) if i not in by_all]
    assert np.allclose(found.kinetics[:, rest], whole[:, rest], rtol=0.0, atol=1e-15)
    assert not np.any(found.regressed[:, rest[1:]])
    assert np.all(np.abs(found.regressed[:, by_all]).max(axis=(0, 2)) > 0.01)


def made_up(rng, share: float) -> Deviation:
    """Of somebody whose medial force is larger by a share of how much wider the steps are."""
    usual = rng.normal(1.0, 0.1, (2, len(KINETICS), 20))
    wider, kinetics = float(rng.normal(0.0, 0.2)), np.zeros_like(usual)
    medial = KINETICS.index(("forces", "medial"))
    kinetics[:, medial] = share * wider * usual[:, medial]
    angles = rng.normal(size=(2, 8, 20))
    return Deviation(angles[:, :3], angles[:, 3:], 0.1, kinetics, kinetics, usual, wider, 0.0)


def test_what_a_lever_says_is_taken_from_what_is_left():
    """n people whose noise is supposed to be as large as one's signal: n / (n + 1) of the share."""
    rng = np.random.default_rng(3)
    people, other = [made_up(rng, 0.5) for _ in range(9)], made_up(rng, 0.0)
    message, rest = _levered(people, other, LEVERS)
    medial = KINETICS.index(("forces", "medial"))
    expected = 0.5 * 0.9 * other.step_width * other.usual[:, medial]
    np.testing.assert_allclose(message[:, medial], expected, atol=1e-12)
    assert not np.delete(message, medial, axis=1).any()
    for each, left in zip(people, rest, strict=True):
        np.testing.assert_allclose(left, 0.1 * each.kinetics, atol=1e-12)
