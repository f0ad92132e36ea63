"""The walk in a motion of an OpenSim model: events, gait cycles, speed, mean curves.

The origins of heel, toes and hips stand in for markers, so that everything that reads markers of an
import reads them too: events by forces where there are any, else by the feet's motion.
"""

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from typing import Final

import numpy as np

from gaitval.apps.judge.limits import LIMITS
from gaitval.apps.judge.loads import Loads
from gaitval.apps.judge.skeleton import Skeleton
from gaitval.arrays import Array
from gaitval.configuration import ProcessingSettings
from gaitval.constants import STANDARD_GRAVITY
from gaitval.coordinates import SIDES, Side, opposite
from gaitval.errors import RecordError
from gaitval.gait.cycles import GaitCycle, average, belt_speed, cut_cycles, spatiotemporal
from gaitval.gait.events import find_events, marker_events
from gaitval.gait.foot_forces import assign_forces, of_weight
from gaitval.kinetics.inverse.inverse_dynamics import ground_level
from gaitval.mocap.recording import FootForces, Recording
from gaitval.mocap.separate_forces import with_plates
from gaitval.scaling.opensim.placing import Motion, at_times, centre_of_mass, place

LANDMARKS: Final = {
    f"{letter}.{name}": f"{letter}.{name}"
    for letter in "RL"
    for name in ("Heel", "MT2", "Ankle", "ASIS", "PSIS")
}


@dataclass(frozen=True)
class JudgedGait:
    """What a walk is.

    Attributes
    ----------
    forces : on each foot, project's axes; None without a force file.
    cycles : of each side, also those that are not valid.
    belt : speed of the belt, m/s; 0 over ground, NaN where not known.
    speed : m/s; NaN where not known.
    stance_fraction : mean of each side; NaN where not known.
    height : m, mean height of the centre of mass above the ground.
    findings : what was noticed, a sentence each.
    """

    forces: FootForces | None
    cycles: Mapping[Side, tuple[GaitCycle, ...]]
    belt: float
    speed: float
    stance_fraction: Mapping[Side, float]
    height: float
    findings: tuple[str, ...] = field(default=())

    @property
    def peak_force(self) -> float:
        """Largest ground reaction on one foot, N; NaN without forces."""
        if self.forces is None:
            return float("nan")
        return float(np.linalg.norm(self.forces.force, axis=2).max())


def find_gait(
    skeleton: Skeleton, motion: Motion, loads: Loads | None, *, belt: float | None = None
) -> JudgedGait:
    """Events, cycles and forces of a `motion` of `skeleton`; events are those of the `loads` if
    there are any. The speed of the `belt`, m/s, is as the flat feet move if it is
    None. Raises RecordError if the forces are not of this motion.
    """
    recording = _stand_ins(skeleton, motion, None if loads is None else loads.rate)
    findings: list[str] = []
    forces = None
    processing = of_weight(ProcessingSettings(), skeleton.model.mass)
    if loads is not None:
        recording = _with_loads(recording, loads, skeleton.model.up)
        try:
            forces, found = assign_forces(recording, processing, landmarks=LANDMARKS)
        except RecordError as error:
            # What an import is continued with, this command does not have.
            raise RecordError(str(error)) from None
        findings += [f"Forces: {one}" for one in dict.fromkeys(str(each) for each in found)]
        findings += _wrong_feet(recording, loads, forces)
    cycles: dict[Side, tuple[GaitCycle, ...]] = dict.fromkeys(SIDES, ())
    speeds: list[float] = []
    moving = 0.0 if belt is None else belt
    stance = dict.fromkeys(SIDES, float("nan"))
    try:
        if forces is None:
            events = marker_events(recording, landmarks=LANDMARKS)
        else:
            events = find_events(recording, forces, processing, landmarks=LANDMARKS)
        carried = belt_speed(recording, events, landmarks=LANDMARKS)
        if belt is None:
            moving = carried
        elif abs(carried - belt) > LIMITS.other_belt:
            findings.append(
                f"Belt: the flat feet go back at {carried:.2f} m/s, but {belt:g} m/s was given as "
                "the speed of the belt, in m/s. The walking speed, and so the healthy people "
                "beside whom the moments stand, is wrong unless the feet slide."
            )
        for side in SIDES:
            cycles[side] = cut_cycles(events, side, forces=forces)
            found_of = spatiotemporal(
                recording, events, cycles[side], side, landmarks=LANDMARKS, belt=moving
            )
            speeds += list(found_of.speed)
            if len(found_of.stance_fraction):
                stance[side] = float(np.mean(found_of.stance_fraction))
    except RecordError as error:
        findings.append(f"Gait cycles: {error}")
    for side in SIDES:
        if not any(cycle.kinematics_valid for cycle in cycles[side]):
            findings.append(
                f"No complete gait cycle of the {side} side: its curves are not compared."
            )
    poses = place(skeleton.model, motion.values)
    mass_centre = centre_of_mass(skeleton.model, poses)
    height = float((mass_centre @ skeleton.model.up).mean())
    if forces is not None:
        height -= ground_level(forces.centre_of_pressure)
    if not np.isfinite(speeds).any():
        # No foot is flat twice in the trial. Over a cycle the body goes as far as its feet.
        level = mass_centre @ project_axes(skeleton.model.up)[:2].T
        speeds = [
            moving + _covered(motion.time, level, one)
            for side in SIDES
            for one in cycles[side]
            if one.kinematics_valid
        ]
    return JudgedGait(
        forces=forces,
        cycles=cycles,
        belt=moving,
        speed=float(np.nanmean(speeds)) if speeds else float("nan"),
        stance_fraction=stance,
        height=height,
        findings=tuple(findings),
    )


