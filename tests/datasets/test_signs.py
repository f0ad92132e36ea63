"""Signs of angles, moments and forces, on both sides, against mechanics rather than belief."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from gaitval.coordinates import AXES, SIDES
from gaitval.model.rotations import foot_angles
from gaitval.subjects.subject_file import builtin_subjects

SUBJECTS = builtin_subjects()
# Single stance, rows 8-55 %: no impact, and the segments' weight and inertia are small
# beside the ground reaction.
STANCE = np.linspace(0.08, 0.55, 48)
THIGH, SHANK = 0.245, 0.246  # of stature, Drillis and Contini


def turn(axis, angle):
    return Rotation.from_rotvec(np.outer(angle, axis))


def axes_of(side):
    """Axes of flexion, adduction and internal rotation of a leg's joints."""
    letter = side[0]
    return {
        "flexion": np.array(AXES[f"hip_flexion_{letter}"]),
        "knee": np.array(AXES[f"knee_angle_{letter}"]),
        "adduction": np.array(AXES[f"hip_adduction_{letter}"]),
        "rotation": np.array(AXES[f"hip_rotation_{letter}"]),
    }


def leg(record, side, phase):
    """World orientation of pelvis, thigh, shank and foot, from the record's angles."""
    letter, axes = side[0], axes_of(side)
    angle = {name: curve(phase) for name, curve in record.angles.items()}

    def of(name):
        return angle[f"{name}_{letter}"]

    # Own side forward is internal rotation's axis, own side up adduction's reversed, anterior
    # tilt flexion's reversed.
    pelvis = (
        turn(axes["rotation"], of("pelvis_rotation"))
        * turn(-axes["adduction"], of("pelvis_list"))
        * turn(-axes["flexion"], of("pelvis_tilt"))
    )
    thigh = (
        pelvis
        * turn(axes["flexion"], of("hip_flexion"))
        * turn(axes["adduction"], of("hip_adduction"))
        * turn(axes["rotation"], of("hip_rotation"))
    )
    shank = (
        thigh
        * turn(axes["knee"], of("knee_angle"))
        * turn(axes["adduction"], of("knee_adduction"))
        * turn(axes["rotation"], of("knee_rotation"))
    )
    foot = (
        shank
        * turn(axes["flexion"], of("ankle_angle"))
        * turn(axes["adduction"], of("subtalar_angle"))
        * turn(axes["rotation"], of("ankle_rotation"))
    )
    return pelvis, thigh, shank, foot


def balance(signs):
    """Mean square of what is left of hip - knee and knee - ankle moments, (2,).

    signs : of flexion, adduction and rotation of hip, knee and ankle, (3, 3); 1 as recorded.
    """
    left_over = []
    for subject in SUBJECTS:
        record = subject.measured()
        for side in SIDES:
            letter, axes = side[0], axes_of(side)
            _, thigh, shank, foot = leg(record, side, STANCE)
            weight = 9.80665 * record.ground_reaction(side, STANCE)
            moments = []
            for names, bend, segment, sign in zip(
                (
                    ("hip_flexion", "hip_adduction", "hip_rotation"),
                    ("knee_angle", "knee_adduction", "knee_rotation"),
                    ("ankle_angle", "subtalar_angle", "ankle_rotation"),
                ),
                ("flexion", "knee", "flexion"),
                (thigh, shank, foot),
                signs,
                strict=True,
            ):
                vector = sum(
                    s * np.outer(record.moments[f"{name}_{letter}"](STANCE), axes[axis])
                    for s, name, axis in zip(
                        sign, names, (bend, "adduction", "rotation"), strict=True
                    )
                )
                moments.append(segment.apply(vector))
            hip, knee, ankle = moments
            up = np.array([0, 0, subject.height_m])
            left_over.append(
                [
                    np.mean((hip - knee - np.cross(thigh.apply(THIGH * up), weight)) ** 2),
                    np.mean((knee - ankle - np.cross(shank.apply(SHANK * up), weight)) ** 2),
                ]
            )
    return 3 * np.mean(left_over, axis=0)


def test_moments_of_neighbouring_joints_differ_by_the_lever_of_the_ground_reaction():
    hip_knee, knee_ankle = np.sqrt(balance(np.ones((3, 3))))
    # Nm/kg; the moments themselves reach 1 to 1.8. What remains is weight, inertia, segment
    # lengths from stature and the plates' calibration.
    assert hip_knee < 0.20
    assert knee_ankle < 0.28


@pytest.mark.parametrize("joint", range(3))
@pytest.mark.parametrize("axis", range(3))
def test_no_moment_has_the_wrong_sign(joint, axis):
    signs = np.ones((3, 3))
    recorded = balance(signs).sum()
    signs[joint, axis] = -1
    assert balance(signs).sum() > recorded


@pytest.mark.parametrize("subject", SUBJECTS, ids=lambda subject: subject.identifier)
@pytest.mark.parametrize("side", SIDES)
class TestEverySubjectAndSide:
    def test_the_chain_of_angles_gives_the_foot_angles(self, subject, side):
        record, letter = subject.record(), side[0]
        phase = np.linspace(0, 1, 101)
        foot = leg(record, side, phase)[3].as_matrix()
        found = dict(zip(("pitch", "list", "progression"), foot_angles(foot, side).T, strict=True))
        # The source's foot angles have a static offset: a standing foot is not flat to the degree.
        for name, most in (("pitch", 1.5), ("list", 3.0), ("progression", 3.5)):
            difference = found[name] - record.angles[f"foot_{name}_{letter}"](phase)
            assert np.degrees(np.abs(difference).max()) < most

    def test_sagittal_angles(self, subject, side):
        record, letter = subject.record(), side[0]
        phase = np.linspace(0, 1, 101)
        angles = {name: curve(phase) for name, curve in record.angles.items()}
        assert 0.55 < phase[angles[f"knee_angle_{letter}"].argmax()] < 0.9
        assert 30 < np.degrees(np.ptp(angles[f"knee_angle_{letter}"])) < 80
        assert 0.4 < phase[angles[f"hip_flexion_{letter}"].argmin()] < 0.7
        assert angles[f"foot_pitch_{letter}"][0] > 0  # heel first
        assert angles[f"foot_pitch_{letter}"].min() < -0.5  # push-off
        assert np.all(angles[f"pelvis_tilt_{letter}"] > 0)

    def test_moments(self, subject, side):
        record, letter = subject.record(), side[0]
        early, mid, late = 0.1, np.linspace(0.15, 0.45, 30), np.linspace(0.4, 0.65, 30)
        moments = record.moments
        assert moments[f"hip_flexion_{letter}"](early) < 0  # extends
        assert moments[f"hip_flexion_{letter}"](late).max() > 0  # then flexes
        assert moments[f"hip_adduction_{letter}"](mid).max() < -0.3  # abducts
        assert moments[f"ankle_angle_{letter}"](late).min() < -0.7  # plantarflexes

    def test_forces_brake_push_lift_and_point_to_the_midline(self, subject, side):
        record = subject.record()
        stance = np.linspace(0.1, 0.5, 41)
        forward, left, up = record.ground_reaction(side, stance).T
        assert forward[stance < 0.2].mean() < 0 < forward[stance > 0.45].mean()
        assert np.all((up > 0.4) & (up < 1.5))
        assert left.mean() * (1 if side == "right" else -1) > 0.02
