"""An import gives back the body, the motion and the moments that made-up recordings were made from.

The promises of the import, each with 0 and with 3 mm of noise on every coordinate of every marker:
lengths within 1 and 5 mm, angles within 0.05° and 1°, moments within 0.1 % and 5 % of their peaks
(root mean square over the trial without its ends, where the filter settles).

The known walk has content up to 7.3 Hz. Three settings of the processing:

* `EXACT` passes all of it, so what is left is the error of the import itself;
* the default, 8 Hz, is the lowest cut-off that passes this walk;
* `USUAL`, 6 Hz, is the convention for walking.
"""

import hashlib
import subprocess
import sys
from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from few_bands import every_change
from made_up_session import MARKER_RATE, MadeUpSession, made_up_session
from quick_settings import WITH_WORDS
from standing_person import PERSON

import gaitval as gv
from gaitval._internal.io.artefacts import read_json
from gaitval.configuration import ProcessingSettings
from gaitval.constants import GRAVITY
from gaitval.coordinates import ACTUATED, COORDINATES, SIDES
from gaitval.errors import ArtefactError
from gaitval.gait.agreement import EDGE_SECONDS
from gaitval.gait.mean_curves import ANGLE_TOLERANCE
from gaitval.kinetics.inverse.motion_rates import cardan_coordinates
from gaitval.model.body import SEGMENTS, BodyModel
from gaitval.scaling.scaling import scale_subject
from gaitval.session.importing import write
from gaitval.session.importing.files import FOLDER
from gaitval.session.importing.importing import work_out
from gaitval.session.importing.results import ImportResult
from gaitval.session.importing.stored import Session
from gaitval.session.importing.summary import trial_residuals
from gaitval.session.session import Import
from gaitval.session.subject import subject_of
from gaitval.session.trial import WalkingTrial, valid_cycles
from gaitval.subjects.subject_file import load_subject
from gaitval.walk.reference.motion import build_reference

# all need the import of a made-up person, of which others have parts
pytestmark = pytest.mark.slow

EXACT = ProcessingSettings(
    marker_cutoff_hz=60.0, force_cutoff_hz=60.0, moment_force_cutoff_hz=60.0, force_threshold_n=2.0
)
"""With 20 N, what a foot carries below it is missing: 0.6 % of the peak at the hip."""
USUAL = ProcessingSettings(marker_cutoff_hz=6.0, moment_force_cutoff_hz=6.0)
INSIDE = slice(round(0.2 * MARKER_RATE), -round(0.2 * MARKER_RATE))
"""More than a period of the slowest filter from both ends."""
LEGS = [
    i for i, n in enumerate(ACTUATED) if n.split("_")[0] in ("hip", "knee", "ankle", "subtalar")
]
SHOWN = [*range(6), *(6 + i for i in LEGS)]
"""Coordinates that the markers of pelvis and legs show; trunk, arms and toes they do not."""
SHOWN_SEGMENTS = [
    i
    for i, n in enumerate(SEGMENTS)
    if n.split("_")[0] in ("pelvis", "thigh", "shank", "foot", "toes")
]


@dataclass(frozen=True)
class Imported:
    """A session, and what an import of it found."""

    session: MadeUpSession
    found: Import

    @property
    def walk(self) -> WalkingTrial:
        return self.found.trials[0]


@pytest.fixture(scope="module")
def sessions(tmp_path_factory: pytest.TempPathFactory) -> dict[float, MadeUpSession]:
    return {
        noise: made_up_session(tmp_path_factory.mktemp("session"), noise=noise)
        for noise in (0.0, 0.003)
    }


@pytest.fixture(scope="module")
def imported(
    sessions: dict[float, MadeUpSession],
) -> Callable[[float, ProcessingSettings], Imported]:
    """The import of a session by its noise and processing, each done once."""
    done: dict[str, Imported] = {}

    def once(noise: float, processing: ProcessingSettings) -> Imported:
        key = f"{noise} {processing}"
        if key not in done:
            session = sessions[noise]
            done[key] = Imported(session, work_out(session.request, processing))
        return done[key]

    return once


def joints(model: BodyModel) -> np.ndarray:
    return np.array([segment.joint_position for segment in model.segments])


