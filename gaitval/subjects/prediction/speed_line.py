"""A straight line on speed through people, whatever of theirs it is that changes with speed."""

import numpy as np

from gaitval.arrays import Array
from gaitval.gait.dimensionless import speed_unit
from gaitval.subjects.subject import Subject

FEWEST_PEOPLE = 3
"""People that a straight line needs so that it does not pass through all of them."""


def dimensionless_speed(subject: Subject) -> float:
    """Speed of a `subject` in units of the leg (`gait.dimensionless`)."""
    return subject.walking_speed_m_s / speed_unit(subject.leg_length_m)


def line_weights(speeds: Array, speed: float) -> Array:
    """Weights (n,), which add up to one, that give the straight line through gaits of dimensionless
    `speeds` (n,), by least squares, at a dimensionless `speed`.
    """
    design = np.column_stack([np.ones(len(speeds)), speeds])
    # The line at a speed is [1, speed] · (X⁺ y), linear in the gaits y: these are the factors of y.
    return np.asarray(np.array([1.0, speed]) @ np.linalg.pinv(design))
