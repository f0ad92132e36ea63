"""An import held against results that came with the recording: Plug-in Gait's, or OpenSim's.

Angles are compared over the valid gait cycles of each leg, moments over those whose forces the
plates show. Three differences of convention are taken out, and said: a peer's filter (its moments
and angles are low-passed as ours are), signs (Plug-in Gait's moments are positive for extensors),
and the zero of an angle (each leg's mean difference over the standing trial; over the cycles where
the peer has no results in standing). The difference without the last is kept as `raw`.
"""

from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any, Final

import ezc3d
import numpy as np

from gaitval.coordinates import COORDINATES, SIDES
from gaitval.gait.filters import low_pass
from gaitval.inverse.inverse_kinematics import inverse_kinematics
from gaitval.mocap.mot import read_storage
from gaitval.session.session import Import
from gaitval.session.trial import WalkingTrial, valid_cycles

JOINTS: Final = {"Hip": "hip_flexion", "Knee": "knee_angle", "Ankle": "ankle_angle"}
FEWEST: Final = 20
"""Frames below which two curves are not compared."""
LARGEST_NM_KG: Final = 20.0
"""Nm/kg. No joint moment of walking is larger, and all are in Nmm/kg."""
END_SECONDS: Final = 0.1
"""s at both ends of a trial in which filters settle."""


def against_plug_in_gait(found: Import, files: list[Path]) -> list[dict[str, Any]]:
    """Differences from the results of Plug-in Gait in the C3D files of an import's trials.

    Parameters
    ----------
    files : C3D file of each trial of the import, in its order.

    Returns
    -------
    list : a row for each trial, joint and side: `kind`, `joint`, `side`, `frames`, `rms`, `raw`
        (degrees or Nm/kg) and `zero` ("standing" or "cycles").
    """
    rows = []
    standing = _standing_zero(found)
    # One bad trial of several is left out by the import.
    pairs = ((w, f) for w in found.trials for f in files if w.name in (f.name, f.stem))
    for walk, file in pairs:
        points, rate = _points(file)
        if any(len(values) != len(walk.recording.time) for values in points.values()):
            continue
        for joint, name, side in _legs():
            ours = np.degrees(walk.positions[:, COORDINATES.index(name)])
            theirs = points.get(f"{side[0].upper()}{joint}Angles")
            if theirs is not None:
                theirs = low_pass(theirs, rate=rate, cutoff_hz=found.processing.marker_cutoff_hz)
                apart = ours - theirs
                rows += _row("angle", joint, side, apart, _inside(walk, side, False), standing)
            theirs = points.get(f"{side[0].upper()}{joint}Moment")
            if theirs is not None and walk.moments is not None:
                cutoff = found.processing.moment_force_cutoff_hz
                # Files of Geneva say Nmm and hold Nm/kg.
                unit = 1.0 if np.nanmax(np.abs(theirs)) < LARGEST_NM_KG else 1000.0
                theirs = low_pass(-theirs / unit, rate=rate, cutoff_hz=cutoff)
                moment = walk.moments.recorded_moments()[name] / found.request.mass_kg
                rows += _row("moment", joint, side, moment - theirs, _inside(walk, side, True), {})
    return rows


def against_opensim(found: Import, motion: Path) -> list[dict[str, Any]]:
    """Differences of the sagittal angles of the first trial from an OpenSim motion file's, over all
    frames; rows as `against_plug_in_gait`.
    """
    walk = found.trials[0]
    table = read_storage(motion)
    factor = 1.0 if table.in_degrees else 180.0 / np.pi
    time, own = table.time, walk.recording.time
    inside = (time > own[0] + END_SECONDS) & (time < own[-1] - END_SECONDS)
    rows = []
    for joint, name, side in _legs():
        column = COORDINATES.index(name)
        ours = np.degrees(np.interp(time, own, walk.positions[:, column]))
        seen = np.interp(time, own, walk.kinematics.determined[:, column]) == 1.0
        rows += _row("angle", joint, side, ours - factor * table.column(name), inside & seen, {})
    return rows


def _row(
    kind: str, joint: str, side: str, apart: Any, inside: Any, zero: Mapping[str, float]
) -> list[dict[str, Any]]:
    used = apart[inside & np.isfinite(apart)]
    if len(used) < FEWEST:
        return []
    of_standing = zero.get(f"{side} {joint}")
    centre = 0.0
    if kind == "angle":
        centre = float(used.mean()) if of_standing is None else of_standing
    return [
        {
            "kind": kind,
            "joint": joint,
            "side": side,
            "frames": len(used),
            "rms": float(np.sqrt(np.mean((used - centre) ** 2))),
            "raw": float(np.sqrt(np.mean(used**2))),
            "zero": "cycles" if of_standing is None else "standing",
        }
    ]


def _standing_zero(found: Import) -> dict[str, float]:
    """Our angle less the peer's in standing, degrees, by side and joint; without those it lacks."""
    source = Path(found.request.static)
    if found.request.stands_in_walk or source.suffix.lower() != ".c3d":
        return {}
    points, _ = _points(source)
    standing, body = found.session.standing, found.body
    markers = [marker for marker in body.markers if marker.name in standing.names]
    measured = standing.columns([marker.name for marker in markers])
    middle = np.nanmedian(measured, axis=0, keepdims=True)
    pose = inverse_kinematics(body.model, markers, middle).positions[0]
    return {
        f"{side} {joint}": float(np.degrees(pose[COORDINATES.index(name)]) - np.nanmedian(theirs))
        for joint, name, side in _legs()
        if (theirs := points.get(f"{side[0].upper()}{joint}Angles")) is not None
    }


def _legs() -> Iterator[tuple[str, str, str]]:
    for side in SIDES:
        for joint, name in JOINTS.items():
            yield joint, f"{name}_{side[0]}", side


def _inside(walk: WalkingTrial, side: Any, kinetics: bool) -> Any:
    """(T,) whether each frame is in a valid cycle of a side."""
    time = walk.recording.time
    inside = np.zeros(len(time), dtype=bool)
    for cycle in valid_cycles(walk, side, kinetics=kinetics):
        inside |= (time >= cycle.start) & (time <= cycle.end)
    return inside


def _points(file: Path) -> tuple[dict[str, Any], float]:
    """First component of each computed angle and moment (T,), NaN where there is none; the rate."""
    content = ezc3d.c3d(str(file))
    point = content["parameters"]["POINT"]
    found = {}
    for i, label in enumerate(point["LABELS"]["value"]):
        name = label.rsplit(":", 1)[-1]
        if name.endswith(("Angles", "Moment")):
            values = content["data"]["points"][:3, i]
            first = np.where((values == 0.0).all(axis=0), np.nan, values[0])
            if np.isfinite(first).sum() >= FEWEST:
                found[name] = first
    return found, float(point["RATE"]["value"][0])