def moment_errors(walk: WalkingTrial, truth: np.ndarray, peaks: np.ndarray) -> dict[str, float]:
    """Root mean square by joint coordinate, share of the peak."""
    assert walk.dynamics is not None
    error = (walk.dynamics.moments - truth)[INSIDE]
    return {ACTUATED[i]: float(np.sqrt((error[:, i] ** 2).mean()) / peaks[i]) for i in LEGS}


@pytest.mark.parametrize(
    ("noise", "processing", "metres"),
    [(0.0, EXACT, 0.001), (0.003, ProcessingSettings(), 0.005)],
    ids=["exact", "3 mm"],
)
def test_lengths_come_back(imported, noise, processing, metres):
    case = imported(noise, processing)
    body, true = case.found.body, case.session.person
    apart = np.abs(joints(body.model) - joints(true.model))[SHOWN_SEGMENTS]
    assert apart.max() < metres
    for side in SIDES:
        leg, own = getattr(body.chosen, side), getattr(true.measured, side)
        assert leg.thigh == pytest.approx(own.thigh, abs=metres)
        assert leg.shank == pytest.approx(own.shank, abs=metres)
        np.testing.assert_allclose(leg.heel, own.heel, atol=metres)
        np.testing.assert_allclose(leg.metatarsals, own.metatarsals, atol=metres)


@pytest.mark.slow
@pytest.mark.parametrize(
    "misplaced",
    [{"Knee": (0.0, 0.0, 0.005)}, {"SIS": (0.006, 0.0, 0.006)}],
    ids=["knee markers 5 mm up", "pelvis markers 6 mm forward and up"],
)
def test_lengths_come_back_where_markers_are_off_their_landmarks(tmp_path, misplaced):
    """By what palpation leaves. The pelvis's put the hips as far off as their regression does."""
    session = made_up_session(tmp_path, noise=0.003, misplaced=misplaced)
    model = work_out(session.request, ProcessingSettings()).body.model
    own = session.person.model
    for segment, part in (("shank_r", "thigh"), ("foot_r", "shank"), ("thigh_r", "hip width")):
        apart = model[segment].joint_position - own[segment].joint_position
        assert np.abs(apart).max() < 0.005, part


@pytest.mark.parametrize(
    ("noise", "processing", "degrees"),
    [(0.0, EXACT, 0.05), (0.003, ProcessingSettings(), 1.0), (0.003, USUAL, 1.0)],
    ids=["exact", "3 mm, 8 Hz", "3 mm, 6 Hz"],
)
def test_angles_come_back(imported, noise, processing, degrees):
    case = imported(noise, processing)
    error = cardan_coordinates(case.walk.positions) - cardan_coordinates(
        case.session.walk.positions
    )
    sizes = np.sqrt((error[INSIDE] ** 2).mean(axis=0))
    for i in SHOWN:
        name = COORDINATES[i]
        if name in ("pelvis_tx", "pelvis_ty", "pelvis_tz"):
            assert sizes[i] < 0.001 * (1.0 if noise else 0.05), f"{name}: {1e3 * sizes[i]:.3g} mm"
        else:
            assert np.degrees(sizes[i]) < degrees, f"{name}: {np.degrees(sizes[i]):.3g}°"


@pytest.mark.parametrize(
    ("noise", "processing", "share"),
    [(0.0, EXACT, 0.001), (0.003, ProcessingSettings(), 0.05)],
    ids=["exact", "3 mm, 8 Hz"],
)
def test_moments_come_back(imported, noise, processing, share):
    case = imported(noise, processing)
    truth = case.session.walk.moments
    for name, size in moment_errors(case.walk, truth, np.abs(truth).max(axis=0)).items():
        assert size < share, f"{name}: {100 * size:.3g} % of the peak"


