"""What is expected of a person on a slope or with a load, and what is refused."""

import csv
from dataclasses import replace
from importlib import resources

import numpy as np
import pytest

from gaitval.configuration import Configuration, RecordSettings
from gaitval.coordinates import SIDES
from gaitval.errors import ConfigurationError
from gaitval.metrics.walk_muscles import person_and_laden
from gaitval.model.devices.loads import trunk_load
from gaitval.model.ground import Ground
from gaitval.model.parameters import nominal_parameters
from gaitval.subjects.prediction.known import is_unrecorded, known_record
from gaitval.subjects.prediction.slopes import (
    ON_A_SLOPE,
    angle_change,
    body_on,
    body_without,
    check_ground,
    friction_needed,
    on_ground,
    stride_time_factor,
)
from gaitval.subjects.subject_file import builtin_subjects, load_subject
from gaitval.walk.reference.fitted_record import with_fitted_kinetics

SUBJECT = load_subject("5")
RECORD = SUBJECT.record()
CONTACT = Configuration().contact
PHASE = np.linspace(0.0, 1.0, 50, endpoint=False)


def settings(**given: float) -> RecordSettings:
    return RecordSettings(speed=RECORD.speed, **given)


def test_the_record_of_level_ground_is_the_record():
    assert on_ground(RECORD, settings()) is RECORD
    assert not is_unrecorded(RecordSettings())
    assert is_unrecorded(RecordSettings(slope=5.0))
    assert is_unrecorded(RecordSettings(load=20.0))


@pytest.mark.parametrize(("name", "joint"), [("knee", "knee_angle"), ("ankle", "ankle_angle")])
@pytest.mark.parametrize("degrees", [-10.0, 10.0])
def test_angles_change_by_the_table(name, joint, degrees):
    """At the slopes that people were measured on, both sides alike."""
    text = (
        resources.files("gaitval.subjects.prediction")
        .joinpath("slope_angles.csv")
        .read_text("utf-8")
    )
    table = [float(row[f"{name}_{degrees:+g}"]) for row in csv.DictReader(text.splitlines())]
    there = on_ground(RECORD, settings(slope=100.0 * np.tan(np.deg2rad(degrees))))
    for side in "rl":
        key = f"{joint}_{side}"
        change = np.rad2deg(there.angles[key](PHASE) - RECORD.angles[key](PHASE))
        np.testing.assert_allclose(change, table, atol=0.4)  # ten harmonics of it


def test_uphill_people_flex_at_heel_strike_and_downhill_their_knees_bend_in_stance():
    """McIntosh et al. (2006), J Biomech 39:2491, abstract: hip flexion at heel strike rises from
    -10 to +10 degrees; knee flexion and dorsiflexion at heel strike rise uphill, not downhill."""
    slopes = (-10.0, -5.0, 0.0, 5.0, 10.0)
    hips = [float(angle_change("thigh", slope)(0.0)) for slope in slopes]
    assert np.all(np.diff(hips) > 0.0)
    for name in ("knee", "ankle"):
        up, down = (float(angle_change(name, slope)(0.0)) for slope in (10.0, -10.0))
        assert up > np.deg2rad(5.0)
        assert down < 0.6 * up
    assert angle_change("knee", -10.0)(0.3) > np.deg2rad(5.0)


@pytest.mark.parametrize("slope", [-8.0, 8.0])
@pytest.mark.parametrize("cross", [0.0, 6.0])
def test_forces_and_pelvis_keep_their_direction_in_the_room(slope, cross):
    """Turned back from the ground's axes they are those of level walking."""
    given = settings(slope=slope, cross_slope=cross)
    there, ground = on_ground(RECORD, given), Ground(slope, cross)
    for side in SIDES:
        back = there.ground_reaction(side, PHASE) @ ground.from_level
        np.testing.assert_allclose(back, RECORD.ground_reaction(side, PHASE), atol=1e-12)
    tilt = there.angles["pelvis_tilt_r"](PHASE) - RECORD.angles["pelvis_tilt_r"](PHASE)
    np.testing.assert_allclose(tilt.mean(), ground.angles[0], atol=0.01)
    right, left = (
        (there.angles[key](PHASE) - RECORD.angles[key](PHASE)).mean()
        for key in ("pelvis_list_r", "pelvis_list_l")
    )
    # level hips on ground that rises to the left are nearer to it there
    np.testing.assert_allclose([right, -left], np.arctan(cross / 100.0), atol=0.01)


