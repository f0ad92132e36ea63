"""The dynamic fit of gaits that are far from what healthy people's forces expect.

`walk.reference.dynamic_fit` puts weight on Newton's laws in three steps. From a patient's angles,
the first is too large for some: the steps end in a motion that obeys the laws and has an ankle 13
degrees off. Such a fit is started again with less weight, an amputee's also from one whose sound
foot leaves the ground earlier (`SHORTER`), and of all the one with the smallest sum of squares is
taken.

How well a quantity is known differs, too (`_as_known`): an ankle's moment is expected in the time
of this foot, a prosthetic knee does not do what healthy ones do, and amputees walk on a broader
base.
"""

from dataclasses import replace
from typing import Final

import numpy as np

from gaitval.apps.patients.known_record import over_stance
from gaitval.configuration import ContactSettings
from gaitval.coordinates import COORDINATES, SIDES, Side, opposite
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
from gaitval.walk.reference.motion import (
    ReferenceMotion,
    build_reference,
)
from gaitval.walk.reference.walking_laws import FOOT, FOOT_NUMBERS

GENTLE: Final = (0.01, 0.03, 0.1, 0.3, 1.0)
"""Weights of Newton's laws on the pelvis, one after the other."""

POOR: Final = float(np.radians(2.0))
"""rad, mean root-mean-square change of the recorded angles above which a fit is started again."""

ANKLE_MOMENT: Final = 0.025
"""Nm/kg. Where the force acts below a foot is free in the fit, so with the 0.05 of other joints the
ankle gave way to all that is less known: by 0.06 to 0.1 in amputees, as much as what is expected of
them may be off by."""
SHORTER: Final = (0.03, 0.02, 0.01)
"""Of the cycle, by which an amputee's sound foot leaves the ground earlier in the fits of which the
last one is started: sound feet do so about 0.03 later than the angles say (`sound_side`), and where
that asks for a force of a foot that has left the ground, no fit started from the angles finds its
way back to the ground (two of twelve amputees)."""
PROSTHETIC_KNEE: Final = 0.25
"""Nm/kg, the size (RMS) of a healthy knee's moment. A prosthetic knee stands on its stop, extended,
and has no muscle that would hold it bent (Segal et al. 2006, J Rehabil Res Dev 43:857, from
memory), so that healthy people's moment says little of it."""
BROAD_BASE: Final = 2.0
"""Times the accuracy of sideways forces and hip adduction moments, for people with a prosthesis:
steps of above-knee amputees are about twice as wide as healthy people's (Jaegers et al. 1995, Arch
Phys Med Rehabil 76:736, from memory), and both are in proportion to the width. With healthy
people's accuracy their hips were drawn together by 3 degrees."""


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

    def started(each: GaitRecord) -> tuple[ReferenceMotion, Problem]:
        # toes bend until the foot leaves the ground, so each record has its own
        built = build_reference(each, model, contact)
        target = fit_problem(built, each, model, contact, Accuracy(record=accuracy), 0.0)
        return built, _as_known(target, accuracy, amputation)

    built, problem = started(record)
    fits = [solve_problem(problem)]
    if _moved_by(problem, fits[0]) > POOR:
        fits.append(_gently(problem))
        if amputation is not None:
            shorter = [started(_shorter(record, amputation, by))[1] for by in SHORTER]
            fits.append(_gently(shorter[0]))
            for each in (*shorter[1:], problem):
                fits[-1] = solve_problem(each, start=(fits[-1].change, fits[-1].common))
    best = min(fits, key=lambda each: each.cost)
    motion = motion_of(best, built, record, model, contact)
    return replace(motion, hip_centre=np.zeros((2, 2)))


def _shorter(record: GaitRecord, amputation: Side, by: float) -> GaitRecord:
    """`record` whose sound foot leaves the ground `by` so much of the cycle earlier."""
    sound, stance = opposite(amputation), dict(record.stance_fraction)
    return over_stance(record, stance | {sound: stance[sound] - by})


def _as_known(problem: Problem, accuracy: RecordAccuracy, amputation: Side | None) -> Problem:
    """`problem` with the weights of `ANKLE_MOMENT`, `PROSTHETIC_KNEE` and `BROAD_BASE`."""
    weight = problem.weight.copy()
    for side in SIDES:
        weight[:, COORDINATES.index(f"ankle_angle_{side[0]}")] *= accuracy.moment / ANKLE_MOMENT
    if amputation is not None:
        knee = COORDINATES.index(f"knee_angle_{amputation[0]}")
        weight[:, knee] *= accuracy.moment / PROSTHETIC_KNEE
        for foot, side in enumerate(SIDES):
            weight[:, FOOT + FOOT_NUMBERS * foot + 1] /= BROAD_BASE
            weight[:, COORDINATES.index(f"hip_adduction_{side[0]}")] /= BROAD_BASE
    return problem._replace(weight=weight)


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
