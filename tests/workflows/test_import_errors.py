"""What a laboratory gets wrong ends in an error that says what was seen, where, and how to fix it.

Every input is a recorded one (WBDS01, 8 s of its walk on a treadmill) with one thing wrong. Nothing
of it may go through: not with a traceback, and not with a result.
"""

import csv
import io
import signal
import subprocess
import sys
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from typer.testing import CliRunner

from gaitval import cli
from gaitval.cli.terminal import display
from gaitval.configuration import ProcessingSettings
from gaitval.errors import GaitvalError, RecordError, ScalingError
from gaitval.gait.plate_offset import zero_plates
from gaitval.mocap.mot_writing import StorageTable, write_storage
from gaitval.mocap.reading import read_recording
from gaitval.mocap.recording import Plate, Recording
from gaitval.mocap.trc_writing import write_trc
from gaitval.session.importing.importing import work_out
from gaitval.session.read import read_session
from gaitval.session.request import Request
from gaitval.session.scale import scale_body
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
    standing: Recording
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

    def text(self, name: str, change: Callable[[str], str]) -> Request:
        """The session with the text of one of its files changed."""
        role = "forces" if name == "forces.mot" else "walking"
        (source,) = self.session.forces if role == "forces" else self.session.trials
        (self.folder / name).write_text(change(source.read_text()))
        return self.request(**{role: self.folder / name})


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
    tmp_path: Path, stood: Recording, walked: Recording, faultless: Request
) -> Laboratory:
    return Laboratory(tmp_path, stood, walked, faultless)


def everything(request: Request) -> Import:
    """The whole import but for its files."""
    found = work_out(request, ProcessingSettings())
    subject_of(found)
    return found


def session(request: Request) -> object:
    return read_session(request, ProcessingSettings())


def refuse(
    request: Request,
    *words: str,
    through: Callable[[Request], object] = session,
    kind: type[GaitvalError] = RecordError,
) -> str:
    """The message with which a request is refused; it has these words."""
    with pytest.raises(kind) as caught:
        through(request)
    message = str(caught.value)
    for word in words:
        assert word in message, f"{word!r} is not in: {message}"
    assert caught.value.exit_code == 2
    return message


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


# -- files ----------------------------------------------------------------------------------------


@pytest.mark.parametrize("role", ["standing", "walking", "forces"])
def test_a_missing_file(laboratory: Laboratory, role: str) -> None:
    path = laboratory.folder / ("no.mot" if role == "forces" else "no.c3d")
    refuse(laboratory.request(**{role: path}), str(path), "no such file", "Check the name")


def test_files_of_another_kind(raw: Path, laboratory: Laboratory) -> None:
    c3d = raw / "WBDS01walkT01.c3d"
    disguised = laboratory.folder / "walk.c3d"
    disguised.write_bytes(laboratory.session.trials[0].read_bytes())
    refuse(laboratory.request(walking=disguised), "not a C3D file")
    disguised = disguised.rename(laboratory.folder / "x.trc")
    disguised.write_bytes(c3d.read_bytes())
    refuse(laboratory.request(walking=disguised), "x.trc", "must end in .c3d")
    refuse(laboratory.request(forces=c3d), "forces are read from .mot", "as the trial")
    refuse(laboratory.without_plates(laboratory.session.forces[0]), "not from .mot", "as C3D")
    joint_angles = raw / "WBDS01walkT01_ik_sample.mot"
    refuse(laboratory.request(forces=joint_angles), "no ground reaction", "pelvis_tilt")


def test_files_that_do_not_pair(laboratory: Laboratory, raw: Path) -> None:
    once = laboratory.request()
    again = laboratory.trc("again.trc", laboratory.walking)
    trials = (*once.trials, again)
    more = laboratory.request(trials=trials)
    refuse(more, "--forces is given 1× and --trial 2×", "same order")
    more = once.model_copy(update={"forces": (*once.forces, again)})
    refuse(more, "--forces is given 2× and --trial 1×")
    twice = once.model_copy(update={"trials": once.trials * 2, "forces": ()})
    refuse(twice, "walk.trc", "given twice, with --trial and with --trial")
    copied = once.model_copy(update={"trials": trials, "forces": (), "kinematics_only": True})
    refuse(copied, "walk.trc", "again.trc", "are the same recording")
    both = once.model_copy(update={"trials": (raw / "WBDS01walkT01.c3d",)})
    refuse(both, "has 2 force plates", "Leave one out")


