"""Faults of force plates, planted and taken away."""

from dataclasses import replace

import numpy as np
import pytest
from simulation_fixtures import standing_moments, task_of_subject

from gaitval.constants import GRAVITY, STANDARD_GRAVITY
from gaitval.coordinates import COORDINATES, SIDES
from gaitval.gait.plate_correction import SHIFT_SIGNS, PlateCorrection, corrected
from gaitval.subjects.subject_file import load_subject

RECORD = load_subject("S05").measured()
PHASE = np.linspace(0.0, 1.0, 301)


def test_the_scale_multiplies_forces_and_the_moments_of_a_loaded_leg_only():
    found = corrected(RECORD, PlateCorrection(scale=1.05))
    for side in SIDES:
        force = RECORD.ground_reaction(side, PHASE)
        np.testing.assert_allclose(found.ground_reaction(side, PHASE), 1.05 * force, atol=1e-12)
        loaded = (force[:, 2] > 0.3) & (PHASE < 0.9)
        swing = (RECORD.stance_fraction[side] + 0.05 < PHASE) & (PHASE < 0.95)
        for name, curve in RECORD.moments.items():
            if name[-1] == side[0]:
                before, after = curve(PHASE), found.moments[name](PHASE)
                np.testing.assert_allclose(after[loaded], 1.05 * before[loaded], atol=2e-3)
                np.testing.assert_allclose(after[swing], before[swing], atol=2e-3)


@pytest.mark.parametrize("side", SIDES)
def test_a_shift_of_one_plate_changes_the_sagittal_moments_of_its_leg_only(side):
    plates = PlateCorrection(**{f"shift_{side}": 0.02})
    found = corrected(RECORD, plates)
    vertical = RECORD.ground_reaction(side, PHASE)[:, 2] * STANDARD_GRAVITY
    for name, curve in RECORD.moments.items():
        sign = SHIFT_SIGNS.get(name[:-2], 0.0) if name[-1] == side[0] else 0.0
        change = found.moments[name](PHASE) - curve(PHASE)
        # the series rounds the corner at toe-off
        np.testing.assert_allclose(change, -0.02 * sign * vertical, atol=0.012)
    assert found.forces[side][2] == RECORD.forces[side][2]


def test_what_is_planted_is_taken_away():
    planted = PlateCorrection(scale=0.95, shift_right=0.03, shift_left=-0.01)
    taken = PlateCorrection(scale=1 / 0.95, shift_right=-0.03 * 0.95, shift_left=0.01 * 0.95)
    again = corrected(corrected(RECORD, planted), taken)
    for name, curve in RECORD.moments.items():
        stance = RECORD.stance_fraction["right" if name[-1] == "r" else "left"] - 0.05 > PHASE
        np.testing.assert_allclose(
            again.moments[name](PHASE)[stance], curve(PHASE)[stance], atol=0.02
        )


@pytest.mark.parametrize("column", [0, 1])
def test_the_signs_are_those_of_newton_and_euler(column):
    """A vertical force 1 cm further forward under a foot, by inverse dynamics, on either side."""
    model = task_of_subject("S05").model
    q = np.zeros(31)
    q[5] = 0.85
    for name, angle in (("hip_flexion", 0.3), ("knee_angle", 0.4), ("ankle_angle", 0.1)):
        q[COORDINATES.index(f"{name}_{'rl'[column]}")] = angle
    weight = model.mass * GRAVITY

    def moments(ahead):
        return standing_moments(model, q, column, [0.05 + ahead, 0.1 - 0.2 * column, 0.0])

    change = moments(0.01) - moments(0.0)
    for name, sign in SHIFT_SIGNS.items():
        own = change[COORDINATES.index(f"{name}_{'rl'[column]}")]
        assert own == pytest.approx(0.01 * sign * weight, rel=0.05)
        assert change[COORDINATES.index(f"{name}_{'lr'[column]}")] == pytest.approx(0.0, abs=1e-9)


def test_a_subject_s_record_is_corrected_and_its_measurement_is_not():
    subject = load_subject("S05")
    assert subject.plates is not None
    mean = sum(
        subject.record().ground_reaction(side, np.arange(1000) / 1000)[:, 2].mean()
        for side in SIDES
    )
    assert mean == pytest.approx(1.0, abs=1e-4)
    assert subject.model_copy(update={"plates": None}).record() == subject.measured()
    assert replace(subject.record(), moments={}, forces={}) == replace(
        subject.measured(), moments={}, forces={}
    )
