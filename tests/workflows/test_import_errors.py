"""What a laboratory gets wrong ends in an error that says what was seen, where, and how to fix it.

Every input is a recorded one (WBDS01, 8 s of its walk on a treadmill) with one thing wrong. Nothing
of it may go through: not with a traceback, and not with a result.
"""

import csv
import io
import signal
import subprocess
import sys
from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from typer.testing import CliRunner

from gaitval import cli
from gaitval.cli.terminal import display
from gaitval.configuration import ProcessingSettings
from gaitval.errors import GaitvalError, RecordError
from gaitval.gait.plate_offset import zero_plates
from gaitval.mocap.mot_writing import StorageTable, write_storage
from gaitval.mocap.reading import read_recording
from gaitval.mocap.recording import Plate, Recording
from gaitval.mocap.trc_writing import write_trc
from gaitval.session.importing.importing import work_out
from gaitval.session.read import read_session
from gaitval.session.request import Request
from gaitval.session.session import Import
from gaitval.session.subject import subject_of

SECONDS = 8.0
MASS, HEIGHT = 74.3, 1.725
UP_IS_Z = np.array([[1.0, 0, 0], [0, 0, -1.0], [0, 1.0, 0]])
"""Turns the laboratory's axes (y up) so that z is up."""


@pytest.fixture(autouse=True)
def plain_messages(monkeypatch: pytest.MonkeyPatch) -> Iterator[io.StringIO]:
    """Messages of the command line as text without colours."""
    text = io.StringIO()
    monkeypatch.setattr(display, "messages", display.Terminal(file=text, width=200))
    return text  # type: ignore[return-value]


# -- the recording, and files with something wrong ------------------------------------------------


@pytest.fixture(scope="module")
def raw(gait_data: Path) -> Path:
    return gait_data / "wbds" / "raw"


@pytest.fixture(scope="module")
def stood(raw: Path) -> Recording:
    return read_recording(raw / "WBDS01static1.c3d")


@pytest.fixture(scope="module")
def whole_walk(raw: Path) -> Recording:
    """With zeroed plates: from a text file of forces, which has no moments, none could be."""
    path = raw / "WBDS01walkT01.c3d"
    request = Request(
        static=raw / "WBDS01static1.c3d",
        trials=(path,),
        identifier="S",
        mass=MASS,
        height=HEIGHT,
        sex="M",
    )
    known = read_session(request, ProcessingSettings())
    zeroed, _ = zero_plates(known.walking[0], landmarks=known.marker_set.landmarks)
    return replace(read_recording(path), plates=zeroed.turned(known.axes.rotation.T).plates)


@pytest.fixture(scope="module")
def walked(whole_walk: Recording) -> Recording:
    return window(whole_walk, 0.0, SECONDS)


def window(recording: Recording, begin: float, end: float) -> Recording:
    """Part of a trial, s, with its own clock."""
    frames = slice(*(round(at * recording.marker_rate) for at in (begin, end)))
    samples = slice(*(round(at * recording.force_rate) for at in (begin, end)))
    return replace(
        recording,
        markers=recording.markers[frames],
        plates=tuple(
            Plate(p.name, p.corners, *(x[samples] for x in wrench(p))) for p in recording.plates
        ),
        start=0.0,
        events=(),
    )


def wrench(plate: Plate) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    return plate.force, plate.centre_of_pressure, plate.free_moment


def write_forces(path: Path, recording: Recording) -> Path:
    """The plates as OpenSim has them, in the axes of the recording."""
    columns, values = [], []
    for number, plate in enumerate(recording.plates, start=1):
        for what, vectors in zip(("force_v", "force_p", "torque_"), wrench(plate), strict=True):
            columns += [f"{number}_ground_{what}{axis}" for axis in "xyz"]
            values.append(vectors if what == "force_v" else np.nan_to_num(vectors))
    write_storage(path, StorageTable(tuple(columns), recording.force_time, np.hstack(values)))
    return path


