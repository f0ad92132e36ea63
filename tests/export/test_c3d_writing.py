"""What goes out as C3D comes in equal: markers, gaps, plates, rates."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from synthetic_recording import BELTS, walk

from gaitval.errors import RecordError
from gaitval.mocap.c3d import read_c3d
from gaitval.mocap.c3d_writing import write_c3d

TURN = np.array([[0.0, -1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, 1.0]])
"""To axes with y forward and x to the right."""


@pytest.mark.parametrize("turn", [np.eye(3), TURN], ids=["x forward", "y forward"])
def test_what_goes_out_comes_in_equal(tmp_path: Path, turn: np.ndarray) -> None:
    markers = walk(2.0, belt=1.2, plates=BELTS)
    markers.markers[7:12, 3] = np.nan
    # a free moment about the vertical alone, as a plate can measure it
    recording = replace(markers, axes="laboratory").turned(turn)
    write_c3d(tmp_path / "walk.c3d", recording)
    found = read_c3d(tmp_path / "walk.c3d")
    assert found.names == recording.names
    assert (found.marker_rate, found.force_rate, found.start) == (100.0, 500.0, 0.0)
    np.testing.assert_allclose(found.markers, recording.markers, atol=1e-6)
    assert np.isnan(found.markers[7:12, 3]).all()
    for plate, read in zip(recording.plates, found.plates, strict=True):
        np.testing.assert_allclose(read.corners, plate.corners, atol=1e-6)
        np.testing.assert_allclose(read.force, plate.force, atol=1e-3)
        np.testing.assert_allclose(read.moment, plate.moment, atol=1e-3)
        np.testing.assert_allclose(read.centre_of_pressure, plate.centre_of_pressure, atol=1e-5)


def test_standing_without_plates(tmp_path: Path) -> None:
    recording = walk(0.5)
    write_c3d(tmp_path / "stand.c3d", recording)
    found = read_c3d(tmp_path / "stand.c3d")
    assert not found.plates
    np.testing.assert_allclose(found.markers, recording.markers, atol=1e-6)


def test_a_plate_without_a_moment_or_with_other_samples_is_refused(tmp_path: Path) -> None:
    recording = walk(0.5, plates=BELTS)
    (first, second), file = recording.plates, tmp_path / "walk.c3d"
    for plate, message in (
        (replace(first, moment=None), "plate 1 has no moment"),
        (replace(first, corners=np.full((4, 3), np.nan)), "plate 1 has no corners"),
        (replace(first, force=first.force[1:]), "249 samples for 50 frames"),
    ):
        with pytest.raises(RecordError, match=message):
            write_c3d(file, replace(recording, plates=(plate, second)))
        assert not file.exists()