def _covered(time: Array, path: Array, cycle: GaitCycle) -> float:
    """Speed, m/s, from the beginning to the end of a `cycle`, of a level `path` (T, 2), m."""
    begin, end = (
        np.array([np.interp(at, time, path[:, axis]) for axis in (0, 1)])
        for at in (cycle.start, cycle.end)
    )
    return float(np.linalg.norm(end - begin)) / cycle.duration


def project_axes(up: Array) -> Array:
    """(3, 3), takes vectors of a model's ground to axes with z up; X forward stays x forward."""
    forward = np.array([1.0, 0.0, 0.0]) if abs(up[0]) < 0.9 else np.array([0.0, 0.0, 1.0])
    forward = forward - (forward @ up) * up
    forward /= np.linalg.norm(forward)
    return np.stack([forward, np.cross(up, forward), up])


def mean_curve(time: Array, values: Array, cycles: list[GaitCycle]) -> tuple[Array, Array] | None:
    """Mean and standard deviation (101,) over those of `cycles` that lie in the time of the
    `values`, which are at `time` (T,) s, not necessarily uniform.
    """
    unknown = time[~np.isfinite(values)]
    inside = [
        one
        for one in cycles
        if time[0] - 1e-6 <= one.start
        and one.end <= time[-1] + 1e-6
        and not ((unknown >= one.start - 1e-6) & (unknown <= one.end + 1e-6)).any()
    ]
    if not inside or len(time) < 2:
        return None
    even = np.linspace(time[0], time[-1], len(time))
    found = average([(even, np.interp(even, time, np.nan_to_num(values)), inside)])
    return None if found is None else (found.mean, found.deviation)


def valid(gait: JudgedGait, side: Side, *, kinetics: bool) -> list[GaitCycle]:
    """Cycles of a `side` in `gait` that count; for moments (`kinetics`) those whose forces the
    plates show, if there are any plates.
    """
    shown = kinetics and gait.forces is not None
    return [
        one for one in gait.cycles[side] if (one.kinetics_valid if shown else one.kinematics_valid)
    ]


def weight_ratio(gait: JudgedGait, mass: float) -> float:
    """Mean vertical force over whole gait cycles, over the weight of a mass (kg); NaN if no cycle
    shows the forces of both feet.
    """
    if gait.forces is None:
        return float("nan")
    time, ratios = gait.forces.time, []
    for side in SIDES:
        for cycle in valid(gait, side, kinetics=True):
            inside = (time >= cycle.start) & (time < cycle.end)
            if inside.any() and gait.forces.valid[inside].all():
                up = gait.forces.force[inside, :, 2].sum(axis=1)
                ratios.append(float(up.mean()))
    return float(np.mean(ratios)) / (mass * STANDARD_GRAVITY) if ratios else float("nan")


