"""How close a motion should stay to each recorded quantity."""

from typing import NamedTuple

import numpy as np


class RecordAccuracy(NamedTuple):
    """Departures from a record that weigh the same in a fit: angles in rad, moments in Nm/kg,
    forces in body weights (BW).
    """

    sagittal: float = np.deg2rad(1.2)
    frontal: float = np.deg2rad(1.0)
    """Hip adduction and rotation."""
    pelvis: float = np.deg2rad(1.5)
    moment: float = 0.06
    adduction_moment: float = 0.15
    forward_force: float = 0.010
    sideways_force: float = 0.0075
    vertical_force: float = 0.010
