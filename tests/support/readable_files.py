"""Files of every kind that gaitval reads, and what reads each: its reader, or the whole command.

Recordings are a made-up session, worked out whole. A command refuses by exit code 2; what it writes
may hold no NaN and no infinity, and a subject that it makes has to be one.
"""

import contextlib
import io
import json
import shutil
from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path
from typing import Any, Final

import numpy as np
import pandas as pd
from format_files import (
    kistler_text,
    laboratory,
    motion_analysis,
    opencap_folder,
    pose2sim_folder,
    qualisys_tsv,
    vicon_csv,
)
from known_walk import known_walk
from made_up_session import MadeUpSession, made_up_session
from quick_settings import WITH_WORDS

from gaitval._internal.io.artefacts import read_json
from gaitval.apps.cohort.table import read_table
from gaitval.apps.regression.baseline import believed
from gaitval.apps.regression.seal import check_seal
from gaitval.cli import app
from gaitval.cli.terminal import display
from gaitval.configuration import ContactSettings, load_configuration
from gaitval.coordinates import SIDES
from gaitval.errors import GaitvalError
from gaitval.kinetics.inverse.inverse_dynamics import inverse_dynamics
from gaitval.kinetics.inverse.marked_body import marker_positions
from gaitval.kinetics.inverse.scaled_markers import load_markers
from gaitval.metrics.results import identification_from
from gaitval.mocap.c3d_writing import write_c3d
from gaitval.mocap.reading import read_recording
from gaitval.mocap.recording import FootForces, Recording
from gaitval.mocap.trc_writing import write_trc
from gaitval.model.markers import ModelMarker, save_markers
from gaitval.model.urdf import read_urdf, write_urdf
from gaitval.policy.storage import load_policy
from gaitval.policy.training import read_log
from gaitval.scaling.scaling import scale_subject
from gaitval.session.importing.batch_imports import read_batch
from gaitval.session.importing.importing import work_out
from gaitval.session.opensim.motion import (
    write_external_loads,
    write_ground_reaction,
    write_markers,
    write_moments,
    write_motion,
)
from gaitval.session.opensim.osim import write_osim
from gaitval.session.request import Request
from gaitval.session.subject import subject_of
from gaitval.subjects.subject_file import load_subject
from gaitval.walk.reference.adjustment import Adjustment
from gaitval.walk.reference.motion import ReferenceMotion
from gaitval.walk.simulation.rollout import Rollout
from gaitval.walk.simulation.simulated_walk import SimulatedWalk

ROOT = Path(__file__).resolve().parents[2]
BASELINE = ROOT / "reports" / "S05" / "baseline"

RATE: Final = 150.0
PER_FRAME: Final = 2
"""Of WBDS's text files, which say neither."""
SECONDS: Final = 2.4
"""Two strides: a right and a left cycle."""


@dataclass(frozen=True)
class Kind:
    """A kind of input.

    Attributes
    ----------
    seeds : content of each file, by its name.
    files : names of those that are damaged.
    run : reads them from a folder.
    """

    seeds: Mapping[str, bytes]
    files: tuple[str, ...]
    run: Callable[[Path], None]


def _walking_c3d(path: Path, trial: Recording) -> None:
    """A trial whose plates are two strips of floor, right and left, as type 2, in N and Nmm."""
    plates = []
    for plate in trial.plates:
        side = float(np.sign(np.nanmedian(plate.centre_of_pressure[:, 2])))
        outer, back, front = side, -1.0, 6.0
        right, left = max(outer, 0.0), min(outer, 0.0)
        # x forward, z to the right, so the plate's third axis points down
        at = np.array([[front, 0, right], [back, 0, right], [back, 0, left], [front, 0, left]])
        moment = np.cross(np.nan_to_num(plate.centre_of_pressure), plate.force) + plate.free_moment
        moment[np.isnan(plate.centre_of_pressure).any(axis=1)] = 0.0
        plates.append(replace(plate, corners=at, moment=moment))
    write_c3d(path, replace(trial, plates=tuple(plates)))


