"""Whole files in, names of findings out: what people sent, clean recordings, wrong forces.

Every small input of `cases` beside the raw data ends as it should. How a finding's sentence reads
is tested in `tests/measurement/test_findings.py`, what is refused before in `test_import_errors`.
"""

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import ezc3d
import numpy as np
import pytest
from knee_implant import knee_request
from made_up_session import MadeUpSession, doubts, made_up_session
from quick_settings import WITH_WORDS
from recorded_sessions import wbds01_overground, wbds01_t01
from typer.testing import CliRunner

from gaitval import cli
from gaitval._internal.io.artefacts import read_json
from gaitval.configuration import ProcessingSettings
from gaitval.errors import RecordError
from gaitval.mocap.mot import read_storage
from gaitval.mocap.mot_writing import write_storage
from gaitval.session.importing.importing import work_out
from gaitval.session.request import Request

PERSON = "--mass 64.95 --height 1.53 --sex F"
C3D = "import --static standing.c3d --trial walking.c3d"
TRC = "import --static standing.trc --trial walking.trc --forces grf.mot"
BELTED = f"{PERSON} --belt 1.1473"
CURVES = f"curves means.csv --speed 1.12 --stride-time 1.05 --leg-length 0.8 {PERSON}"

CASES = {
    "curves_sign_of_hip_adduction": (CURVES, 0, ("angle_hip_adduction_r", "Change the sign")),
    "curves_sign_of_hip_adduction_moment": (
        CURVES, 2, ("moment_hip_adduction_r", "moment_hip_adduction_l", "Change the sign"),
    ),
    "import_corners_other_way_round": (
        f"{C3D} {PERSON}", 2, ("under the other one", "corners", "other way round"),
    ),
    "import_decimal_commas": (
        "import --static standing.trc --trial walking.trc --forces walking.mot "
        + BELTED,
        0, ("trial walking",),
    ),
    "import_exoskeleton_torques": (
        f"{TRC} {PERSON}", 0,
        ("exo_r", "exo_l", "10 Nm", "person and device together", "2 force plates"),
    ),
    "import_forces_end_earlier": (f"{TRC} --trial-time 0:3.1 {PERSON}", 0, ("3.1 s at 100 Hz",)),
    "import_fpcoppoly": (f"{C3D} {PERSON}", 0, ("2 force plates",)),
    "import_gap_as_9999": (f"{TRC} {PERSON}", 0, ("RFCC", "gap", "rebuilt from")),
    "import_heels_taken_off_for_the_walk": (
        f"{C3D} {BELTED}", 0, ("RFCC: the walk has no marker there", "LFCC: the walk"),
    ),
    "import_marker_in_one_standing_frame": (
        f"{C3D} {BELTED}", 0, ("RFMT1: only 1 of the 12 frames of the standing trial",),
    ),
    "import_marker_fell_off": (f"{C3D} {PERSON}", 0, ("RFCC: from 2.01 s on", "left out")),
    "import_other_axes_without_ankles": (
        "import --static standing_y_up.trc --trial walking_z_up.c3d --marker-set cluster.toml "
        f"{PERSON}",
        2, ("other axes than the standing trial",),
    ),
    "import_same_trial_twice": (f"{C3D} --trial walking.c3d {PERSON}", 2, ("same recording",)),
    "import_stature_mistyped": (
        f"{C3D} --mass 64.95 --height 1.35 --sex F --belt 1.1473", 0,
        ("the stature that was given is 10 ± 3 % too small for this body",),
    ),
    "import_turning_parts": (
        f"import --static standing.trc --trial circuit.trc --kinematics-only {PERSON}",
        2, ("--trial-time",),
    ),
    "import_unused_forces_in_exports": (f"{C3D} {PERSON}", 0, ("plate 2", "not used")),
    "judge_coupled_coordinate_in_degrees": ("judge model.osim --ik ik.mot", 0, ("0 failed",)),
    "judge_degrees_called_radians": (
        "judge ../judge_radians_called_degrees/model.osim --ik ik.mot", 2,
        ("inDegrees=yes", "radians"),
    ),
    "judge_degrees_said_in_words": (
        "judge model.osim --ik ik.mot --id id.sto --grf grf.mot", 0, ("69 kept, 2 failed",),
    ),
    "judge_motion_of_one_row": ("judge model.osim --ik ik.mot", 2, ("ik.mot", "one row")),
    "judge_radians_called_degrees": (
        "judge model.osim --ik ik.mot --id id.sto --grf grf.mot", 2, ("inDegrees=no", "radians"),
    ),
    "curves_without_subtalar": (f"{CURVES} --stance 0.62", 0, ("subtalar",)),
    "judge_angles_wrapped_by_a_turn": (
        "judge model.osim --ik ik.mot --mass 64.95 --height 1.53 --belt 1.1473", 0, ("turn",),
    ),
    "judge_noise_called_a_sign": (
        "judge model.osim --ik ik.mot --id id.sto --mass 64.95 --height 1.53 --belt 1.1473",
        1, ("not low-passed",),
    ),
}  # fmt: skip
"""Command, exit code, and what must be said."""
NEVER = {
    "import_stature_mistyped": ("--correct",),
    "import_exoskeleton_torques": ("4 force plates",),
    "import_marker_fell_off": ("--correct place", "RFLE and LFLE"),
    "import_gap_as_9999": ("954 %", "not steady"),
    "import_corners_other_way_round": ("--plate", "of another trial"),
    "import_other_axes_without_ankles": ("running", "mislabelled"),
}
"""What led people astray."""
NAMES: dict[str, tuple[str, ...]] = {
    "import_decimal_commas": (),
    "import_exoskeleton_torques": (),
    "import_forces_end_earlier": (),
    "import_fpcoppoly": (),
    "import_gap_as_9999": (),
    "import_heels_taken_off_for_the_walk": ("heel taken off", "heel taken off"),
    "import_marker_fell_off": ("lost marker",),
    "import_marker_in_one_standing_frame": ("seldom seen",),
    "import_stature_mistyped": ("measurement: place or stature", "build"),
    "import_unused_forces_in_exports": ("centre of pressure under the foot", "one side"),
}
"""Findings of those that are imported."""
PROCESSING = ProcessingSettings()


