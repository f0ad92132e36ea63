"""Synthetic walkers of strangers: lengths, angles and moments against OpenSim's on the true model.

`data/regression/Arnold2013Synthetic` of keenon/nimblephysics has walks of one stride without a
standing trial, whose markers are those of a model that is beside them: OpenSim's inverse kinematics
finds them within 0.1 mm, so its angles and its inverse dynamics are the truth. Nothing in gaitval
was chosen on 18 and 19, which were met after the others.

The zero of an angle is that of a model's axes, and is taken from the mean of both, but for the
bands, which include it. OpenSim does not filter the forces: its moments are low-passed as the
forces of an import are.

Two things about these walkers no trial shows: their shanks have twice the moment of inertia of a
person's (de Leva 1996), and their ankles are 19 mm behind and below the middle of the malleoli's
markers. So the moments are compared once more with the walkers' own masses of the legs, and with
these and their own joint centres: what is then left is what the method makes wrong.
"""

import json
import tempfile
from argparse import Namespace
from collections.abc import Mapping
from contextlib import chdir
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, Final

import numpy as np
from scipy.spatial.transform import Rotation

import evidence
from evidence.measurement.faults import FROM
from gaitval.arrays import Array
from gaitval.configuration import load_configuration
from gaitval.coordinates import SIDES
from gaitval.gait.cycles import normalise
from gaitval.gait.filters import low_pass
from gaitval.importing.importing import request_of, work_out
from gaitval.inverse.inverse_dynamics import inverse_dynamics
from gaitval.mocap.mot import read_storage
from gaitval.mocap.mot_writing import StorageTable, write_storage
from gaitval.mocap.reading import read_recording
from gaitval.model.body import SEGMENTS, BodyModel
from gaitval.model.tree import segment_frames
from gaitval.session.request import ImportOptions, checked
from gaitval.session.trial import WalkingTrial
from gaitval.session.whole_stride import COPIES

FOLDER: Final = "keenon+nimblephysics/data/regression/Arnold2013Synthetic"
SUBJECTS: Final = ("01", "02", "04", "18", "19")
SAGITTAL: Final = ("hip_flexion", "knee_angle", "ankle_angle")
CENTRES: Final = {
    "hip_flexion": ("thigh", "HJC", 1.0),
    "knee_angle": ("shank", "KJC", -1.0),
    "ankle_angle": ("foot", "AJC", 1.0),
}
"""Segment below the joint, the marker on its true centre, and the sign of the coordinate about the
axis to the right: the knee's is flexion. The walkers' knees have no one centre, because the shank
slides on the thigh."""
CUTOFF_HZ: Final = 8.0
"""Of coordinates in inverse dynamics, as `ProcessingSettings.marker_cutoff_hz`."""
MEASURES = {
    "*": {
        "code": (
            "@motion",
            "gaitval/session/standing_pose.py",
            "gaitval/session/whole_stride.py",
            "gaitval/measurement/bands.py",
            "gaitval/measurement/sources.py",
            "evidence/measurement/synthetic.py",
        ),
        "allowed": 80,
        "why": "of 5,000 statements; millimetres and degrees do not move unless a test fails, and "
        "alignment devices, midfoot markers and C3D parameters are none of these walkers'",
    },
}
"""What the rows depend on; see evidence/stale.py."""
LOADS: Final = """<?xml version="1.0" encoding="UTF-8" ?>
<OpenSimDocument Version="40000"><ExternalLoads name="plates"><objects>{}</objects>
<datafile>{}</datafile></ExternalLoads></OpenSimDocument>"""
LOAD: Final = """<ExternalForce name="{0}"><applied_to_body>calcn_{0}</applied_to_body>
<force_expressed_in_body>ground</force_expressed_in_body>
<point_expressed_in_body>ground</point_expressed_in_body>
<force_identifier>ground_force_{0}_v</force_identifier>
<point_identifier>ground_force_{0}_p</point_identifier>
<torque_identifier>ground_torque_{0}_</torque_identifier></ExternalForce>"""


@dataclass(frozen=True)
class Walker:
    """Files of a synthetic walker, and who it is."""

    folder: Path
    name: str
    mass: float
    height: float
    sex: str

    @property
    def markers(self) -> Path:
        """The walk."""
        return self.folder / "trials/walk2/markers.trc"

    @property
    def forces(self) -> Path:
        """Of both feet."""
        return self.folder / "trials/walk2/grf.mot"