def _stand_ins(skeleton: Skeleton, motion: Motion, force_rate: float | None) -> Recording:
    """The places of heels, toes, ankles and hips as markers, at a rate that divides the forces'."""
    model = skeleton.model
    span = float(motion.time[-1] - motion.time[0])
    if len(motion.time) < 3 or span <= 0.0:
        raise RecordError("the motion has fewer than three frames, or no length. Give a walk.")
    rate = (len(motion.time) - 1) / span
    if force_rate is not None:
        # Forces have a whole number of samples in each frame, as in a recording.
        rate = force_rate / max(1, round(force_rate / rate))
    times = motion.time[0] + np.arange(int(span * rate + 1e-6) + 1) / rate
    poses = place(model, at_times(motion, times).values)
    turn = project_axes(model.up).T
    # Rows are vectors here: v @ Rᵀ.
    at = {name: poses[body][1] @ turn for name, body in skeleton.bodies.items()}
    across = at["thigh_r"] - at["thigh_l"]
    forward = np.cross(np.array([0.0, 0.0, 1.0]), across)
    forward /= np.linalg.norm(forward, axis=1, keepdims=True)
    places = {}
    for letter in "RL":
        side = letter.lower()
        heel = at[f"foot_{side}"]
        # Without toes, the front of the foot is a foot's length ahead of the heel in the foot.
        toes = at.get(f"toes_{side}")
        if toes is None:
            ahead = poses[skeleton.bodies[f"foot_{side}"]][0] @ np.array([0.2, 0.0, 0.0])
            toes = heel + ahead @ turn
        places[f"{letter}.Heel"] = heel
        places[f"{letter}.MT2"] = toes
        places[f"{letter}.Ankle"] = at.get(f"talus_{side}", heel)
        places[f"{letter}.ASIS"] = at[f"thigh_{side}"] + LIMITS.pelvis_depth * forward
        places[f"{letter}.PSIS"] = at[f"thigh_{side}"] - LIMITS.pelvis_depth * forward
    return Recording(
        source="the motion",
        axes="project",
        names=tuple(places),
        markers=np.stack(list(places.values()), axis=1),
        marker_rate=rate,
        start=float(times[0]),
    )


def _with_loads(recording: Recording, loads: Loads, up: Array) -> Recording:
    """The stand-ins with the plates, cut to the motion's time and turned."""
    samples = len(loads.plates[0].force)
    time = loads.start + np.arange(samples) / loads.rate
    half = 0.5 / loads.rate
    inside = (time >= recording.time[0] - half) & (time <= recording.time[-1] + half)
    if inside.sum() < 2:
        raise RecordError(
            f"{loads.path}: the forces go from {time[0]:.3f} to {time[-1]:.3f} s, the motion from "
            f"{recording.time[0]:.3f} to {recording.time[-1]:.3f} s. Give those of the same trial."
        )
    cut = tuple(plate.during(inside) for plate in loads.plates)
    plates = replace(recording, plates=cut).turned(project_axes(up)).plates
    first = float(time[np.flatnonzero(inside)[0]])
    found = with_plates(recording, loads.path, plates, rate=loads.rate, start=first)
    for plate in found.plates:
        if plate.fault:
            raise RecordError(plate.fault)
    return found


def _wrong_feet(recording: Recording, loads: Loads, forces: FootForces) -> list[str]:
    """Plates whose force external loads put on the foot that is not on them."""
    found = []
    for plate, side in zip(recording.plates, loads.sides, strict=False):
        up = np.clip(plate.force[:, 2], 0.0, None)
        other = SIDES.index(opposite(side))
        theirs = up > 0.9 * np.abs(forces.force[:, other, 2])
        on_other = (forces.force[:, other, 2] > 20.0) & theirs & (up > 20.0)
        if up.sum() > 0 and up[on_other].sum() > LIMITS.other_foot * up.sum():
            found.append(
                f"External loads: the force {plate.name!r} acts on the {side} foot, but the "
                f"{SIDES[other]} foot is above it. Right and left are exchanged in the loads."
            )
    return found
