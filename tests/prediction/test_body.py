"""Step width is what angles and lengths say, and the levers find the share that was planted."""

from dataclasses import replace

import numpy as np
import pytest

from gaitval.gait.record import PeriodicCurve
from gaitval.subjects.prediction.body import _DOUBLE_SUPPORT, _lengths, pelvic_width, step_width
from gaitval.subjects.prediction.deviations import (
    KINETICS,
    DeviationTrial,
    kinetics_of,
    learned_from,
    stored_fits,
)
from gaitval.subjects.prediction.deviations import trial_of as trial_from
from gaitval.subjects.prediction.estimate import LEVERS, estimate
from gaitval.subjects.subject_file import builtin_subjects, load_subject

MEDIAL = KINETICS.index(("forces", "medial"))
HIP = KINETICS.index(("moments", "hip_flexion"))


def constant(value: float) -> PeriodicCurve:
    return PeriodicCurve(value, (), ())


def standing(subject, **angles):
    """The record of `subject` with all angles zero but some of both sides, rad."""
    record = subject.record()
    still = {name: constant(angles.get(name[:-2], 0.0)) for name in record.angles}
    return replace(record, angles=still)


def test_straight_legs_are_as_far_apart_as_the_hips():
    subject = load_subject("5")
    # Bell et al. 1990: 0.36 of the distance between the ASIS to either side
    wide = 2.0 * 0.36 * pelvic_width(subject) / subject.leg_length_m
    assert step_width(subject, standing(subject)) == pytest.approx(wide, rel=1e-6)


S, C = np.sin, np.cos
TURNS = {
    "a side that is up swings its leg out": (
        {"pelvis_list": 0.1}, lambda hips, leg, shank: hips * C(0.1) + leg * S(0.1)
    ),
    "a leg that is adducted is swung in": (
        {"hip_adduction": 0.1}, lambda hips, leg, shank: hips - leg * S(0.1)
    ),
    "what the hip adducts back": (
        {"pelvis_list": 0.1, "hip_adduction": 0.1}, lambda hips, leg, shank: hips * C(0.1)
    ),
    "a leg that is ahead turns in with a side that is forward": (
        {"pelvis_rotation": 0.2, "hip_flexion": 0.3},
        lambda hips, leg, shank: hips * C(0.2) - leg * S(0.3) * S(0.2),
    ),
    "but not below a pelvis that is tilted as much": (
        {"pelvis_rotation": 0.2, "hip_flexion": 0.3, "pelvis_tilt": 0.3},
        lambda hips, leg, shank: hips * C(0.2),
    ),
    "a hip that turns in puts the shank of a bent knee out": (
        {"knee_angle": 0.5, "hip_rotation": 0.2},
        lambda hips, leg, shank: hips + shank * S(0.5) * S(0.2),
    ),
    "a knee that is adducted puts the ankle in": (
        {"knee_adduction": 0.1}, lambda hips, leg, shank: hips - shank * S(0.1)
    ),
    "a turn about the shank's own axis moves no ankle": (
        {"knee_rotation": 0.3}, lambda hips, leg, shank: hips
    ),
}  # fmt: skip


@pytest.mark.parametrize("turn", TURNS)
def test_every_turn_moves_the_ankles_as_trigonometry_says(turn):
    subject = load_subject("5")
    angles, expected = TURNS[turn]
    record = standing(subject)
    turned = {f"{name}_{side}": constant(each) for name, each in angles.items() for side in "rl"}
    wide = step_width(subject, replace(record, angles=dict(record.angles) | turned))
    lengths = _lengths(subject)
    shank = lengths.right.shank + lengths.left.shank
    leg = shank + lengths.right.thigh + lengths.left.thigh
    hips = 2.0 * lengths.hip_half_width
    assert wide * subject.leg_length_m == pytest.approx(expected(hips, leg, shank), rel=1e-9)


