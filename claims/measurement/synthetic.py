"""Synthetic walkers of strangers: lengths, angles and moments against OpenSim's on the true model.

`data/regression/Arnold2013Synthetic` of keenon/nimblephysics has walks of one stride without a
standing trial, whose markers are those of a model that is beside them: OpenSim's inverse kinematics
finds them within 0.1 mm, so its angles and its inverse dynamics are the truth. Nothing in gaitval
was chosen on 18 and 19, which were met after the others.

The zero of an angle is that of a model's axes: angles are counted as by Rajagopal's model, whose
markers the walkers have (`gaitval.conventions`). Errors are about the means of both, but for the
bands, which include what the convention leaves. OpenSim does not filter the forces: its moments are
low-passed as the forces of an import are.

Two things about these walkers no trial shows: their shanks have twice the moment of inertia of a
person's (de Leva 1996), and their ankles are 19 mm behind and below the middle of the malleoli's
markers. So the moments are compared once more with the walkers' own masses of the legs, and with
these and their own joint centres: what is then left is what the method makes wrong.
"""

import json
import tempfile
from collections.abc import Mapping
from contextlib import chdir
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, Final

import numpy as np

import claims
from claims import Claim
from gaitval.arrays import Array
from gaitval.configuration import load_configuration
from gaitval.conventions import convention_of
from gaitval.coordinates import SIDES
from gaitval.gait.cycles import normalise
from gaitval.gait.filters import low_pass
from gaitval.importing.importing import request_of, work_out
from gaitval.measurement.measured import measurement_of
from gaitval.mocap.mot import read_storage
from gaitval.mocap.mot_writing import StorageTable, write_storage
from gaitval.mocap.reading import read_recording
from gaitval.session.request import ImportOptions, checked
from gaitval.session.whole_stride import COPIES

FOLDER: Final = "keenon+nimblephysics/data/regression/Arnold2013Synthetic"
SUBJECTS: Final = ("01", "02", "04", "18", "19")
SAGITTAL: Final = ("hip_flexion", "knee_angle", "ankle_angle")
CONVENTION: Final = convention_of("rajagopal2016")
CUTOFF_HZ: Final = 8.0
"""Of coordinates in inverse dynamics, as `ProcessingSettings.marker_cutoff_hz`."""
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
class SyntheticWalker:
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


def walker(clones: Path, number: str) -> SyntheticWalker:
    """The walker of this number."""
    folder = clones / FOLDER / f"subject{number}"
    known = json.loads((folder / "_subject.json").read_text(encoding="utf-8"))
    sex = {"male": "M", "female": "F"}[known["sex"]]
    return SyntheticWalker(folder, f"subject{number}", known["massKg"], known["heightM"], sex)


def truth(of: SyntheticWalker, folder: Path) -> tuple[StorageTable, StorageTable]:
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
                raise RuntimeError(f"OpenSim failed on {of.name}")

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


def lengths_apart(of: SyntheticWalker, ours: dict[str, object]) -> list[float]:
    """Thighs and shanks minus those between the true joint centres, which are among the markers."""
    trial = read_recording(of.markers)
    off = []
    for side in SIDES:
        at = [trial.marker(f"{side[0].upper()}{joint}JC") for joint in "HKA"]
        for segment, one, two in (("thigh", at[0], at[1]), ("shank", at[1], at[2])):
            true = float(np.median(np.linalg.norm(one - two, axis=1)))
            off.append(float(str(ours[f"{segment}_{side}"])) - true)
    return off


@dataclass(frozen=True)
class Apart:
    """What an import makes of a walker, minus the truth.

    Attributes
    ----------
    lengths : m, of thighs and shanks.
    lengths_inside : whether each is inside its band of 90 %.
    angles : degrees by name, (101,), about their means.
    moments : Nm/kg by name, (101,).
    inside : points of each kind of curve inside its band of 90 %, the zero of angles included.
    """

    lengths: list[float]
    lengths_inside: list[bool]
    angles: dict[str, Array]
    moments: dict[str, Array]
    inside: dict[str, list[bool]]