@dataclass
class Laboratory:
    """Writes the files of a session into a folder.

    `session` are the files without a fault.
    """

    folder: Path
    raw: Path
    standing: Recording
    whole_walk: Recording
    walking: Recording
    session: Request

    def trc(self, name: str, recording: Recording) -> Path:
        write_trc(self.folder / name, recording)
        return self.folder / name

    def request(
        self,
        standing: Recording | Path | None = None,
        walking: Recording | Path | None = None,
        forces: Recording | Path | None = None,
        **options: Any,
    ) -> Request:
        """The session, with some of its files or values replaced."""
        if standing is not None:
            written = isinstance(standing, Path)
            options["static"] = standing if written else self.trc("stand.trc", standing)
        if walking is not None:
            written = isinstance(walking, Path)
            options["trials"] = (walking if written else self.trc("walk.trc", walking),)
        if forces is not None:
            file = self.folder / "forces.mot"
            written = isinstance(forces, Path)
            options["forces"] = (forces if written else write_forces(file, forces),)
        return self.session.model_copy(update=options)

    def without_plates(self, walking: Recording | Path, **options: Any) -> Request:
        """The session with another walk, kinematics only."""
        changed = {"forces": (), "kinematics_only": True}
        return self.request(walking=walking, **options).model_copy(update=changed)


@pytest.fixture(scope="module")
def faultless(
    stood: Recording, walked: Recording, tmp_path_factory: pytest.TempPathFactory
) -> Request:
    folder = tmp_path_factory.mktemp("session")
    write_trc(folder / "stand.trc", stood)
    write_trc(folder / "walk.trc", walked)
    return Request(
        static=folder / "stand.trc",
        trials=(folder / "walk.trc",),
        forces=(write_forces(folder / "forces.mot", walked),),
        identifier="S",
        mass=MASS,
        height=HEIGHT,
        sex="M",
    )


@pytest.fixture
def laboratory(
    tmp_path: Path, raw: Path, stood: Recording, whole_walk: Recording, walked: Recording,
    faultless: Request,
) -> Laboratory:  # fmt: skip
    return Laboratory(tmp_path, raw, stood, whole_walk, walked, faultless)


def everything(request: Request) -> Import:
    """The whole import but for its files."""
    found = work_out(request, ProcessingSettings())
    subject_of(found)
    return found


def changed(recording: Recording, change: Callable[[np.ndarray, list[str]], None]) -> Recording:
    """The trial after a change in place of its markers (T, M, 3)."""
    markers = recording.markers.copy()
    change(markers, list(recording.names))
    return recording.with_markers(recording.names, markers)


def scaled(recording: Recording, factor: float) -> Recording:
    return recording.with_markers(recording.names, factor * recording.markers)


def exchanged(
    recording: Recording, first: str, second: str, frames: slice = slice(None)
) -> Recording:
    def exchange(markers: np.ndarray, names: list[str]) -> None:
        pair = [names.index(first), names.index(second)]
        markers[frames, pair] = markers[frames, pair[::-1]]

    return changed(recording, exchange)


def without(recording: Recording, *names: str) -> Recording:
    kept = [i for i, name in enumerate(recording.names) if name not in names]
    return recording.with_markers([recording.names[i] for i in kept], recording.markers[:, kept])


def renamed(recording: Recording, name: Callable[[str], str]) -> Recording:
    return recording.with_markers(map(name, recording.names), recording.markers)


def in_axes(recording: Recording, rotation: np.ndarray) -> Recording:
    return replace(recording.turned(rotation), axes="laboratory")


def with_plates(recording: Recording, change: Callable[[Plate], Plate]) -> Recording:
    return replace(recording, plates=tuple(map(change, recording.plates)))