# -- units and axes -------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("role", "factor", "words"),
    [
        ("standing", 1e-3, "metres that are called millimetres)"),
        ("walking", 1e3, "millimetres that are called metres)"),
    ],
)
def test_markers_in_the_wrong_unit(
    laboratory: Laboratory, role: str, factor: float, words: str
) -> None:
    recording = scaled(getattr(laboratory, role), factor)
    refuse(laboratory.request(**{role: laboratory.trc("unit.trc", recording)}), "unit.trc", words)


@pytest.mark.parametrize(
    ("axes", "words"),
    [
        ("forward=-x up=+y", ("forward is -x", "nearest: +x", "Correct --axes")),
        ("forward=+x up=+x", ("two directions share an axis",)),
        ("x y z", ("'x' is not understood", "forward=+x up=+y")),
    ],
)
def test_wrong_axes_given(laboratory: Laboratory, axes: str, words: Sequence[str]) -> None:
    refuse(laboratory.request(axes=axes), *words)


def test_files_whose_up_is_another_axis_are_found_and_told(laboratory: Laboratory) -> None:
    standing, walking = (
        in_axes(recording, UP_IS_Z) for recording in (laboratory.standing, laboratory.walking)
    )
    request = laboratory.request(standing, walking, walking)
    messages: list[str] = []
    turned = read_session(request, ProcessingSettings(), lambda _, text: messages.append(text))
    assert any("+x forward, +y to the left, +z up" in text for text in messages)
    usual = read_session(laboratory.request(), ProcessingSettings())
    np.testing.assert_allclose(turned.walking[0].markers, usual.walking[0].markers, atol=1e-6)


def test_axes_of_one_file_only(laboratory: Laboratory) -> None:
    standing, walking = laboratory.standing, in_axes(laboratory.walking, UP_IS_Z)
    words = "other axes than the standing trial"
    refuse(
        laboratory.request(walking=walking, forces=walking), "walk.trc", "° off the vertical", words
    )
    refuse(laboratory.request(standing=in_axes(standing, UP_IS_Z)), "walk.trc", words)
    refuse(laboratory.request(forces=walking), "forces.mot", "in other axes than the markers")


def test_a_mirrored_recording(laboratory: Laboratory) -> None:
    mirrored = in_axes(laboratory.standing, np.diag([1.0, 1.0, -1.0]))
    refuse(laboratory.request(standing=mirrored), "left and right are exchanged", "mirrored")


# -- markers --------------------------------------------------------------------------------------


def test_nothing_but_nan(laboratory: Laboratory) -> None:
    for role in ("standing", "walking"):
        recording = scaled(getattr(laboratory, role), np.nan)
        refuse(laboratory.request(**{role: recording}), "none of the", "Reconstruct and label")
    blind = with_plates(
        laboratory.walking, lambda plate: replace(plate, force=plate.force * np.nan)
    )
    refuse(laboratory.request(forces=blind), "forces.mot", "2400 force samples are missing")


@pytest.mark.parametrize(("role", "marker"), [("standing", "HF"), ("walking", "Knee")])
def test_left_and_right_exchanged(laboratory: Laboratory, role: str, marker: str) -> None:
    """A landmark that is needed, and a marker that only tracks its segment."""
    wrong = exchanged(getattr(laboratory, role), f"R.{marker}", f"L.{marker}")
    file = "stand.trc" if role == "standing" else "walk.trc"
    message = refuse(laboratory.request(**{role: wrong}), file, "left and right are exchanged")
    assert marker in message
    assert "xchange the" in message or "Exchange these" in message


def test_two_markers_of_one_side_exchanged(laboratory: Laboratory) -> None:
    first, second = "R.Heel", "R.MT1"
    wrong = exchanged(laboratory.walking, first, second)
    words = ("walk.trc", first, second, "have each other's names", "stand.trc", "correct the")
    refuse(laboratory.request(walking=wrong), *words, through=everything)


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


def test_medial_and_lateral_exchanged_in_standing(laboratory: Laboratory) -> None:
    wrong = exchanged(laboratory.standing, "R.Knee", "R.Knee.Medial")
    words = ("stand.trc", "R.Knee.Medial and R.Knee", "check the names")
    refuse(laboratory.request(standing=wrong), *words, through=everything, kind=ScalingError)


