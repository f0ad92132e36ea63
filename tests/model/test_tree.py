"""The compiled kinematics against DART, yourdfpy, scipy and the anatomy."""

import numpy as np
import pytest
import yourdfpy
from scipy.spatial.transform import Rotation
from simulation_fixtures import kinematics, random_state

from gaitval.coordinates import ACTUATED, AXES, COORDINATES, mirrored
from gaitval.model.body import SEGMENTS
from gaitval.model.tree import (
    enter_rotation,
    enter_rotation_vector,
    segment_frames,
    tree_arrays,
    whole_body_centre_of_mass,
)
from gaitval.policy.observation import measure_workspace, whole_body_motion

# Everything here is a few hundred products of numbers of the order of ten: rounding leaves
# about 1e-14.
ROUNDING = 1e-12


@pytest.mark.parametrize("seed", range(8))
def test_poses_and_velocities_of_all_segments_are_those_of_dart(task, peer, seed):
    q, qd = random_state(seed)
    seen = kinematics(task.model, q, qd)
    peer.set(q, qd)
    for i, name in enumerate(SEGMENTS):
        body = peer.body(name)
        pose = body.getWorldTransform().matrix()
        np.testing.assert_allclose(seen.rotation[i], pose[:3, :3], atol=ROUNDING)
        np.testing.assert_allclose(seen.origin[i], pose[:3, 3], atol=ROUNDING)
        np.testing.assert_allclose(seen.angular[i], body.getAngularVelocity(), atol=ROUNDING)
        np.testing.assert_allclose(seen.linear[i], body.getLinearVelocity(), atol=ROUNDING)


@pytest.mark.parametrize("seed", range(8))
def test_the_centre_of_mass_and_its_velocity_are_those_of_dart(task, peer, seed):
    q, qd = random_state(seed)
    seen = kinematics(task.model, q, qd)
    tree = tree_arrays(task.model)
    peer.set(q, qd)
    com = whole_body_centre_of_mass(tree, seen)
    motion = np.empty((3, 3))
    whole_body_motion(tree, seen, motion, measure_workspace())
    np.testing.assert_allclose(com, peer.skeleton.getCOM(), atol=ROUNDING)
    np.testing.assert_allclose(motion[0], peer.skeleton.getCOM(), atol=ROUNDING)
    np.testing.assert_allclose(motion[1], peer.skeleton.getCOMLinearVelocity(), atol=ROUNDING)


def test_a_body_that_turns_as_a_whole_has_one_angular_velocity(task):
    q, qd = random_state(4)
    qd[6:] = 0.0
    motion = np.empty((3, 3))
    frames = kinematics(task.model, q, qd)
    whole_body_motion(tree_arrays(task.model), frames, motion, measure_workspace())
    np.testing.assert_allclose(motion[2], qd[:3], atol=ROUNDING)


def test_a_coordinate_turns_its_segment_about_the_axis_that_forward_reports(task, peer):
    q, _ = random_state(3)
    axes = kinematics(task.model, q, np.zeros(31)).axes
    for i, name in enumerate(COORDINATES):
        if name not in ACTUATED:
            continue
        qd = np.zeros(31)
        qd[i] = 1.0
        peer.set(q, qd)
        moved = [
            body.getAngularVelocity()
            for body in map(peer.body, SEGMENTS)
            if np.any(body.getAngularVelocity())
        ]
        assert moved, name
        for angular_velocity in moved:
            np.testing.assert_allclose(axes[i], angular_velocity, atol=ROUNDING)


def test_the_legs_alone_are_the_same_as_in_the_whole_body(task):
    """Contact computes the first nine segments only."""
    q, qd = random_state(4)
    whole = kinematics(task.model, q, qd)
    legs = kinematics(task.model, q, qd, 9)
    assert SEGMENTS[:9][-1] == "toes_l"
    for name in ("rotation", "origin", "linear", "angular"):
        found, expected = getattr(legs, name)[:9], getattr(whole, name)[:9]
        np.testing.assert_array_equal(found, expected, name)


def test_segment_frames_are_those_of_yourdfpy(task, peer):
    robot = yourdfpy.URDF.load(str(peer.path))
    poses = np.array([random_state(seed)[0] for seed in range(4)])
    frames = segment_frames(task.model, poses)
    assert frames.shape == (4, 14, 4, 4)
    for q, frame in zip(poses, frames, strict=True):
        robot.update_cfg(dict(zip(ACTUATED, q[6:], strict=True)))
        pelvis = np.eye(4)
        pelvis[:3, :3] = Rotation.from_rotvec(q[:3]).as_matrix()
        pelvis[:3, 3] = q[3:6]
        for name, seen in zip(SEGMENTS, frame, strict=True):
            expected = pelvis @ robot.get_transform(name, "pelvis")
            np.testing.assert_allclose(seen, expected, atol=ROUNDING)


# 0.99e-7, 1.01e-7, 0.99e-4 and 1.01e-4 lie on both sides of the switches to series.
ANGLES = (0.0, 1e-12, 0.99e-7, 1.01e-7, 1e-5, 0.99e-4, 1.01e-4, 0.01, 1.0, 2.0, 3.0)