@pytest.fixture
def cases(gait_data) -> Path:
    folder = gait_data.parent / "cases"
    if not folder.is_dir():
        pytest.skip(f"no cases at {folder}, beside the raw data")
    return folder


@pytest.mark.slow
@pytest.mark.parametrize("name", CASES)
def test_a_case_that_somebody_sent_ends_as_it_should(name, cases, tmp_path, monkeypatch):
    monkeypatch.chdir(cases / name)
    command, code, words = CASES[name]
    out = tmp_path / ("out.toml" if name.startswith("curves") else "out")
    pages = WITH_WORDS if name.startswith("import") else ()
    result = CliRunner().invoke(cli.app, [*command.split(), "--out", str(out), *pages])
    message = " ".join(result.output.split())
    assert result.exit_code == code, message
    for word in words:
        assert word in message
    for word in NEVER.get(name, ()):
        assert word not in message
    record = out / "recording" / "import.json"
    if name in NAMES:
        assert tuple(each["check"] for each in read_json(record)["warnings"]) == NAMES[name]
    if name == "import_unused_forces_in_exports":
        forces = read_storage(out / "recording/trial1_grf.mot")
        moments = read_storage(out / "recording/trial1_id.sto")
        assert np.abs(forces.column("ground_force_l_vy")).max() < 1.0
        left = moments.column("hip_adduction_l_moment")
        assert np.isnan(left).any()
        # In swing the leg's own weight and inertia are left.
        assert np.nanmax(np.abs(left)) < 0.4 * 64.95
        assert np.isfinite(moments.column("hip_adduction_r_moment")).all()


def test_every_case_is_tried(cases):
    assert {each.name for each in cases.iterdir() if each.is_dir()} == {*CASES}