def test_the_standing_trial_of_another_person(gait_data: Path, laboratory: Laboratory) -> None:
    path = gait_data / "wbds" / "static_markers_10subjects.csv"
    with path.open(newline="") as file:
        rows = {row["Subject"]: row for row in csv.DictReader(file)}
    row = rows["WBDS14"]
    names = [name for name in laboratory.standing.names if f"{name}X" in row]
    places = np.array([[float(row[f"{name}{axis}"]) for axis in "XYZ"] for name in names]) / 1e3
    other = laboratory.standing.with_markers(names, np.tile(places, (50, 1, 1)))
    refuse(
        laboratory.request(standing=other),
        "do not show the same person",
        "mm standing",
        "Use the standing trial of this session",
    )


def test_markers_of_the_walk_that_are_not_of_the_set(laboratory: Laboratory) -> None:
    unlabelled = renamed(laboratory.walking, lambda name: f"U{name}" if name[0] == "L" else name)
    words = ("walk.trc", "9 of the 18", "missing: L.ASIS", "UL.ASIS", "--marker-set")
    refuse(laboratory.request(walking=unlabelled), *words)


def test_wrong_marker_sets(laboratory: Laboratory) -> None:
    refuse(laboratory.request(marker_set="helen_hays"), "'helen_hays': no such", "plug_in_gait")
    words = ("stand.trc", "the marker set plug_in_gait needs are missing", "RTIB", "--marker-set")
    refuse(laboratory.request(marker_set="plug_in_gait"), *words)


@pytest.mark.slow
@pytest.mark.parametrize("marker", ["R.ASIS", "L.Ankle"])
def test_a_marker_that_standing_needs_is_missing(laboratory: Laboratory, marker: str) -> None:
    names = laboratory.standing.names
    lacking = without(laboratory.standing, marker)
    hidden = changed(laboratory.standing, lambda m, _: m[:, names.index(marker)].fill(np.nan))
    for standing in (lacking, hidden):
        refuse(
            laboratory.request(standing=standing),
            "stand.trc",
            f"missing from the standing pose: {marker}",
            "with all of",
            through=lambda request: scale_body(
                request, ProcessingSettings(), read_session(request, ProcessingSettings())
            ),
            kind=ScalingError,
        )


def test_a_walk_without_a_leg(laboratory: Laboratory) -> None:
    foot = without(laboratory.walking, "R.Heel", "R.MT1", "R.MT5")
    words = ("walk.trc", "never show ankle_angle_r", "Missing: R.Heel, R.MT1, R.MT5. Label them")
    refuse(laboratory.request(walking=foot), *words, through=everything)
    heel = without(laboratory.walking, "R.Heel")
    # The foot's other markers carry the heel.
    assert (
        "R.Heel"
        in read_session(laboratory.request(walking=heel), ProcessingSettings()).walking[0].names
    )


def plug_in_gait(recording: Recording) -> Recording:
    """The markers that Plug-in Gait has too, by its names."""
    names = {"ASIS": "ASI", "PSIS": "PSI", "Knee": "KNE", "Ankle": "ANK", "Heel": "HEE"}
    names |= {"MT1": "TOE", "GTR": "THI", "HF": "TIB"}
    known = {f"{side}.{ours}": side + theirs for ours, theirs in names.items() for side in "RL"}
    recording = without(recording, *(name for name in recording.names if name not in known))
    return renamed(recording, lambda name: known[name])


@pytest.mark.parametrize(
    ("widths", "words"),
    [
        ({}, ["--knee-width and --ankle-width", "in metres"]),
        ({"knee_width": 105.0, "ankle_width": 70.0}, ["--knee-width 105", "0.04 to 0.17 m"]),
    ],
    ids=["none", "mm"],
)
def test_plug_in_gait_without_the_widths(
    laboratory: Laboratory, widths: dict[str, float], words: Sequence[str]
) -> None:
    standing, walking = map(plug_in_gait, (laboratory.standing, laboratory.walking))
    request = laboratory.request(standing, walking, **widths)
    refuse(request, "stand.trc", *words, through=everything, kind=ScalingError)


# -- trials that are not what they should be ------------------------------------------------------


