"""Angles of healthy adults over the gait cycle, to whom gait is compared.

They are 42 adults at their own speed over ground (Fukuchi et al. 2018), in `gps_controls.csv`;
`experiments/gps_controls.py` makes it.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cache
from typing import Final

import numpy as np

from gaitval._internal.io.text_tables import shipped_table
from gaitval.arrays import Array

PROFILE_ANGLES: Final[tuple[str, ...]] = (
    "pelvis_tilt",
    "hip_flexion",
    "knee_angle",
    "ankle_angle",
    "pelvis_list",
    "hip_adduction",
    "pelvis_rotation",
    "hip_rotation",
    "foot_progression",
)
"""The nine variables by the names and signs of `gait.record.GaitRecord`: sagittal, frontal,
transverse."""


@dataclass(frozen=True)
class Controls:
    """Healthy people, to whom gait is compared.

    Attributes
    ----------
    curves : (101,) deg, their mean, both sides together, by name of `PROFILE_ANGLES`.
    scores : mean and standard deviation of their own `GaitProfile.scores` of one side, deg.
    side, total : the same of a side's score, and of `GaitProfile.total`.
    people : how many.
    """

    curves: Mapping[str, Array]
    scores: Mapping[str, tuple[float, float]]
    side: tuple[float, float]
    total: tuple[float, float]
    people: int


@cache
def load_controls() -> Controls:
    """The 42 adults of `gps_controls.csv`."""
    # columns of the variables, side and total; 101 rows of means, then rows score, sd and people
    (_, *names), rows = shipped_table("gaitval.gait", "gps_controls.csv")
    by_label = {row[0]: np.array(row[1:], dtype=float) for _, row in rows}
    curves = np.array([by_label[str(percent)] for percent in range(101)])
    means, spreads = by_label["score"], by_label["sd"]
    scores = {
        name: (float(mean), float(spread))
        for name, mean, spread in zip(names, means, spreads, strict=True)
    }
    return Controls(
        curves={name: curves[:, names.index(name)] for name in PROFILE_ANGLES},
        scores={name: scores[name] for name in PROFILE_ANGLES},
        side=scores["side"],
        total=scores["total"],
        people=round(by_label["people"][0]),
    )
