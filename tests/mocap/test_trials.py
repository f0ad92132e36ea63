"""Every format of a trial comes in as what was written: markers, forces, both sides, all signs."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from format_files import (
    PERSON,
    TRIALS,
    kistler_text,
    motion_analysis,
    qualisys_tsv,
    vicon_csv,
)

from gaitval.errors import RecordError, RecordWarning
from gaitval.mocap.force_plates import UNLOADED_N
from gaitval.mocap.reading import read_recording
from gaitval.mocap.recording import Recording
from gaitval.mocap.trc_writing import write_trc

RELATIVE = 1e-6
"""Of the quantity's largest value: files have nine digits."""


def assert_same(read: Recording, written: Recording, *, torque: bool = True) -> None:
    assert read.names == written.names
    assert read.marker_rate == pytest.approx(written.marker_rate, rel=1e-9)
    assert read.start == pytest.approx(written.start, abs=1e-9)
    assert read.force_rate == pytest.approx(written.force_rate, rel=1e-9)
    np.testing.assert_array_equal(np.isnan(read.markers), np.isnan(written.markers))
    np.testing.assert_allclose(read.markers, written.markers, atol=RELATIVE)
    assert len(read.plates) == len(written.plates) == 2
    for theirs, ours in zip(read.plates, written.plates, strict=True):
        size = np.linalg.norm(ours.force, axis=1)
        np.testing.assert_allclose(theirs.force, ours.force, atol=RELATIVE * size.max())
        on = size > 2.0 * UNLOADED_N
        np.testing.assert_allclose(
            theirs.centre_of_pressure[on], ours.centre_of_pressure[on], atol=2e-6
        )
        if torque:
            largest = np.abs(ours.free_moment).max()
            np.testing.assert_allclose(
                theirs.free_moment[on], ours.free_moment[on], atol=1e-5 * largest + 2e-5
            )


def assert_right_and_left(read: Recording) -> None:
    """The person walks towards -y with z up, so that the right is towards -x. A foot is pushed up,
    towards the midline, backwards first and then forwards."""
    for plate, side in zip(read.plates, (-1.0, 1.0), strict=True):
        loaded = plate.force[:, 2] > 300.0
        assert np.nanmean(plate.centre_of_pressure[loaded, 0]) * side > 0.02
        assert plate.force[loaded, 2].min() > 0.0
        assert plate.force[loaded, 0].mean() * side < 0.0
        begins = np.flatnonzero(loaded[1:] & ~loaded[:-1])
        ends = np.flatnonzero(~loaded[1:] & loaded[:-1])
        (first, last) = begins[0], ends[ends > begins[0]][0]
        middle = (first + last) // 2
        assert plate.force[first:middle, 1].mean() > 0.0 > plate.force[middle:last, 1].mean()


@pytest.mark.parametrize("name", TRIALS)
def test_what_was_written_comes_in(name: str, trial: Recording, tmp_path: Path) -> None:
    path, forces = TRIALS[name](tmp_path, trial)
    read = read_recording(path, forces=forces)
    assert_same(read, trial)
    assert_right_and_left(read)


@pytest.mark.parametrize("name", TRIALS)
def test_a_child_of_13_kg(name: str, trial: Recording, tmp_path: Path) -> None:
    """Never 200 N on a plate; signs, units and free moments are found as a heavier person's are."""
    share = 13.0 / PERSON["mass"]
    plates = tuple(
        replace(
            plate,
            force=share * plate.force,
            free_moment=share * plate.free_moment,
            centre_of_pressure=np.where(
                share * np.linalg.norm(plate.force, axis=1)[:, None] < UNLOADED_N,
                np.nan,
                plate.centre_of_pressure,
            ),
            moment=share * plate.moment,
        )
        for plate in trial.plates
    )
    child = replace(trial, plates=plates)
    path, forces = TRIALS[name](tmp_path, child)
    assert_same(read_recording(path, forces=forces), child)


@pytest.mark.parametrize(
    "options",
    [
        {"separator": "\t"},
        {"separator": ";"},
        {"on_plate": False},
        {"prefix": ""},
        {"moments": 1.0, "unit": "N.m"},
        {"magnitudes": True},
    ],
)
def test_vicon_as_other_settings_write_it(options, trial, tmp_path) -> None:
    assert_same(read_recording(vicon_csv(tmp_path / "walk.csv", trial, **options)), trial)