def walker(clones: Path, number: str) -> Walker:
    """The walker of this number."""
    folder = clones / FOLDER / f"subject{number}"
    known = json.loads((folder / "_subject.json").read_text(encoding="utf-8"))
    sex = {"male": "M", "female": "F"}[known["sex"]]
    return Walker(folder, f"subject{number}", known["massKg"], known["heightM"], sex)


def truth(of: Walker, folder: Path) -> tuple[StorageTable, StorageTable]:
    """Angles and moments of OpenSim on the true model, which goes on as it began: filters and
    derivatives have neighbours at the ends of the stride.
    """
    import opensim

    opensim.Logger.setLevelString("Off")
    opensim.Logger.removeFileSink()
    path = str(of.folder / f"{of.name}.osim")
    coordinates, forces, loads = (folder / name for name in ("ik.mot", "forces.mot", "loads.xml"))

    def ran(tool: Any) -> None:
        model = opensim.Model(path)
        model.initSystem()
        tool.setModel(model)
        tool.setStartTime(-np.inf)
        tool.setEndTime(np.inf)
        tool.setResultsDir(str(folder))
        if isinstance(tool, opensim.InverseKinematicsTool):
            for i in range(model.getMarkerSet().getSize()):
                task = opensim.IKMarkerTask()
                task.setName(model.getMarkerSet().get(i).getName())
                task.setApply(True)
                task.setWeight(1.0)
                tool.getIKTaskSet().cloneAndAppend(task)
        with chdir(folder):
            if not tool.run():
                raise SystemExit(f"OpenSim failed on {of.name}")

    kinematics = opensim.InverseKinematicsTool()
    kinematics.setMarkerDataFileName(str(of.markers))
    kinematics.setOutputMotionFileName(str(coordinates))
    kinematics.set_report_errors(False)
    ran(kinematics)
    stride = read_storage(coordinates)
    path_of = {axis: stride.column(f"pelvis_t{axis}") for axis in "xz"}
    way = {axis: float(column[-1] - column[0]) for axis, column in path_of.items()}
    write_storage(coordinates, joined(stride, {f"pelvis_t{axis}": way[axis] for axis in "xz"}))
    points = {f"ground_force_{foot}_p{axis}": way[axis] for axis in "xz" for foot in "rl"}
    write_storage(forces, joined(read_storage(of.forces), points))
    each = "".join(LOAD.format(side[0]) for side in SIDES)
    loads.write_text(LOADS.format(each, forces), encoding="utf-8")
    dynamics = opensim.InverseDynamicsTool()
    every = opensim.ArrayStr()
    every.append("ALL")
    dynamics.setExcludedForces(every)
    dynamics.setCoordinatesFileName(str(coordinates))
    dynamics.setExternalLoadsFileName(str(loads))
    dynamics.setLowpassCutoffFrequency(CUTOFF_HZ)
    dynamics.setOutputGenForceFileName("id.sto")
    ran(dynamics)
    return read_storage(coordinates), read_storage(folder / "id.sto")


def joined(stride: StorageTable, way: Mapping[str, float]) -> StorageTable:
    """A stride whose last row is its first, three times; the second has its times. Columns of `way`
    grow by that much in a stride.
    """
    count, seconds = len(stride.time) - 1, stride.time[-1] - stride.time[0]
    more = np.array([way.get(name, 0.0) for name in stride.columns])
    copies = np.arange(-1, COPIES - 1)
    return replace(
        stride,
        time=np.concatenate([stride.time[:count] + copy * seconds for copy in copies]),
        values=np.concatenate([stride.values[:count] + copy * more for copy in copies]),
    )


def lengths_apart(of: Walker, ours: dict[str, object]) -> list[float]:
    """Thighs and shanks minus those between the true joint centres, which are among the markers."""
    trial = read_recording(of.markers)
    off = []
    for side in SIDES:
        at = [trial.marker(f"{side[0].upper()}{joint}JC") for joint in "HKA"]
        for segment, one, two in (("thigh", at[0], at[1]), ("shank", at[1], at[2])):
            true = float(np.median(np.linalg.norm(one - two, axis=1)))
            off.append(float(str(ours[f"{segment}_{side}"])) - true)
    return off


