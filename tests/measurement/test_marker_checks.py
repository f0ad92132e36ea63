"""Trajectories that no camera saw so are doubted; those of a steady walk are not."""

import numpy as np
import pytest
from synthetic_recording import LANDMARKS as SYNTHETIC
from synthetic_recording import walk as synthetic

from gaitval.findings import look
from gaitval.findings.feet import Beside
from gaitval.findings.markers import AsRead
from gaitval.mocap.recording import Recording

RATE = 100.0
NAMES = tuple(f"{side}.{part}" for side in "RL" for part in ("Heel", "Ankle", "MT1", "MT5"))
LANDMARKS = {name: name for name in NAMES}
HEIGHTS = 0.03 + 0.01 * np.arange(len(NAMES))


def trajectory_warnings(recording):
    return look(AsRead(recording, {})).flags


def foot_marker_warnings(standing, walking, landmarks, stood=True):
    return look(Beside(standing, walking, landmarks, stood=stood)).flags


def walked(noise: float = 0.0, step: float = 0.0) -> Recording:
    """Six seconds at 1.2 m/s: markers sway by 2 cm and are lifted by 20 cm, half of the time."""
    random = np.random.default_rng(0)
    time = np.arange(600) / RATE
    lifted = 0.2 * np.clip(np.sin(2 * np.pi * time), 0.0, None)
    markers = np.empty((600, len(NAMES), 3))
    markers[..., 0] = 1.2 * time[:, None]
    markers[..., 1] = 0.02 * np.sin(2 * np.pi * time)[:, None]
    markers[..., 2] = lifted[:, None] + HEIGHTS
    markers += random.normal(0.0, max(noise, 1e-7), markers.shape)
    if step:
        markers = np.round(markers / step) * step
    return Recording("walk", "project", NAMES, markers, RATE)


def stood(**moved: float) -> Recording:
    heights = HEIGHTS + [moved.get(name.replace(".", "_"), 0.0) for name in NAMES]
    markers = np.stack([np.zeros(8), np.zeros(8), heights], axis=1)[None]
    return Recording("stand", "project", NAMES, markers, RATE)


@pytest.mark.parametrize("noise", [0.0, 0.0005, 0.003])
def test_a_walk_that_cameras_saw(noise):
    assert not list(trajectory_warnings(walked(noise)))


@pytest.mark.parametrize(("raised", "names"), [(0.0, []), (0.05, ["R.Heel"]), (-0.05, ["R.Heel"])])
def test_a_marker_of_the_foot_that_is_higher_in_walking(raised, names):
    standing, walking = synthetic(2.0), synthetic(6.0)
    flat = np.tile(np.percentile(walking.markers, 15, axis=0), (len(standing.markers), 1, 1))
    walking.markers[:, walking.names.index("R.Heel"), 2] += raised
    found = foot_marker_warnings(standing.with_markers(standing.names, flat), walking, SYNTHETIC)
    assert [warning.where for warning in found] == names


def test_a_pose_put_together_from_the_walk_says_nothing_of_the_height_of_feet():
    """Its feet are where the walk has them, but for how the pose is put together."""
    raised = stood(R_MT1=-0.03)
    checks = [
        {each.check for each in foot_marker_warnings(raised, walked(), LANDMARKS, s)}
        for s in (True, False)
    ]
    assert "height of a foot's marker" in checks[0]
    assert "height of a foot's marker" not in checks[1]
