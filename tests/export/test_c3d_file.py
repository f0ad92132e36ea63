"""The walk as C3D: gaitval's own reader finds the same markers and forces."""

from pathlib import Path

import numpy as np
import pytest

from gaitval.apps.export.c3d_file import CAMERA_STEPS, recording_of, write_c3d_file
from gaitval.apps.export.virtual_markers import JOINT_CENTRES
from gaitval.apps.export.walked import ExportedWalk
from gaitval.mocap.c3d import read_c3d
from gaitval.mocap.recording import Recording
from gaitval.model.body import SEGMENTS
from gaitval.model.tree import segment_frames


@pytest.fixture(scope="module")
def read(walked: ExportedWalk, tmp_path_factory: pytest.TempPathFactory) -> Recording:
    (path,) = write_c3d_file(tmp_path_factory.mktemp("c3d"), walked)
    return read_c3d(Path(path))


def test_markers_come_in_again(walked: ExportedWalk, read: Recording) -> None:
    """To C3D's single precision: half a micrometre at ten metres."""
    written = recording_of(walked)
    assert read.names == written.names
    assert read.marker_rate == pytest.approx(written.marker_rate)
    np.testing.assert_allclose(read.markers, written.markers, atol=2e-6)


def test_joint_centres_are_those_of_the_walk(walked: ExportedWalk, read: Recording) -> None:
    shown = walked.walk.positions[walked.rows][::CAMERA_STEPS][: len(read.markers)]
    frames = segment_frames(walked.body, shown)
    for name, segment in JOINT_CENTRES.items():
        expected = frames[:, SEGMENTS.index(segment), :3, 3]
        np.testing.assert_allclose(read.marker(name), expected, atol=2e-6, err_msg=name)


def test_each_foots_force_is_on_its_own_plate(walked: ExportedWalk, read: Recording) -> None:
    walk = walked.walk.ground_reaction[walked.rows][: len(read.force_time)]
    assert len(read.plates) == 2
    for side, plate in enumerate(read.plates):
        loaded = walk[:, side, 2] > 20.0
        np.testing.assert_allclose(plate.force[loaded], walk[loaded, side], atol=2e-3)  # N
        point = walked.walk.centre_of_pressure[walked.rows][: len(loaded)][loaded, side]
        np.testing.assert_allclose(plate.centre_of_pressure[loaded], point, atol=1e-4)  # m