def with_legs_of(model: BodyModel, of: Walker) -> BodyModel:
    """Our body with the masses and inertias of the walker's legs."""
    import opensim

    true = opensim.Model(str(of.folder / f"{of.name}.osim"))
    true.initSystem()
    bodies = true.getBodySet()
    segments = []
    for segment in model.segments:
        part, _, side = segment.name.rpartition("_")
        theirs = {"thigh": "femur", "shank": "tibia", "foot": "calcn", "toes": "toes"}.get(part)
        if theirs is None:
            segments.append(segment)
            continue
        body = bodies.get(f"{theirs}_{side}")
        mass = body.getMass()
        if part == "foot":
            mass += bodies.get(f"talus_{side}").getMass()
        moments, centre = body.getInertia().getMoments(), body.getMassCenter()
        segment = replace(
            segment, mass=mass, inertia=np.diag([moments.get(i) for i in (0, 2, 1)])
        )  # OpenSim's y is up, its z to the right
        if part in ("thigh", "shank"):
            own = np.array([centre.get(0), -centre.get(2), centre.get(1)])
            segment = replace(segment, centre_of_mass=own)
        segments.append(segment)
    return replace(model, segments=tuple(segments))


def between_centres(of: Walker, walk: WalkingTrial, model: BodyModel) -> dict[str, Array]:
    """(T,) Nm by sagittal joint, what its moment would be more about the walker's own centre."""
    true, middle = read_recording(of.markers), _middle(walk)
    ours_of, force = walk.recording, walk.loads.force[middle]
    names = [name for name in ours_of.names if name in true.names]
    # the import turns the laboratory and does not move the person in it
    pairs = [(true.marker(name)[: len(force)], ours_of.marker(name)[middle]) for name in names]
    theirs, ours = (np.concatenate(each) for each in zip(*pairs, strict=True))
    seen = np.isfinite(theirs).all(axis=1) & np.isfinite(ours).all(axis=1)
    middles = theirs[seen].mean(axis=0), ours[seen].mean(axis=0)
    turn, _ = Rotation.align_vectors(ours[seen] - middles[1], theirs[seen] - middles[0])
    frames = segment_frames(model, walk.positions[middle])
    found = {}
    for joint, (segment, marker, sign) in CENTRES.items():
        for foot, side in enumerate("rl"):
            there = true.marker(f"{side.upper()}{marker}")[: len(force)]
            centre = turn.apply(there - middles[0]) + middles[1]
            aside = frames[:, SEGMENTS.index(f"{segment}_{side}"), :3, 3] - centre
            moment = sign * np.cross(aside, force[:, foot])[:, 1]
            found[f"{joint}_{side}"] = np.tile(moment, COPIES)
    return found


def _middle(walk: WalkingTrial) -> slice:
    """The stride as it was recorded; an import has it three times."""
    frames = len(walk.recording.time) // COPIES
    return slice(frames, 2 * frames)


MADE_WITH: Final = (
    "",
    ", with their own masses of the legs",
    ", with these and their own joint centres",
)


@dataclass(frozen=True)
class Apart:
    """What an import makes of a walker, minus the truth.

    Attributes
    ----------
    lengths : m, of thighs and shanks.
    angles : degrees by name, (101,), about their means.
    moments : Nm/kg by name, (101,), each way of `MADE_WITH`.
    inside : points of each kind of curve inside its band of 90 %, the zero of angles included.
    """

    lengths: list[float]
    angles: dict[str, Array]
    moments: list[dict[str, Array]]
    inside: dict[str, list[bool]]