def resampled(recording: Recording, rate: float) -> Recording:
    """The markers at another rate, over the same time."""
    time = np.arange(round(len(recording.markers) / recording.marker_rate * rate)) / rate
    columns = recording.markers.reshape(len(recording.markers), -1).T
    markers = np.stack([np.interp(time, recording.time, column) for column in columns], axis=1)
    return replace(recording, markers=markers.reshape(len(time), -1, 3), marker_rate=rate)


def test_without_a_fault_the_session_goes_through(laboratory: Laboratory) -> None:
    """What the other tests change is itself faultless."""
    found = everything(laboratory.request())
    assert {side: len(curve.curves) for side, curve in found.forces.items()} == {
        "right": 3,
        "left": 4,
    }


# -- what is refused: one thing wrong, and what is said of it --------------------------------------


def role(name: str, change: Callable[[Recording], Recording]) -> Callable[[Laboratory], Request]:
    """The session with the recording of a role, `standing`, `walking` or `forces`, changed."""
    source = "standing" if name == "standing" else "walking"
    return lambda lab: lab.request(**{name: change(getattr(lab, source))})


def plates(change: Callable[[Plate], Plate]) -> Callable[[Laboratory], Request]:
    return role("forces", lambda walk: with_plates(walk, change))


def missing(name: str) -> Callable[[Laboratory], Request]:
    return lambda lab: lab.request(
        **{name: lab.folder / ("no.mot" if name == "forces" else "no.c3d")}
    )


def with_z_up(recording: Recording) -> Recording:
    return in_axes(recording, UP_IS_Z)


def backwards(lab: Laboratory) -> Request:
    walk = lab.walking
    return lab.without_plates(walk.with_markers(walk.names, walk.markers[::-1]))


def there_and_back(lab: Laboratory) -> Request:
    there = read_recording(lab.raw / "WBDS01walkO01Cmkr.txt")
    back = there.markers * [-1.0, 1.0, -1.0] + there.markers[-1:].mean(axis=1) * [2.0, 0.0, 2.0]
    return lab.without_plates(
        there.with_markers(there.names, np.concatenate([there.markers, back]))
    )


def of_another_person(lab: Laboratory) -> Request:
    path = lab.raw.parent / "static_markers_10subjects.csv"
    with path.open(newline="") as file:
        rows = {row["Subject"]: row for row in csv.DictReader(file)}
    row = rows["WBDS14"]
    names = [name for name in lab.standing.names if f"{name}X" in row]
    places = np.array([[float(row[f"{name}{axis}"]) for axis in "XYZ"] for name in names]) / 1e3
    return lab.request(standing=lab.standing.with_markers(names, np.tile(places, (50, 1, 1))))


def plug_in_gait(recording: Recording) -> Recording:
    """The markers that Plug-in Gait has too, by its names."""
    names = {"ASIS": "ASI", "PSIS": "PSI", "Knee": "KNE", "Ankle": "ANK", "Heel": "HEE"}
    names |= {"MT1": "TOE", "GTR": "THI", "HF": "TIB"}
    known = {f"{side}.{ours}": side + theirs for ours, theirs in names.items() for side in "RL"}
    recording = without(recording, *(name for name in recording.names if name not in known))
    return renamed(recording, lambda name: known[name])


def by_widths(**widths: float) -> Callable[[Laboratory], Request]:
    return lambda lab: lab.request(*map(plug_in_gait, (lab.standing, lab.walking)), **widths)


def disguised(name: str, as_role: str, source: str) -> Callable[[Laboratory], Request]:
    """A file of WBDS, or one of the session's own, under another name."""

    def change(lab: Laboratory) -> Request:
        path = lab.folder / name
        own = lab.session.trials[0] if source == "walk.trc" else lab.raw / source
        path.write_bytes(own.read_bytes())
        return lab.request(**{as_role: path})

    return change


def crossed(lab: Laboratory) -> Request:
    """The force of each plate at the other one's place."""
    left, right = lab.walking.plates
    changed = (replace(left, force=right.force), replace(right, force=left.force))
    return lab.request(forces=replace(lab.walking, plates=changed))


