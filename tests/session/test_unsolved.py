"""Frames whose pose was not found, and angles at an end of their range, are told."""

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from gaitval.coordinates import COORDINATES
from gaitval.findings import look
from gaitval.findings.poses import Poses
from gaitval.model.markers import ModelMarker
from gaitval.model.measured_ranges import MEASURED_RANGES

MARKERS = [ModelMarker(name, "foot_r", np.zeros(3)) for name in ("heel", "toe", "unseen")]


@pytest.fixture
def kinematics() -> Any:
    return SimpleNamespace(
        names=("heel", "toe"),
        positions=np.zeros((100, 31)),
        determined=np.ones((100, 31), bool),
        converged=np.ones(100, bool),
        at_limit=np.zeros((100, 31), bool),
    )


def test_frames_whose_pose_was_not_found_are_counted(kinematics):
    kinematics.determined[:10] = kinematics.converged[:10] = False  # not seen: said elsewhere
    assert not look(Poses(kinematics, MARKERS)).flags
    kinematics.converged[[54, 55, 80]] = False
    (warning,) = look(Poses(kinematics, MARKERS)).flags
    assert warning.value == 3
    assert "in 3 of 100 frames, from frame 54 on" in str(warning)


def test_angles_at_an_end_of_their_range_are_named_with_their_share(kinematics):
    knee, subtalar = COORDINATES.index("knee_angle_l"), COORDINATES.index("subtalar_angle_r")
    kinematics.at_limit[:5, knee] = True
    kinematics.at_limit[:, subtalar] = True  # not shown by two markers
    kinematics.positions[:, knee] = MEASURED_RANGES["knee_angle_l"][0]
    assert not look(Poses(kinematics, MARKERS)).flags
    kinematics.determined[50:, knee] = False
    (warning,) = look(Poses(kinematics, MARKERS)).flags
    assert str(warning).startswith("left knee angle: at -25° in 10 % of the frames")
    kinematics.names = ("heel", "toe", "unseen")
    assert "right subtalar angle" in {each.where for each in look(Poses(kinematics, MARKERS)).flags}