def test_strides_are_franz_and_krams():
    """At 1.25 m/s 0.93 Hz on the level, 0.92 at 9° up and 0.99 down; half way to 0.75 m/s, 3°."""
    assert stride_time_factor(1.25, 9.0) == pytest.approx(0.93 / 0.92)
    assert stride_time_factor(1.25, -9.0) == pytest.approx(0.93 / 0.99)
    assert stride_time_factor(1.0, 1.5) == pytest.approx(0.835 / 0.8225)
    assert stride_time_factor(2.5, 20.0) == pytest.approx(1.05 / 1.07)
    down = on_ground(RECORD, settings(slope=-10.0))
    assert down.stride_time < RECORD.stride_time  # shorter steps at the same speed
    assert down.speed == RECORD.speed


def test_a_load_is_part_of_the_trunk_and_comes_off_again(task):
    given = settings(load=20.0, slope=5.0)
    laden = body_on(task.model, given)
    assert laden.mass == pytest.approx(1.2 * task.model.mass)
    assert laden.ground == Ground(5.0)
    bare = body_without(laden, given)
    for was, now in zip(task.model.segments, bare.segments, strict=True):
        assert now.mass == pytest.approx(was.mass)
        np.testing.assert_allclose(now.centre_of_mass, was.centre_of_mass, atol=1e-12)
        np.testing.assert_allclose(now.inertia, was.inertia, atol=1e-12)
    assert body_on(task.model, settings()) is task.model


def test_muscles_are_of_the_person_and_move_the_load_too(task):
    """Whose rest and strength do not grow with a load."""
    given, mu = settings(load=20.0), nominal_parameters()
    person, laden = person_and_laden(body_on(task.model, given), mu, given)
    assert person.mass == pytest.approx(task.model.mass)
    assert laden.mass == pytest.approx(1.2 * task.model.mass)
    alone, none = person_and_laden(task.model, mu, settings(slope=5.0))
    assert alone.mass == pytest.approx(task.model.mass)
    assert none is None


def test_what_is_known_on_a_slope_is_the_level_record_and_other_people(monkeypatch):
    found = known_record(SUBJECT, settings(slope=5.0), builtin_subjects())
    assert found.accuracy is ON_A_SLOPE
    wanted = on_ground(RECORD, settings(slope=5.0))
    np.testing.assert_allclose(
        found.record.angles["knee_angle_r"](PHASE), wanted.angles["knee_angle_r"](PHASE), atol=1e-3
    )


@pytest.mark.parametrize("slope", [12.0, 17.0])
def test_feet_that_would_slide_are_refused(slope):
    """On wet ground: what the person's forces need, what there is, and how steep it may be."""
    wet = CONTACT.model_copy(update={"dynamic_to_static": 0.6})
    with pytest.raises(ConfigurationError, match=r"is 0\.48.*slide.*at most \+\d+\.\d %"):
        check_ground(RECORD, settings(slope=slope), wet)
    check_ground(RECORD, settings(slope=slope), CONTACT)
    assert friction_needed(on_ground(RECORD, settings(slope=slope))) > friction_needed(RECORD)
    ice = CONTACT.model_copy(update={"dynamic_to_static": 0.2})
    with pytest.raises(ConfigurationError, match="On the level they would slide, too"):
        check_ground(RECORD, settings(slope=-slope), ice)


def test_a_slope_that_nobody_was_measured_on_is_refused():
    check_ground(RECORD, settings(slope=17.6), CONTACT)
    for slope in (18.0, -25.0):
        with pytest.raises(ConfigurationError, match=r"up to 10 degrees.*-17\.6 and 17\.6"):
            check_ground(RECORD, settings(slope=slope), CONTACT)
    with pytest.raises(ConfigurationError, match=r"60 % of 70\.0 kg is 42\.0 kg"):
        trunk_load(60.0, 70.0)


def test_a_held_out_trial_has_no_slope():
    with pytest.raises(ValueError, match=r"T03.*level without a load"):
        RecordSettings(holdout="T03", slope=5.0)


def test_moments_and_forces_are_those_of_the_fitted_motion(task):
    """Of level walking they are the fit's, at each side's own phase."""
    found = with_fitted_kinetics(RECORD, task.reference, task.model.mass)
    from gaitval.coordinates import ACTUATED

    rows = task.reference.moments / task.model.mass
    right = found.moments["knee_angle_r"](task.reference.phase)
    np.testing.assert_allclose(right, rows[:, ACTUATED.index("knee_angle_r")], atol=0.015)
    left = found.moments["ankle_angle_l"](task.reference.phase - RECORD.left_phase)
    np.testing.assert_allclose(left, rows[:, ACTUATED.index("ankle_angle_l")], atol=0.05)
    assert replace(found, moments=RECORD.moments, forces=RECORD.forces) == RECORD