def other_part(begin: float) -> Callable[[Laboratory], Request]:
    """Forces of the same length, from another time of the same person."""
    return lambda lab: lab.request(forces=window(lab.whole_walk, begin, begin + SECONDS))


def short(seconds: float) -> Callable[[Laboratory], Request]:
    def change(lab: Laboratory) -> Request:
        part = window(lab.whole_walk, 0.0, seconds)
        return lab.request(walking=part, forces=part)

    return change


REFUSED: dict[str, tuple[Callable[[Laboratory], Request], tuple[str, ...]]] = {
    "no standing": (missing("standing"), ("no such file", "Check the name")),
    "no forces": (missing("forces"), ("no.mot", "no such file", "Check the name")),
    "TRC called C3D": (disguised("walk.c3d", "walking", "walk.trc"), ("not a C3D file",)),
    "C3D called TRC": (
        disguised("x.trc", "walking", "WBDS01walkT01.c3d"), ("x.trc", "must end in .c3d"),
    ),
    "forces in C3D": (
        lambda lab: lab.request(forces=lab.raw / "WBDS01walkT01.c3d"),
        ("forces are read from .mot", "as the trial"),
    ),
    "angles as forces": (
        lambda lab: lab.request(forces=lab.raw / "WBDS01walkT01_ik_sample.mot"),
        ("no ground reaction", "pelvis_tilt"),
    ),
    "forces as markers": (
        lambda lab: lab.without_plates(lab.session.forces[0]), ("not from .mot", "as C3D"),
    ),
    "forces twice": (
        lambda lab: lab.request(walking=lab.raw / "WBDS01walkT01.c3d"),
        ("has 2 force plates", "Leave one out"),
    ),
    "standing in metres": (
        role("standing", lambda one: scaled(one, 1e-3)),
        ("stand.trc", "metres that are called millimetres)"),
    ),
    "walk in millimetres": (
        role("walking", lambda one: scaled(one, 1e3)),
        ("walk.trc", "millimetres that are called metres)"),
    ),
    "walk in other axes": (
        lambda lab: lab.request(walking=with_z_up(lab.walking), forces=with_z_up(lab.walking)),
        ("walk.trc", "° off the vertical", "other axes than the standing trial"),
    ),
    "standing in other axes": (
        role("standing", with_z_up), ("walk.trc", "other axes than the standing trial"),
    ),
    "forces in other axes": (
        role("forces", with_z_up), ("forces.mot", "in other axes than the markers"),
    ),
    "mirrored": (
        role("standing", lambda one: in_axes(one, np.diag([1.0, 1.0, -1.0]))),
        ("left and right are exchanged", "mirrored"),
    ),
    "standing without a marker": (
        role("standing", lambda one: scaled(one, np.nan)),
        ("none of the", "Reconstruct and label"),
    ),
    "no number in the forces": (
        plates(lambda plate: replace(plate, force=plate.force * np.nan)),
        ("forces.mot", "missing in 2400 samples"),
    ),
    "sides exchanged in standing": (
        role("standing", lambda one: exchanged(one, "R.HF", "L.HF")),
        ("stand.trc", "left and right markers look swapped", "HF", "Check the names"),
    ),
    "sides exchanged in the walk": (
        role("walking", lambda one: exchanged(one, "R.Knee", "L.Knee")),
        ("walk.trc", "left and right are exchanged", "Knee"),
    ),
    "two of a side exchanged": (
        role("walking", lambda one: exchanged(one, "R.Heel", "R.MT1")),
        ("walk.trc", "the right foot faces away from the pelvis", "toes and heel", "Correct these"),
    ),
    "medial for lateral": (
        role("standing", lambda one: exchanged(one, "R.Knee", "R.Knee.Medial")),
        ("stand.trc", "R.Knee.Medial and R.Knee", "check the names"),
    ),
    "another person stands": (
        of_another_person,
        ("do not show the same person", "mm standing", "Use the standing trial of this session"),
    ),
    "labels of a half": (
        role("walking", lambda one: renamed(one, lambda n: f"U{n}" if n[0] == "L" else n)),
        ("walk.trc", "9 of the 18", "missing: L.ASIS", "UL.ASIS", "--marker-set"),
    ),
    "unknown marker set": (
        lambda lab: lab.request(marker_set="helen_hays"),
        ("'helen_hays': no such", "plug_in_gait"),
    ),
    "another marker set": (
        lambda lab: lab.request(marker_set="plug_in_gait"),
        ("stand.trc", "the marker set plug_in_gait needs are missing", "RTIB", "--marker-set"),
    ),
    "standing without an ankle": (
        role("standing", lambda one: without(one, "L.Ankle")),
        ("stand.trc", "missing from the standing pose: L.Ankle", "with all of"),
    ),
    "a walk without a foot": (
        role("walking", lambda one: without(one, "R.Heel", "R.MT1", "R.MT5")),
        ("walk.trc", "never show ankle_angle_r", "Missing: R.Heel, R.MT1, R.MT5. Label them"),
    ),
    "no widths": (by_widths(), ("stand.trc", "--knee-width and --ankle-width", "in metres")),
    "widths in millimetres": (
        by_widths(knee_width=105.0, ankle_width=70.0),
        ("stand.trc", "--knee-width 105", "0.04 to 0.17 m"),
    ),
    "a walk as standing": (
        lambda lab: lab.without_plates(
            lab.raw / "WBDS01static1.c3d", standing=lab.raw / "WBDS01walkT01.c3d"
        ),
        ("WBDS01walkT01.c3d", "does not stand still", "--static"),
    ),
    "standing as a walk": (
        lambda lab: lab.without_plates(lab.standing),
        ("walk.trc", "not a walking trial", "give it as --static"),
    ),
    "0.05 s": (short(0.05), ("walk.trc", "shorter than a gait cycle", "Give a", "at least")),
    "1.5 s": (short(1.5), ("walk.trc", "heel strike", "Give a", "at least")),
    "turned round": (
        there_and_back, ("walk.trc", "the person turns", "Give each part", "--trial-time"),
    ),
    "backwards": (backwards, ("walk.trc", "off the direction of walking", "walks backwards")),
    "slow forces": (
        role("walking", lambda one: resampled(one, 2.5 * one.force_rate)),
        ("forces.mot", "at the rate at which they were recorded"),
    ),
    "coarse markers": (
        role("walking", lambda one: resampled(one, 12.5)),
        ("walk.trc", "markers at 12.5 Hz", "needs more than"),
    ),
    "half of the forces": (
        role("forces", lambda one: window(one, 0.0, 4.0)),
        ("the forces go from", "to 4.000 s", "Give the forces of the same trial"),
    ),
    "forces that begin later": (
        role("forces", lambda one: replace(one, start=3.0)),
        ("the forces go from", "3.000 to 11.000 s"),
    ),
    "0.1 s late": (
        other_part(0.1), ("forces.mot", "before the markers show it", "not synchronised"),
    ),
    "forces of another time": (
        other_part(9.0), ("forces.mot", "before the markers show it", "not synchronised"),
    ),
    "sign": (
        plates(lambda p: replace(p, force=-p.force)), ("those on the person are needed",),
    ),
    "kgf": (plates(lambda p: replace(p, force=p.force / 9.81)), ("the unit of the forces (N)",)),
    "kN": (plates(lambda p: replace(p, force=p.force / 1e3)), ("not in N or",)),
    "mm": (
        plates(lambda p: replace(p, centre_of_pressure=1e3 * p.centre_of_pressure)),
        ("not in m",),
    ),
    "Nmm": (
        plates(lambda p: replace(p, free_moment=1e3 * p.free_moment)), ("Nmm", "divide by 1000"),
    ),
    "nobody": (
        plates(lambda p: replace(p, force=0 * p.force, free_moment=0 * p.free_moment)),
        ("no foot is on",),
    ),
    "moment about the origin": (
        plates(lambda p: replace(
            p, free_moment=p.free_moment + np.cross([0.3, 0, 0], p.force)
        )),
        ("moment about the plate's middle",),
    ),
    "forces at the other foot": (
        crossed,
        ("forces.mot", "does not point to the person", "act at the points of the other foot"),
    ),
}  # fmt: skip
"""A session with one thing wrong, and what is said."""
LATE = {
    *("forces of another time", "sign", "kgf", "kN", "mm", "Nmm", "nobody"),
    *("moment about the origin", "forces at the other foot", "standing without an ankle"),
}
"""Those that are found at the end of the work."""