def test_trials_in_each_others_place(raw: Path, laboratory: Laboratory) -> None:
    stand, walk = raw / "WBDS01static1.c3d", raw / "WBDS01walkT01.c3d"
    words = ("WBDS01walkT01.c3d", "does not stand still", "cm from its median position", "--static")
    refuse(laboratory.without_plates(stand, standing=walk), *words)
    refuse(
        laboratory.without_plates(laboratory.standing),
        "walk.trc",
        "not a walking trial",
        "give it as --static",
    )


@pytest.mark.parametrize(
    ("seconds", "words"),
    [(0.05, "shorter than a gait cycle"), (1.5, "heel strike")],
)
def test_a_walk_that_is_too_short(
    laboratory: Laboratory, whole_walk: Recording, seconds: float, words: str
) -> None:
    short = window(whole_walk, 0.0, seconds)
    request = laboratory.request(walking=short, forces=short)
    refuse(request, "walk.trc", words, "Give a", "at least", through=everything)


def test_a_person_who_turns_round(raw: Path, laboratory: Laboratory) -> None:
    there = read_recording(raw / "WBDS01walkO01Cmkr.txt")
    back = there.markers * [-1.0, 1.0, -1.0] + there.markers[-1:].mean(axis=1) * [2.0, 0.0, 2.0]
    both = there.with_markers(there.names, np.concatenate([there.markers, back]))
    wanted = laboratory.without_plates(both)
    refuse(wanted, "walk.trc", "the person turns", "Give each part", "--trial-time")


def test_a_person_who_walks_backwards(laboratory: Laboratory) -> None:
    back = laboratory.walking.with_markers(
        laboratory.walking.names, laboratory.walking.markers[::-1]
    )
    refuse(
        laboratory.without_plates(back),
        "walk.trc",
        "off the direction of walking",
        "walks backwards",
    )


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
    gone = changed(laboratory.walking, lambda markers, _: markers[300:850].fill(np.nan))
    words = ("walk.trc", "no complete right gait cycle", "heel strike")
    refuse(laboratory.request(walking=gone), *words, through=everything)


# -- forces ---------------------------------------------------------------------------------------


def test_forces_slower_than_the_markers_are_refused(laboratory: Laboratory) -> None:
    fast = resampled(laboratory.walking, 2.5 * laboratory.walking.force_rate)
    refuse(
        laboratory.request(walking=fast), "forces.mot", "at the rate at which they were recorded"
    )


def test_markers_too_coarse_for_the_filter(laboratory: Laboratory) -> None:
    coarse = resampled(laboratory.walking, 12.5)
    refuse(laboratory.request(walking=coarse), "walk.trc", "markers at 12.5 Hz", "needs more than")


def test_forces_of_another_length(raw: Path, laboratory: Laboratory) -> None:
    words = ("the forces go from", "Give the forces of the same trial")
    refuse(laboratory.request(forces=raw / "WBDS01walkT01_grf.mot"), "30.000 s", *words)
    refuse(laboratory.request(forces=window(laboratory.walking, 0, 4)), "to 4.000 s", *words)
    late = replace(laboratory.walking, start=3.0)
    refuse(laboratory.request(forces=late), "3.000 to 11.000 s", *words)


@pytest.mark.parametrize("late", [0.1, pytest.param(9.0, marks=pytest.mark.slow)])
def test_forces_of_another_time(laboratory: Laboratory, whole_walk: Recording, late: float) -> None:
    """Of the same length, but not synchronised, or of another trial of the same person."""
    other = window(whole_walk, late, late + SECONDS)
    refuse(
        laboratory.request(forces=other),
        "forces.mot",
        "before the markers show it",
        "not synchronised",
        through=everything,
    )


@pytest.mark.slow
@pytest.mark.parametrize(
    ("change", "words"),
    [
        (lambda p: replace(p, force=-p.force), "those on the person are needed"),
        (lambda p: replace(p, force=p.force / 9.81), "the unit of the forces (N)"),
        (lambda p: replace(p, force=p.force / 1e3), "not in N or"),
        (lambda p: replace(p, centre_of_pressure=1e3 * p.centre_of_pressure), "not in m"),
        (lambda p: replace(p, free_moment=1e3 * p.free_moment), "looks like Nmm"),
        (lambda p: replace(p, force=0 * p.force, free_moment=0 * p.free_moment), "no foot is on"),
        (
            lambda p: replace(p, free_moment=p.free_moment + np.cross([0.3, 0, 0], p.force)),
            "moment about the plate's middle",
        ),
    ],
    ids=["sign", "kgf", "kN", "mm", "Nmm", "nobody", "moment about the origin"],
)
def test_forces_in_another_unit_or_sign(
    laboratory: Laboratory, change: Callable[[Plate], Plate], words: str
) -> None:
    wrong = with_plates(laboratory.walking, change)
    refuse(laboratory.request(forces=wrong), words, through=everything)