@pytest.mark.parametrize("side", ["right", "left"])
def test_both_feet_are_looked_at_when_either_is_in_front(side):
    """Of the left cycle that begins at 60 % of the right one, each side at its own phase."""
    subject = load_subject("5")
    record = replace(standing(subject), left_phase=0.6)
    wave = PeriodicCurve(0.0, (0.1,), (0.05,))
    angles = dict(record.angles) | {f"hip_adduction_{side[0]}": wave}
    wide = step_width(subject, replace(record, angles=angles)) * subject.leg_length_m
    lengths = _lengths(subject)
    limbs = lengths.right if side == "right" else lengths.left
    # A phase of the other cycle is 0.6 later of the right foot, or 0.6 earlier of the left one.
    other = _DOUBLE_SUPPORT + (0.6 if side == "right" else -0.6)
    moved = np.mean([np.sin(wave(_DOUBLE_SUPPORT)), np.sin(wave(other))])
    expected = 2.0 * lengths.hip_half_width - (limbs.thigh + limbs.shank) * moved
    assert wide == pytest.approx(expected, rel=1e-9)


def test_toes_that_turn_out_widen_the_steps():
    subject = load_subject("5")
    wide = step_width(subject, standing(subject))
    out = step_width(subject, standing(subject, foot_progression=-0.2))
    foot = (out - wide) * subject.leg_length_m / np.sin(0.2) / 2.0
    assert 0.06 < foot < 0.2  # m from the ankle to the metatarsal heads


def test_without_lengths_or_foot_angles_it_is_unknown():
    subject = load_subject("5")
    record = subject.record()
    assert np.isnan(step_width(subject.model_copy(update={"markers": {}}), record))
    angles = {name: each for name, each in record.angles.items() if "progression" not in name}
    assert np.isnan(step_width(subject, replace(record, angles=angles)))
    assert np.isnan(pelvic_width(subject.model_copy(update={"markers": {}})))


def test_healthy_adults_step_a_sixth_to_a_third_of_a_leg_apart():
    widths = [step_width(each, each.record()) for each in builtin_subjects()]
    assert 0.15 < min(widths) < max(widths) < 0.35, widths


@pytest.mark.parametrize(("wider", "lever"), [(0.2, MEDIAL), (0.03, HIP)])
def test_who_steps_wider_or_has_a_wider_pelvis_is_estimated_otherwise(wider, lever):
    subject = load_subject("5")
    people = learned_from(subject, builtin_subjects())
    trial = trial_from(subject, subject.record(), stored_fits()["S05 T05"])
    if lever == MEDIAL:
        moved = trial._replace(step_width=trial.step_width * (1.0 + wider))
    else:
        moved = trial._replace(pelvic_width=trial.pelvic_width + wider)
    change = estimate(moved, people).kinetics - estimate(trial, people).kinetics
    by = next(each.by for each in LEVERS if each.moved == lever)
    usual = estimate(trial, people).expected[:, by]
    share = np.sum(change[:, lever] * usual) / np.sum(usual**2)
    assert np.allclose(change[:, lever], share * usual, atol=1e-9)
    others = [i for i in range(len(KINETICS)) if i != lever]
    assert np.allclose(change[:, others], 0.0, atol=1e-12)
    # wider steps push harder towards the midline; hip centres further back need less extension
    assert share > 0.0 if lever == MEDIAL else share < 0.0


def test_a_planted_lever_is_found():
    rng = np.random.default_rng(7)
    people = learned_from(load_subject("5").model_copy(update={"person": ""}), builtin_subjects())
    usual, fit, *_ = people[0][0]
    planted = []
    for wider in [0.3, *rng.normal(0.0, 0.15, 11)]:
        forces = usual.forces.copy()
        forces[:, :, 1] *= 1.0 + 0.8 * wider
        gait = replace(usual, forces=forces)
        planted.append(
            [DeviationTrial(gait, 0.01 * rng.normal(size=fit.shape), 0.2 * (1.0 + wider))]
        )
    found = estimate(planted[0][0], planted[1:], angles=False)
    truth, guess = kinetics_of(planted[0][0].gait), found.expected

    def missed(curves):
        # both sides together: asymmetry is nobody's expectation
        return np.abs((curves - truth)[:, MEDIAL].mean(axis=0)).max()

    assert missed(found.kinetics) < 0.25 * missed(guess)
