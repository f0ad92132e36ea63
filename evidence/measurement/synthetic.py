"""Synthetic walkers of strangers: lengths, angles and moments against OpenSim's on the true model.

`data/regression/Arnold2013Synthetic` of keenon/nimblephysics has walks of one stride without a
standing trial, whose markers are those of a model that is beside them: OpenSim's inverse kinematics
finds them within 0.1 mm, so its angles and its inverse dynamics are the truth. An import refuses
them, because a foot strikes once; so what is measured is what it makes of a trial before it cuts it
into gait cycles.

The zero of an angle is that of a model's axes, and is taken from the mean of both. OpenSim does not
filter the forces: its moments are low-passed as the forces of an import are.

Two things about these walkers no trial shows: their shanks have twice the moment of inertia of a
person's (de Leva 1996), and their ankles are 19 mm behind and below the middle of the malleoli's
markers. So the moments are compared once more with the walkers' own masses of the legs, and with
these and their own joint centres: what is then left is what the method makes wrong.
"""

import json
import tempfile
from argparse import Namespace
from contextlib import chdir
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Final

import numpy as np
from scipy.spatial.transform import Rotation

import evidence
from evidence.measurement.faults import FROM
from gaitval.arrays import Array
from gaitval.configuration import load_configuration
from gaitval.coordinates import SIDES
from gaitval.gait.filters import low_pass
from gaitval.inverse.inverse_dynamics import inverse_dynamics
from gaitval.mocap.mot import read_storage
from gaitval.mocap.mot_writing import StorageTable
from gaitval.mocap.reading import read_recording
from gaitval.mocap.recording import Recording
from gaitval.model.body import SEGMENTS, BodyModel
from gaitval.model.tree import segment_frames
from gaitval.opensim.coordinates import OPENSIM_COORDINATES, to_opensim
from gaitval.session.importing import request_of
from gaitval.session.read import read_session
from gaitval.session.request import ImportOptions, checked
from gaitval.session.scale import scale_body
from gaitval.session.trial import leg_shown, trial_loads, trial_motion