@pytest.mark.slow
def test_cycles_are_those_of_the_walk(imported):
    case = imported(0.0, EXACT)
    walk, truth = case.walk, case.session.walk
    loaded = truth.force[:, :, 2] > EXACT.force_threshold_n
    for i, side in enumerate(SIDES):
        true = truth.time[1:][loaded[1:, i] & ~loaded[:-1, i]]
        strikes = [e.time for e in walk.events if e.side == side and e.kind == "heel_strike"]
        np.testing.assert_allclose(strikes, true, atol=1.0 / MARKER_RATE)
        cycles = valid_cycles(walk, side, kinetics=True)
        assert len(cycles) == len(true) - 1
        assert not any(cycle.reasons for cycle in cycles)
        stride = np.mean(np.diff(true))
        assert np.mean([c.duration for c in cycles]) == pytest.approx(stride, abs=0.002)
        travelled = np.interp(true, truth.time, truth.positions[:, 3])
        assert walk.gait[side].speed.mean() == pytest.approx(
            (travelled[-1] - travelled[0]) / (true[-1] - true[0]), rel=0.005
        )
    # Periodic and free of residuals, so the forces carry the body.
    assert case.found.weight_ratio == pytest.approx(1.0, abs=0.002)


def test_the_subject_walks_as_the_recording(imported):
    """Its mean curves are the true angles of a cycle, as closely as curves are fitted."""
    case = imported(0.0, EXACT)
    truth, record = case.session.walk, subject_of(case.found).record()
    cycle = valid_cycles(case.walk, "right", kinetics=True)[0]
    phase = np.linspace(0.0, 1.0, 101)
    time = cycle.start + phase * cycle.duration
    angles = cardan_coordinates(truth.positions)
    for name in ("hip_flexion_r", "hip_adduction_r", "knee_angle_r", "ankle_angle_r"):
        true = np.interp(time, truth.time, angles[:, COORDINATES.index(name)])
        apart = np.abs(record.angles[name](phase) - true).max()
        assert apart < ANGLE_TOLERANCE + np.radians(0.05), name


@pytest.mark.slow
@pytest.mark.parametrize(
    ("noise", "processing", "off"), [(0.0, EXACT, 0.004), (0.003, USUAL, 0.03)]
)
def test_the_motion_alone_gives_the_force_on_both_feet(imported, noise, processing, off):
    """Its size and its signs, in body weights; the plates are the truth, which it does not read."""
    case = imported(noise, processing)
    total, truth = subject_of(case.found).gait.total_force, case.session.walk
    phase = np.linspace(0.0, 1.0, 101)
    cycles = valid_cycles(case.walk, "right", kinetics=False)
    for i, axis in enumerate(("forward", "left", "up")):
        both = truth.force[:, :, i].sum(axis=1) / (case.found.body.model.mass * GRAVITY)
        at = [np.interp(c.start + c.duration * phase, truth.time, both) for c in cycles]
        curve = getattr(total, axis).periodic()(phase)
        assert np.sqrt(np.mean((curve - np.mean(at, axis=0)) ** 2)) < off, axis
        assert np.corrcoef(curve, np.mean(at, axis=0))[0, 1] > 0.9, axis
    assert total.up.mean == pytest.approx(1.0, abs=1e-3)


def command(session: MadeUpSession, out: Path) -> list[str]:
    return [
        "import",
        *("--static", str(session.standing), "--trial", str(session.walking)),
        *("--forces", str(session.forces), "--out", str(out)),
        *("--mass", str(PERSON.mass_kg), "--height", str(PERSON.height_m), "--sex", PERSON.sex),
        *WITH_WORDS,
    ]


def hashes(folder: Path) -> dict[str, str]:
    return {
        str(path.relative_to(folder)): hashlib.sha256(path.read_bytes()).hexdigest()
        for path in sorted(folder.rglob("*"))
        if path.is_file()
    }


@pytest.fixture(scope="module")
def from_the_command_line(sessions, tmp_path_factory) -> Path:
    out: Path = tmp_path_factory.mktemp("import") / "made-up"
    done = subprocess.run(
        [sys.executable, "-P", "-m", "gaitval", *command(sessions[0.003], out)],
        capture_output=True,
        text=True,
    )
    assert done.returncode == 0, done.stdout + done.stderr
    return out


def test_the_subject_file_gives_the_body_of_the_import(imported, from_the_command_line):
    """To the six digits of the file; and that body can walk as the record says."""
    case = imported(0.003, ProcessingSettings())
    subject = load_subject(str(from_the_command_line / "subject.toml"))
    assert subject.identifier == "made-up"
    model = scale_subject(subject).model
    np.testing.assert_allclose(joints(model), joints(case.found.body.model), atol=1e-6)
    for ours, theirs in zip(model.segments, case.found.body.model.segments, strict=True):
        assert ours.mass == pytest.approx(theirs.mass, rel=1e-5), ours.name
        np.testing.assert_allclose(ours.centre_of_mass, theirs.centre_of_mass, atol=1e-6)
        np.testing.assert_allclose(ours.inertia, theirs.inertia, rtol=1e-4, atol=1e-7)
    reference = build_reference(subject.record(), model)
    assert np.isfinite(reference.positions).all()
    assert reference.speed == pytest.approx(case.walk.gait["right"].speed.mean(), rel=0.01)


