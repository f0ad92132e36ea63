"""Gaits as numbers: there and back, averages, the mirror image."""

import numpy as np
import pytest

from gaitval.constants import GRAVITY
from gaitval.gait.record import REQUIRED_ANGLES, REQUIRED_MOMENTS
from gaitval.subjects.prediction.normal_form import combined, normal_form, record_from, symmetric
from gaitval.subjects.subject_file import builtin_subjects

SUBJECTS = builtin_subjects()
PHASE = np.arange(200) / 200


@pytest.mark.parametrize("subject", SUBJECTS, ids=lambda s: s.identifier)
def test_there_and_back_a_record_is_the_same(subject):
    record = subject.record()
    back = record_from(normal_form(record, subject.leg_length_m), subject.leg_length_m)
    for name in REQUIRED_ANGLES:
        np.testing.assert_allclose(back.angles[name](PHASE), record.angles[name](PHASE), atol=1e-3)
    for name in REQUIRED_MOMENTS:
        np.testing.assert_allclose(
            back.moments[name](PHASE), record.moments[name](PHASE), atol=0.02
        )
    for side in ("right", "left"):
        inside = PHASE[record.stance_fraction[side] - 0.01 > PHASE]
        np.testing.assert_allclose(
            back.ground_reaction(side, inside), record.ground_reaction(side, inside), atol=0.02
        )
    assert back.speed == pytest.approx(record.speed)
    assert back.stride_time == pytest.approx(record.stride_time)
    assert back.stance_fraction == pytest.approx(record.stance_fraction)


def test_a_gait_without_dimension_does_not_know_the_leg():
    """Twice the leg at the same dimensionless speed and stride time is the same gait."""
    record = SUBJECTS[0].record()
    one = normal_form(record, 0.9)
    other = record_from(one, 1.8)
    assert other.speed == pytest.approx(record.speed * np.sqrt(2.0))
    assert other.stride_time == pytest.approx(record.stride_time * np.sqrt(2.0))
    assert one.speed**2 == pytest.approx(record.speed**2 / (GRAVITY * 0.9))
    for name in REQUIRED_MOMENTS:
        longer = 2.0 if name.startswith("ankle") else 1.0
        np.testing.assert_allclose(
            other.moments[name](PHASE), longer * record.moments[name](PHASE), atol=0.04
        )


def test_an_average_of_one_gait_is_that_gait_and_weights_add():
    gaits = [normal_form(each.record(), each.leg_length_m) for each in SUBJECTS[:3]]
    same = combined(gaits, np.array([0.0, 1.0, 0.0]))
    np.testing.assert_allclose(same.forces, gaits[1].forces)
    half = combined(gaits, np.array([0.5, 0.0, 0.5]))
    np.testing.assert_allclose(half.angles, 0.5 * (gaits[0].angles + gaits[2].angles))


def test_a_symmetric_gait_is_its_own_mirror_image_and_keeps_the_mean():
    gait = normal_form(SUBJECTS[4].record(), SUBJECTS[4].leg_length_m)
    found = symmetric(gait)
    assert found.left_phase == 0.5
    np.testing.assert_array_equal(found.forces[0], found.forces[1])
    np.testing.assert_allclose(found.forces.mean(axis=0), gait.forces.mean(axis=0))
    knees = [REQUIRED_ANGLES.index(f"knee_angle_{side}") for side in "rl"]
    np.testing.assert_array_equal(*found.angles[knees])
    np.testing.assert_allclose(found.angles[knees].mean(axis=0), gait.angles[knees].mean(axis=0))
    hips = [REQUIRED_MOMENTS.index(f"hip_flexion_{side}") for side in "rl"]
    np.testing.assert_array_equal(*found.moments[hips])


@pytest.mark.parametrize("subject", SUBJECTS, ids=lambda s: s.identifier)
def test_the_ground_pushes_either_foot_towards_the_midline(subject):
    """In the middle of stance both feet press outwards; to the left is the midline of the right."""
    record = subject.record()
    gait = normal_form(record, subject.leg_length_m)
    assert (gait.forces[:, 15:45, 1].mean(axis=1) > 0.02).all()
    for foot, side, sign in ((0, "right", 1.0), (1, "left", -1.0)):
        world = record.ground_reaction(side, np.array([0.3]))[0]
        np.testing.assert_allclose(gait.forces[foot, 30], [world[0], sign * world[1], world[2]])