@pytest.mark.parametrize(
    "name", [pytest.param(n, marks=[pytest.mark.slow] if n in LATE else []) for n in REFUSED]
)
def test_what_is_wrong_is_refused_and_said(laboratory: Laboratory, name: str) -> None:
    change, words = REFUSED[name]
    with pytest.raises(GaitvalError) as caught:
        everything(change(laboratory))
    for word in words:
        assert word in str(caught.value), f"{word!r} is not in: {caught.value}"
    assert caught.value.exit_code == 2


def test_files_that_do_not_pair(laboratory: Laboratory) -> None:
    once = laboratory.request()
    again = laboratory.trc("again.trc", laboratory.walking)
    trials = (*once.trials, again)
    for changes, *words in (
        ({"trials": trials}, "--forces is given 1× and --trial 2×", "same order"),
        ({"trials": once.trials * 2, "forces": ()}, "given twice, with --trial and with --trial"),
    ):
        with pytest.raises(RecordError) as caught:
            read_session(once.model_copy(update=changes), ProcessingSettings())
        assert all(word in str(caught.value) for word in words)


# -- what is not wrong, or is put right ------------------------------------------------------------


def test_files_whose_up_is_another_axis_are_found_and_told(laboratory: Laboratory) -> None:
    standing, walking = map(with_z_up, (laboratory.standing, laboratory.walking))
    request = laboratory.request(standing, walking, walking)
    messages: list[str] = []
    turned = read_session(request, ProcessingSettings(), lambda _, text: messages.append(text))
    assert any("+x forward, +y to the left, +z up" in text for text in messages)
    usual = read_session(laboratory.request(), ProcessingSettings())
    np.testing.assert_allclose(turned.walking[0].markers, usual.walking[0].markers, atol=1e-6)


