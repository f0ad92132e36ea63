"""Frames whose pose was not found are named."""

from types import SimpleNamespace
from typing import Any

import numpy as np

from gaitval.session.trial import unsolved


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
