"""Gait Profile Score and Movement Analysis Profile: how far gait is from that of healthy adults.

The gait variable score of an angle is the RMS difference over the cycle from the mean of healthy
people; the nine of a side are the Movement Analysis Profile, their RMS is the side's Gait Profile
Score, and the RMS of both sides' the person's (Baker et al. 2009, Gait Posture 30:265, who take the
pelvis of one side only for the latter: up to a degree more). A difference of 1.6 degrees is the
smallest that matters clinically (Baker et al. 2012, Gait Posture 35:612). The healthy people are 42
adults at their own speed over ground (Fukuchi et al. 2018), in `gps_controls.csv`;
`experiments/gps_controls.py` makes it.
"""

import csv
import math
from collections.abc import Mapping
from dataclasses import dataclass
from functools import cache
from importlib import resources
from typing import Final

import numpy as np

from gaitval.arrays import Array
from gaitval.coordinates import SIDES
from gaitval.datasets.identity import WBDS
from gaitval.datasets.subject import Subject
from gaitval.metrics.statistics_results import GaitProfile

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

SMALLEST_DIFFERENCE: Final = 1.6
"""Degrees: minimal clinically important difference of the score (Baker et al. 2012)."""


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
    text = resources.files("gaitval.metrics").joinpath("gps_controls.csv").read_text("utf-8")
    # columns of the variables, side and total; 101 rows of means, then rows score, sd and people
    rows = list(csv.reader(line for line in text.splitlines() if not line.startswith("#")))
    names = rows[0][1:]
    by_label = {row[0]: np.array(row[1:], dtype=float) for row in rows[1:]}
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


def is_control(subject: Subject) -> bool:
    """Whether `subject` is one of the controls, who are people of WBDS.

    Their own curves are then in the mean they are compared with: with N controls, the distance from
    the mean of the others is N / (N - 1) times as large.
    """
    numbers = range(1, load_controls().people + 1)
    return subject.laboratory == WBDS and subject.person in {f"WBDS{each:02d}" for each in numbers}


def gait_profile(angles: Mapping[str, Array], controls: Mapping[str, Array]) -> GaitProfile:
    """Score mean curves of both sides, `angles` (101,) deg by name of `PROFILE_ANGLES` with `_r` or
    `_l`, signs of `GaitRecord`, against `controls` (101,) deg by name, such as `Controls.curves`. A
    variable that a side lacks is left out; the total then cannot be compared with one of nine.
    Raises ValueError if no variable is there for both.
    """
    used = [
        name
        for name in PROFILE_ANGLES
        if name in controls and f"{name}_r" in angles and f"{name}_l" in angles
    ]
    if not used:
        raise ValueError(
            f"none of the angles of a gait profile ({', '.join(PROFILE_ANGLES)}) is there for both "
            f"sides; seen: {', '.join(sorted(angles)) or 'none'}."
        )
    scores = {
        f"{name}_{side[0]}": _rms(np.asarray(angles[f"{name}_{side[0]}"]) - controls[name])
        for name in used
        for side in SIDES
    }
    right, left = (_rms(np.array([scores[f"{name}_{side[0]}"] for name in used])) for side in SIDES)
    # RMS over both sides, which have the same variables
    total = math.hypot(right, left) / math.sqrt(2.0)
    return GaitProfile(scores=scores, right=right, left=left, total=total)


def _rms(values: Array) -> float:
    return float(np.sqrt(np.mean(np.square(values))))
