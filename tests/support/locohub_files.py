"""LocoHub's Parquet made of subject 5's record: names, units and signs of the standard."""

from pathlib import Path

import numpy as np
import pandas as pd

from gaitval.constants import GRAVITY
from gaitval.coordinates import SIDES
from gaitval.datasets.locohub import POINTS
from gaitval.datasets.subject_file import load_subject

PERSON = load_subject("S05")
PHASE = np.linspace(0.0, 1.0, POINTS)
JOINTS = {
    "hip_flexion": ("hip_flexion", 1.0),
    "hip_adduction": ("hip_adduction", 1.0),
    "hip_rotation": ("hip_rotation", -1.0),
    "knee_flexion": ("knee_angle", 1.0),
    "ankle_dorsiflexion": ("ankle_angle", 1.0),
    "ankle_eversion": ("subtalar_angle", -1.0),
}


def cycle_of(side: str, *, raw: bool = False) -> pd.DataFrame:
    """The mean cycle of subject 5 that begins with a foot, in LocoHub's names and signs."""
    record = PERSON.record()
    shift = {("right", "right"): 0.0, ("left", "left"): 0.0}
    shift |= {("right", "left"): -record.left_phase, ("left", "right"): record.left_phase}
    found: dict[str, object] = {"phase_ipsi": 100.0 * PHASE}
    per, weight = (PERSON.mass_kg, PERSON.mass_kg * GRAVITY) if raw else (1.0, 1.0)
    for whose in SIDES:
        leg = "ipsi" if whose == side else "contra"
        at = PHASE + shift[side, whose]
        for theirs, (ours, sign) in JOINTS.items():
            name = f"{ours}_{whose[0]}"
            found[f"{theirs}_angle_{leg}_rad"] = sign * record.angles[name](at)
            if theirs != "ankle_eversion" and name in record.moments:
                unit = "Nm" if raw else "Nm_kg"
                found[f"{theirs}_moment_{leg}_{unit}"] = sign * per * record.moments[name](at)
            if theirs in ("hip_flexion", "knee_flexion"):
                rate = record.angles[name].derivative(at) / PERSON.stride_time_s
                found[f"{theirs}_velocity_{leg}_rad_s"] = rate
        force = weight * record.ground_reaction(whose, at % 1.0)
        for axis, column, sign in (
            ("anterior", 0, 1.0),
            ("lateral", 1, -1.0),
            ("vertical", 2, 1.0),
        ):
            name = f"{axis}_grf_{leg}_N" if raw else f"grf_{axis}_{leg}_BW"
            found[name] = sign * force[:, column]
    own = 1.0 if side == "right" else -1.0
    for plane, ours, sign in (
        ("sagittal", "pelvis_tilt", 1.0), ("frontal", "pelvis_list", own),
        ("transverse", "pelvis_rotation", own),
    ):  # fmt: skip
        found[f"pelvis_{plane}_angle_rad"] = sign * record.angles[f"{ours}_{side[0]}"](PHASE)
    return pd.DataFrame(found)


def data_set(
    path: Path, *sides: str, raw: bool = False, message: bool = True, **about: str
) -> Path:
    parts = []
    for step, side in enumerate(sides):
        cycle = cycle_of(side, raw=raw)
        cycle["subject"], cycle["task"], cycle["task_id"] = "MD23_AB01", "level_walking", "level"
        cycle["subject_metadata"] = about.get("metadata", "sex:F,height_m:1.53,weight_kg:64.95")
        foot = f",ipsi_side:{side}" if message else ""
        cycle["task_info"] = about.get("info", "speed_m_s:1.12") + foot
        cycle["step"] = step
        parts.append(cycle)
    pd.concat(parts, ignore_index=True).to_parquet(path, index=False)
    return path