@pytest.mark.parametrize("name", ["vicon", "qualisys", "kistler"])
def test_no_centre_of_pressure_below_the_programs_own_threshold(name, trial, tmp_path) -> None:
    """It writes 0 there, but a force and a moment."""
    plates = []
    for plate in trial.plates:
        faint = np.linalg.norm(plate.force, axis=1) < 50.0
        point = np.where(faint[:, None], np.nan, plate.centre_of_pressure)
        plates.append(replace(plate, centre_of_pressure=point))
    given = replace(trial, plates=tuple(plates))
    if name == "kistler":
        write_trc(tmp_path / "walk.trc", given)
        path, forces = tmp_path / "walk.trc", tmp_path / "walk.txt"
        kistler_text(forces, given, sensors=False)
    else:
        path, forces = TRIALS[name](tmp_path, given)
    with pytest.warns(RecordWarning, match="have no centre of pressure"):
        read = read_recording(path, forces=forces)
    for plate, true in zip(read.plates, trial.plates, strict=True):
        faint = np.isfinite(true.centre_of_pressure[:, 0])
        faint &= np.linalg.norm(true.force, axis=1) < 50.0
        away = (plate.centre_of_pressure - true.centre_of_pressure)[faint]
        # a foot is no longer than that
        assert np.linalg.norm(away, axis=1).max() < 0.1
        assert np.abs(plate.free_moment - true.free_moment)[faint].max() < 1.0


def test_vicon_from_a_later_frame_on(trial, tmp_path) -> None:
    later = replace(trial, start=1.5)
    assert_same(read_recording(vicon_csv(tmp_path / "walk.csv", later)), later)


@pytest.mark.parametrize(
    "options",
    [
        {"local": False},
        {"clock": False},
        {"moment": 1e3},
        {"local": False, "moment": 1e3, "clock": False},
        {"on_plate": False},
        {"gap": "NULL"},
        {"gap": "0.000"},
    ],
)
def test_qualisys_as_other_settings_write_it(options, trial, tmp_path) -> None:
    assert_same(read_recording(qualisys_tsv(tmp_path / "walk.tsv", trial, **options)), trial)


@pytest.mark.parametrize("clock", [True, False], ids=["frame and time", "markers alone"])
@pytest.mark.parametrize("which", [0, slice(None)], ids=["first marker", "all markers"])
@pytest.mark.parametrize("gap", ["", "NULL"], ids=["empty", "NULL"])
def test_qualisys_before_the_markers_are_seen(gap, which, clock, trial, tmp_path) -> None:
    """A recording is often longer than the walk through the measured volume."""
    markers = trial.markers.copy()
    markers[:30, which] = np.nan
    markers[-20:, which] = np.nan
    late = replace(trial, markers=markers)
    path = qualisys_tsv(tmp_path / "walk.tsv", late, gap=gap, clock=clock)
    assert_same(read_recording(path), late)


def test_qualisys_forces_for_markers_of_another_file(trial, tmp_path) -> None:
    qualisys_tsv(tmp_path / "walk.tsv", trial)
    write_trc(tmp_path / "walk.trc", trial)
    read = read_recording(tmp_path / "walk.trc", forces=tmp_path / "walk_f_1.tsv")
    assert_same(read, trial)
    np.testing.assert_allclose(read.plates[0].corners, trial.plates[0].corners, atol=1e-6)


@pytest.mark.parametrize("moment", [1.0, 1e3], ids=["Nm", "Nmm"])
def test_motion_analysis_in_either_unit(moment, trial, tmp_path) -> None:
    write_trc(tmp_path / "walk.trc", trial)
    path = motion_analysis(tmp_path / "walk.forces", trial, moment=moment)
    assert_same(read_recording(tmp_path / "walk.trc", forces=path), trial)