def _tabbed(path: Path, header: list[str], values: np.ndarray) -> None:
    rows = ("\t".join(f"{value:.9g}" for value in row) for row in np.nan_to_num(values))
    path.write_text("\n".join(["\t".join(header), *rows, ""]))


def _wbds_text(folder: Path, trial: Recording) -> None:
    """A trial as WBDS has it."""
    names = [name + axis for name in trial.names for axis in "XYZ"]
    markers = 1e3 * trial.markers.reshape(len(trial.markers), -1)
    table = np.column_stack([trial.time, markers])
    _tabbed(folder / "walkmkr.txt", ["Time", *names], table)
    header, columns = ["Time"], [np.arange(len(trial.plates[0].force))[:, None]]
    for number, plate in enumerate(trial.plates, start=1):
        header += [f"{name}{number}" for name in ("Fx", "Fy", "Fz", "COPx", "COPy", "COPz", "Ty")]
        columns += [plate.force, 1e3 * plate.centre_of_pressure, 1e3 * plate.free_moment[:, 1:2]]
    _tabbed(folder / "walkgrf.txt", header, np.column_stack(columns))


def _session(folder: Path, *, walking: str, forces: str | None) -> None:
    person = MadeUpSession(None, None, *(folder / n for n in ("stand.c3d", walking, "x"))).request  # type: ignore[arg-type]
    own = {} if forces is None else {"forces": (folder / forces,)}
    values = {**person.__dict__, "forces": (), **own}
    subject_of(work_out(Request(**values), load_configuration().processing))


def _subject(folder: Path) -> None:
    return as_subject(folder / "subject.toml")


def as_subject(path: Path) -> None:
    """The body and the record of a subject; a number that is another is another person."""
    subject = load_subject(path)
    model, record = scale_subject(subject).model, subject.record()
    masses = np.array([segment.mass for segment in model.segments])
    phase = np.linspace(0.0, 1.0, 21)
    messages = [curve(phase) for curve in (*record.angles.values(), *record.moments.values())]
    _plausible(np.isfinite(masses).all() and (masses > 0.0).all(), "masses", masses)
    _plausible(abs(masses.sum() / subject.mass_kg - 1.0) < 1e-6, "sum of masses", masses.sum())
    _plausible(
        np.isfinite(messages).all() and np.abs(messages).max() < 6.0,
        "curves",
        np.abs(messages).max(),
    )


def _plausible(holds: Any, what: str, value: Any) -> None:
    if not holds:
        raise AssertionError(f"{what}: {value}")


def _configuration(folder: Path) -> None:
    configuration = load_configuration(folder / "configuration.toml")
    sent = configuration.model_dump_json()
    _plausible("NaN" not in sent and "Infinity" not in sent, "settings", sent[:200])


def _urdf(folder: Path) -> None:
    """The model; a number that is another is another body, as long as it is one."""
    model = read_urdf(folder / "model.urdf")
    for segment in model.segments:
        moments = np.linalg.eigvalsh(segment.inertia)
        _plausible(segment.mass > 0.0, f"{segment.name}: mass", segment.mass)
        _plausible((moments > 0.0).all(), f"{segment.name}: inertia", moments)
        _plausible(np.isfinite(segment.joint_position).all(), segment.name, segment.joint_position)


def _policy(folder: Path) -> None:
    """One action; weights of other bytes are another policy, as long as it acts."""
    policy = load_policy(folder, environment=load_configuration().environment)
    size = policy.tensors["observation_mean"].shape[0]
    with np.errstate(over="ignore"):
        action = policy.act(np.zeros(size))
    _plausible(np.isfinite(action).all(), "action", action)


def _stored(folder: Path) -> None:
    """What `gaitval check` reads before it walks: sealed, so nothing may be another."""
    check_seal(folder)
    found = believed(folder / "metrics.json")
    assert found == believed(BASELINE / "metrics.json")
    identification_from(read_json(folder / "identification.json"), "mu")
    Adjustment.from_dict(read_json(folder / "correction.json"), "correction")
    load_policy(folder / "policy")


