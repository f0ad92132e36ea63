"""Units of speed and time by which people of every size compare (Hof 1996, Gait Posture 4:222)."""

import numpy as np

from gaitval.constants import GRAVITY


def speed_unit(leg_length: float) -> float:
    """Root of gravity times `leg_length` (m), m/s; a speed over it is the Froude number's root."""
    return float(np.sqrt(GRAVITY * leg_length))


def time_unit(leg_length: float) -> float:
    """Root of `leg_length` (m) over gravity, s."""
    return float(np.sqrt(leg_length / GRAVITY))
