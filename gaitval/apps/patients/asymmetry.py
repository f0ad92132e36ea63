"""How much right and left of a person's gait differ, beside what speed and age lead to expect."""

from typing import NamedTuple

import numpy as np

from gaitval.apps.patients.records import Patient
from gaitval.arrays import Array
from gaitval.coordinates import SIDES, Side
from gaitval.gait.healthy_controls import PROFILE_ANGLES, load_controls
from gaitval.metrics.gait_profile import gait_profile
from gaitval.metrics.norms import norms

BEYOND = 2.0
"""Standard deviations from the norm beyond which a curve is unlike healthy people's."""


class AngleRow(NamedTuple):
    """An angle of a page; deg but for the last two.

    Attributes
    ----------
    score : gait variable score of each side, and the healthy people's mean and SD.
    ranges : largest less smallest value of each side.
    difference : RMS of right less left curve.
    symmetry : symmetry index of the ranges, %, right above left positive (Robinson et al. 1987, J
        Manipulative Physiol Ther 10:172): difference over the mean of both.
    beyond : of each side, % of the cycle that is more than `BEYOND` SD from people of this speed
        and age, or, of a child, from children at their free speed; None where there is no norm.
    """

    name: str
    score: dict[Side, float]
    healthy: tuple[float, float]
    ranges: dict[Side, float]
    difference: float
    symmetry: float
    beyond: dict[Side, float | None]


def symmetry_index(right: float, left: float) -> float:
    """%; 0 for equal values, both zero among them, positive where `right` is larger."""
    mean = 0.5 * (abs(right) + abs(left))
    return 100.0 * (right - left) / mean if mean > 0.0 else 0.0


def angle_rows(patient: Patient) -> list[AngleRow]:
    """A row for each angle of the Gait Profile Score."""
    controls, usual = load_controls(), norms(patient.subject)
    profile = gait_profile(patient.strides.angles, controls.curves)
    rows = []
    for name in PROFILE_ANGLES:
        own = {side: patient.strides.angles[f"{name}_{side[0]}"] for side in SIDES}
        ranges = {side: float(np.ptp(own[side])) for side in SIDES}
        norm = usual.get(f"angles/{name}")
        beyond: dict[Side, float | None] = dict.fromkeys(SIDES)
        if norm is not None:
            for side in SIDES:
                beyond[side] = _share_beyond(own[side], norm.mean, norm.sd)
        difference = own["right"] - own["left"]
        rows.append(
            AngleRow(
                name,
                {side: profile.scores[f"{name}_{side[0]}"] for side in SIDES},
                controls.scores[name],
                ranges,
                float(np.sqrt(np.mean(difference**2))),
                symmetry_index(ranges["right"], ranges["left"]),
                beyond,
            )
        )
    return rows


def worse_side(patient: Patient) -> tuple[Side, float]:
    """The side with the larger Gait Profile Score, and by how much, deg."""
    profile = gait_profile(patient.strides.angles, load_controls().curves)
    side: Side = "right" if profile.right > profile.left else "left"
    return side, abs(profile.right - profile.left)


def _share_beyond(own: Array, mean: Array, sd: Array) -> float:
    return 100.0 * float(np.mean(np.abs(own - mean) > BEYOND * sd))