@pytest.mark.parametrize("units", [True, False])
@pytest.mark.parametrize("sensors", [True, False], ids=["eight sensors", "force and point"])
def test_kistler_in_either_kind_of_columns(sensors, units, trial, tmp_path) -> None:
    write_trc(tmp_path / "walk.trc", trial)
    path = kistler_text(tmp_path / "walk.txt", trial, sensors=sensors, units=units)
    assert_same(read_recording(tmp_path / "walk.trc", forces=path), trial)


def test_kistler_with_its_own_z_up(trial, tmp_path) -> None:
    """The same plates in other axes: their corners are numbered the other way round."""
    plates = tuple(replace(each, corners=each.corners[[1, 0, 3, 2]]) for each in trial.plates)
    write_trc(tmp_path / "walk.trc", trial)
    path = kistler_text(tmp_path / "walk.txt", replace(trial, plates=plates), sensors=True)
    assert_same(read_recording(tmp_path / "walk.trc", forces=path), trial)


def changed(path: Path, old: str, new: str, count: int = -1) -> Path:
    text = path.read_text(encoding="utf-8-sig")
    assert old in text
    path.write_text(text.replace(old, new, count))
    return path


def refused(path: Path, *words: str, forces: Path | None = None) -> None:
    """It says what was seen and where, why it is wrong, and what to do."""
    with pytest.raises(RecordError) as caught:
        read_recording(path, forces=forces)
    message = str(caught.value)
    for word in words:
        assert word in message, message
    fixes = "Export Give give set Write Copy Enter Tick Label Correct Leave Download"
    assert any(fix in message for fix in fixes.split()), message


class TestVicon:
    @pytest.fixture
    def path(self, trial, tmp_path) -> Path:
        return vicon_csv(tmp_path / "walk.csv", trial)

    @pytest.mark.parametrize(
        ("old", "new", "words"),
        [
            ("Trajectories", "Somethings", ("no section Trajectories", "devices")),
            (",N,N,N,", ",lb,N,N,", ("'lb'", "Force Plate #1 - Force")),
            (",mm,mm,mm", ",px,mm,mm", ("'px'", "no known unit")),
            (" - CoP", " - Centre", ("has no cop", "Export Force, Moment and CoP")),
            ("Fx,Fy,Fz", "Fy,Fx,Fz", ("Fy, Fx, Fz", "Fx, Fy, Fz")),
            ("\n100\n", "\nfast\n", ("'fast'", "(Hz)")),
            ("Frame,Sub Frame,X,Y,Z,X", "Frame,Part,X,Y,Z,X", ("Frame, Part", "Sub Frame")),
            ("\n5,0,", "\n6,0,", ()),
        ],
    )
    def test_what_is_wrong_is_said(self, path, old, new, words) -> None:
        refused(changed(path, old, new), str(path), *words)

    def test_moments_in_other_axes(self, trial, tmp_path) -> None:
        """A plate turned by a right angle, whose moments are in its own axes."""
        turned = [
            replace(plate, moment=plate.moment @ np.array([[0, 1, 0], [-1, 0, 0], [0, 0, 1.0]]))
            for plate in trial.plates
        ]
        path = vicon_csv(tmp_path / "walk.csv", replace(trial, plates=tuple(turned)))
        refused(path, "does not belong to the force", "mm", "Export the trial as C3D")

    def test_cut_off(self, path) -> None:
        text = path.read_text(encoding="utf-8-sig")
        path.write_text(text[: text.rindex(",")][:-40])
        refused(path, "truncated")