@pytest.mark.slow
def test_feet_exchanged_in_the_force_file(laboratory: Laboratory) -> None:
    """The plates' order and names say nothing; a force at the other foot's place is refused."""
    usual = everything(laboratory.request())
    left, right = laboratory.walking.plates
    other_names = replace(laboratory.walking, plates=(right, left))
    found = everything(laboratory.request(forces=other_names))
    for side in ("right", "left"):
        np.testing.assert_allclose(found.forces[side].mean, usual.forces[side].mean, atol=1e-9)
    crossed = (replace(left, force=right.force), replace(right, force=left.force))
    refuse(
        laboratory.request(forces=replace(laboratory.walking, plates=crossed)),
        "forces.mot",
        "does not point to the person",
        "act at the points of the other foot",
    )


# -- the person -----------------------------------------------------------------------------------


# -- the command ----------------------------------------------------------------------------------


def gaitval(request: Request, out: Path, *more: str, **person: str) -> Any:
    values = {"mass": f"{request.mass_kg}", "height": f"{request.height_m}", "sex": request.sex}
    options = [f"--{name}={value}" for name, value in (values | person).items()]
    options += [f"--forces={path}" for path in request.forces]
    options += [f"--trial={path}" for path in request.trials]
    arguments = ["import", f"--static={request.static}", *options, f"--out={out}", *more]
    return CliRunner().invoke(cli.app, arguments)


@pytest.mark.parametrize(
    ("person", "words"),
    [
        ({"mass": "1.725", "height": "74.3"}, "--mass 1.725: outside the plausible"),
        ({"mass": "nan"}, "--mass = nan: input should be a finite number"),
    ],
    ids=["swapped", "nan"],
)
def test_an_impossible_person(
    laboratory: Laboratory, plain_messages: io.StringIO, person: dict[str, str], words: str
) -> None:
    result = gaitval(laboratory.request(), laboratory.folder / "out", **person)
    assert result.exit_code == 2
    assert words in plain_messages.getvalue()
    assert not (laboratory.folder / "out").exists()


def test_the_command_says_why_and_leaves_no_subject(
    laboratory: Laboratory, plain_messages: io.StringIO
) -> None:
    """One error of each stage: reading, axes, scaling, forces."""
    walking, out = laboratory.walking, laboratory.folder / "out"
    unloaded = with_plates(walking, lambda p: replace(p, force=0 * p.force))
    for change, words in (
        ({"standing": laboratory.folder / "no [1].c3d"}, "no [1].c3d: no such file"),
        ({"standing": in_axes(laboratory.standing, UP_IS_Z)}, "other axes"),
        ({"standing": without(laboratory.standing, "R.Knee")}, "standing pose: R.Knee"),
        ({"forces": unloaded}, "no foot is on"),
    ):
        result = gaitval(laboratory.request(**change), out)
        assert result.exit_code == 2, words
        assert isinstance(result.exception, SystemExit)
        text = plain_messages.getvalue()
        assert words in text
        assert "Traceback" not in text
        assert not (out / "subject.toml").exists()
        pages = [(out / "recording" / f"{name}.html").exists() for name in ("refused", "recording")]
        # a typing error leaves no folder behind
        assert sum(pages) == (0 if "no such file" in words else 1), words


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


@pytest.mark.slow
def test_a_full_disk(
    laboratory: Laboratory, plain_messages: io.StringIO, monkeypatch: pytest.MonkeyPatch
) -> None:
    def full(*_: object, **__: object) -> None:
        raise OSError(28, "No space left on device", str(laboratory.folder / "out" / "x"))

    monkeypatch.setattr("gaitval.session.opensim.of_import.write_osim", full)
    result = gaitval(laboratory.request(), laboratory.folder / "out")
    assert result.exit_code == 2
    assert (
        "cannot be written (No space left on device). Free disk space" in plain_messages.getvalue()
    )


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