def kinds(folder: Path) -> dict[str, Kind]:
    """All kinds of input, with their undamaged files, which are made in an empty folder."""
    session = made_up_session(
        folder,
        noise=2e-4,
        seconds=SECONDS,
        rate=RATE,
        per_frame=PER_FRAME,
        standing_frames=20,
    )
    trial = read_recording(session.walking, forces=session.forces)
    _walking_c3d(folder / "walk.c3d", trial)
    _wbds_text(folder, trial)
    write_urdf(scale_subject(load_subject("S05")).model, folder / "model.urdf")
    shutil.copytree(BASELINE, folder / "stored")

    def seeds(*names: str) -> dict[str, bytes]:
        return {name: (folder / name).read_bytes() for name in names}

    stored = {
        str(path.relative_to(folder / "stored")): path.read_bytes()
        for path in sorted((folder / "stored").rglob("*"))
        if path.is_file()
    }
    trc = partial(_session, walking="walk.trc", forces="walk_forces.mot")
    files = seeds("stand.c3d", "walk.trc", "walk_forces.mot")
    wbds = partial(_session, walking="walkmkr.txt", forces="walkgrf.txt")
    return _further(folder) | {
        "c3d_standing": Kind(files, ("stand.c3d",), trc),
        "c3d_walking": Kind(
            seeds("stand.c3d", "walk.c3d"),
            ("walk.c3d",),
            partial(_session, walking="walk.c3d", forces=None),
        ),
        "trc": Kind(files, ("walk.trc",), trc),
        "mot": Kind(files, ("walk_forces.mot",), trc),
        "wbds": Kind(
            seeds("stand.c3d", "walkmkr.txt", "walkgrf.txt"),
            ("walkmkr.txt", "walkgrf.txt"),
            wbds,
        ),
        "subject": Kind({"subject.toml": stored["subject.toml"]}, ("subject.toml",), _subject),
        "configuration": Kind(
            {"configuration.toml": stored["configuration.toml"]},
            ("configuration.toml",),
            _configuration,
        ),
        "urdf": Kind(seeds("model.urdf"), ("model.urdf",), _urdf),
        "policy": Kind(
            {name: stored[f"policy/{name}"] for name in ("policy.safetensors", "policy.json")},
            ("policy.safetensors", "policy.json"),
            _policy,
        ),
        "baseline": Kind(
            stored,
            (
                "metrics.json",
                "identification.json",
                "correction.json",
                "seal.json",
                "policy/policy.json",
                "policy/policy.safetensors",
                "subject.toml",
                "configuration.toml",
            ),
            _stored,
        ),
    }


SLOW: Final = (
    *("session", "marker_set", "judged_model", "judged_motion", "judged_moments"),
    *("judged_loads", "judged_forces", "judged_markers"),
)
"""Kinds of which a case takes a second or more if its file is not refused."""


class Refused(GaitvalError):
    """The command has refused its input."""


def command(*arguments: str | Path) -> None:
    """Run `gaitval` with these arguments. Raises Refused for exit code 2, and what it raises."""
    with (
        display.messages.capture() as message,
        contextlib.redirect_stdout(io.StringIO()),
        contextlib.redirect_stderr(io.StringIO()),
    ):
        try:
            code = app([str(each) for each in arguments], standalone_mode=False)
        except SystemExit as ended:
            code = ended.code
    text = " ".join(message.get().split())[-300:]
    if code == 2:
        raise Refused(text)
    if code not in (0, 1, None):
        raise AssertionError(f"exit code {code}: {text}")


def through(folder: Path, *arguments: str | Path) -> None:
    """What a command writes into `folder`/out is looked at."""
    out = folder / "out"
    command(*arguments, "--out", out)
    looked_over(out)


def _no_number(text: str) -> Any:
    raise AssertionError(f"{text} in JSON")


