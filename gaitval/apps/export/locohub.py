"""Curves in LocoHub's phase-indexed Parquet: 150 points of each gait cycle.

Names are those of LocoHub's `src/locohub/feature_constants.py` and signs those of
`docs/reference/biomechanical_standard.md` and `index.md` (repository jmontp/LocoHub, read in
November 2026): angles in rad; flexion, adduction and dorsiflexion positive; moments in Nm/kg,
positive where they would increase their angle; forces in body weights, on the foot, forward, up and
to the right. A cycle of either foot is a `step`; that foot is `ipsi`. Segments are seen from the
side: pelvis and trunk positive as they lean forward, thigh and shank as their lower end is forward,
foot toes up. The centre of pressure is left out, because the standard does not say from where.
"""

import hashlib
from pathlib import Path
from typing import TYPE_CHECKING, Final

import numpy as np

from gaitval.apps.export.walked import ExportedWalk
from gaitval.arrays import Array
from gaitval.artefacts import replacing
from gaitval.constants import GRAVITY
from gaitval.coordinates import ACTUATED, COORDINATES, SIDES, Side, opposite
from gaitval.datasets.subject_file import BUILTIN
from gaitval.gait.sampling import interpolated
from gaitval.metrics.comparison import low_pass_of
from gaitval.metrics.cycles import filtered
from gaitval.model.body import SEGMENTS
from gaitval.model.tree import segment_frames

if TYPE_CHECKING:
    import pandas as pd

POINTS: Final = 150
"""Of a cycle, both of its heel strikes among them."""
FILE: Final = "gaitval_phase.parquet"
LEVEL: Final = "level_walking", "level"
"""LocoHub's `task` and `task_id`."""
_ANGLES: Final = {
    "hip_flexion": "hip_flexion",
    "hip_adduction": "hip_adduction",
    "knee_flexion": "knee_angle",
    "ankle_dorsiflexion": "ankle_angle",
}
"""Their name of each of our coordinates; the signs are the same."""
_NO_VELOCITY: Final = "hip_adduction"
_FORCES: Final = (("anterior", 0, 1.0), ("lateral", 1, -1.0), ("vertical", 2, 1.0))
"""Their name of each of our axes, and its sign: OpenSim's lateral is to the right, ours left."""


def write_locohub(folder: Path, walked: ExportedWalk) -> list[Path]:
    """Write `FILE` into `folder`; returns its path. Raises ArtefactError."""
    path = folder / FILE
    with replacing(path) as temporary:
        locohub_frame(walked).to_parquet(temporary, index=False)
    return [path]


def locohub_frame(walked: ExportedWalk) -> "pd.DataFrame":
    """A row for each of `POINTS` points of each cycle of the walk, right foot's first."""
    import pandas as pd

    curves, subject = _curves(walked), walked.stored.subject
    parts = []
    step = 0
    for side in SIDES:
        starts, ends = walked.cycles.starts[side], walked.cycles.ends[side]
        for start, end in zip(starts, ends, strict=True):
            speed = _speed(walked, start, end)
            columns: dict[str, object] = {
                "subject": _name(subject.identifier),
                "subject_metadata": f"sex:{subject.sex},height_m:{subject.height_m:g},"
                f"weight_kg:{subject.mass_kg:g}",
                "task": LEVEL[0],
                "task_id": LEVEL[1],
                "task_info": f"speed_m_s:{speed:.3f},treadmill:false,ipsi_side:{side},"
                f"simulated_by:gaitval",
                "step": step,
                "phase_ipsi": np.linspace(0.0, 100.0, POINTS),
            }
            at = start + (end - start) * np.linspace(0.0, 1.0, POINTS)
            columns |= {
                name.replace("_SIDE_", f"_{leg}_"): _at(values, at)
                for leg, whose in (("ipsi", side), ("contra", opposite(side)))
                for name, values in curves[whose].items()
            }
            columns |= {name: _at(values, at) for name, values in curves[""].items()}
            parts.append(pd.DataFrame(columns))
            step += 1
    return pd.concat(parts, ignore_index=True)


def _name(identifier: str) -> str:
    """LocoHub's DATASET_POPULATIONnn: dataset GV, able-bodied, the number of a built-in subject, or
    six digits of the identifier's hash, so that two people have two names.
    """
    if identifier in BUILTIN:
        return f"GV_AB{identifier[1:]}"
    return f"GV_AB{int(hashlib.sha256(identifier.encode()).hexdigest(), 16) % 900_000 + 100_000}"


def _speed(walked: ExportedWalk, start: int, end: int) -> float:
    place, time = walked.walk.centre_of_mass[:, 0], walked.walk.time
    return float((place[end] - place[start]) / (time[end] - time[start]))


def _at(values: Array, samples: Array) -> Array:
    return np.asarray(interpolated(values, samples[None])[0])


def _curves(walked: ExportedWalk) -> dict[Side | str, dict[str, Array]]:
    """Curves (T,) over the walk of each side, and of pelvis and trunk under ""."""
    walk, task = walked.walk, walked.stored.task
    mass = walked.stored.model.mass
    filters = low_pass_of(task.record, task.configuration.validation.filter_frequency)
    moments, forces = filtered(walk, filters)
    frames = segment_frames(walked.body, walk.positions)[..., :3, :3]
    found: dict[Side | str, dict[str, Array]] = {
        side: _of_side(side, walk.positions, walk.velocities, moments / mass)
        | {
            f"grf_{name}_SIDE_BW": sign * forces[:, column, axis] / (mass * GRAVITY)
            for name, axis, sign in _FORCES
        }
        | _of_segments(side, frames)
        for column, side in enumerate(SIDES)
    }
    found[""] = _of_trunk(frames)
    return found


def _of_side(side: Side, positions: Array, velocities: Array, moments: Array) -> dict[str, Array]:
    curves = {}
    for name, ours in _ANGLES.items():
        coordinate = f"{ours}_{side[0]}"
        place = COORDINATES.index(coordinate)
        curves[f"{name}_angle_SIDE_rad"] = positions[:, place]
        if name != _NO_VELOCITY:
            curves[f"{name}_velocity_SIDE_rad_s"] = velocities[:, place]
        curves[f"{name}_moment_SIDE_Nm_kg"] = moments[:, ACTUATED.index(coordinate)]
    return curves


def _of_segments(side: Side, frames: Array) -> dict[str, Array]:
    curves = {}
    for name in ("thigh", "shank", "foot"):
        # The segment's own vertical (of the foot, its own forward axis) seen from the side.
        turn = frames[:, SEGMENTS.index(f"{name}_{side[0]}")]
        down, ahead = -turn[:, :, 2], turn[:, :, 0]
        curves[f"{name}_sagittal_angle_SIDE_rad"] = (
            np.arctan2(ahead[:, 2], ahead[:, 0])
            if name == "foot"
            else np.arctan2(down[:, 0], -down[:, 2])
        )
    return curves


def _of_trunk(frames: Array) -> dict[str, Array]:
    curves = {}
    for name, segment in (("pelvis", "pelvis"), ("trunk", "torso")):
        turn = frames[:, SEGMENTS.index(segment)]
        ahead, left = turn[:, :, 0], turn[:, :, 1]
        curves[f"{name}_sagittal_angle_rad"] = -np.arcsin(ahead[:, 2])
        # Right side up, and right side forward (turned to the left).
        curves[f"{name}_frontal_angle_rad"] = -np.arcsin(left[:, 2])
        curves[f"{name}_transverse_angle_rad"] = np.arctan2(ahead[:, 1], ahead[:, 0])
    return curves
