"""Further files that are damaged, each through the command that reads it, in this process, or
through its reader where the command takes minutes.

A command refuses by exit code 2; whatever else it raises is a fault. What it writes may hold no NaN
and no infinity, and a subject that it makes has to be one.
"""

import contextlib
import io
import json
import re
import shutil
import zipfile
from collections.abc import Callable
from functools import partial
from pathlib import Path
from typing import Any, Final

import fuzz_mutators as m
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
from fuzz_cases import BASELINE, PER_FRAME, RATE, SECONDS, Kind, Result, SilentNonsense, as_subject
from known_walk import known_walk
from made_up_session import made_up_session

from gaitval.apps.cohort.table import read_table
from gaitval.cli import app
from gaitval.configuration import ContactSettings
from gaitval.coordinates import SIDES
from gaitval.datasets.subject_file import load_subject
from gaitval.errors import GaitvalError
from gaitval.importing.batch_imports import read_batch
from gaitval.inverse.inverse_dynamics import inverse_dynamics
from gaitval.inverse.marked_body import marker_positions
from gaitval.inverse.scaled_markers import load_markers
from gaitval.journal import Journal
from gaitval.mocap.reading import read_recording
from gaitval.mocap.recording import FootForces, Recording
from gaitval.mocap.trc_writing import write_trc
from gaitval.model.markers import ModelMarker, save_markers
from gaitval.opensim.motion import (
    write_external_loads,
    write_ground_reaction,
    write_markers,
    write_moments,
    write_motion,
)
from gaitval.opensim.osim import write_osim
from gaitval.policy.training import read_log
from gaitval.reference.motion import ReferenceMotion
from gaitval.simulation.rollout import Rollout
from gaitval.simulation.simulated_walk import SimulatedWalk
from gaitval.terminal import display

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
        raise SilentNonsense(f"exit code {code}: {text}")


def through(folder: Path, *arguments: str | Path) -> Result:
    """What a command writes into `folder`/out is looked at."""
    out = folder / "out"
    command(*arguments, "--out", out)
    looked_over(out)
    return Result()


def _no_number(text: str) -> Any:
    raise SilentNonsense(f"{text} in JSON")


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
                raise SilentNonsense(f"an infinite number in {path.name}")


def _curves(folder: Path, *files: str) -> Result:
    person = "--mass 64.95 --height 1.53 --leg-length 0.8 --sex F --age 31 --speed 1.12"
    out = folder / "mine.toml"
    command("curves", *(folder / each for each in files), *person.split(), "--stride-time", "1.05",
            "--trial-name", "T05", "--out", out)  # fmt: skip
    return as_subject(out)


def _judge(folder: Path) -> Result:
    files = {"--ik": "ik.mot", "--id": "id.sto", "--markers": "walk.trc", "--grf": "grf.mot",
             "--external-loads": "loads.xml"}  # fmt: skip
    given = [each for option, name in files.items() for each in (option, folder / name)]
    return through(
        folder, "judge", folder / "model.osim", *given, "--mass", "60", "--height", "1.6"
    )


def _loaded(load: Callable[[Path], Any], name: str, folder: Path) -> Result:
    found = load(folder / name)
    frame = found.to_frame() if hasattr(found, "to_frame") else None
    if frame is not None and np.isinf(frame.select_dtypes("number")).to_numpy().any():
        raise SilentNonsense("an infinite number")
    return Result()


def _imported(folder: Path) -> Result:
    """A marker set of one's own, through the import."""
    return through(folder, "import", *_PERSON, "--static", folder / "stand.c3d", "--trial",
                   folder / "walk.trc", "--forces", folder / "walk_forces.mot", "--marker-set",
                   folder / "own.toml")  # fmt: skip


_PERSON: Final = ("--sex", "F", "--mass", "63.2", "--height", "1.66", "--age", "30")


def _trial(name: str, forces: str | None, folder: Path) -> Result:
    """Of a trial only finite forces may come in, and markers that are of a person."""
    read = read_recording(folder / name, forces=None if forces is None else folder / forces)
    if not all(np.isfinite(plate.force).all() for plate in read.plates):
        raise SilentNonsense("a force that is no number")
    if np.isinf(read.markers).any() or not read.marker_rate > 0.0:
        raise SilentNonsense("markers that are nowhere, or have no times")
    return Result()