def looked_over(folder: Path) -> None:
    """Raises SilentNonsense where a file of results holds what is no number."""
    for path in folder.rglob("*"):
        if path.suffix == ".json":
            json.loads(path.read_text(encoding="utf-8"), parse_constant=_no_number)
        elif path.suffix == ".toml" and path.name == "subject.toml":
            as_subject(path)
        elif path.suffix == ".csv":
            table = pd.read_csv(path)
            if np.isinf(table.select_dtypes("number")).to_numpy().any():
                raise AssertionError(f"an infinite number in {path.name}")


def _curves(folder: Path, *files: str) -> None:
    person = "--mass 64.95 --height 1.53 --leg-length 0.8 --sex F --age 31 --speed 1.12"
    out = folder / "mine.toml"
    command("curves", *(folder / each for each in files), *person.split(), "--stride-time", "1.05",
            "--trial-name", "T05", "--out", out)  # fmt: skip
    as_subject(out)


def _judge(folder: Path) -> None:
    files = {"--ik": "ik.mot", "--id": "id.sto", "--markers": "walk.trc", "--grf": "grf.mot",
             "--external-loads": "loads.xml"}  # fmt: skip
    given = [each for option, name in files.items() for each in (option, folder / name)]
    return through(
        folder, "judge", folder / "model.osim", *given, "--mass", "60", "--height", "1.6"
    )


def _loaded(load: Callable[[Path], Any], name: str, folder: Path) -> None:
    found = load(folder / name)
    frame = found.to_frame() if hasattr(found, "to_frame") else None
    if frame is not None and np.isinf(frame.select_dtypes("number")).to_numpy().any():
        raise AssertionError("an infinite number")


def _imported(folder: Path) -> None:
    """A marker set of one's own, through the import."""
    return through(folder, "import", *_PERSON, "--static", folder / "stand.c3d", "--trial",
                   folder / "walk.trc", "--forces", folder / "walk_forces.mot", "--marker-set",
                   folder / "own.toml", *WITH_WORDS)  # fmt: skip


_PERSON: Final = ("--sex", "F", "--mass", "63.2", "--height", "1.66", "--age", "30")


def _trial(name: str, forces: str | None, folder: Path) -> None:
    """Of a trial only finite forces may come in, and markers that are of a person."""
    read = read_recording(folder / name, forces=None if forces is None else folder / forces)
    if not all(np.isfinite(plate.force).all() for plate in read.plates):
        raise AssertionError("a force that is no number")
    if np.isinf(read.markers).any() or not read.marker_rate > 0.0:
        raise AssertionError("markers that are nowhere, or have no times")


def _session_folder(name: str, folder: Path) -> None:
    for person in read_batch([folder / name]):
        if not (0.0 < (person.mass or 0.0) < 1e4 and 0.0 < (person.height or 0.0) < 1e4):
            raise AssertionError(f"mass {person.mass}, height {person.height}")