FOLDER: Final = "keenon+nimblephysics/data/regression/Arnold2013Synthetic"
SUBJECTS: Final = ("01", "02", "04")
SAGITTAL: Final = ("hip_flexion", "knee_angle", "ankle_angle")
CENTRES: Final = {
    "hip_flexion": ("thigh", "HJC", 1.0),
    "knee_angle": ("shank", "KJC", -1.0),
    "ankle_angle": ("foot", "AJC", 1.0),
}
"""Segment below the joint, the marker on its true centre, and the sign of the coordinate about the
axis to the right: the knee's is flexion. The walkers' knees have no one centre, because the shank
slides on the thigh."""
EDGE: Final = 0.1
"""s at both ends, where filters have no neighbours."""
CUTOFF_HZ: Final = 8.0
"""Of coordinates in inverse dynamics, as `ProcessingSettings.marker_cutoff_hz`."""
MEASURES = {
    "*": {
        "code": (
            "@motion",
            "gaitval/session/standing_pose.py",
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
    """Angles and moments of OpenSim on the true model."""
    import opensim

    opensim.Logger.setLevelString("Off")
    opensim.Logger.removeFileSink()
    path = str(of.folder / f"{of.name}.osim")
    loads = "".join(LOAD.format(side[0]) for side in SIDES)
    (folder / "loads.xml").write_text(LOADS.format(loads, of.forces), encoding="utf-8")
    models = []
    for tool in (opensim.InverseKinematicsTool(), opensim.InverseDynamicsTool()):
        models.append(model := opensim.Model(path))
        model.initSystem()
        tool.setModel(model)
        tool.setStartTime(-np.inf)
        tool.setEndTime(np.inf)
        tool.setResultsDir(str(folder))
        if isinstance(tool, opensim.InverseKinematicsTool):
            tool.setMarkerDataFileName(str(of.markers))
            tool.setOutputMotionFileName(str(folder / "ik.mot"))
            tool.set_report_errors(False)
            for i in range(model.getMarkerSet().getSize()):
                task = opensim.IKMarkerTask()
                task.setName(model.getMarkerSet().get(i).getName())
                task.setApply(True)
                task.setWeight(1.0)
                tool.getIKTaskSet().cloneAndAppend(task)
        else:
            every = opensim.ArrayStr()
            every.append("ALL")
            tool.setExcludedForces(every)
            tool.setCoordinatesFileName(str(folder / "ik.mot"))
            tool.setExternalLoadsFileName(str(folder / "loads.xml"))
            tool.setLowpassCutoffFrequency(CUTOFF_HZ)
            tool.setOutputGenForceFileName("id.sto")
        with chdir(folder):
            if not tool.run():
                raise SystemExit(f"OpenSim failed on {of.name}")
    return read_storage(folder / "ik.mot"), read_storage(folder / "id.sto")


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


def between_centres(
    of: Walker, walk: Recording, model: BodyModel, positions: Array, force: Array
) -> dict[str, Array]:
    """(T,) Nm by sagittal joint, what its moment would be more about the walker's own centre."""
    true = read_recording(of.markers)
    names = [name for name in walk.names if name in true.names]
    # the import turns the laboratory and does not move the person in it
    pairs = [(true.marker(name), walk.marker(name)) for name in names]
    theirs, ours = (np.concatenate(each) for each in zip(*pairs, strict=True))
    seen = np.isfinite(theirs).all(axis=1) & np.isfinite(ours).all(axis=1)
    middles = theirs[seen].mean(axis=0), ours[seen].mean(axis=0)
    turn, _ = Rotation.align_vectors(ours[seen] - middles[1], theirs[seen] - middles[0])
    frames = segment_frames(model, positions)
    found = {}
    for joint, (segment, marker, sign) in CENTRES.items():
        for foot, side in enumerate("rl"):
            centre = turn.apply(true.marker(f"{side.upper()}{marker}") - middles[0]) + middles[1]
            aside = frames[:, SEGMENTS.index(f"{segment}_{side}"), :3, 3] - centre
            found[f"{joint}_{side}"] = sign * np.cross(aside, force[:, foot])[:, 1]
    return found


MADE_WITH: Final = (
    "",
    ", with their own masses of the legs",
    ", with these and their own joint centres",
)


def curves_apart(
    of: Walker, folder: Path
) -> tuple[list[float], dict[str, Array], list[dict[str, Array]]]:
    """Lengths (m), angles (degrees) and moments (Nm/kg, each way of `MADE_WITH`) minus the true
    ones; sagittal, over the trial without its ends.
    """
    options = {
        "trials": [of.markers], "forces": [of.forces],
        "mass": of.mass, "height": of.height, "sex": of.sex,
    }  # fmt: skip
    request = request_of(checked(ImportOptions, options), folder / "out", lambda *_: None)
    processing = load_configuration().processing
    session = read_session(request, processing)
    body = scale_body(request, processing, session)
    walk = session.walking[0]
    motion = trial_motion(body.model, body.markers, walk, processing)
    kinematics = motion.anchoring.kinematics
    shown = {side: leg_shown(kinematics, side, walk, session.marker_set) for side in SIDES}
    carried = trial_loads(walk, processing, session.marker_set.landmarks, shown)
    ours = np.degrees(to_opensim(motion.positions))
    true_angles, true_moments = truth(of, folder)
    inner = slice(round(EDGE * walk.marker_rate), -round(EDGE * walk.marker_rate))
    time = walk.time - walk.time[0] + true_angles.time[0]
    plain, heavy = (
        inverse_dynamics(model, walk.time, motion.positions, *carried.wrenches).recorded_moments()
        for model in (body.model, with_legs_of(body.model, of))
    )
    more = between_centres(of, walk, body.model, motion.positions, carried.wrenches[0])
    angles: dict[str, Array] = {}
    torques: list[dict[str, Array]] = [{}, {}, {}]
    for name in (f"{joint}_{side[0]}" for joint in SAGITTAL for side in SIDES):
        known = np.interp(time, true_angles.time, true_angles.column(name))
        off = ours[:, OPENSIM_COORDINATES.index(name)] - known
        angles[name] = (off - off.mean())[inner]
        known = np.interp(time, true_moments.time, true_moments.column(f"{name}_moment"))
        known = low_pass(known[:, None], rate=walk.marker_rate, cutoff_hz=CUTOFF_HZ)[:, 0]
        made = (plain[name], heavy[name], heavy[name] + more[name])
        for into, moment in zip(torques, made, strict=True):
            into[name] = ((moment - known) / of.mass)[inner]
    return lengths_apart(of, body.chosen.to_dict()), angles, torques


@evidence.measurement(FROM)
def synthetic(arguments: Namespace) -> list[evidence.Row]:
    """Synthetic walkers of nimblephysics: lengths, angles, moments against the true model's."""
    lengths: list[float] = []
    angles: list[Array] = []
    moments: list[list[Array]] = [[], [], []]
    for number in SUBJECTS:
        with tempfile.TemporaryDirectory() as name:
            off, of_angles, of_moments = curves_apart(
                walker(arguments.clones, number), Path(name).resolve()
            )
        print(number, "lengths, mm:", np.round(1000 * np.array(off), 1))
        for kind, curves in (
            ("angles", of_angles),
            *zip((f"moments{way}" for way in MADE_WITH), of_moments, strict=True),
        ):
            sizes = {n: round(float(np.sqrt(np.nanmean(v**2))), 3) for n, v in curves.items()}
            print(number, kind, sizes, flush=True)
        lengths += off
        angles += of_angles.values()
        for into, one in zip(moments, of_moments, strict=True):
            into += one.values()

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
    ]  # fmt: skip