# -- clean recordings, and forces with one fault ---------------------------------------------------

CLEAN: dict[str, tuple[Callable[[Path, Path], Request], tuple[str, ...]]] = {
    "WBDS01, over ground": (lambda data, _: wbds01_overground(data), ()),
    # He is given as 75 kg, and the plates carry 83 kg; markers of the left shank were filled in;
    # the right foot strikes once.
    "implanted knee, 1": (
        lambda data, out: knee_request(data, out, ("ss1",)),
        ("filled gap", "measurement: mass", "one side"),
    ),
    "implanted knee, 11": (
        lambda data, out: knee_request(data, out, ("ss11",)),
        ("filled gap", "measurement: mass", "one side"),
    ),
}
"""Recordings of the raw data, and what is truly wrong with them. WBDS01's treadmill and Rajagopal's
walk are in `test_import_recordings.py`; the shipped sample is imported in
`tests/session/test_uneven_legs.py` and the cases, and has nothing."""


@pytest.mark.slow
@pytest.mark.parametrize("name", CLEAN)
def test_a_clean_recording_has_the_warnings_that_are_true(name, gait_data, tmp_path):
    of, names = CLEAN[name]
    found = work_out(of(gait_data, tmp_path), PROCESSING)
    assert [warning.check for _, warning in found.warnings] == [*names]


def force(side: str, axis: str) -> str:
    return f"ground_force_{side}_v{axis}"


def turned(side: str, axis: str) -> Callable[[Any], None]:
    def change(columns: Any) -> None:
        columns[force(side, axis)] = -columns[force(side, axis)]

    return change


def exchanged(columns: Any) -> None:
    forward, right = force("l", "x"), force("l", "z")
    columns[forward], columns[right] = columns[right], columns[forward]


def dead(columns: Any) -> None:
    columns[force("r", "x")] = 0.0 * columns[force("r", "x")]


def twisted(columns: Any) -> None:
    columns["ground_torque_r_y"] = 3.0 * columns["ground_torque_r_y"]


def clipped(columns: Any) -> None:
    vertical = columns[force("r", "y")]
    columns[force("r", "y")] = np.minimum(vertical, 0.9 * vertical.max())


@pytest.fixture(scope="module")
def made(tmp_path_factory: pytest.TempPathFactory) -> MadeUpSession:
    return made_up_session(tmp_path_factory.mktemp("made"), noise=0.0005, seconds=2.4)


MADE_UP = {
    "sound": (lambda _: None, "", ""),
    "right turned": (turned("r", "x"), "r", "pushed back first and forward later"),
    "left turned": (turned("l", "x"), "l", "pushed back first and forward later"),
    "sideways turned": (turned("r", "z"), "r", "pushed outwards"),
    "exchanged": (exchanged, "l", "axes are exchanged"),
    "dead": (dead, "r", "fore-aft force hardly changes under load"),
}
"""A change of the forces, the plate that cannot be right then, and why; none if nothing is."""
DOUBTED = {"free moment x 3": (twisted, "size of the free moment"),
           "clipped": (clipped, "saturated channel")}  # fmt: skip


def with_forces(made: MadeUpSession, path: Path, change: Callable[[Any], None]) -> Request:
    """The session with other forces; `change` gets the columns by name."""
    table = read_storage(made.forces)
    columns = {name: table.values[:, i] for i, name in enumerate(table.columns)}
    change(columns)
    write_storage(path, replace(table, values=np.column_stack([columns[n] for n in table.columns])))
    return made.request.model_copy(update={"forces": (path,)})


@pytest.mark.parametrize("name", MADE_UP)
def test_forces_that_cannot_be_right_are_refused_with_the_way_on(name, made, tmp_path):
    change, plate, words = MADE_UP[name]
    request = with_forces(made, tmp_path / "f.mot", change)
    if not plate:
        assert [str(warning) for warning in doubts(work_out(request, PROCESSING))] == []
        return
    with pytest.raises(RecordError, match=f"plate {plate}(.|\n)*{words}") as caught:
        work_out(request, PROCESSING)
    assert caught.value.goes_on == (f"--plate {plate}=none", "--kinematics-only")


