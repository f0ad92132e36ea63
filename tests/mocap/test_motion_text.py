"""TRC, MOT, STO and the text files of WBDS: read as meant, written as OpenSim reads them."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from gaitval.errors import RecordError
from gaitval.mocap.mot import StorageTable, read_ground_reaction, read_storage, write_storage
from gaitval.mocap.reading import read_recording
from gaitval.mocap.recording import Recording
from gaitval.mocap.text_table import sample_rate
from gaitval.mocap.trc import read_trc, write_trc
from gaitval.mocap.wbds_text import read_wbds_forces, read_wbds_markers

FORCE, POINT, TORQUE = (30.0, 700.0, -20.0), (0.5, 0.0, 0.3), (0.0, 4.0, 0.0)


def recording(frames: int = 20, rate: float = 100.0, start: float = 0.0) -> Recording:
    """Three markers about a metre apart that move a little."""
    course = np.linspace(0, 0.1, frames)[:, None, None]
    places = np.array([[0.4, 0.9, 0.2], [0.4, 0.9, 0.5], [0.6, 0.1, 0.3]])
    return Recording("test", "laboratory", ("a", "b.c", "d 1"), places + course, rate, start)


def trc(path: Path, *, units: str = "mm", changes: dict[int, str] | None = None) -> Path:
    """A TRC file of `recording()`; `changes` replaces lines by their number."""
    write_trc(path, recording())
    lines = path.read_text().splitlines()
    lines[2] = lines[2].replace("mm", units)
    for number, line in (changes or {}).items():
        lines[number - 1] = line
    path.write_text("\n".join(lines) + "\n")
    return path


def forces(
    path: Path,
    *,
    rate: float = 1000.0,
    samples: int = 200,
    start: float = 0.0,
    point: tuple[float, ...] = POINT,
    sign: float = 1.0,
    form: str = "ground_force_{}1",
    torque_form: str = "ground_torque_{}1",
    axes: str = "xyz",
) -> Path:
    """A MOT file of one plate that carries FORCE at POINT, and nothing in the first 50 samples."""
    values = np.tile(np.r_[FORCE, point, TORQUE], (samples, 1))
    values[:, [0, 1, 2, 6, 7, 8]] *= sign
    values[:50, [0, 1, 2, 6, 7, 8]] = 0.0
    values[:50, 3:6] = 346.0  # as in OpenSim's own example: nonsense while unloaded
    columns = [form.format(kind + axis) for kind in "vp" for axis in axes]
    columns += [torque_form.format(axis) for axis in axes]
    time = start + np.arange(samples) / rate
    write_storage(path, StorageTable(tuple(columns), time, values))
    return path


def refuse(read: object, path: Path, *words: str, **options: object) -> str:
    assert callable(read)
    with pytest.raises(RecordError) as caught:
        read(path, **options)
    message = str(caught.value)
    for word in words:
        assert word in message, message
    return message


class TestTrc:
    def test_round_trip_with_gaps(self, tmp_path):
        written = recording(start=0.25)
        written.markers[3, 1] = np.nan
        write_trc(tmp_path / "a.trc", written)
        read = read_trc(tmp_path / "a.trc")
        assert read.names == written.names
        assert (read.marker_rate, read.start) == (100.0, 0.25)
        np.testing.assert_allclose(read.markers, written.markers, atol=1e-9)

    @pytest.mark.parametrize(("units", "factor"), [("mm", 1.0), ("cm", 10.0), ("m", 1e3)])
    def test_units(self, tmp_path, units, factor):
        read = read_trc(trc(tmp_path / "a.trc", units=units))
        np.testing.assert_allclose(read.markers, factor * recording().markers, rtol=1e-8)

    def test_zero_and_nan_are_gaps(self, tmp_path):
        row = "1\t0\t0\t0\t0\tNaN\tNaN\tNaN\t600\t0\t300"
        read = read_trc(trc(tmp_path / "a.trc", changes={7: row}))
        assert np.isnan(read.markers[0, :2]).all()
        np.testing.assert_allclose(read.markers[0, 2], [0.6, 0, 0.3])

    def test_opensim_reads_what_is_written(self, tmp_path):
        opensim = pytest.importorskip("opensim")
        written = recording(start=0.5)
        written.markers[3, 1] = np.nan
        written.markers[4, 2] = np.nan
        write_trc(tmp_path / "a.trc", written)
        table = opensim.TimeSeriesTableVec3(str(tmp_path / "a.trc"))
        assert table.getColumnLabels() == written.names
        np.testing.assert_allclose(table.getIndependentColumn(), written.time)
        for name in written.names:
            column = table.getDependentColumn(name)
            read = np.array([column[i].to_numpy() for i in range(20)])
            np.testing.assert_allclose(read, 1e3 * written.marker(name), rtol=1e-8)

    @pytest.mark.parametrize(
        ("name", "frames", "markers"),
        [("static_walk_1", 287, 64), ("static_walk_2", 153, 41), ("motion_capture_walk", 238, 41)],
    )
    def test_rajagopal(self, gait_data, name, frames, markers):
        read = read_trc(gait_data / "opensim_rajagopal" / "ExpData" / f"{name}.trc")
        assert read.markers.shape == (frames, markers, 3)
        assert read.marker_rate == 100.0
        assert np.isfinite(read.markers).all()
        # The anterior iliac spines of an adult are a quarter of a metre apart.
        width = np.linalg.norm(read.marker("R.ASIS") - read.marker("L.ASIS"), axis=1)
        assert 0.22 < width.mean() < 0.28

    @pytest.mark.parametrize(
        ("changes", "words"),
        [
            ({1: "Frame\tTime"}, "not a TRC file"),
            ({3: "100\t100\t20\t3\t100\t1\t20"}, "line 3 has 7 values"),
            ({3: "100\t100\t20\t3\tfurlong\t100\t1\t20"}, "'furlong'"),
            ({3: "fast\t100\t20\t3\tmm\t100\t1\t20"}, "numbers are needed"),
            ({3: "0\t100\t20\t3\tmm\t100\t1\t20"}, "a rate above 0 Hz"),
            ({3: "100\t100\tinf\t3\tmm\t100\t1\t20"}, "whole numbers are needed"),
            ({3: "100\t100\t20\t4\tmm\t100\t1\t20"}, "NumMarkers is 4, but line 4 names 3"),
            ({3: "100\t100\t30\t3\tmm\t100\t1\t30"}, "NumFrames is 30, but there are 20 rows"),
            ({3: "120\t120\t20\t3\tmm\t120\t1\t20"}, "DataRate is 120 Hz"),
            ({26: "20\t0.19\t500\t1000"}, "line 26 has 4 fields, 11 are expected"),
            ({26: "20\t0.19\t500\t1000\t3OO\t1\t1\t1\t1\t1\t1"}, "'3OO' is not a number"),
            ({26: "20\t0.19\tinf\t1\t1\t1\t1\t1\t1\t1\t1"}, "infinite"),
            ({26: "20\t0.05\t1\t1\t1\t1\t1\t1\t1\t1\t1"}, "instead of increasing"),
            ({26: "20\t0.25\t1\t1\t1\t1\t1\t1\t1\t1\t1"}, "not evenly spaced"),
            ({26: "20\t\t1\t1\t1\t1\t1\t1\t1\t1\t1"}, "a time is missing"),
        ],
    )
    def test_refusals(self, tmp_path, changes, words):
        path = trc(tmp_path / "a.trc", changes=changes)
        refuse(read_trc, path, str(path), words)

    def test_truncated_anywhere(self, tmp_path):
        whole = trc(tmp_path / "whole.trc").read_text()
        for size in range(0, len(whole) - 12, 61):
            (tmp_path / "a.trc").write_text(whole[:size])
            refuse(read_trc, tmp_path / "a.trc", "a.trc")

    def test_not_text(self, tmp_path):
        (tmp_path / "a.trc").write_bytes(bytes(range(256)) * 4)
        refuse(read_trc, tmp_path / "a.trc", "not a text file")

    def test_a_folder_name_in_the_code_page_of_windows(self, tmp_path):
        path = trc(tmp_path / "a.trc", changes={1: "PathFileType\t4\t(X/Y/Z)\tC:\\München\\a.trc"})
        path.write_bytes(path.read_text().encode("cp1252"))
        assert read_trc(path).names == recording().names


class TestSampleRate:
    def test_times_rounded_to_milliseconds(self):
        assert sample_rate(Path("a"), np.round(np.arange(374) / 150, 3)) == 150.0

    def test_a_rate_that_is_no_whole_number_stays(self):
        found = sample_rate(Path("a"), np.arange(500) / 119.88)
        assert found == pytest.approx(119.88, rel=1e-9)

    @pytest.mark.parametrize("place", [3, 250, 496])
    def test_one_missing_sample_is_found(self, place):
        with pytest.raises(RecordError, match="not evenly spaced"):
            sample_rate(Path("a"), np.delete(np.arange(500) / 100, place))


class TestStorage:
    @pytest.mark.parametrize("in_degrees", [True, False])
    def test_round_trip(self, tmp_path, in_degrees):
        rng = np.random.default_rng(1)
        table = StorageTable(
            ("hip_flexion_r", "b/c|d"), np.arange(5) / 300, rng.normal(size=(5, 2)), in_degrees, "x"
        )
        write_storage(tmp_path / "a.mot", table)
        read = read_storage(tmp_path / "a.mot")
        assert (read.columns, read.in_degrees, read.name) == (table.columns, in_degrees, "x")
        np.testing.assert_allclose(read.time, table.time, rtol=1e-11)
        np.testing.assert_allclose(read.values, table.values, rtol=1e-11)
        np.testing.assert_array_equal(read.column("b/c|d"), read.values[:, 1])

    def test_opensim_reads_what_is_written(self, tmp_path):
        opensim = pytest.importorskip("opensim")
        table = StorageTable(("a", "b"), np.arange(4) / 150, np.arange(8.0).reshape(4, 2) / 3, True)
        write_storage(tmp_path / "a.mot", table)
        peer = opensim.TimeSeriesTable(str(tmp_path / "a.mot"))
        assert peer.getColumnLabels() == table.columns
        assert peer.getTableMetaDataString("inDegrees") == "yes"
        np.testing.assert_allclose(peer.getMatrix().to_numpy(), table.values, rtol=1e-11)
        np.testing.assert_allclose(peer.getIndependentColumn(), table.time, rtol=1e-11)
        assert opensim.Storage(str(tmp_path / "a.mot")).getSize() == 4

    @pytest.mark.parametrize(
        "header",
        [
            "walk\nversion=1\nnRows=2\nnColumns=3\ninDegrees=yes\nendheader\n",
            "inDegrees=yes\nDataRate=100.0\nDataType=double\nversion=3\nOpenSimVersion=4.2\nendheader\n",
            "walk\ndatacolumns 3\ndatarows 2\nrange 0 1\ninDegrees=yes\nendheader\n",
            "walk\nversion=1\nnRows=2\nnColumns=3\ninDegrees=yes\n\nAngles are in degrees.\n\n"
            "endheader\n\n",
        ],
        ids=["version 1", "version 3", "SIMM", "with a comment"],
    )
    def test_versions_of_the_header(self, tmp_path, header):
        (tmp_path / "a.mot").write_text(header + "time\ta\tb\n 0.0  1 2\n 0.1\t3\t4\n")
        read = read_storage(tmp_path / "a.mot")
        assert read.in_degrees
        assert read.columns == ("a", "b")
        np.testing.assert_array_equal(read.values, [[1, 2], [3, 4]])

    @pytest.mark.parametrize(
        ("text", "words"),
        [
            ("", "empty"),
            ("time\ta\n0\t1\n", "no line `endheader`"),
            ("endheader\n", "nothing follows"),
            ("endheader\ntime\ta\n", "no rows"),
            ("endheader\nt\ta\n0\t1\n", "must begin with time"),
            ("endheader\ntime\ta\ta\n0\t1\t2\n", "column a appears 2 times"),
            ("nRows=2\nendheader\ntime\ta\n0\t1\n", "promises 2 rows, there are 1"),
            ("nColumns=3\nendheader\ntime\ta\n0\t1\n", "promises 3 columns, there are 2"),
            ("endheader\ntime\ta\n0\t1\n0.1\n", "line 4 has 1 fields, 2 are expected"),
            ("endheader\ntime\ta\n0\tone\n", "'one' is not a number"),
            ("DataType=Vec3\nendheader\ntime\ta\n0\t1,2,3\n", "DataType is Vec3"),
        ],
    )
    def test_refusals(self, tmp_path, text, words):
        (tmp_path / "a.sto").write_text(text)
        refuse(read_storage, tmp_path / "a.sto", "a.sto", words)

    def test_third_party_files(self, gait_data):
        folder = gait_data / "wbds" / "raw"
        forces_of = read_storage(folder / "WBDS01walkT01_grf.mot")
        assert forces_of.values.shape == (9000, 18)
        assert not forces_of.in_degrees
        angles = read_storage(folder / "WBDS01walkT01_ik_sample.mot")
        assert angles.name == "Coordinates"
        assert angles.in_degrees
        assert angles.column("hip_flexion_r")[0] == 20.17079055
        errors = read_storage(folder / "WBDS01walkT01_ik_marker_errors.sto")
        assert errors.columns == ("total_squared_error", "marker_error_RMS", "marker_error_max")


class TestGroundReaction:
    @pytest.mark.parametrize(
        ("form", "torque_form", "name"),
        [
            ("ground_force_{}1", "ground_torque_{}1", "1"),
            ("ground_force_r_{}", "ground_torque_r_{}", "r"),
            ("1_ground_force_{}", "1_ground_torque_{}", "1"),
            ("ground_force_{}", "ground_torque_{}", "1"),
            ("ground_force_calcn_l_{}", "ground_moment_calcn_l_m{}", "calcn_l"),
        ],
    )
    def test_names_of_columns(self, tmp_path, form, torque_form, name):
        path = forces(tmp_path / "a.mot", form=form, torque_form=torque_form)
        rate, start, (plate,) = read_ground_reaction(path)
        assert (rate, start, plate.name) == (1000.0, 0.0, name)
        np.testing.assert_allclose(plate.force[-1], FORCE)
        np.testing.assert_allclose(plate.centre_of_pressure[-1], POINT)
        np.testing.assert_allclose(plate.free_moment[-1], TORQUE)

    def test_no_centre_of_pressure_where_unloaded(self, tmp_path):
        _, _, (plate,) = read_ground_reaction(forces(tmp_path / "a.mot"))
        assert np.isnan(plate.centre_of_pressure[:50]).all()
        assert np.isfinite(plate.centre_of_pressure[50:]).all()
        assert plate.moment is None
        assert np.isnan(plate.corners).all()

    def test_no_forces_in_the_file(self, tmp_path):
        write_storage(tmp_path / "a.mot", StorageTable(("hip",), np.arange(3.0), np.ones((3, 1))))
        refuse(read_ground_reaction, tmp_path / "a.mot", "no ground reaction forces", "hip")

    @pytest.mark.parametrize(("lost", "words"), [(4, "point"), (8, "torque"), (1, "force")])
    def test_incomplete_plate(self, tmp_path, lost, words):
        table = read_storage(forces(tmp_path / "a.mot"))
        columns = table.columns[:lost] + table.columns[lost + 1 :]
        write_storage(
            tmp_path / "a.mot",
            replace(table, columns=columns, values=np.delete(table.values, lost, axis=1)),
        )
        refuse(read_ground_reaction, tmp_path / "a.mot", "lacks the " + words)

    @pytest.mark.parametrize("column", [1, 3])
    def test_gaps(self, tmp_path, column):
        table = read_storage(forces(tmp_path / "a.mot"))
        table.values[100, column] = np.nan
        write_storage(tmp_path / "a.mot", table)
        refuse(read_ground_reaction, tmp_path / "a.mot", "missing", "without gaps")


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
            ({"rate": 1050.0, "samples": 210}, "whole multiple"),
            ({"rate": 60.0, "samples": 60, "start": 0.0}, "whole multiple"),
            ({"samples": 400}, "Give the forces of the same trial"),
            ({"start": 5.0}, "Give the forces of the same trial"),
            ({"point": (500.0, 0.0, 300.0)}, "divide the points"),
            ({"point": (50.0, 0.0, 9000.0)}, "another trial or in other axes"),
            ({"sign": -1.0}, "forces on the plate"),
            ({"axes": "xzy"}, "other axes than the markers"),
            ({"samples": 1}, "one sample only"),
        ],
    )
    def test_refusals(self, tmp_path, options, words):
        path = forces(tmp_path / "a.mot", **options)
        refuse(read_recording, trc(tmp_path / "a.trc"), str(path), words, forces=path)

    def test_markers_of_an_unknown_kind(self, tmp_path):
        path = forces(tmp_path / "a.mot")
        refuse(read_recording, path, ".c3d, .trc", "not from .mot")


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
        header = "Time\tFx1\tFy1\tFz1\tCOPx1\tCOPy1\tCOPz1\tTy1" + "\tFx2" * 7
        refuse(read_wbds_forces, wbds_forces(plates, header), "plate 2 lacks Fy, Fz")

    def test_forces_of_another_duration(self, tmp_path):
        plates = wbds_forces(tmp_path / "grf.txt", samples=90)
        markers = wbds_markers(tmp_path / "mkr.txt")
        refuse(read_recording, markers, "Give the forces of the same trial", forces=plates)