def _further(folder: Path) -> dict[str, Kind]:
    """Files that commands read, made in a folder that has the session."""
    (folder / "session.toml").write_text(
        '[[people]]\nname = "P01"\nstatic = "stand.c3d"\ntrials = ["walk.trc"]\n'
        'forces = ["walk_forces.mot"]\nsex = "F"\nmass = 63.2\nheight = 1.66\nage = 30\n'
    )
    own = Path(__file__).parents[2] / "gaitval" / "scaling" / "markersets" / "wbds.toml"
    shutil.copy(own, folder / "own.toml")
    (folder / "table.csv").write_text(
        "name,subject,trial,seed,start,training.samples\nyoung,S01,,0,,\nslow,S02,,1,scratch,500\n"
    )
    _write_curves(folder)
    write_judged(folder)
    _write_arrays(folder)
    _write_formats(folder)
    shutil.copy(next((BASELINE / "policy").glob("*.json")), folder / "policy.json")
    (folder / "training.csv").write_text("samples,reward\n100,1.5\n200,2.5\n300,3.5\n")

    def seeds(*names: str) -> dict[str, bytes]:
        return {name: (folder / name).read_bytes() for name in names}

    trial = ("stand.c3d", "walk.trc", "walk_forces.mot")
    judged = seeds("model.osim", "ik.mot", "id.sto", "loads.xml", "grf.mot", "judged.trc")
    judged["walk.trc"] = judged.pop("judged.trc")

    def judge(name: str) -> Kind:
        return Kind(judged, (name,), _judge)

    def loaded(name: str, load: Callable[[Path], Any]) -> Kind:
        return Kind(seeds(name), (name,), partial(_loaded, load, name))

    def trial_of(name: str, forces: str | None, damaged: str, *more: str) -> Kind:
        there = [each for each in (name, forces, *more) if each is not None]
        return Kind(seeds(*there), (damaged,), partial(_trial, name, forces))

    def program(*names: str) -> Kind:
        first = names[0].partition("/")[0]
        return Kind(seeds(*names), (names[0],), partial(_session_folder, first))

    trials = ("v.trc", "walk_f_1.tsv", "walk_f_2.tsv")
    pose = "P00/T01_Walk/pose-3d/T01_Walk_0-100.trc"
    return {
        "vicon_csv": trial_of("v.csv", None, "v.csv"),
        "qualisys_tsv": trial_of("walk.tsv", None, "walk.tsv", *trials[1:]),
        "qualisys_forces": trial_of("v.trc", "walk_f_1.tsv", "walk_f_2.tsv", "walk_f_2.tsv"),
        "motion_analysis": trial_of("v.trc", "v.forces", "v.forces"),
        "kistler_text": trial_of("v.trc", "k.txt", "k.txt", "k.plates.toml"),
        "kistler_places": trial_of("v.trc", "k.txt", "k.plates.toml", "k.plates.toml"),
        "opencap": program("OC/sessionMetadata.yaml", "OC/MarkerData/walk1.trc"),
        "pose2sim": program("P00/Config.toml", pose),
        "session": Kind(
            seeds("session.toml", *trial),
            ("session.toml",),
            lambda f: through(f, "import", f / "session.toml", *WITH_WORDS),
        ),
        "marker_set": Kind(seeds("own.toml", *trial), ("own.toml",), _imported),
        "cohort": loaded("table.csv", read_table),
        "curves_csv": Kind(
            seeds("curves.csv"), ("curves.csv",), lambda f: _curves(f, "curves.csv")
        ),
        "judged_model": judge("model.osim"),
        "judged_motion": judge("ik.mot"),
        "judged_moments": judge("id.sto"),
        "judged_loads": judge("loads.xml"),
        "judged_forces": judge("grf.mot"),
        "judged_markers": judge("walk.trc"),
        "configuration_command": Kind(
            {"c.toml": (BASELINE / "configuration.toml").read_bytes()},
            ("c.toml",),
            lambda f: through(f, "stage", "scale", "5", "--config", f / "c.toml"),
        ),
        "subject_command": Kind(
            {"s.toml": (BASELINE / "subject.toml").read_bytes()},
            ("s.toml",),
            lambda f: through(f, "stage", "scale", f / "s.toml"),
        ),
        "reference_npz": loaded("reference.npz", ReferenceMotion.load),
        "rollout_npz": loaded("rollout.npz", Rollout.load),
        "walk_npz": loaded("walk.npz", SimulatedWalk.load),
        "recording_npz": loaded("recording.npz", Recording.load),
        "markers_json": loaded("markers.json", load_markers),
        "training_log": loaded("training.csv", lambda path: read_log(path, 200)),
    }  # fmt: skip


