"""How close a motion should stay to each recorded quantity."""

from typing import NamedTuple

import numpy as np


class RecordAccuracy(NamedTuple):
    """Departures from a record that weigh the same in a fit: angles in rad, moments in Nm/kg,
    forces in body weights (BW).

    The defaults are those of the reference that a walker follows. They were chosen by walks, see
    `experiments/fit_weights.py`: what counts is what the walk keeps, and an angle that is not
    sagittal gives way before a moment or a force does.
    """

    sagittal: float = np.deg2rad(1.2)
    frontal: float = np.deg2rad(1.5)
    """Hip adduction and rotation."""
    pelvis: float = np.deg2rad(2.0)
    moment: float = 0.025
    adduction_moment: float = 0.10
    forward_force: float = 0.006
    sideways_force: float = 0.006
    vertical_force: float = 0.007