@pytest.fixture(scope="module")
def from_python(sessions, from_the_command_line, tmp_path_factory) -> Session:
    """Without the page, which has its own tests and takes long."""
    session, person = sessions[0.003], sessions[0.003].request
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(write, "write_recording_report", lambda *_: None)
        every_change(patch)
        return gv.import_session(
            session.standing,
            session.walking,
            forces=[session.forces],
            mass=person.mass,
            height=person.height,
            sex=person.sex,
            out=tmp_path_factory.mktemp("python") / from_the_command_line.name,
        )


@pytest.mark.slow
def test_an_import_repeats_bit_for_bit(from_the_command_line: Path, from_python: Session):
    """By the command and from Python, in two processes: the same bytes."""
    first, again = hashes(from_the_command_line), hashes(from_python.folder)
    only = set(first) - set(again)
    tables = {name for name in only if name.startswith(f"{FOLDER}/figures/")}
    assert tables
    assert only - tables == {f"{FOLDER}/recording.html"}
    assert {name: first[name] for name in again} == again
    assert {"subject.toml", *(f"{FOLDER}/{name}" for name in _PROMISED)} <= set(again)


def test_the_record_of_an_import_is_typed(from_the_command_line):
    written = read_json(from_the_command_line / FOLDER / "import.json")
    found = ImportResult.model_validate(written)
    assert found.as_dict() == written
    assert found.person.mass_kg == PERSON.mass_kg


def test_an_import_is_read_again(from_python: Session, tmp_path: Path):
    assert "Residual moment" in repr(from_python)
    from_python.save(tmp_path)
    again = Session.load(tmp_path)
    assert again.subject == from_python.subject
    pd.testing.assert_frame_equal(again.to_frame(), from_python.to_frame())
    (tmp_path / FOLDER / "import.json").unlink()
    with pytest.raises(ArtefactError, match="no import ended here"):
        Session.load(tmp_path)


@pytest.mark.slow
def test_motion_and_moments_from_python_are_those_of_the_import(imported, from_python: Session):
    case = imported(0.003, ProcessingSettings())
    files, walk = case.session, case.walk
    axes = from_python.record["axes"]
    trial = gv.read_recording(files.walking, forces=files.forces, axes=axes)
    motion = gv.inverse_kinematics(trial, from_python.body)
    np.testing.assert_allclose(motion.positions, walk.positions, atol=1e-6)
    moments = gv.inverse_dynamics(motion, trial, from_python.body)
    assert walk.dynamics is not None
    assert walk.loads is not None
    np.testing.assert_allclose(moments.moments, walk.dynamics.moments, atol=1e-3)
    np.testing.assert_array_equal(moments.known, walk.loads.valid.all(axis=1))


_PROMISED = (
    "model.osim",
    "model.urdf",
    "markers.json",
    "import.json",
    "trial1_ik.mot",
    "trial1_grf.mot",
    "trial1_id.sto",
    "trial1_markers.trc",
    "trial1_external_loads.xml",
)


def test_the_ends_of_a_trial_are_no_residual(imported):
    """What is added to the force there is not judged; a frame further in, it is."""
    walk = imported(0.003, ProcessingSettings()).walk
    (_, here), *_ = trial_residuals(walk)
    edge, force = round(EDGE_SECONDS * MARKER_RATE), walk.dynamics.residual_force.copy()
    force[:edge] += 1e3
    force[-edge:] += 1e3
    ends = replace(walk, dynamics=replace(walk.dynamics, residual_force=force.copy()))
    assert trial_residuals(ends)[0][1] == here
    force[edge] += 1e3
    inside = replace(walk, dynamics=replace(walk.dynamics, residual_force=force))
    assert trial_residuals(inside)[0][1].force_peak > 900.0
