"""Kinetics from kinematics in the figures that other methods print: a table of docs/held-out.md.

`evidence held_out walks` writes it; `experiments.held_out_runs.likeness` has the figures.
"""

from collections.abc import Mapping
from statistics import fmean
from typing import Any

from evidence.marked_table import spread
from gaitval.constants import STANDARD_GRAVITY
from gaitval.datasets.subject_file import load_subject

CURVES = {
    "vertical force": ("forces", "vertical"),
    "fore-aft force": ("forces", "forward"),
    "medial force": ("forces", "medial"),
    "hip moment": ("moments", "hip_flexion"),
    "knee moment": ("moments", "knee_angle"),
    "ankle moment": ("moments", "ankle_angle"),
}
Stored = dict[str, Any]


def printed(found: Mapping[str, Stored]) -> str:
    """Means over people and sides, ± the standard deviation over people, of stored walks by the
    identifier of the person.
    """
    lines = ["| curve | RMSE | relative RMSE, % | correlation |", "|---|---|---|---|"]
    heights = [load_subject(person).height_m for person in found]
    for noun, (kind, name) in CURVES.items():
        rmse = [
            fmean([one["errors"][kind][f"{name}_{side}"] for side in "rl"])
            for one in found.values()
        ]
        size = f"{spread(rmse, 1)} % BW"
        if kind == "moments":
            shares = [
                100.0 * each / (STANDARD_GRAVITY * height)
                for each, height in zip(rmse, heights, strict=True)
            ]
            size = f"{spread(rmse, 3)} Nm/kg; {spread(shares, 2)} % BW·h"
        alike = [
            [one["likeness"][kind][f"{name}_{side}"] for side in "rl"] for one in found.values()
        ]
        relative, correlation = (
            spread([fmean([side[key] for side in each]) for each in alike], digits)
            for key, digits in (("relative_rmse", 1), ("correlation", 3))
        )
        lines.append(f"| {noun} | {size} | {relative} | {correlation} |")
    arms = [
        fmean([row["value"] for row in one["measures"] if row["measure"] == "pressure_arm_rmse"])
        for one in found.values()
    ]
    lines.append(f"| arm of the force at the ankle | {spread(arms, 1)} mm | | |")
    return "\n".join(lines)
