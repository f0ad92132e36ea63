"""The text files of WBDS: read as meant."""

from pathlib import Path

import numpy as np
import pytest
from motion_files import FORCE, POINT, TORQUE, refuse

from gaitval.mocap.reading import read_recording
from gaitval.mocap.wbds_text import read_wbds_forces, read_wbds_markers


def wbds_markers(path: Path, lines: list[str] | None = None) -> Path:
    rows = lines or [
        f"{i / 150:.3f}\t400\t900\t200\t400\t900\t{i}\t600\t100\t300" for i in range(9)
    ]
    header = "Time\tR.ASISX\tR.ASISY\tR.ASISZ\tL.ASISX\tL.ASISY\tL.ASISZ\tR.MT1X\tR.MT1Y\tR.MT1Z"
    path.write_text("\n".join([header, *rows]) + "\n")
    return path


def wbds_forces(path: Path, header: str | None = None, samples: int = 18) -> Path:
    names = [f"{n}{i}" for i in (1, 2) for n in ("Fx", "Fy", "Fz", "COPx", "COPy", "COPz", "Ty")]
    rows = []
    for i in range(samples):
        loaded = [30, 700, -20, 500, 0, 300, 4000] if i > 5 else [0, 0, 0, -9999, 0, 7777, 0]
        rows.append("\t".join(str(value) for value in [i, *loaded, 0, 2, 0, 1, 2, 3, 0]))
    path.write_text("\n".join([header or "\t".join(["Time", *names]), *rows]) + "\n")
    return path


class TestWbds:
    def test_markers(self, tmp_path):
        read = read_wbds_markers(
            wbds_markers(
                tmp_path / "mkr.txt",
                ["0\t1\t2\t3\tNaN\tNaN\tNaN\t4\t5\t6", "0.007\t1\t2\t3\t\t\t\t4\t5\t6"],
            )
        )
        assert read.names == ("R.ASIS", "L.ASIS", "R.MT1")
        np.testing.assert_allclose(read.marker("R.MT1"), np.tile([0.004, 0.005, 0.006], (2, 1)))
        assert np.isnan(read.marker("L.ASIS")).all()

    def test_forces_in_newtons_and_millimetres(self, tmp_path):
        rate, start, plates = read_wbds_forces(wbds_forces(tmp_path / "grf.txt"))
        assert (rate, start) == (300.0, 0.0)
        assert [plate.name for plate in plates] == ["1", "2"]
        np.testing.assert_allclose(plates[0].force[-1], FORCE)
        np.testing.assert_allclose(plates[0].centre_of_pressure[-1], POINT)
        np.testing.assert_allclose(plates[0].free_moment[-1], TORQUE)
        assert np.isnan(plates[0].centre_of_pressure[:6]).all()
        assert np.isnan(plates[1].centre_of_pressure).all()

    def test_markers_and_forces(self, tmp_path):
        read = read_recording(
            wbds_markers(tmp_path / "mkr.txt"), forces=wbds_forces(tmp_path / "grf.txt")
        )
        assert (read.marker_rate, read.force_rate) == (150.0, 300.0)
        assert len(read.plates[0].force) == 2 * len(read.markers)

    def test_overground_trial(self, gait_data):
        read = read_recording(gait_data / "wbds" / "raw" / "WBDS01walkO01Cmkr.txt")
        assert read.marker_rate == 150.0
        assert read.markers.shape == (374, 22, 3)
        travel = read.marker("R.ASIS")[-1] - read.marker("R.ASIS")[0]
        assert travel[0] / (read.time[-1] - read.time[0]) == pytest.approx(1.26, abs=0.01)

    def test_exchanged_and_damaged_files(self, tmp_path):
        markers, plates = wbds_markers(tmp_path / "mkr.txt"), wbds_forces(tmp_path / "grf.txt")
        refuse(read_wbds_markers, plates, "not a marker file of WBDS", "Fx1")
        refuse(read_wbds_forces, markers, "R.ASISX")
        whole = markers.read_text()
        markers.write_text(whole[:-20])
        refuse(read_wbds_markers, markers, "line 10 has")
        markers.write_text(whole.splitlines()[0])
        refuse(read_wbds_markers, markers, "no rows")
        markers.write_text("hello\n")  # any text: it is not called truncated
        for read in (read_wbds_markers, read_wbds_forces):
            refuse(read, markers, "must be Time", "'hello'", ".c3d")
        header = "Time\tFx1\tFy1\tFz1\tCOPx1\tCOPy1\tCOPz1\tTy1" + "\tFx2" * 7
        refuse(read_wbds_forces, wbds_forces(plates, header), "plate 2 lacks Fy, Fz")

    def test_forces_of_another_duration(self, tmp_path):
        plates = wbds_forces(tmp_path / "grf.txt", samples=90)
        markers = wbds_markers(tmp_path / "mkr.txt")
        refuse(read_recording, markers, "Give the forces of the same trial", forces=plates)
