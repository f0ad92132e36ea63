"""Virtual people: their errors are as large as said, and their subject does not know the truth."""

from pathlib import Path

import numpy as np
import pytest

from gaitval.configuration import load_configuration
from gaitval.datasets.subject_file import load_subject, parse_subject
from gaitval.gait.cycle_curves import PELVIS_ANGLES, recorded_curves
from gaitval.gait.record import RECORDED_ANGLES
from gaitval.identification.prior import prior_sd
from gaitval.identification.virtual_person import (
    VIRTUAL,
    drawn_parameters,
    of_another_size,
    virtual_person,
    with_errors,
)
from gaitval.model.parameters import nominal_parameters
from gaitval.policy.storage import load_start
from gaitval.prediction.speed_line import dimensionless_speed
from gaitval.scaling.scaling import scale_subject

CONFIGURATION = load_configuration()
NOISE = CONFIGURATION.noise
GENERAL = Path(__file__).parents[2] / "reports" / "general"


@pytest.fixture(scope="module")
def errors():
    """What is added to the curves of S05, by kind and curve, (400, 101)."""
    record = load_subject("S05").record()
    curves = recorded_curves(record)
    random = np.random.default_rng(0)
    drawn = [with_errors(curves, record.left_phase, NOISE, random) for _ in range(400)]
    return {
        kind: {
            name: np.array([getattr(each, kind)[name] - getattr(curves, kind)[name]
                            for each in drawn])
            for name in getattr(drawn[0], kind)
        }
        for kind in ("angles", "moments", "forces")
    }  # fmt: skip


@pytest.mark.parametrize("name", [*RECORDED_ANGLES, *PELVIS_ANGLES])
@pytest.mark.parametrize("side", "rl")
def test_angles_have_an_offset_and_a_waveform_of_the_size_that_is_set(errors, name, side):
    found = errors["angles"][f"{name}_{side}"]
    offsets = found[:, :100].mean(axis=1)
    assert offsets.std() == pytest.approx(NOISE.angle_offset, rel=0.12)
    waves = found - offsets[:, None]
    assert np.sqrt(np.mean(waves**2)) == pytest.approx(NOISE.angle, rel=0.1)


def test_both_sides_see_one_pelvis(errors):
    left_phase = load_subject("S05").record().left_phase
    phase = np.linspace(0.0, 1.0, 101)
    for name, sign in (("pelvis_tilt", 1.0), ("pelvis_list", -1.0), ("pelvis_rotation", -1.0)):
        right, left = (errors["angles"][f"{name}_{side}"][0] for side in "rl")
        at = np.interp((phase + left_phase) % 1.0, phase, right)
        np.testing.assert_allclose(left, sign * at, atol=5e-4)


def test_joint_errors_of_the_two_sides_are_independent(errors):
    right, left = (errors["angles"][f"knee_angle_{side}"].mean(axis=1) for side in "rl")
    assert abs(np.corrcoef(right, left)[0, 1]) < 0.15


def test_forces_and_moments_have_errors_of_the_size_that_is_set(errors):
    """In mid-stance; a moment's grow with the load, by plate and joint centre."""
    middle = slice(15, 45)
    for name, size in (
        ("vertical", NOISE.vertical_force),
        ("forward", NOISE.forward_force),
        ("medial", NOISE.medial_force),
    ):
        found = np.sqrt(np.mean(errors["forces"][f"{name}_r"][:, middle] ** 2))
        assert found == pytest.approx(size, rel=0.12)
        np.testing.assert_array_equal(errors["forces"][f"{name}_r"][:, 75:90], 0.0)
    swing = np.sqrt(np.mean(errors["moments"]["knee_angle_l"][:, 75:95] ** 2))
    assert swing == pytest.approx(NOISE.moment, rel=0.12)
    stance = np.sqrt(np.mean(errors["moments"]["knee_angle_l"][:, middle] ** 2))
    away = np.hypot(NOISE.plate, NOISE.joint_centre) * 9.81 * 0.95
    assert stance == pytest.approx(np.hypot(NOISE.moment, away), rel=0.12)
    adduction = np.sqrt(np.mean(errors["moments"]["hip_adduction_r"][:, middle] ** 2))
    away = NOISE.joint_centre * 9.81 * 0.95
    assert adduction == pytest.approx(np.hypot(NOISE.adduction_moment, away), rel=0.12)


def test_a_plate_moves_the_moments_of_its_leg_together(errors):
    """Forward: hip extension, knee flexion and plantarflexion moments increase."""
    means = {name: errors["moments"][f"{name}_r"][:, 15:45].mean(axis=1)
             for name in ("hip_flexion", "knee_angle", "ankle_angle")}  # fmt: skip
    assert np.corrcoef(means["hip_flexion"], means["ankle_angle"])[0, 1] > 0.2
    assert np.corrcoef(means["knee_angle"], means["ankle_angle"])[0, 1] < -0.2


def test_bodies_are_drawn_from_the_prior():
    sd = prior_sd(load_subject("S05"))
    random = np.random.default_rng(3)
    z = np.array([(drawn_parameters(sd, random) - nominal_parameters()) / sd for _ in range(2000)])
    assert np.abs(z).max() <= 2.5
    np.testing.assert_allclose(z[:, 2:].mean(axis=0), 0.0, atol=0.08)
    np.testing.assert_allclose(z[:, 2:].std(axis=0), 0.96, atol=0.06)


@pytest.mark.slow  # makes the same person twice
def test_a_seed_makes_one_person_and_the_subject_is_an_ordinary_one():
    policy = load_start(GENERAL, CONFIGURATION.environment)
    around = load_subject("S03")
    first, again = (virtual_person(2, 7, around, policy, CONFIGURATION) for _ in range(2))
    np.testing.assert_array_equal(first.truth, again.truth)
    text = first.subject.to_toml()
    assert text == again.subject.to_toml()
    assert parse_subject(text, "virtual").to_toml() == text
    assert first.subject.identifier == "V7_002"
    assert "virtual" in first.subject.citation
    for value in first.truth[first.truth != nominal_parameters()]:
        assert repr(float(value)) not in text
    assert abs(first.subject.walking_speed_m_s - around.walking_speed_m_s) < 0.05


def test_somebody_of_another_size_walks_alike():
    person = load_subject("S05")
    random = np.random.default_rng(0)
    drawn = [of_another_size(person, random) for _ in range(300)]
    sizes = np.array([each.height_m for each in drawn]) / person.height_m
    masses = np.array([each.mass_kg for each in drawn]) / person.mass_kg
    assert sizes.std() == pytest.approx(VIRTUAL.stature_sd, rel=0.15)
    assert (masses / sizes**2).std() == pytest.approx(VIRTUAL.build_sd, rel=0.15)
    assert np.abs(np.corrcoef(sizes, masses / sizes**2)[0, 1]) < 0.15
    for each in drawn:
        assert dimensionless_speed(each) == pytest.approx(dimensionless_speed(person))
        stride = each.walking_speed_m_s * each.stride_time_s
        own = person.walking_speed_m_s * person.stride_time_s
        assert stride / each.leg_length_m == pytest.approx(own / person.leg_length_m)
    for each in drawn[:10]:
        parse_subject(each.to_toml(), "drawn")
        assert scale_subject(each).model.mass == pytest.approx(each.mass_kg)
        assert each.by_stature() == each
        assert not each.trials