def apart(of: SyntheticWalker, folder: Path) -> Apart:
    """What the import of a walker into a folder makes of it, minus the truth."""
    options = {
        "trials": [of.markers],
        "forces": [of.forces],
        "mass": of.mass,
        "height": of.height,
        "sex": of.sex,
    }
    request = request_of(checked(ImportOptions, options), folder / "out", lambda *_: None)
    found = work_out(request, load_configuration().processing)
    walk, half = found.trials[0], measurement_of(found).bands.half
    time, rate = walk.recording.time, walk.recording.marker_rate
    true_angles, true_moments = truth(of, folder)
    angles: dict[str, Array] = {}
    moments: dict[str, Array] = {}
    inside: dict[str, list[bool]] = {"angle": [], "moment": []}
    for side in SIDES:
        (cycle,) = walk.cycles[side]
        for name in (f"{joint}_{side[0]}" for joint in SAGITTAL):
            known = normalise(
                time, np.interp(time, true_angles.time, true_angles.column(name)), cycle
            )
            counted = found.angles[name].mean + CONVENTION.offset(name)
            off = np.degrees(counted) - known
            angles[name] = off - off.mean()
            inside["angle"] += list(np.abs(off) <= np.degrees(half[f"angle_{name}"]))
            moment = true_moments.column(f"{name}_moment")
            moment = np.interp(time, true_moments.time, moment)[:, None]
            moment = low_pass(moment, rate=rate, cutoff_hz=CUTOFF_HZ)[:, 0]
            known = normalise(time, moment, cycle) / of.mass
            moments[name] = found.moments[name].mean - known
            inside["moment"] += list(np.abs(moments[name]) <= half[f"moment_{name}"])
    lengths = lengths_apart(of, found.body.chosen.to_dict())
    widths = measurement_of(found).bands.lengths
    known_to = [widths[f"{segment}_{side}"] for side in SIDES for segment in ("thigh", "shank")]
    within = [abs(off) <= width for off, width in zip(lengths, known_to, strict=True)]
    return Apart(lengths, within, angles, moments, inside)


@claims.measured("public")
def synthetic(given: claims.Given) -> list[Claim]:
    """Synthetic walkers of nimblephysics: lengths, angles, moments against the true model's."""
    lengths: list[float] = []
    angles: list[Array] = []
    moments: list[Array] = []
    inside: dict[str, list[bool]] = {"angle": [], "moment": [], "length": []}
    for number in SUBJECTS:
        with tempfile.TemporaryDirectory() as name:
            of = apart(walker(given.public, number), Path(name).resolve())
        print(number, "lengths, mm:", np.round(1000 * np.array(of.lengths), 1))
        for kind, curves in (("angles", of.angles), ("moments", of.moments)):
            sizes = {n: round(float(np.sqrt(np.nanmean(v**2))), 3) for n, v in curves.items()}
            print(number, kind, sizes, flush=True)
        print(number, "inside", {kind: np.mean(each) for kind, each in of.inside.items()})
        lengths += of.lengths
        angles += of.angles.values()
        moments += of.moments.values()
        inside["length"] += of.lengths_inside
        for kind, each in of.inside.items():
            inside[kind] += each

    def size(values: Array) -> float:
        return float(np.sqrt(np.nanmean(values**2)))

    what = "synthetic walkers, without a standing trial:"
    return [
        Claim(
            f"{what} root mean square error of thighs and shanks",
            1000 * size(np.array(lengths)),
            "mm",
            len(lengths),
        ),
        Claim(
            f"{what} sagittal angles about their means, root mean square error, mean of curves",
            float(np.mean([size(each) for each in angles])),
            "deg",
            len(angles),
        ),
        Claim(
            f"{what} sagittal moments, root mean square error, mean of curves",
            float(np.mean([size(each) for each in moments])),
            "Nm/kg",
            len(moments),
        ),
        *(
            Claim(
                f"{what} {'' if kind == 'length' else 'sagittal '}{kind}s, share inside bands of "
                "90 %",
                100 * float(np.mean(each)),
                "%",
                len(lengths if kind == "length" else angles),
            )
            for kind, each in inside.items()
        ),
    ]
