from dataclasses import replace

import numpy as np
import pytest
from scipy.spatial.transform import Rotation
from synthetic_walk import MODEL, perfect_walk, sharp_filter, synthetic_record

from experiments import gps_controls, healthy_bands
from gaitval.gait.cycle_curves import recorded_curves
from gaitval.gait.healthy_controls import PROFILE_ANGLES, load_controls
from gaitval.metrics.comparison import foot_progression
from gaitval.metrics.cycles import find_cycles
from gaitval.metrics.gait_profile import gait_profile, is_control, walk_profiles
from gaitval.metrics.origin import everything
from gaitval.subjects.subject_file import builtin_subjects, load_subject

WBDS = {"S01": "WBDS01", "S03": "WBDS12", "S05": "WBDS14"}
"""Built-in subjects whose overground strides are among the controls'."""


def _both(curves, shift=0.0):
    return {f"{name}_{side}": curve + shift for name, curve in curves.items() for side in "rl"}


def test_the_mean_of_healthy_people_scores_nothing_and_an_offset_itself():
    controls = load_controls().curves
    assert gait_profile(_both(controls), controls).total == 0.0
    found = gait_profile(_both(controls, 3.0), controls)
    assert list(found.scores.values()) == pytest.approx([3.0] * 18)
    assert found.total == pytest.approx(3.0)


def test_the_score_is_the_rms_of_its_variables_and_of_its_sides():
    controls = load_controls().curves
    angles = _both(controls)
    angles["knee_angle_r"] = angles["knee_angle_r"] + 9.0
    found = gait_profile(angles, controls)
    assert found.scores["knee_angle_r"] == pytest.approx(9.0)
    assert found.right == pytest.approx(3.0)  # one of nine
    assert found.left == 0.0
    assert found.total == pytest.approx(3.0 / np.sqrt(2.0))


def test_variables_that_are_missing_are_left_out():
    controls = load_controls().curves
    angles = _both(controls, 2.0)
    del angles["foot_progression_l"]
    found = gait_profile(angles, controls)
    assert len(found.scores) == 16
    assert found.total == pytest.approx(2.0)
    with pytest.raises(ValueError, match="none of the angles"):
        gait_profile({"knee_angle_r": controls["knee_angle"]}, controls)


def test_the_shipped_people_are_those_of_the_data(gait_data):
    assert gps_controls.controls_file(gait_data) == gps_controls.FILE.read_text("utf-8")
    assert healthy_bands.bands_file(gait_data) == healthy_bands.FILE.read_text("utf-8")


def test_groups_score_as_their_source_says(gait_data):
    """Stated with one digit: a group's mean to 0.05, one of a rounded reference to a little
    more."""
    for group, (mean, spread) in gps_controls.differences(gait_data).items():
        assert mean <= 0.1, group
        assert spread <= 0.1, group


def test_signs_are_those_of_the_same_people_in_the_built_in_subjects(gait_data):
    """Treadmill and overground, but the same persons: each angle must move the same way. Pelvic
    tilt hardly moves at all, so the mean over people is looked at."""
    table, phase = gps_controls.strides(gait_data).xs("control"), np.linspace(0.0, 1.0, 101)
    for name in PROFILE_ANGLES:
        alike = []
        for subject, person in WBDS.items():
            angles = load_subject(subject).record().angles
            alike += [
                np.corrcoef(angles[f"{name}_{side}"](phase), table.loc[person, side, name])[0, 1]
                for side in "rl"
            ]
        assert np.mean(alike) > 0.6, name


def test_the_built_in_people_are_among_the_controls_and_others_are_not():
    assert all(is_control(subject) for subject in builtin_subjects())
    one = builtin_subjects()[0]
    assert is_control(one.model_copy(update={"person": "WBDS42"}))
    for person in ("WBDS43", "WBDS142", "my laboratory, WBDS14", "", "WBDS00"):
        assert not is_control(one.model_copy(update={"person": person}))
    assert not is_control(one.model_copy(update={"laboratory": "another"}))


def test_record_and_walk_are_scored_from_the_same_angles():
    record = synthetic_record()
    curves = recorded_curves(record)
    for kind in (curves.angles, curves.moments, curves.forces):
        for name, curve in kind.items():
            kind[name] = np.tile(curve, (2, 1))
    curves.angles["knee_angle_r"][:, 20:41] += np.radians(30.0)
    feet = {f"foot_progression_{side}": np.zeros((2, 101)) for side in "rl"}
    found = walk_profiles(curves, feet, record, everything("recorded"))
    assert "foot_progression" not in found.variables  # the made-up record has none
    assert len(found.variables) == 8
    changed = {
        name
        for name, score in found.walk.scores.items()
        if score != pytest.approx(found.record.scores[name], abs=1e-6)
    }
    assert changed == {"knee_angle_r"}
    curves.angles["hip_flexion_l"] = curves.angles["hip_flexion_l"][:1]
    assert walk_profiles(curves, feet, record, everything("recorded")) is None


def test_feet_turn_with_the_walk():
    """Both feet of a walk that is turned to the left by 0.2 rad point 0.2 rad more to the left,
    which is towards the midline for the right one only, while they are flat on the ground."""
    record = synthetic_record()
    configuration = sharp_filter(cycles=5, start_phases=(0.0,))
    walk = perfect_walk(record, cycles=8.0)
    cycles = find_cycles(walk, configuration).first(4)
    turn = Rotation.from_rotvec([0.0, 0.0, 0.2])
    positions = walk.positions.copy()
    positions[:, :3] = (turn * Rotation.from_rotvec(positions[:, :3])).as_rotvec()
    straight = foot_progression(walk, cycles, MODEL)
    turned = foot_progression(replace(walk, positions=positions), cycles, MODEL)
    for side, sign in (("r", 1.0), ("l", -1.0)):
        key = f"foot_progression_{side}"
        assert np.allclose((turned[key] - straight[key])[:, 15:25], sign * 0.2, atol=0.02)
