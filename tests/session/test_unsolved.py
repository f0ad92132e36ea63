"""Frames whose pose was not found, and angles at an end of their range, are named."""

from types import SimpleNamespace
from typing import Any

import numpy as np

from gaitval.coordinates import COORDINATES
from gaitval.model.markers import ModelMarker
from gaitval.model.measured_ranges import MEASURED_RANGES
from gaitval.session.trial import held_angles, unsolved


def test_frames_whose_pose_was_not_found_are_named_with_their_times():
    kinematics: Any = SimpleNamespace(
        determined=np.ones((100, 31), bool), converged=np.ones(100, bool)
    )
    recording: Any = SimpleNamespace(time=2.0 + np.arange(100) / 100)
    kinematics.determined[:10] = kinematics.converged[:10] = False  # not seen: said elsewhere
    assert not list(unsolved(kinematics, recording))
    kinematics.converged[[54, 55, 80]] = False
    (warning,) = unsolved(kinematics, recording)
    assert warning.value == 3
    assert "in 3 of 100 frames" in str(warning)
    assert "frames 54-55 (2.540-2.550 s), 80-80 (2.800-2.800 s). Look" in str(warning)


def test_angles_at_an_end_of_their_range_are_named_with_their_share():
    knee, subtalar = COORDINATES.index("knee_angle_l"), COORDINATES.index("subtalar_angle_r")
    kinematics: Any = SimpleNamespace(
        names=("heel", "toe"),
        positions=np.zeros((100, 31)),
        determined=np.ones((100, 31), bool),
        at_limit=np.zeros((100, 31), bool),
    )
    on_foot = [ModelMarker(name, "foot_r", np.zeros(3)) for name in ("heel", "toe", "unseen")]
    kinematics.at_limit[:5, knee] = True
    kinematics.at_limit[:, subtalar] = True  # not shown by two markers: said elsewhere
    kinematics.positions[:, knee] = MEASURED_RANGES["knee_angle_l"][0]
    assert not list(held_angles(kinematics, on_foot))
    kinematics.determined[50:, knee] = False
    (warning,) = held_angles(kinematics, on_foot)
    assert str(warning).startswith("joint angles: left knee angle -25° in 10 % of the frames: ")
    kinematics.names = ("heel", "toe", "unseen")
    (warning,) = held_angles(kinematics, on_foot)
    assert "right subtalar angle 0° in 100 % of the frames" in str(warning)
