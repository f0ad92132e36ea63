"""How a virtual person stands for the standing trial."""

import numpy as np
import pytest

from gaitval.apps.virtual.standing import standing_pose
from gaitval.datasets.subject_file import load_subject
from gaitval.model.body import SEGMENTS
from gaitval.model.tree import segment_frames
from gaitval.scaling.scaling import scale_subject

MODEL = scale_subject(load_subject("S05")).model
ANKLE = 0.08


def frames_of(**angles: object) -> np.ndarray:
    """Frames (14, 4, 4) of a standing body."""
    return segment_frames(MODEL, standing_pose(MODEL, ANKLE, **angles)[None])[0]


def axes(frames: np.ndarray, segment: str) -> np.ndarray:
    return frames[SEGMENTS.index(segment), :3, :3]


@pytest.mark.parametrize("tilt", [0.0, 12.0])
@pytest.mark.parametrize("heading", [0.0, 90.0, -30.0])
def test_both_feet_are_flat_at_the_ankles_height_and_point_ahead(tilt, heading):
    frames = frames_of(tilt=tilt, heading=heading)
    ahead = np.array([np.cos(np.radians(heading)), np.sin(np.radians(heading)), 0.0])
    for foot in ("foot_r", "foot_l"):
        assert frames[SEGMENTS.index(foot), 2, 3] == pytest.approx(ANKLE, abs=1e-9)
        np.testing.assert_allclose(axes(frames, foot)[:, 0], ahead, atol=1e-9)
        np.testing.assert_allclose(axes(frames, foot)[:, 2], [0.0, 0.0, 1.0], atol=1e-9)


def test_the_pelvis_tilts_forward_and_the_trunk_stays_upright():
    """Forward: the front of the pelvis is lower, so its x axis points down by the tilt."""
    frames = frames_of(tilt=10.0)
    assert axes(frames, "pelvis")[2, 0] == pytest.approx(-np.sin(np.radians(10.0)))
    np.testing.assert_allclose(axes(frames, "torso")[:, 2], [0.0, 0.0, 1.0], atol=1e-9)


def test_toes_point_out_on_both_sides():
    frames = frames_of(tilt=0.0, toe_out={"r": 7.0, "l": 7.0})
    right, left = (axes(frames, foot)[:, 0] for foot in ("foot_r", "foot_l"))
    angle = np.degrees(np.arctan2([right[1], left[1]], [right[0], left[0]]))
    assert angle == pytest.approx([-7.0, 7.0], abs=0.05)  # y is to the left


def test_the_right_leg_is_on_the_right():
    frames = frames_of(tilt=0.0)
    right, left = (frames[SEGMENTS.index(name), 1, 3] for name in ("foot_r", "foot_l"))
    assert right < left