def _session_folder(name: str, folder: Path) -> Result:
    for person in read_batch([folder / name]):
        if not (0.0 < (person.mass or 0.0) < 1e4 and 0.0 < (person.height or 0.0) < 1e4):
            raise SilentNonsense(f"mass {person.mass}, height {person.height}")
    return Result()


def npz_member(data: bytes, random: m.Random) -> bytes:
    """An array is missing, has another header, or holds what is no number; or a member is another
    file.
    """
    try:
        with zipfile.ZipFile(io.BytesIO(data)) as stored:
            members = {name: stored.read(name) for name in stored.namelist()}
    except (OSError, ValueError, zipfile.BadZipFile):
        return m.cut(data, random)
    name = sorted(members)[int(random.integers(len(members)))]
    content = members.pop(name)
    begin = 10 + int.from_bytes(content[8:10], "little")
    kind = int(random.integers(7))
    if kind == 1:
        content = m.other_number(content[:begin], random)[:begin].ljust(begin) + content[begin:]
    elif kind == 2 and len(content) > begin + 8:
        place = begin + 4 * int(random.integers((len(content) - begin) // 4))
        content = content[:place] + np.float32(random.choice([np.nan, np.inf, 1e30])).tobytes()
        content += members.get(name, b"") or data[:0]
        content = content.ljust(begin, b"\0")
    elif kind == 3:
        content = content[: int(random.integers(len(content)))]
    elif kind == 4:
        content = m.flip_bits(content, random)
    elif kind == 5:
        other = io.BytesIO()
        shape = [(), (0,), (3, 3), (1, 0), (10_000, 5)][int(random.integers(5))]
        np.save(other, np.full(shape, random.choice([0.0, np.nan, -1.0, 1e300])))
        content = other.getvalue()
    elif kind == 6:
        content = content.replace(b"<f", b"|V" if random.integers(2) else b"<c").replace(
            b"<U", b"|O"
        )
    if kind:
        members[name] = content
    out = io.BytesIO()
    with zipfile.ZipFile(out, "w", zipfile.ZIP_DEFLATED) as written:
        for each, text in members.items():
            written.writestr(each, text)
    return out.getvalue()


def xml_element(data: bytes, random: m.Random) -> bytes:
    """A tag is missing, twice, or another; or the document has a type with entities."""
    text = data.decode("utf-8", "replace")
    found = list(re.finditer(r"</?[A-Za-z][^<>]*>", text))
    if not found:
        return m.cut(data, random)
    match = found[int(random.integers(len(found)))]
    bomb = '<!DOCTYPE a [<!ENTITY b "bb"><!ENTITY c "&b;&b;"><!ENTITY f SYSTEM "/etc/passwd">]>'
    others = ("", match[0] * 2, "<x>", "</x>", bomb, "<a>" * 2000, "&c;", "&f;", "<![CDATA[")
    other = others[int(random.integers(len(others)))]
    return (text[: match.start()] + other + text[match.end() :]).encode()


def kinds(folder: Path) -> dict[str, Kind]:
    """All further kinds, with their undamaged files, which are made in an empty folder."""
    made_up_session(
        folder, noise=2e-4, seconds=SECONDS, rate=RATE, per_frame=PER_FRAME, standing_frames=20
    )
    (folder / "session.toml").write_text(
        '[[people]]\nname = "P01"\nstatic = "stand.c3d"\ntrials = ["walk.trc"]\n'
        'forces = ["walk_forces.mot"]\nsex = "F"\nmass = 63.2\nheight = 1.66\nage = 30\n'
    )
    own = Path(__file__).parents[2] / "gaitval" / "scaling" / "markersets" / "wbds.toml"
    shutil.copy(own, folder / "own.toml")
    (folder / "table.csv").write_text(
        "name,subject,trial,seed,start,training.samples,static,trials,forces,sex,mass,height\n"
        "young,S01,,0,,,,,,,,\nslow,S02,,1,scratch,500000,,,,,,\n"
        "own,,,,,,stand.c3d,walk.trc,walk_forces.mot,F,63.2,1.66\n"
    )
    (folder / "table.toml").write_text(
        "[settings]\ntraining.samples = 500_000\n\n[[studies]]\nsubject = 'S01'\nseeds = [0, 1]\n"
        "start = 'scratch'\nsettings.identification.method = 'none'\n\n[[studies]]\nname = 'P01'\n"
        "recording = { static = 'stand.c3d', trials = ['walk.trc'], sex = 'F', mass = 63.2 }\n"
        "\n[[studies]]\nvirtual = { number = 3, seed = 1, around = '5', by = 'stature' }\n"
    )
    _write_curves(folder)
    write_judged(folder)
    _write_arrays(folder)
    _write_formats(folder)
    (folder / "journal.jsonl").write_text(
        "".join(json.dumps([i, 0.1 * i]) + "\n" for i in range(9))
    )
    shutil.copy(next((BASELINE / "policy").glob("*.json")), folder / "policy.json")
    (folder / "training.csv").write_text("samples,reward\n100,1.5\n200,2.5\n300,3.5\n")

    def seeds(*names: str) -> dict[str, bytes]:
        return {name: (folder / name).read_bytes() for name in names}

    trial = ("stand.c3d", "walk.trc", "walk_forces.mot")
    toml = (*m.BYTES, *m.TEXT, *[m.toml_tree] * 12)
    tree = (*m.BYTES, *m.TEXT, *[m.json_tree] * 12)
    text, arrays = (*m.BYTES, *m.TEXT), (*m.BYTES, *[npz_member] * 18)
    xml = (*text, *[xml_element] * 6)
    judged = seeds("model.osim", "ik.mot", "id.sto", "loads.xml", "grf.mot", "judged.trc")
    judged["walk.trc"] = judged.pop("judged.trc")

    def judge(name: str, mutators: tuple[m.Mutator, ...]) -> Kind:
        return Kind(judged, {name: mutators}, _judge)

    def loaded(name: str, load: Callable[[Path], Any], mutators: tuple[m.Mutator, ...]) -> Kind:
        return Kind(seeds(name), {name: mutators}, partial(_loaded, load, name))

    def trial_of(name: str, forces: str | None, damaged: str, *more: str) -> Kind:
        there = [each for each in (name, forces, *more) if each is not None]
        cells = (*text, *[m.other_number] * 4)
        return Kind(seeds(*there), {damaged: cells}, partial(_trial, name, forces))

    def program(*names: str) -> Kind:
        first = names[0].partition("/")[0]
        return Kind(seeds(*names), {names[0]: text}, partial(_session_folder, first))

    storage = (*text, *m.of_table(m.MOT))
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
            {"session.toml": toml},
            lambda f: through(f, "import", f / "session.toml"),
        ),
        "marker_set": Kind(seeds("own.toml", *trial), {"own.toml": toml}, _imported),
        "cohort": loaded("table.csv", read_table, text),
        "curves_csv": Kind(
            seeds("curves.csv"), {"curves.csv": text}, lambda f: _curves(f, "curves.csv")
        ),
        "judged_model": judge("model.osim", xml),
        "judged_motion": judge("ik.mot", storage),
        "judged_moments": judge("id.sto", storage),
        "judged_loads": judge("loads.xml", xml),
        "judged_forces": judge("grf.mot", storage),
        "judged_markers": judge("walk.trc", (*text, *m.of_table(m.TRC))),
        "configuration_command": Kind(
            {"c.toml": (BASELINE / "configuration.toml").read_bytes()},
            {"c.toml": toml},
            lambda f: through(f, "stage", "scale", "5", "--config", f / "c.toml"),
        ),
        "subject_command": Kind(
            {"s.toml": (BASELINE / "subject.toml").read_bytes()},
            {"s.toml": toml},
            lambda f: through(f, "stage", "scale", f / "s.toml"),
        ),
        "reference_npz": loaded("reference.npz", ReferenceMotion.load, arrays),
        "rollout_npz": loaded("rollout.npz", Rollout.load, arrays),
        "walk_npz": loaded("walk.npz", SimulatedWalk.load, arrays),
        "recording_npz": loaded("recording.npz", Recording.load, arrays),
        "markers_json": loaded("markers.json", load_markers, tree),
        "training_log": loaded(
            "training.csv", lambda path: read_log(path, 200), text
        ),
        "journal": loaded("journal.jsonl", Journal, text),
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
