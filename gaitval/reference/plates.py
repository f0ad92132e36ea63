"""Find what is wrong with the force plates of a laboratory from its records.

The scale follows from each record's mean vertical force. Where each plate's centre of pressure must
lie follows from the motion: the sole is on the ground where the foot is, and the force through it
must carry the whole body and turn it as it turns. So the fit of `dynamic_fit`, whose forces act
where the contact spheres are, is solved with the two shifts as further unknowns. Where its moments
differ from the recorded ones by the vertical force times a length, that length is the shift, and
the normal equations say how certain it is. Plates stay where they are, so several records of one
laboratory are evidence for the same two shifts.
"""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from gaitval.arrays import Array
from gaitval.configuration import ContactSettings
from gaitval.coordinates import SIDES
from gaitval.gait.plate_correction import PlateCorrection, corrected
from gaitval.gait.record import GaitRecord
from gaitval.model.body import BodyModel
from gaitval.reference.dynamic_fit import INFERENCE, solve
from gaitval.reference.motion import build_reference

SHIFT_SD = 0.03
"""m, of a shift before a record is seen; convention. A plate that is further away than two of these
misses the foot, which an import sees (`gait.feet_on_plates`)."""

SCALE_SD = 0.005
"""Of the mean vertical force: body mass changes by this within a day and with clothing;
convention."""

CLEAR = 2.0
"""Standard deviations from which a fault is corrected."""


class PlateEvidence(NamedTuple):
    """What one record says about its plates.

    Attributes
    ----------
    mean_force : mean vertical force of both feet, body weights; 1 in every periodic motion.
    shift : (2,) m, by which the centre of pressure of the right and the left plate is too far
        forward.
    covariance : (2, 2) m², of `shift`, which was 0 +- `SHIFT_SD` beforehand.
    """

    mean_force: float
    shift: Array
    covariance: Array


def plate_evidence(record: GaitRecord, model: BodyModel) -> PlateEvidence:
    """What a `record` as measured, not corrected, with moments and forces of both sides, says about
    its plates; `model` is the scaled body. The contact law is the default configuration's.
    """
    contact = ContactSettings()
    phase = np.arange(1000) / 1000
    # Over a whole cycle the mean vertical force of both feet is one body weight, or the body would
    # rise or fall.
    mean = sum(float(record.ground_reaction(side, phase)[:, 2].mean()) for side in SIDES)
    # The scale first: a wrong scale also changes the moments, and would look like a shift.
    record = corrected(record, PlateCorrection(scale=1.0 / mean))
    reference = build_reference(record, model, contact)
    solution = solve(reference, record, model, contact, INFERENCE, shift_sd=SHIFT_SD)
    return PlateEvidence(mean, solution.common[:2], solution.covariance[:2, :2])


def common_shift(evidence: Sequence[PlateEvidence]) -> tuple[Array, Array]:
    """The shift (2,) m of the right and left plate, forward, that all records of a laboratory
    share, and its covariance (2, 2) m²; from the `evidence` of each record, with the prior 0 ±
    `SHIFT_SD` in it.
    """
    before = np.eye(2) / SHIFT_SD**2
    precision, information = before.copy(), np.zeros(2)
    for each in evidence:
        own = np.linalg.inv(each.covariance)
        precision += own - before  # what was known beforehand counts once
        information += own @ each.shift
    covariance = np.linalg.inv(precision)
    return np.asarray(covariance @ information), np.asarray(covariance, dtype=float)


def plate_corrections(evidence: Sequence[PlateEvidence]) -> list[PlateCorrection | None]:
    """How to correct each record of one laboratory, in the order of the `evidence` of each; None
    where no fault is clear.

    A scale is a record's own. The two shifts, which all records share, are corrected together, if
    one of them or their difference is `CLEAR` standard deviations from zero.
    """
    shift, covariance = common_shift(evidence)
    sd = np.sqrt(np.diag(covariance))
    apart = np.sqrt(np.array([1.0, -1.0]) @ covariance @ np.array([1.0, -1.0]))
    shifted = max(*(np.abs(shift) / sd), abs(shift[0] - shift[1]) / apart) > CLEAR
    found: list[PlateCorrection | None] = []
    for each in evidence:
        scaled = abs(each.mean_force - 1.0) > CLEAR * SCALE_SD
        correction = PlateCorrection(
            scale=1.0 / each.mean_force if scaled else 1.0,
            scale_sd=SCALE_SD if scaled else 0.0,
            shift_right=float(shift[0]) if shifted else 0.0,
            shift_right_sd=float(sd[0]) if shifted else 0.0,
            shift_left=float(shift[1]) if shifted else 0.0,
            shift_left_sd=float(sd[1]) if shifted else 0.0,
        )
        found.append(correction if scaled or shifted else None)
    return found
