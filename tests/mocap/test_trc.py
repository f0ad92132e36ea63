"""TRC: read as meant, written as OpenSim reads it."""

import warnings

import numpy as np
import pytest
from motion_files import recording, refuse, trc

from gaitval.errors import RecordError, RecordWarning
from gaitval.mocap.trc import read_trc
from gaitval.mocap.trc_writing import write_trc


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

    @pytest.mark.parametrize("ragged", [False, True])
    def test_unlabelled_markers_beside_the_named_ones(self, tmp_path, ragged):
        """Cortex appends markers without a name, in every row or where it saw them."""
        path = trc(tmp_path / "a.trc")
        lines = path.read_text().splitlines()
        for i in range(6 if not ragged else 15, len(lines)):
            lines[i] += "\t1\t2\t3\t"
        path.write_text("\r\n".join(lines) + "\r\n")
        read = read_trc(path)
        assert read.names == recording().names
        np.testing.assert_allclose(read.markers, recording().markers, rtol=1e-8)

    @pytest.mark.parametrize("unnamed", [0, 1])
    @pytest.mark.parametrize("counted", [2, 3])
    def test_a_marker_without_a_name_between_the_others(self, tmp_path, unnamed, counted):
        """Its columns are its own: the markers after it keep theirs."""
        path = trc(tmp_path / "a.trc", changes={3: f"100\t100\t20\t{counted}\tmm\t100\t1\t20"})
        lines, true = path.read_text().splitlines(), recording()
        lines[3] = lines[3].replace(true.names[unnamed], "")
        path.write_text("\n".join(lines) + "\n")
        read = read_trc(path)
        kept = [place for place in range(3) if place != unnamed]
        assert read.names == tuple(true.names[place] for place in kept)
        np.testing.assert_allclose(read.markers, true.markers[:, kept], rtol=1e-8)

    @pytest.mark.parametrize(("header", "message"), [(100.1, False), (100.4, True)])
    def test_times_that_go_at_another_rate_than_the_header_says(self, tmp_path, header, message):
        line = f"{header:g}\t{header:g}\t20\t3\tmm\t100\t1\t20"
        path = trc(tmp_path / "a.trc", changes={3: line})
        with warnings.catch_warnings(record=True) as seen:
            warnings.simplefilter("always")
            assert read_trc(path).marker_rate == 100.0
        assert [
            f"DataRate is {header:g} Hz, but the times go at 100 Hz" in str(w.message) for w in seen
        ] == [True] * message

    def test_a_row_that_ends_early_lacks_its_last_markers(self, tmp_path):
        read = read_trc(trc(tmp_path / "a.trc", changes={9: "3\t0.02\t500\t1000\t300"}))
        np.testing.assert_allclose(read.markers[2, 0], [0.5, 1.0, 0.3])
        assert np.isnan(read.markers[2, 1:]).all()

    def test_as_windows_and_motive_write_it(self, tmp_path):
        """A byte order mark, CRLF, tabs at the ends of lines, a blank line below the header."""
        path = trc(tmp_path / "a.trc")
        text = path.read_text().replace("\n", "\t\r\n")
        path.write_bytes(b"\xef\xbb\xbf" + text.encode())
        np.testing.assert_allclose(read_trc(path).markers, recording().markers, rtol=1e-8)

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
            ({3: "fast\t100\t20\t3\tmm\t100\t1\t20"}, "the counts whole numbers"),
            ({3: "0\t100\t20\t3\tmm\t100\t1\t20"}, "the rate must be above 0 Hz"),
            ({3: "100\t100\tinf\t3\tmm\t100\t1\t20"}, "the counts whole numbers"),
            ({3: "100\t100\t20\t0\tmm\t100\t1\t20", 4: "Frame#\tTime\t"}, "names no marker"),
            ({3: "101\t101\t20\t3\tmm\t100\t1\t20"}, "DataRate is 101 Hz"),
            ({26: "20\t0.19\t500\t1000"}, "line 26 has 4 fields, but the header has 11"),
            ({26: "20 0.19 500 1000 1 2 3 4 5 6 7"}, "a gap would be none: separate them by tabs"),
            ({26: "20\t0.19\t500\t1000\t3OO\t1\t1\t1\t1\t1\t1"}, "'3OO' is not a number"),
            ({26: "20\t0.19\tinf\t1\t1\t1\t1\t1\t1\t1\t1"}, "infinite"),
            ({26: "20\t0.19\t-1e308\t1\t1\t1\t1\t1\t1\t1\t1"}, "infinite"),
            ({26: "20\t0.05\t1\t1\t1\t1\t1\t1\t1\t1\t1"}, "instead of increasing"),
            ({26: "20\t0.25\t1\t1\t1\t1\t1\t1\t1\t1\t1"}, "not evenly spaced"),
            ({26: "20\t\t1\t1\t1\t1\t1\t1\t1\t1\t1"}, "a time is missing"),
        ],
    )
    def test_refusals(self, tmp_path, changes, words):
        path = trc(tmp_path / "a.trc", changes=changes)
        refuse(read_trc, path, str(path), words)

    def test_truncated_anywhere(self, tmp_path):
        """Cut in a row it is refused; cut between two it is used, and that is said."""
        path = trc(tmp_path / "whole.trc")
        whole, all_of_it = path.read_text(), read_trc(path)
        refused = 0
        for size in range(0, len(whole) - 12, 61):
            (tmp_path / "a.trc").write_text(whole[:size])
            with warnings.catch_warnings(record=True) as message:
                warnings.simplefilter("always")
                try:
                    found = read_trc(tmp_path / "a.trc")
                except RecordError:
                    refused += 1
                    continue
            assert any("NumFrames is 20, but there are" in str(each.message) for each in message)
            frames = len(found.markers)
            assert np.array_equal(found.markers, all_of_it.markers[:frames], equal_nan=True)
        assert refused > 5

    @pytest.mark.parametrize(
        ("changes", "words", "frames"),
        [
            ({3: "100\t100\t20\t4\tmm\t100\t1\t20"}, "NumMarkers is 4, but there are 3", 20),
            ({3: "100\t100\t30\t3\tmm\t100\t1\t30"}, "NumFrames is 30, but there are 20", 19),
            ({3: "100\t100\t10\t3\tmm\t100\t1\t10"}, "NumFrames is 10, but there are 20", 20),
        ],
    )
    def test_counts_of_the_header_unlike_the_rows(self, tmp_path, changes, words, frames):
        """As OpenSim's own example of running has them, and markers cut by hand."""
        path = trc(tmp_path / "a.trc", changes=changes)
        with pytest.warns(RecordWarning, match=words):
            assert len(read_trc(path).markers) == frames

    def test_not_text(self, tmp_path):
        (tmp_path / "a.trc").write_bytes(bytes(range(256)) * 4)
        refuse(read_trc, tmp_path / "a.trc", "not a text file")

    def test_a_folder_name_in_the_code_page_of_windows(self, tmp_path):
        path = trc(tmp_path / "a.trc", changes={1: "PathFileType\t4\t(X/Y/Z)\tC:\\München\\a.trc"})
        path.write_bytes(path.read_text().encode("cp1252"))
        assert read_trc(path).names == recording().names