@pytest.mark.slow
@pytest.mark.parametrize("name", DOUBTED)
def test_forces_that_are_unlikely_are_doubted(name, made, tmp_path):
    change, check = DOUBTED[name]
    found = doubts(work_out(with_forces(made, tmp_path / "f.mot", change), PROCESSING))
    assert check in {warning.check for warning in found}
    assert {warning.where.split()[1] for warning in found} == {"r"}


def test_a_doubt_is_on_the_page_in_the_record_and_in_the_summary(made, tmp_path):
    request = with_forces(made, tmp_path / "f.mot", twisted)
    options = [f"--mass={request.mass_kg}", f"--height={request.height_m}", f"--sex={request.sex}"]
    options += [f"--trial={request.trials[0]}", f"--forces={request.forces[0]}"]
    command = [
        "import",
        f"--static={request.static}",
        f"--out={tmp_path / 'out'}",
        *options,
        *WITH_WORDS,
    ]
    result = CliRunner().invoke(cli.app, command)
    assert result.exit_code == 0, result.output
    assert "Warning: walk.trc: plate r" in " ".join(result.output.split())
    folder = tmp_path / "out" / "recording"
    stored, _ = read_json(folder / "import.json")["warnings"]
    assert (stored["check"], stored["trial"]) == ("size of the free moment", "walk.trc")
    assert stored["value"] > stored["limit"] > 0.0
    page = (folder / "recording.html").read_text()
    assert page.index("2 warnings about the recording") < page.index("quality limits")


def calibrated(row: int, diagonal: float, factor: float) -> Callable[[Any], None]:
    """A row of the left plate's matrix times `factor`: sideways, fore-aft and vertical force, and
    their moments; `diagonal` is added to its own channel.
    """

    def change(matrix: Any) -> None:
        matrix[row, :, 0] *= factor
        matrix[row, row, 0] += diagonal

    return change


CALIBRATED = {
    "free moment x 10": (calibrated(5, 0.0, 10.0), "free moment is"),
    "dead sideways": (calibrated(0, -1.0, 0.0), "sideways force hardly changes"),
    "dead vertical": (calibrated(2, -1.0, 0.0), "vertical force hardly changes"),
    "dead vertical moment": (calibrated(5, -1.0, 0.0), "free moment is"),
    "dead moment along": (calibrated(3, -1.0, 0.0), ""),
    "dead moment across": (calibrated(4, -1.0, 0.0), ""),
}
"""A change of the calibration of a plate of WBDS01, and why it cannot be right; without a reason
its centre of pressure is beside the foot."""


@pytest.mark.slow
@pytest.mark.parametrize("name", CALIBRATED)
def test_a_plate_without_its_calibration_is_refused_or_doubted(name, gait_data, tmp_path):
    change, words = CALIBRATED[name]
    whole = wbds01_t01(gait_data)
    file = ezc3d.c3d(str(whole.trials[0]))
    frames = 8 * 150
    meta = file["data"]["meta_points"]
    file["data"]["points"] = file["data"]["points"][:, :, :frames]
    meta["residuals"] = meta["residuals"][:, :, :frames]
    meta["camera_masks"] = meta["camera_masks"][:, :, :frames]
    file["data"]["analogs"] = file["data"]["analogs"][:, :, : 2 * frames]
    change(file["parameters"]["FORCE_PLATFORM"]["CAL_MATRIX"]["value"])
    file.write(str(tmp_path / "w.c3d"))
    request = whole.model_copy(update={"trials": (tmp_path / "w.c3d",)})
    if not words:
        checks = {warning.check for _, warning in work_out(request, PROCESSING).warnings}
        assert "centre of pressure under the foot" in checks
        return
    with pytest.raises(RecordError, match=words) as caught:
        work_out(request, PROCESSING)
    assert caught.value.goes_on[-1] == "--kinematics-only"
    assert "--plate 1=none" in caught.value.goes_on
