"""The files that `fuzz.py` damages, what the project makes of them, and how the results
are compared with those of the undamaged files.

Recordings are a made-up session (`tests/support/made_up_session.py`), worked out whole: reading,
scaling, inverse kinematics and dynamics, mean cycle, subject. Stored files go through their reader
and the first stage that uses them.
"""

import re
import shutil
import zlib
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, replace
from functools import partial
from pathlib import Path
from typing import Any, Final

import fuzz_mutators as m
import numpy as np
from made_up_session import MadeUpSession, made_up_session

from gaitval.apps.regression.baseline import believed
from gaitval.apps.regression.seal import check_seal
from gaitval.artefacts import read_json
from gaitval.configuration import load_configuration
from gaitval.datasets.subject_file import load_subject
from gaitval.importing.importing import work_out
from gaitval.metrics.results import identification_from
from gaitval.mocap.c3d_writing import write_c3d
from gaitval.mocap.reading import read_recording
from gaitval.mocap.recording import Recording
from gaitval.model.urdf import read_urdf, write_urdf
from gaitval.policy.storage import load_policy
from gaitval.reference.adjustment import Adjustment
from gaitval.scaling.scaling import scale_subject
from gaitval.session.request import Request
from gaitval.session.subject import subject_of

ROOT = Path(__file__).resolve().parents[2]
BASELINE = ROOT / "reports" / "S05" / "baseline"

RATE: Final = 150.0
PER_FRAME: Final = 2
"""Of WBDS's text files, which say neither."""
SECONDS: Final = 2.4
"""Two strides: a right and a left cycle."""

LIMITS: Final = {"angle": 2.0, "moment": 0.1, "force": 3.0, "time": 10.0}
"""RMS over the cycle, degrees, Nm/kg, % of body weight, and % of stride time and of speed, by which
a result may be another without a word. 2 degrees is what repeated sessions of one person are good
for (McGinley et al. 2009, Gait & Posture 29:360); the others are the project's, of the size by
which a person's single cycles differ."""

TURNS: Final = dict.fromkeys(("subject", "configuration", "urdf", "policy", "baseline"), 5)
"""Cases of a kind for one of the others; a recording takes ten times as long as a stored file."""


@dataclass(frozen=True)
class Result:
    """What was made of the files.

    Attributes
    ----------
    curves : by kind (`LIMITS`) and name, in the units of `LIMITS`.
    told : sentences that the user sees, without their numbers.
    exact : something that has to be equal, if it is accepted at all.
    """

    curves: Mapping[tuple[str, str], np.ndarray] = field(default_factory=dict)
    told: frozenset[str] = frozenset()
    exact: Any = None


@dataclass(frozen=True)
class Kind:
    """A kind of input.

    Attributes
    ----------
    files : names of those that are damaged, with their mutators; the first byte mutators are for
        each.
    run : from a folder with all files of `seeds` to the result.
    """

    seeds: Mapping[str, bytes]
    files: Mapping[str, tuple[m.Mutator, ...]]
    run: Callable[[Path], Result]


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


def _plain(text: str, folder: Path) -> str:
    return re.sub(r"[-+]?\d[\d.]*(e-?\d+)?", "#", text.replace(str(folder), ""))


def import_result(request: Request, folder: Path) -> Result:
    """The mean cycle of a session, and all that the user reads about it."""
    found = work_out(request, load_configuration().processing)
    subject = subject_of(found)
    curves = {("angle", name): np.degrees(c.mean) for name, c in found.angles.items()}
    curves |= {("moment", name): curve.mean for name, curve in found.moments.items()}
    curves |= {("force", side): 100.0 * curve.mean for side, curve in found.forces.items()}
    for name in ("stride_time_s", "walking_speed_m_s"):
        curves["time", name] = 100.0 * np.log([getattr(subject, name)])
    messages = {f"{step}: {_plain(sentence, folder)}" for step, sentence in found.decisions}
    messages |= {f"doubt: {warning.check}: {warning.where}" for _, warning in found.warnings}
    return Result(curves, frozenset(messages))


def _session(folder: Path, *, walking: str, forces: str | None) -> Result:
    person = MadeUpSession(None, None, *(folder / n for n in ("stand.c3d", walking, "x"))).request  # type: ignore[arg-type]
    own = {} if forces is None else {"forces": (folder / forces,)}
    values = {**person.__dict__, "forces": (), **own}
    return import_result(Request(**values), folder)


def _subject(folder: Path) -> Result:
    return as_subject(folder / "subject.toml")


def as_subject(path: Path) -> Result:
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
    return Result()


def _plausible(holds: Any, what: str, value: Any) -> None:
    if not holds:
        raise SilentNonsense(f"{what}: {value}")


class SilentNonsense(Exception):
    """A result that cannot be, about which nothing was said."""


def _configuration(folder: Path) -> Result:
    configuration = load_configuration(folder / "configuration.toml")
    sent = configuration.model_dump_json()
    _plausible("NaN" not in sent and "Infinity" not in sent, "settings", sent[:200])
    return Result()