@pytest.mark.parametrize("angle", ANGLES)
def test_rotation_vectors_are_scipys_and_survive_the_round_trip(angle):
    for direction in np.random.default_rng(0).standard_normal((20, 3)):
        vector = angle * direction / np.linalg.norm(direction)
        matrix = np.empty((3, 3))
        enter_rotation(vector, matrix)
        np.testing.assert_allclose(matrix, Rotation.from_rotvec(vector).as_matrix(), atol=1e-14)
        found = np.empty(3)
        enter_rotation_vector(matrix, found)
        np.testing.assert_allclose(found, vector, rtol=0, atol=ROUNDING)


# ---- What a positive coordinate does to the body, seen from its neutral pose. ----


def moved(task, name: str, segment: str, point=(0.0, 0.0, 0.0), angle: float = 0.2):
    """Displacement (3,) m of a point of a segment when one coordinate becomes positive."""
    poses = np.zeros((2, 31))
    poses[1, COORDINATES.index(name)] = angle
    frames = segment_frames(task.model, poses)[:, SEGMENTS.index(segment)]
    before, after = frames @ np.array([*point, 1.0])
    return (after - before)[:3]


MEDIAL = {"r": 1.0, "l": -1.0}  # the midline is to the left of the right side
FORWARD, LEFT, UP = np.eye(3)


@pytest.mark.parametrize("side", ["r", "l"])
class TestSigns:
    def test_hip_flexion_brings_the_knee_forward_and_up(self, task, side):
        knee = moved(task, f"hip_flexion_{side}", f"shank_{side}")
        assert knee @ FORWARD > 0.05
        assert knee @ UP > 0.001
        assert knee @ LEFT == pytest.approx(0.0, abs=ROUNDING)

    def test_hip_adduction_brings_the_foot_to_the_midline(self, task, side):
        foot = moved(task, f"hip_adduction_{side}", f"foot_{side}")
        assert foot @ LEFT * MEDIAL[side] > 0.1
        assert foot @ FORWARD == pytest.approx(0.0, abs=ROUNDING)

    def test_hip_rotation_turns_the_toes_to_the_midline(self, task, side):
        toes = moved(task, f"hip_rotation_{side}", f"toes_{side}", (0.05, 0.0, 0.0))
        assert toes @ LEFT * MEDIAL[side] > 0.02
        assert toes @ UP == pytest.approx(0.0, abs=ROUNDING)

    def test_knee_flexion_brings_the_foot_backward_and_up(self, task, side):
        foot = moved(task, f"knee_angle_{side}", f"foot_{side}")
        assert foot @ FORWARD < -0.05
        assert foot @ UP > 0.001

    def test_dorsiflexion_raises_the_toes(self, task, side):
        assert moved(task, f"ankle_angle_{side}", f"toes_{side}") @ UP > 0.015

    def test_inversion_turns_the_sole_to_the_midline(self, task, side):
        # The sole is under the joint: its middle moves to the midline, its medial edge up.
        name, foot = f"subtalar_angle_{side}", f"foot_{side}"
        assert moved(task, name, foot, (0.0, 0.0, -0.07)) @ LEFT * MEDIAL[side] > 0.01
        medial_edge = (0.0, 0.03 * MEDIAL[side], -0.07)
        assert moved(task, name, foot, medial_edge) @ UP > 0.005

    def test_toe_extension_raises_the_tip_of_the_toes(self, task, side):
        tip = moved(task, f"mtp_angle_{side}", f"toes_{side}", (0.06, 0.0, 0.0))
        assert tip @ UP > 0.01
        assert not np.any(moved(task, f"mtp_angle_{side}", f"foot_{side}"))

    def test_shoulder_flexion_brings_the_elbow_forward(self, task, side):
        assert moved(task, f"arm_flex_{side}", f"forearm_{side}") @ FORWARD > 0.04

    def test_shoulder_adduction_brings_the_elbow_to_the_midline(self, task, side):
        elbow = moved(task, f"arm_add_{side}", f"forearm_{side}")
        assert elbow @ LEFT * MEDIAL[side] > 0.04

    def test_internal_rotation_of_the_arm_turns_its_front_to_the_midline(self, task, side):
        front = moved(task, f"arm_rot_{side}", f"upper_arm_{side}", (0.1, 0.0, 0.0))
        assert front @ LEFT * MEDIAL[side] > 0.01

    def test_elbow_flexion_brings_the_hand_forward_and_up(self, task, side):
        hand = moved(task, f"elbow_flex_{side}", f"forearm_{side}", (0.0, 0.0, -0.25))
        assert hand @ FORWARD > 0.04
        assert hand @ UP > 0.001


def test_lumbar_signs(task):
    def head(name):
        return moved(task, name, "torso", (0.0, 0.0, 0.5))

    assert head("lumbar_extension") @ FORWARD < -0.09
    assert head("lumbar_bending") @ LEFT < -0.09  # to the right
    chest = moved(task, "lumbar_rotation", "torso", (0.1, 0.0, 0.3))
    assert chest @ LEFT > 0.015


def test_both_sides_are_mirror_images(task):
    """The axes of a left coordinate are those of the right one in the mirror y → -y, in which
    axes of turning change their sign as pseudovectors do."""
    for name, axis in AXES.items():
        x, y, z = AXES[mirrored(name)]
        if name.endswith(("_r", "_l")):
            assert axis == (-x, y, -z)
        else:
            assert mirrored(name) == name
