"""Markers and forces of two files as one recording."""

from dataclasses import replace

import numpy as np
import pytest
from motion_files import FORCE, POINT, TORQUE, forces, recording, refuse, trc

from gaitval.errors import RecordError, RecordWarning
from gaitval.mocap.mot import read_storage
from gaitval.mocap.mot_writing import write_storage
from gaitval.mocap.reading import read_recording
from gaitval.mocap.recording import Recording
from gaitval.mocap.trc import read_trc
from gaitval.mocap.trc_writing import write_trc


class TestMarkersWithForces:
    def test_one_recording(self, tmp_path):
        markers = trc(tmp_path / "a.trc")
        read = read_recording(markers, forces=forces(tmp_path / "a.mot"))
        assert (read.marker_rate, read.force_rate) == (100.0, 1000.0)
        assert len(read.plates[0].force) == 10 * len(read.markers) == 200
        assert "a.trc" in read.source
        assert "a.mot" in read.source

    def test_cut_to_what_both_cover(self, tmp_path):
        markers = trc(tmp_path / "a.trc")
        path = forces(tmp_path / "a.mot", start=0.021, samples=189)  # to 0.209 s; markers to 0.19
        read = read_recording(markers, forces=path)
        assert read.start == pytest.approx(0.03)
        np.testing.assert_allclose(read.markers, read_trc(markers).markers[3:])
        assert len(read.plates[0].force) == 10 * len(read.markers)
        # The first 50 samples of the file are unloaded: to 0.071 s.
        loaded = read.force_time[np.isfinite(read.plates[0].centre_of_pressure[:, 0])]
        assert loaded[0] == pytest.approx(0.071, abs=1e-3)

    def test_rajagopal_walk(self, gait_data):
        """Two steps of the right foot and one of the left, each point under its own foot."""
        folder = gait_data / "opensim_rajagopal" / "ExpData"
        read = read_recording(folder / "motion_capture_walk.trc", forces=folder / "grf_walk.mot")
        assert [plate.name for plate in read.plates] == ["r", "l"]
        assert read.force_rate == 2000.0
        assert len(read.plates[0].force) == 20 * len(read.markers)
        for plate, side in zip(read.plates, "RL", strict=True):
            force, pressure = plate.force[::20], plate.centre_of_pressure[::20]
            loaded = force[:, 1] > 100
            heel, toe = read.marker(f"{side}.Heel"), read.marker(f"{side}.Toe")
            behind = (pressure - heel)[loaded, 0]
            ahead = (toe - pressure)[loaded, 0]
            assert behind.min() > -0.03  # the heel's edge is behind its marker
            assert ahead.min() > -0.06  # and the toes reach beyond theirs
            assert np.abs(pressure - (heel + toe) / 2)[loaded, 2].max() < 0.08

    @pytest.mark.parametrize(
        ("options", "words"),
        [
            ({"rate": 40.0, "samples": 60, "start": 0.0}, "rate at which they were recorded"),
            ({"samples": 400}, "Give the forces of the same trial"),
            ({"start": 5.0}, "Give the forces of the same trial"),
            ({"point": (500.0, 0.0, 300.0)}, "divide mm by 1000"),
            ({"point": (50.0, 0.0, 9000.0)}, "another trial or in other axes"),
            ({"sign": -1.0}, "forces on the plate"),
            ({"axes": "xzy"}, "other axes than the markers"),
            ({"samples": 1}, "a single sample"),
        ],
    )
    def test_refusals(self, tmp_path, options, words):
        path = forces(tmp_path / "a.mot", **options)
        refuse(read_recording, trc(tmp_path / "a.trc"), str(path), words, forces=path)

    @pytest.mark.parametrize("rate", [1050.0, 250.0, 120.0, 90.0])
    def test_forces_at_no_multiple_of_the_markers_rate_are_resampled(self, tmp_path, rate):
        path = forces(tmp_path / "a.mot", rate=rate, samples=round(0.2 * rate))
        table = read_storage(path)
        # A ramp under load, which any other time would change.
        load = np.tile(np.r_[FORCE, POINT, TORQUE], (len(table.time), 1))
        load[:, :3] *= (1.0 + table.time)[:, None]
        write_storage(path, replace(table, values=load))
        with pytest.warns(RecordWarning, match=rf"{rate:g} Hz .*resampled to"):
            read = read_recording(trc(tmp_path / "a.trc"), forces=path)
        (plate,) = read.plates
        assert read.force_rate % read.marker_rate == 0.0
        wanted = np.outer(1.0 + read.force_time, FORCE)
        inside = read.force_time <= table.time[-1]
        np.testing.assert_allclose(plate.force[inside], wanted[inside], rtol=1e-6)
        np.testing.assert_allclose(plate.centre_of_pressure, np.tile(POINT, (len(inside), 1)))

    def test_a_part_that_both_files_cover_is_enough(self, tmp_path):
        markers = tmp_path / "a.trc"
        write_trc(markers, recording(200))
        path = forces(tmp_path / "a.mot", samples=1400)
        refuse(read_recording, markers, "--trial-time 0:1.4", "from 0.000 to 1.400 s", forces=path)
        read = read_recording(markers, forces=path, part=(0.3, 1.2))
        assert (read.start, len(read.markers)) == (pytest.approx(0.3), 91)
        assert len(read.plates[0].force) == 10 * len(read.markers)
        refuse(read_recording, markers, "same trial", forces=path, part=(1.0, 1.9))

    def test_a_rate_of_no_camera(self, tmp_path):
        path = tmp_path / "a.trc"
        write_trc(path, recording(1, rate=1e308))
        refuse(read_recording, path, "1e+308 Hz", "cameras record at 50 to 1000 Hz")

    def test_markers_of_an_unknown_kind(self, tmp_path):
        path = forces(tmp_path / "a.mot")
        refuse(read_recording, path, ".c3d, .trc", "not from .mot")


def test_two_people_in_one_file_are_refused_before_their_forces(tmp_path):
    """They have the same names after the colon; objects beside one person have others."""
    names = [f"M{number}" for number in range(12)]
    markers = np.random.default_rng(0).uniform(0.0, 1.5, (50, 24, 3))
    both = (*(f"Ann:{name}" for name in names), *(f"Bob:{name}" for name in names))
    write_trc(tmp_path / "a.trc", Recording("a", "laboratory", both, markers, 100.0))
    with pytest.raises(RecordError, match=r"2 people, .*\(Ann, Bob\)"):
        read_recording(tmp_path / "a.trc")
    one = (*both[:12], *(f"Table:{number}" for number in range(12)))
    write_trc(tmp_path / "b.trc", Recording("b", "laboratory", one, markers, 100.0))
    assert read_recording(tmp_path / "b.trc").names == one
