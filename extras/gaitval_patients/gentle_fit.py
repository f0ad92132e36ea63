"""The dynamic fit of gaits that are far from what healthy people's forces expect.

`reference.dynamic_fit` puts weight on Newton's laws in three steps. From a patient's angles, the
first is too large for some: the steps end in a motion that obeys the laws and has an ankle 13
degrees off. Such a fit is begun again with less weight, and of both the one with the smaller sum of
squares is taken.
"""

from dataclasses import replace
from typing import Final

import numpy as np

from gaitval.arrays import Array
from gaitval.configuration import ContactSettings
from gaitval.constants import GRAVITY
from gaitval.contact.law import contact_law
from gaitval.coordinates import COORDINATES
from gaitval.gait.accuracy import RecordAccuracy
from gaitval.gait.record import GaitRecord
from gaitval.inverse.motion_rates import cardan_coordinates, root_states
from gaitval.model.body import BodyModel
from gaitval.model.parameters import NOMINAL_FRICTION
from gaitval.model.tree import ROOT_DOFS, tree_arrays
from gaitval.reference.dynamic_fit import (
    HARMONICS,
    Accuracy,
    Problem,
    Solution,
    fit_problem,
    solve_problem,
)
from gaitval.reference.motion import ReferenceMotion, build_reference, moved, spectral_rate
from gaitval.reference.walking_laws import FOOT, FOOT_NUMBERS, TRUNK, walking_laws

GENTLE: Final = (0.01, 0.03, 0.1, 0.3, 1.0)
"""Weights of Newton's laws on the pelvis, one after the other."""

POOR: Final = float(np.radians(2.0))
"""rad, mean root-mean-square change of the recorded angles above which a fit is begun again."""


def gentle_reference(
    record: GaitRecord, model: BodyModel, contact: ContactSettings, accuracy: RecordAccuracy
) -> ReferenceMotion:
    """`dynamic_fit.consistent_reference`, begun again with less weight on the laws where it moves
    the recorded angles by more than `POOR`.

    Parameters
    ----------
    record, model, contact, accuracy : as `consistent_reference` takes them.
    """
    built = build_reference(record, model, contact)
    problem = fit_problem(built, record, model, contact, Accuracy(record=accuracy), 0.0)
    found = solve_problem(problem)
    if _moved_by(problem, found) > POOR:
        other = _gently(problem)
        if other.cost < found.cost:
            found = other
    return _motion(built, record, model, contact, found)


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


def _series(phase: Array, stride_time: float) -> tuple[Array, Array]:
    k = 2.0 * np.pi * np.arange(1, HARMONICS + 1)
    angle = np.outer(phase, k)
    one = np.ones((len(phase), 1))
    values = np.hstack([one, np.cos(angle), np.sin(angle)])
    return values, np.hstack([0.0 * one, -k * np.sin(angle), k * np.cos(angle)]) / stride_time


def _motion(
    built: ReferenceMotion,
    record: GaitRecord,
    model: BodyModel,
    contact: ContactSettings,
    solution: Solution,
) -> ReferenceMotion:
    """The motion of a solution, as `dynamic_fit.fitted` makes it."""
    whole = cardan_coordinates(built.positions)
    whole[:, 3] -= built.speed * built.stride_time * built.phase
    values, rates = _series(built.phase, record.stride_time)
    coordinates = whole + values @ solution.change.T
    first = spectral_rate(whole) / record.stride_time + rates @ solution.change.T
    second = spectral_rate(first) / record.stride_time
    first[:, 3] += record.speed
    law = contact_law(contact, NOMINAL_FRICTION)
    out = walking_laws(tree_arrays(model), law, np.hstack([coordinates, first, second]))
    positions, velocities = coordinates.copy(), first.copy()
    root = np.empty((len(positions), 3, 3))
    root_states(coordinates[:, :3], first[:, :3], np.zeros((len(positions), 3)), root)
    positions[:, :3], velocities[:, :3] = root[:, 0], root[:, 1]
    positions[:, 3] += record.speed * record.stride_time * built.phase
    feet = out[:, FOOT:].reshape(len(out), 2, FOOT_NUMBERS)
    return replace(
        moved(built, model, positions, velocities),
        moments=out[:, ROOT_DOFS : TRUNK.start],
        ground_reaction=feet[..., :3] / (model.mass * GRAVITY),
        offsets=built.offsets + solution.change[ROOT_DOFS:, 0],
        hip_centre=np.zeros((2, 2)),
    )