@pytest.mark.slow
def test_two_tracking_markers_of_one_segment_are_exchanged_back(laboratory: Laboratory) -> None:
    """Which of them is which matters to nothing but their own places; and it is reported."""
    wrong = exchanged(laboratory.walking, "R.HF", "R.TT")
    right, mended = (
        everything(laboratory.request(walking=walking)) for walking in (laboratory.walking, wrong)
    )
    warnings = [warning for _, warning in mended.warnings if warning.check == "exchanged markers"]
    assert [warning.where for warning in warnings] == ["R.HF and R.TT"]
    assert not [warning for _, warning in right.warnings if warning.check == "exchanged markers"]
    for name, curve in right.angles.items():
        np.testing.assert_allclose(mended.angles[name].mean, curve.mean, atol=1e-6)


def test_a_heel_that_the_walk_lacks_is_carried_by_its_foot(laboratory: Laboratory) -> None:
    heel = laboratory.request(walking=without(laboratory.walking, "R.Heel"))
    assert "R.Heel" in read_session(heel, ProcessingSettings()).walking[0].names


@pytest.mark.slow
def test_cycles_in_which_no_marker_is_seen_do_not_count(laboratory: Laboratory) -> None:
    hidden = changed(laboratory.walking, lambda markers, _: markers[500:650].fill(np.nan))
    found = work_out(laboratory.request(walking=hidden), ProcessingSettings())
    reasons = [cycle.reasons for cycle in found.trials[0].cycles["right"]]
    assert (
        sum(any("do not show the pelvis and the right leg" in one for one in r) for r in reasons)
        == 2
    )
    assert len(found.angles["knee_angle_r"].curves) == 1


