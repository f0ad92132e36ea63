"""What `gaitval export` writes comes in equal, by the readers that an import uses."""

from pathlib import Path

import numpy as np
import pytest
from opensim_motion import read_motion

from gaitval.apps.export.c3d_file import CAMERA_STEPS, recording_of, write_c3d_file
from gaitval.apps.export.opensim_folder import foot_forces, write_opensim
from gaitval.apps.export.walked import ExportedWalk
from gaitval.mocap.c3d_writing import write_c3d
from gaitval.mocap.force_plates import UNLOADED_N
from gaitval.mocap.reading import read_recording
from gaitval.mocap.trc_writing import write_trc
from gaitval.session.opensim.coordinates import TO_OPENSIM

EQUAL = 1e-6


@pytest.fixture(scope="module")
def walked() -> ExportedWalk:
    return ExportedWalk.of("5")


def relative(read: np.ndarray, written: np.ndarray) -> float:
    return float(np.abs(read - written).max() / np.abs(written).max())


@pytest.mark.slow
def test_c3d(walked: ExportedWalk, tmp_path: Path) -> None:
    (path,) = write_c3d_file(tmp_path, walked)
    read, written = read_recording(path), recording_of(walked)
    assert relative(read.markers, written.markers) < EQUAL
    for theirs, ours in zip(read.plates, written.plates, strict=True):
        on = ours.force[:, 2] > 2.0 * UNLOADED_N
        assert relative(theirs.force, ours.force) < EQUAL
        assert relative(theirs.centre_of_pressure[on], ours.centre_of_pressure[on]) < EQUAL
    # and out of what was read again
    write_c3d(tmp_path / "again.c3d", read)
    again = read_recording(tmp_path / "again.c3d")
    assert relative(again.markers, read.markers) < EQUAL


@pytest.mark.slow
def test_opensim(walked: ExportedWalk, tmp_path: Path) -> None:
    """The forces with markers of the same walk, as an import is given them."""
    _, motion, _, reaction, *_ = write_opensim(tmp_path, walked)
    _, positions = read_motion(motion)
    assert relative(positions, walked.walk.positions[walked.rows]) < EQUAL
    markers = recording_of(walked)
    bare = markers.with_markers(markers.names, markers.markers).turned(TO_OPENSIM)
    write_trc(tmp_path / "walk.trc", bare)
    read = read_recording(tmp_path / "walk.trc", forces=reaction)
    forces = foot_forces(walked)
    count = len(read.plates[0].force)
    assert count >= len(read.markers) * CAMERA_STEPS - 1
    turn = np.asarray(TO_OPENSIM).T
    for side, plate in enumerate(read.plates):
        force, point = forces.force[:count, side] @ turn, forces.centre_of_pressure[:count, side]
        on = forces.force[:count, side, 2] > 2.0 * UNLOADED_N
        assert relative(plate.force, force) < EQUAL
        assert relative(plate.centre_of_pressure[on], point[on] @ turn) < EQUAL
        assert relative(plate.free_moment[on], forces.free_moment[:count, side][on] @ turn) < 1e-5
