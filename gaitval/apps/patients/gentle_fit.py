"""The dynamic fit of gaits that are far from what healthy people's forces expect.

`walk.reference.dynamic_fit` puts weight on Newton's laws in three steps. From a patient's angles,
the first is too large for some: the steps end in a motion that obeys the laws and has an ankle 13
degrees off. Such a fit is started again with less weight, and the one with the smaller sum of
squares is taken.
"""

from dataclasses import replace
from typing import Final

import numpy as np

from gaitval.arrays import Array
from gaitval.configuration import ContactSettings
from gaitval.coordinates import COORDINATES, SIDES, Side
from gaitval.gait.accuracy import RecordAccuracy
from gaitval.gait.record import GaitRecord
from gaitval.model.body import BodyModel
from gaitval.model.tree import ROOT_DOFS
from gaitval.walk.reference.dynamic_fit import (
    Accuracy,
    Problem,
    Solution,
    fit_problem,
    motion_of,
    solve_problem,
)
from gaitval.walk.reference.motion import ReferenceMotion, build_reference
from gaitval.walk.reference.walking_laws import FOOT, FOOT_NUMBERS

GENTLE: Final = (0.01, 0.03, 0.1, 0.3, 1.0)
"""Weights of Newton's laws on the pelvis, one after the other."""

POOR: Final = float(np.radians(2.0))
"""rad, mean root-mean-square change of the recorded angles above which a fit is started again."""

ANKLE_MOMENT: Final = 0.025
"""Nm/kg. Where the force acts below a foot is free in the fit, so with the 0.05 of other joints the
ankle gave way to all that is less known. Of amputees healthy people's ankles say too little for
that."""
PROSTHETIC_KNEE: Final = 0.25
"""Nm/kg, the size (RMS) of a healthy knee's moment. A prosthetic knee stands on its stop, extended,
and has no muscle that would hold it bent (Segal et al. 2006, J Rehabil Res Dev 43:857, from
memory), so that healthy people's moment says little of it."""
BROAD_BASE: Final = 2.0
"""Times the accuracy of sideways forces and hip adduction moments, for people with a prosthesis:
steps of above-knee amputees are about twice as wide as healthy people's (Jaegers et al. 1995, Arch
Phys Med Rehabil 76:736, from memory), and both are in proportion to the width."""


def gentle_reference(
    record: GaitRecord,
    model: BodyModel,
    contact: ContactSettings,
    accuracy: RecordAccuracy,
    amputation: Side | None = None,
) -> ReferenceMotion:
    """`dynamic_fit.consistent_reference` (`record`, `model`, `contact` and `accuracy` as it takes
    them), with moments as well as they are known here, and started again, with less weight on the
    laws, where it moves the recorded angles by more than `POOR`. `amputation` is the side of a
    prosthetic knee.
    """
    built = build_reference(record, model, contact)
    problem = fit_problem(built, record, model, contact, Accuracy(record=accuracy), 0.0)
    problem = problem._replace(weight=_weights(problem.weight, accuracy, amputation))
    found = solve_problem(problem)
    if _moved_by(problem, found) > POOR:
        found = min(found, _gently(problem), key=lambda each: each.cost)
    motion = motion_of(found, built, record, model, contact)
    return replace(motion, hip_centre=np.zeros((2, 2)))


def _weights(usual: Array, accuracy: RecordAccuracy, amputation: Side | None) -> Array:
    """The `usual` weights (T, 52) with moments and forces as well as they are known."""
    weight = usual.copy()
    if amputation is not None:
        knee = COORDINATES.index(f"knee_angle_{amputation[0]}")
        weight[:, knee] *= accuracy.moment / PROSTHETIC_KNEE
    for foot, side in enumerate(SIDES):
        if amputation is None:
            ankle = COORDINATES.index(f"ankle_angle_{side[0]}")
            weight[:, ankle] *= accuracy.moment / ANKLE_MOMENT
        else:
            weight[:, FOOT + FOOT_NUMBERS * foot + 1] /= BROAD_BASE
            weight[:, COORDINATES.index(f"hip_adduction_{side[0]}")] /= BROAD_BASE
    return weight


def _gently(problem: Problem) -> Solution:
    terms = problem.series[0].shape[1]
    found = Solution(
        np.zeros((len(COORDINATES), terms)), np.zeros(len(problem.prior)), np.empty(0), np.inf
    )
    for ease in GENTLE:
        weight = problem.weight.copy()
        weight[:, :ROOT_DOFS] *= ease
        eased = problem._replace(weight=weight)
        found = solve_problem(eased, start=(found.change, found.common))
    return found


def _moved_by(problem: Problem, found: Solution) -> float:
    """Mean RMS change of pelvis, hips, knees and ankles, rad."""
    change = problem.series[0] @ found.change.T
    legs = [
        COORDINATES.index(f"{name}_{side}")
        for name in ("hip_flexion", "hip_adduction", "hip_rotation", "knee_angle", "ankle_angle")
        for side in "rl"
    ]
    return float(np.sqrt(np.mean(change[:, [0, 1, 2, *legs]] ** 2, axis=0)).mean())