def _write_formats(folder: Path) -> None:
    """A trial as other programs have it."""
    trial = laboratory(folder / "walk.trc", folder / "walk_forces.mot")
    write_trc(folder / "v.trc", trial)
    vicon_csv(folder / "v.csv", trial)
    qualisys_tsv(folder / "walk.tsv", trial)
    motion_analysis(folder / "v.forces", trial)
    kistler_text(folder / "k.txt", trial)
    plain = read_recording(folder / "walk.trc")
    opencap_folder(folder / "OC", plain, plain, None)
    pose2sim_folder(folder / "P00", plain, plain)
    (folder / "P00" / "P00_T01_Walk").rename(folder / "P00" / "T01_Walk")
    few = folder / "P00" / "T01_Walk" / "pose-3d"
    (few / "P00_T01_Walk_0-100_filt_butterworth_LSTM.trc").rename(few / "T01_Walk_0-100.trc")


def _write_curves(folder: Path) -> None:
    record, phase = load_subject("S05").measured(), np.linspace(0.0, 1.0, 101)
    columns = {f"angle_{n}": np.degrees(c(phase)) for n, c in record.angles.items()}
    columns |= {f"moment_{n}": c(phase) for n, c in record.moments.items()}
    for side in SIDES:
        force = record.ground_reaction(side, phase % 1.0)
        for axis, name in enumerate(("forward", "left", "up")):
            columns[f"force_{name}_{side[0]}"] = force[:, axis]
    table = pd.DataFrame({"percent": 100 * phase, **columns})
    table.to_csv(folder / "curves.csv", index=False)


def write_judged(folder: Path) -> None:
    """A model and its results, as `gaitval judge` takes them."""
    walk = known_walk(seconds=1.5, rate=60.0)
    random = np.random.default_rng(0)
    segments = ("pelvis", *(f"{n}_{side}" for side in "rl" for n in ("thigh", "shank", "foot")))
    markers = tuple(
        ModelMarker(f"{s}.{i}", s, walk.model[s].centre_of_mass + random.uniform(-0.1, 0.1, 3))
        for s in segments
        for i in range(3)
    )
    write_osim(folder / "model.osim", walk.model, markers, ContactSettings(), 0.8)
    save_markers(folder / "markers.json", markers, "wbds", {})
    write_motion(folder / "ik.mot", walk.time, walk.positions)
    dynamics = inverse_dynamics(walk.model, walk.time, walk.positions, *walk.wrenches)
    write_moments(folder / "id.sto", walk.positions, dynamics)
    twist = walk.free_moment * [0.0, 0.0, 1.0]
    loaded = np.ones(walk.force.shape[:2], dtype=bool)
    write_ground_reaction(
        folder / "grf.mot", FootForces(60.0, 0.0, walk.force, walk.point, twist, loaded)
    )
    write_external_loads(folder / "loads.xml", "grf.mot")
    names = tuple(marker.name for marker in markers)
    places = marker_positions(walk.model, markers, walk.positions)
    write_markers(folder / "judged.trc", Recording("made up", "project", names, places, 60.0))


def _write_arrays(folder: Path) -> None:
    random = np.random.default_rng(1)

    def drawn(*size: int) -> np.ndarray:
        return random.normal(size=size)

    ReferenceMotion(
        np.arange(8) / 8, drawn(8, 31), drawn(8, 31), drawn(8, 25), drawn(8, 2, 3), drawn(8, 3),
        drawn(8, 4, 3), drawn(25), 1.1, 1.2,
    ).save(folder / "reference.npz")  # fmt: skip
    walked = {
        "time": np.arange(9) / 100, "ground_reaction": drawn(9, 2, 3),
        "centre_of_mass": drawn(9, 3), "root_force": drawn(9, 6), "start_phase": drawn(1),
        "fell": np.zeros(1),
        "phase": drawn(9), "positions": drawn(9, 31), "velocities": drawn(9, 31),
        "moments": drawn(9, 25), "centre_of_pressure": drawn(9, 2, 3),
        "free_moment": drawn(9, 2), "mu": drawn(14),
    }  # fmt: skip
    Rollout(**walked).save(folder / "rollout.npz")
    SimulatedWalk(**walked, walker="S05", mass_kg=60.0).save(folder / "walk.npz")
    read_recording(folder / "walk.trc", forces=folder / "walk_forces.mot").save(
        folder / "recording.npz"
    )