def apart(of: Walker, folder: Path) -> Apart:
    """What the import of a walker into a folder makes of it, minus the truth."""
    options = {
        "trials": [of.markers], "forces": [of.forces],
        "mass": of.mass, "height": of.height, "sex": of.sex,
    }  # fmt: skip
    request = request_of(checked(ImportOptions, options), folder / "out", lambda *_: None)
    found = work_out(request, load_configuration().processing)
    walk, model, half = found.trials[0], found.body.model, found.measurement.bands.half
    wrenches = walk.loads.force, walk.loads.centre_of_pressure, walk.loads.free_moment
    time, rate = walk.recording.time, walk.recording.marker_rate
    heavy = inverse_dynamics(with_legs_of(model, of), time, walk.positions, *wrenches)
    more, more_heavy = between_centres(of, walk, model), heavy.recorded_moments()
    true_angles, true_moments = truth(of, folder)
    angles: dict[str, Array] = {}
    moments: list[dict[str, Array]] = [{}, {}, {}]
    inside: dict[str, list[bool]] = {"angle": [], "moment": []}
    for side in SIDES:
        (cycle,) = walk.cycles[side]
        for name in (f"{joint}_{side[0]}" for joint in SAGITTAL):
            known = normalise(
                time, np.interp(time, true_angles.time, true_angles.column(name)), cycle
            )
            off = np.degrees(found.angles[name].mean) - known
            angles[name] = off - off.mean()
            inside["angle"] += list(np.abs(off) <= np.degrees(half[f"angle_{name}"]))
            moment = true_moments.column(f"{name}_moment")
            moment = np.interp(time, true_moments.time, moment)[:, None]
            moment = low_pass(moment, rate=rate, cutoff_hz=CUTOFF_HZ)[:, 0]
            known = normalise(time, moment, cycle) / of.mass
            moments[0][name] = found.moments[name].mean - known
            for into, made in zip(
                moments[1:], (more_heavy[name], more_heavy[name] + more[name]), strict=True
            ):
                into[name] = normalise(time, made, cycle) / of.mass - known
            inside["moment"] += list(np.abs(moments[0][name]) <= half[f"moment_{name}"])
    return Apart(lengths_apart(of, found.body.chosen.to_dict()), angles, moments, inside)


@evidence.measurement(FROM)
def synthetic(arguments: Namespace) -> list[evidence.Row]:
    """Synthetic walkers of nimblephysics: lengths, angles, moments against the true model's."""
    lengths: list[float] = []
    angles: list[Array] = []
    moments: list[list[Array]] = [[], [], []]
    inside: dict[str, list[bool]] = {"angle": [], "moment": []}
    for number in SUBJECTS:
        with tempfile.TemporaryDirectory() as name:
            of = apart(walker(arguments.clones, number), Path(name).resolve())
        print(number, "lengths, mm:", np.round(1000 * np.array(of.lengths), 1))
        for kind, curves in (
            ("angles", of.angles),
            *zip((f"moments{way}" for way in MADE_WITH), of.moments, strict=True),
        ):
            sizes = {n: round(float(np.sqrt(np.nanmean(v**2))), 3) for n, v in curves.items()}
            print(number, kind, sizes, flush=True)
        print(number, "inside", {kind: np.mean(each) for kind, each in of.inside.items()})
        lengths += of.lengths
        angles += of.angles.values()
        for into, one in zip(moments, of.moments, strict=True):
            into += one.values()
        for kind, each in of.inside.items():
            inside[kind] += each

    def size(values: Array) -> float:
        return float(np.sqrt(np.nanmean(values**2)))

    what = "synthetic walkers, without a standing trial:"
    return [
        evidence.Row(
            f"{what} root mean square error of thighs and shanks", 1000 * size(np.array(lengths)),
            "mm", "<=", 5, 10, len(lengths),
        ),
        evidence.Row(
            f"{what} sagittal angles about their means, root mean square error, mean of curves",
            float(np.mean([size(each) for each in angles])), "deg", "<=", 1, 2, len(angles),
        ),
        *(
            evidence.Row(
                f"{what} sagittal moments, root mean square error, mean of curves{way}",
                float(np.mean([size(each) for each in curves])), "Nm/kg", "<=", 0.03, 0.06,
                len(curves),
            )
            for way, curves in zip(MADE_WITH, moments, strict=True)
        ),
        *(
            evidence.Row(
                f"{what} sagittal {kind}s, share inside bands of 90 %, at {end}",
                100 * float(np.mean(each)), "%", relation, goal, must, len(angles),
            )
            for kind, each in inside.items()
            for end, relation, goal, must in (("least", ">=", 85, 78), ("most", "<=", 95, 97))
        ),
    ]  # fmt: skip
