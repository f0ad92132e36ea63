"""The harsh world: what is wrong there has the size that is said, and is drawn from the seed."""

from dataclasses import replace

import numpy as np
import pytest
from typer.testing import CliRunner

from gaitval.apps.virtual.harsh import Faults, drawn_faults, seen_through_skin
from gaitval.cli import app
from gaitval.configuration import load_configuration
from gaitval.datasets.subject_file import load_subject
from gaitval.gait.cycle_curves import recorded_curves
from gaitval.scaling.scaling import scale_subject

CONTACT = load_configuration().contact


@pytest.fixture(scope="module")
def curves():
    return recorded_curves(load_subject("S05").record())


def no_faults() -> Faults:
    """A record in which nothing is wrong."""
    none, zero = (0.0, 0.0), (0.0, 0.0, 0.0)
    return Faults(
        skin="segments", thigh_by_hip=none, thigh_by_knee=none, shank_by_knee=none,
        foot_by_ankle=none, hip=none, knee=none, ankle=none, thigh_by_load=none, late=0.0,
        belt=0.0, clock=0.0, pelvis=0.0, axes=(zero, zero), knee_axis=none, ankle_axis=none,
        sole=(0.0, 0.0, 0.0, 0.0), thigh_mass=1.0, shank_mass=1.0, trunk=none, arms=1.0,
        left_leg=0.0, left_hip=none, plate_gain=(1.0, 1.0),
    )  # fmt: skip


def test_without_faults_the_curves_are_true(curves):
    found = seen_through_skin(curves, no_faults())
    for kind in ("angles", "moments", "forces"):
        for name, curve in getattr(curves, kind).items():
            np.testing.assert_allclose(getattr(found, kind)[name], curve, atol=1e-12)


def test_a_thigh_that_seems_turned_leaves_the_shank_where_it_is(curves):
    """The shank's direction is hip less knee."""
    found = seen_through_skin(curves, replace(no_faults(), thigh_by_hip=(-0.1, -0.1)))
    for side in "rl":
        hip, knee = (found.angles[f"{name}_{side}"] for name in ("hip_flexion", "knee_angle"))
        true_hip, true_knee = (
            curves.angles[f"{name}_{side}"] for name in ("hip_flexion", "knee_angle")
        )
        np.testing.assert_allclose(hip - knee, true_hip - true_knee, atol=1e-12)
        assert np.ptp(hip) == pytest.approx(0.9 * np.ptp(true_hip), rel=1e-6)


def test_by_joint_only_the_excursion_changes(curves):
    faults = replace(no_faults(), skin="joints", knee=(-0.05, 0.05))
    found = seen_through_skin(curves, faults)
    for side, factor in (("r", 0.95), ("l", 1.05)):
        seen, true = found.angles[f"knee_angle_{side}"], curves.angles[f"knee_angle_{side}"]
        assert np.ptp(seen) == pytest.approx(factor * np.ptp(true), rel=1e-9)
        assert seen[:-1].mean() == pytest.approx(true[:-1].mean(), abs=1e-9)


def test_a_longer_left_leg_is_longer_by_what_was_asked():
    model = scale_subject(load_subject("S05")).model
    walked, contact = replace(no_faults(), left_leg=0.02).body(model, CONTACT)

    def leg(side: str) -> float:
        return float(-sum(walked[f"{name}_{side}"].joint_position[2] for name in ("shank", "foot")))

    assert leg("l") - leg("r") == pytest.approx(0.02, rel=1e-6)
    assert walked.leg_length == pytest.approx(model.leg_length)
    assert contact == CONTACT.scaled(1.0, 1.0)


def test_the_scales_show_the_same_mass():
    model = scale_subject(load_subject("S05")).model
    faults = replace(no_faults(), thigh_mass=1.2, shank_mass=0.9)
    walked, _ = faults.body(model, CONTACT)
    assert walked.mass == pytest.approx(model.mass)
    assert walked["thigh_r"].mass == pytest.approx(1.2 * model["thigh_r"].mass)


def test_draws_are_of_the_seed_and_of_the_size_said():
    assert drawn_faults(np.random.default_rng(3)) == drawn_faults(np.random.default_rng(3))
    random = np.random.default_rng(0)
    many = [drawn_faults(random) for _ in range(400)]
    thighs = np.array([each.thigh_by_hip for each in many])
    assert thighs.mean() == pytest.approx(-0.05, abs=0.006)
    assert thighs.std() == pytest.approx(0.04, rel=0.12)
    assert np.corrcoef(thighs.T)[0, 1] == pytest.approx(0.8, abs=0.06)
    assert np.std([each.belt for each in many]) == pytest.approx(0.0125, rel=0.12)
    assert {each.skin for each in many} == {"segments", "joints"}
    assert drawn_faults(random, 0.02).left_leg == 0.02


def test_worlds_that_there_are_not_are_named():
    ran = CliRunner().invoke(app, ["virtual", "--world", "mild"])
    assert ran.exit_code == 2
    assert "give plain or harsh" in ran.output + ran.stderr
