"""A made table of strides: built-in people as if a laboratory had exported one stride a side."""

import csv
from pathlib import Path

import numpy as np

from gaitval.apps.patients.strides import AXES
from gaitval.gait.healthy_controls import PROFILE_ANGLES
from gaitval.subjects.subject_file import load_subject

AXIS_OF = {name: axis for axis, name in AXES.items()}


def stride_rows(person: str, group: str, name: str, **shift: float) -> list[list[object]]:
    """Rows of the table of strides; `shift` adds degrees to an angle of a side."""
    angles = load_subject(person).record().angles
    rows = []
    for angle in PROFILE_ANGLES:
        for side in "rl":
            values = np.degrees(angles[f"{angle}_{side}"](np.linspace(0.0, 1.0, 101)))
            values = values + shift.get(f"{angle}_{side}", 0.0)
            rows.append([group, name, "walk_1", side.upper(), AXIS_OF[angle], *values.round(3)])
    return rows


def write_strides(path: Path, rows: list[list[object]]) -> Path:
    with path.open("w", encoding="utf-8", newline="") as file:
        writer = csv.writer(file)
        header = ["group", "subject", "trial", "side", "angle"]
        writer.writerow([*header, *(f"p{each}" for each in range(101))])
        writer.writerows(rows)
    return path