class TestQualisys:
    @pytest.fixture
    def path(self, trial, tmp_path) -> Path:
        return qualisys_tsv(tmp_path / "walk.tsv", trial)

    @pytest.mark.parametrize(
        ("old", "new", "words"),
        [
            ("MARKER_NAMES", "MARKERS", ("no line MARKER_NAMES", "NO_OF_FRAMES")),
            ("FREQUENCY\t100", "FREQUENCY\t0", ("FREQUENCY", "above 0")),
            ("FREQUENCY\t100", "FREQUENCY\t50", ("second column", "50 Hz")),
            ("NO_OF_FRAMES\t300", "NO_OF_FRAMES\t301", ("301", "300 rows")),
        ],
    )
    def test_what_is_wrong_with_the_markers(self, path, old, new, words) -> None:
        refused(changed(path, old, new, 1), str(path), *words)

    @pytest.mark.parametrize(
        ("old", "new", "words"),
        [
            ("CORNER_POSX_POSY_X", "CORNER_A", ("no corner", "QTM")),
            ("CORNER_NEGX_POSY_Y\t", "CORNER_NEGX_POSY_Y\tx", ("NEGX_POSY_Y", "length in mm")),
            ("NO_OF_SAMPLES\t1500", "NO_OF_SAMPLES\t1501", ("1501", "1500 rows")),
            ("local (force plate)", "world (lab)", ()),
        ],
    )
    def test_what_is_wrong_with_the_forces(self, path, old, new, words) -> None:
        beside = path.with_name("walk_f_2.tsv")
        changed(beside, old, new, 1)
        refused(path, str(beside.parent), *words)

    @pytest.mark.parametrize("clock", [True, False], ids=["frame and time", "markers alone"])
    def test_decimal_commas(self, clock, trial, tmp_path) -> None:
        path = qualisys_tsv(tmp_path / "comma.tsv", trial, clock=clock)
        text = path.read_text()
        names = text.rindex("MARKER_NAMES")
        path.write_text(text[:names] + text[names:].replace(".", ","))
        read = read_recording(path)
        point = read_recording(qualisys_tsv(tmp_path / "point.tsv", trial, clock=clock))
        np.testing.assert_array_equal(read.markers, point.markers)

    def test_plates_of_another_trial(self, path, trial) -> None:
        shorter = replace(trial, plates=tuple(
            replace(each, **{n: getattr(each, n)[:900] for n in (
                "force", "centre_of_pressure", "free_moment", "moment")})
            for each in trial.plates))  # fmt: skip
        qualisys_tsv(path.with_name("other.tsv"), shorter)
        path.with_name("other_f_2.tsv").replace(path.with_name("walk_f_2.tsv"))
        refused(path, "900 and 1500 samples", "Leave files of other trials out")


class TestMotionAnalysis:
    @pytest.fixture
    def files(self, trial, tmp_path) -> tuple[Path, Path]:
        write_trc(tmp_path / "walk.trc", trial)
        return tmp_path / "walk.trc", motion_analysis(tmp_path / "walk.forces", trial)

    @pytest.mark.parametrize(
        ("old", "new", "words"),
        [
            ("[Force Data]", "[Data]", ("[Data]", "begins with [Force Data]")),
            ("SampleRate", "Rate", ("SampleRate missing",)),
            ("500.000000", "500,000000", ("SampleRate (Hz) is '500,000000'", "decimal comma")),
            ("NumberOfSamples=1500", "NumberOfSamples=1501", ("1501", "1500")),
            ("NumberOfForcePlates=2", "NumberOfForcePlates=3", ("NumberOfForcePlates is 3",)),
            ("FX2\tFY2", "FY2\tFX2", ("fy2",)),
            ("#Sample", "Sample", ("#Sample",)),
        ],
    )
    def test_what_is_wrong_is_said(self, files, old, new, words) -> None:
        markers, forces = files
        refused(markers, str(changed(forces, old, new, 1)), *words, forces=forces)

    def test_a_unit_that_cannot_be_told(self, trial, tmp_path) -> None:
        write_trc(tmp_path / "walk.trc", trial)
        strong = [
            replace(plate, free_moment=np.outer(0.0003 * plate.force[:, 2], [0, 0, 1.0]))
            for plate in trial.plates
        ]
        path = motion_analysis(tmp_path / "a.forces", replace(trial, plates=tuple(strong)))
        refused(tmp_path / "walk.trc", "MZ1", "of a free moment", forces=path)