@pytest.mark.slow
def test_the_order_of_plates_says_nothing(laboratory: Laboratory) -> None:
    usual = everything(laboratory.request())
    other_names = replace(laboratory.walking, plates=laboratory.walking.plates[::-1])
    found = everything(laboratory.request(forces=other_names))
    for side in ("right", "left"):
        np.testing.assert_allclose(found.forces[side].mean, usual.forces[side].mean, atol=1e-9)


# -- the command ----------------------------------------------------------------------------------


def gaitval(request: Request, out: Path, *more: str, **person: str) -> Any:
    values = {"mass": f"{request.mass_kg}", "height": f"{request.height_m}", "sex": request.sex}
    options = [f"--{name}={value}" for name, value in (values | person).items()]
    options += [f"--forces={path}" for path in request.forces]
    options += [f"--trial={path}" for path in request.trials]
    arguments = ["import", f"--static={request.static}", *options, f"--out={out}", *more]
    return CliRunner().invoke(cli.app, arguments)


def test_a_folder_that_cannot_be_written(
    laboratory: Laboratory, plain_messages: io.StringIO
) -> None:
    """Said before the work is done."""
    request = laboratory.request(standing=laboratory.folder / "no.c3d")
    file = laboratory.folder / "file"
    file.write_text("")
    kept = laboratory.folder / "kept"
    kept.mkdir()
    (kept / "subject.toml").write_text("mine")
    for out, words in (
        (file, "file: is a file"),
        (file / "below", "file: is a file"),
        (kept, "but no import wrote it"),
    ):
        assert gaitval(request, out).exit_code == 2
        assert words in plain_messages.getvalue()
        assert "--out" in plain_messages.getvalue()
    assert (kept / "subject.toml").read_text() == "mine"


KILLED = """
import os, signal, sys
from pathlib import Path

moved, replace = 0, Path.replace

def dies(self, target):
    global moved
    moved += 1
    if moved == {last}:
        os.kill(os.getpid(), signal.SIGKILL)
    return replace(self, target)

Path.replace = dies
from gaitval.cli import main
main()
"""


@pytest.mark.slow  # kills a whole import
def test_a_killed_import_leaves_whole_files_and_no_subject(laboratory: Laboratory) -> None:
    """Killed between writing a file and giving it its name, over an earlier import."""
    out = laboratory.folder / "out"
    (out / "recording").mkdir(parents=True)
    (out / "subject.toml").write_text("earlier")
    (out / "recording" / "import.json").write_text("{}")
    request = laboratory.request()
    arguments = [f"--static={request.static}", f"--trial={request.trials[0]}"]
    arguments += [f"--forces={request.forces[0]}", f"--mass={MASS}", f"--height={HEIGHT}"]
    arguments += ["--sex=M", f"--out={out}"]
    done = subprocess.run(
        [sys.executable, "-c", KILLED.format(last=5), "import", *arguments],
        capture_output=True,
        check=False,
    )
    assert done.returncode == -signal.SIGKILL, done.stderr.decode()
    named = sorted(p.name for p in out.rglob("*") if p.is_file() and p.name[0] != ".")
    assert named == ["model.osim", "trial1_ik.mot", "trial1_markers.trc"]
    assert (out / "recording" / "model.osim").read_text().rstrip().endswith("</OpenSimDocument>")
    written = read_recording(out / "recording" / "trial1_markers.trc")
    assert len(written.markers) == len(laboratory.walking.markers)