def _urdf(folder: Path) -> Result:
    """The model; a number that is another is another body, as long as it is one."""
    model = read_urdf(folder / "model.urdf")
    for segment in model.segments:
        moments = np.linalg.eigvalsh(segment.inertia)
        _plausible(segment.mass > 0.0, f"{segment.name}: mass", segment.mass)
        _plausible((moments > 0.0).all(), f"{segment.name}: inertia", moments)
        _plausible(np.isfinite(segment.joint_position).all(), segment.name, segment.joint_position)
    return Result()


def _policy(folder: Path) -> Result:
    """One action; weights of other bytes are another policy, as long as it acts."""
    policy = load_policy(folder, environment=load_configuration().environment)
    size = policy.tensors["observation_mean"].shape[0]
    with np.errstate(over="ignore"):
        action = policy.act(np.zeros(size))
    _plausible(np.isfinite(action).all(), "action", action)
    return Result()


def _stored(folder: Path) -> Result:
    """What `gaitval check` reads before it walks: sealed, so nothing may be another."""
    check_seal(folder)
    metrics = believed(folder / "metrics.json")
    mu = identification_from(read_json(folder / "identification.json"), "mu")
    change = Adjustment.from_dict(read_json(folder / "correction.json"), "correction")
    policy = load_policy(folder / "policy")
    action = policy.act(np.zeros(policy.tensors["observation_mean"].shape[0]))
    return Result(exact=(metrics, repr(mu), change.as_dict(), action.tolist()))


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
    safetensors = (*m.BYTES, m.safetensors_header, m.safetensors_value)
    toml, tree = (*m.BYTES, *m.TEXT, *[m.toml_tree] * 12), (*m.BYTES, *m.TEXT, *[m.json_tree] * 12)
    c3d, text = (*m.BYTES, *m.of_c3d() * 4), (*m.BYTES, *m.TEXT)
    trc = partial(_session, walking="walk.trc", forces="walk_forces.mot")
    files = seeds("stand.c3d", "walk.trc", "walk_forces.mot")
    wbds = partial(_session, walking="walkmkr.txt", forces="walkgrf.txt")
    return {
        "c3d_standing": Kind(files, {"stand.c3d": c3d}, trc),
        "c3d_walking": Kind(
            seeds("stand.c3d", "walk.c3d"),
            {"walk.c3d": c3d},
            partial(_session, walking="walk.c3d", forces=None),
        ),
        "trc": Kind(files, {"walk.trc": (*text, *m.of_table(m.TRC))}, trc),
        "mot": Kind(files, {"walk_forces.mot": (*text, *m.of_table(m.MOT))}, trc),
        "wbds": Kind(
            seeds("stand.c3d", "walkmkr.txt", "walkgrf.txt"),
            {name: (*text, *m.of_table(m.WBDS)) for name in ("walkmkr.txt", "walkgrf.txt")},
            wbds,
        ),
        "subject": Kind({"subject.toml": stored["subject.toml"]}, {"subject.toml": toml}, _subject),
        "configuration": Kind(
            {"configuration.toml": stored["configuration.toml"]},
            {"configuration.toml": toml},
            _configuration,
        ),
        "urdf": Kind(seeds("model.urdf"), {"model.urdf": (*text, *[m.hostile_xml] * 6)}, _urdf),
        "policy": Kind(
            {name: stored[f"policy/{name}"] for name in ("policy.safetensors", "policy.json")},
            {"policy.safetensors": safetensors, "policy.json": tree},
            _policy,
        ),
        "baseline": Kind(
            stored,
            {
                "metrics.json": tree,
                "identification.json": tree,
                "correction.json": tree,
                "seal.json": tree,
                "policy/policy.json": tree,
                "policy/policy.safetensors": safetensors,
                "subject.toml": toml,
                "configuration.toml": toml,
            },
            _stored,
        ),
    }


def damaged(kind: str, made: Kind, seed: int) -> tuple[str, str, bytes]:
    """The file, the name of the mutator and the damaged bytes of one case."""
    random = np.random.default_rng([zlib.crc32(kind.encode()), seed])
    places = [(name, mutator) for name, mutators in made.files.items() for mutator in mutators]
    name, mutator = places[int(random.integers(len(places)))]
    return name, mutator.__name__, mutator(made.seeds[name], random)


def differences(before: Result, now: Result) -> dict[str, float]:
    """The largest difference of each kind of curve, as a multiple of its limit; infinite for a
    curve that is missing.
    """
    found = {"exact": float("inf")} if before.exact != now.exact else {}
    for kind, name in before.curves:
        one, other = before.curves[kind, name], now.curves.get((kind, name))
        off = np.inf if other is None else float(np.sqrt(np.mean((one - other) ** 2)))
        found[kind] = max(found.get(kind, 0.0), off / LIMITS[kind])
    return found