class TestKistler:
    @pytest.fixture
    def files(self, trial, tmp_path) -> tuple[Path, Path]:
        write_trc(tmp_path / "walk.trc", trial)
        return tmp_path / "walk.trc", kistler_text(tmp_path / "walk.txt", trial)

    @pytest.mark.parametrize(
        ("old", "new", "words"),
        [
            ("Fz4\n", "Fz5\n", ("plate 2 lacks Fz4", "Export")),
            ("s\tN\tN", "s\tlb\tN", ("'lb'", "Fx12")),
        ],
    )
    def test_what_is_wrong_is_said(self, files, old, new, words) -> None:
        markers, forces = files
        refused(markers, str(changed(forces, old, new, 1)), *words, forces=forces)

    def test_places_are_needed(self, files) -> None:
        markers, forces = files
        places = forces.with_suffix(".plates.toml")
        changed(places, "depth = 0.054", "depth = 'x'", 1)
        refused(markers, "depth", "'x'", forces=forces)
        changed(places, "depth = 'x'", "depth = 0.054", 1)
        changed(places, "corners", "edges", 1)
        refused(markers, str(places), "plate 1", "corners", "four points", forces=forces)
        places.write_text("[[plates]]\n")
        refused(markers, "1 tables [[plates]]", "2 plates", forces=forces)
        places.unlink()
        refused(markers, "does not say where", "walk.plates.toml", forces=forces)

    @pytest.mark.parametrize(
        ("first", "second"),
        [("Tz", "|Ft|"), ("|Ft|", "Tz")],
        ids=["of plate 1", "of plate 2"],
    )
    def test_a_free_moment_is_that_of_its_own_plate(self, first, second, trial, tmp_path) -> None:
        """One Tz of two plates: the other's is 0, and this is said."""
        write_trc(tmp_path / "walk.trc", trial)
        path = kistler_text(tmp_path / "walk.txt", trial, sensors=False)
        names = ["Fx", "Fy", "Fz", "|Ft|", "Ax", "Ay"]
        columns = [[*names, first], [*names, second]]
        columns = [[f"{n}{i}" for n in own] for i, own in enumerate(columns, start=1)]
        usual = "\t".join([*names, "Tz", *names, "Tz"])
        changed(path, usual, "\t".join([*columns[0], *columns[1]]))
        has = 0 if first == "Tz" else 1
        with pytest.warns(RecordWarning, match=f"no column Tz of plate {2 - has} "):
            read = read_recording(tmp_path / "walk.trc", forces=path).plates
        assert np.abs(read[1 - has].free_moment).max() == pytest.approx(0.0, abs=1e-9)
        ours = trial.plates[has]
        on = np.linalg.norm(ours.force, axis=1) > 2.0 * UNLOADED_N
        np.testing.assert_allclose(read[has].free_moment[on], ours.free_moment[on], atol=1e-4)

    @pytest.mark.parametrize("numbered", [True, False], ids=["numbers", "no numbers"])
    def test_columns_of_one_quantity_side_by_side(self, numbered, trial, tmp_path) -> None:
        write_trc(tmp_path / "walk.trc", trial)
        path = kistler_text(tmp_path / "walk.txt", trial, sensors=False, units=False)
        lines = path.read_text().splitlines()
        at = next(i for i, line in enumerate(lines) if line.startswith("abs time"))
        order = [0, *(1 + 7 * plate + each for each in range(7) for plate in (0, 1))]
        for i, line in enumerate(lines[at:], start=at):
            cells = line.split("\t")
            if i == at and numbered:
                cells = [cells[0], *(f"{n}{1 + k // 7}" for k, n in enumerate(cells[1:]))]
            lines[i] = "\t".join(cells[each] for each in order)
        path.write_text("\n".join([*lines, ""]))
        assert_same(read_recording(tmp_path / "walk.trc", forces=path), trial)
        changed(path, "Tz1\tTz2" if numbered else "Tz\tTz", "Tz3\tz" if numbered else "Tz\tz")
        refused(tmp_path / "walk.trc", "nothing shows of which plate", "Tz", forces=path)

    def test_another_text_file_is_the_cores(self, files, tmp_path) -> None:
        """WBDS's forces have the same ending."""
        other = tmp_path / "walkgrf.txt"
        other.write_text("Time\tFx1\n0\t1\n")
        refused(files[0], "plate 1 lacks", forces=other)


def test_endings_that_nobody_reads_name_those_that_are(trial, tmp_path) -> None:
    (tmp_path / "walk.xyz").write_text("a")
    refused(tmp_path / "walk.xyz", ".csv, .tsv", "not from .xyz")
    write_trc(tmp_path / "walk.trc", trial)
    refused(tmp_path / "walk.trc", ".forces, .tsv", forces=tmp_path / "walk.xyz")
