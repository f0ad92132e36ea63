"""Ankles of people at many speeds, as gaits of which nothing else is known."""

import csv
from dataclasses import replace
from pathlib import Path

import numpy as np

from gaitval.constants import GRAVITY
from gaitval.subjects.prediction.normal_form import NormalForm, normal_form
from gaitval.subjects.subject_file import load_subject


def ankles(gait_data: Path) -> list[list[NormalForm]]:
    """Gaits of 30 people at up to eight speeds, of which only the ankle is known: its angle, rad,
    in the place of the first angle, its moment, Nm/kg, in that of the first moment. Those whose
    other trials are built in are left out.
    """
    places = {"ankle_angle_deg": "angles", "ankle_moment_nm_kg": "moments"}
    folder = gait_data / "wbds_ankle"
    walked: dict[tuple[str, str], float] = {}
    found: dict[tuple[str, str], dict[str, np.ndarray]] = {}
    with (folder / "WBDSinfo.csv").open(encoding="utf-8") as file:
        for row in csv.DictReader(file):
            number, at, trial = row["FileName"][4:6], row["GaitSpeed(m/s)"], row["FileName"][10:13]
            if "walkT" in row["FileName"] and at != "--":
                legs = float(row["LegLength"])
                walked[f"S{number}", trial] = float(at) / np.sqrt(GRAVITY * legs)
    with (folder / "ankle.csv").open(encoding="utf-8") as file:
        for row in csv.DictReader(file):
            key = row["subject"], row["trial"]
            if key in walked and key[0] not in {"S01", "S14", "S21"}:
                values = np.array([float(row[f"p{percent}"]) for percent in range(100)])
                if "angle" in row["quantity"]:
                    values = np.radians(values)
                found.setdefault(key, {})[places[row["quantity"]]] = values
    person = load_subject("S05")
    base = normal_form(person.record(), person.leg_length_m)
    people: dict[str, list[NormalForm]] = {}
    for key, curves in sorted(found.items()):
        if len(curves) == 2 and all(np.isfinite(each).all() for each in curves.values()):
            whole = {name: 0.0 * getattr(base, name) for name in curves}
            for name, values in curves.items():
                whole[name][0] = values
            people.setdefault(key[0], []).append(replace(base, speed=walked[key], **whole))
    return [
        sorted(gaits, key=lambda each: each.speed) for gaits in people.values() if len(gaits) > 4
    ]
