"""Sizes that no person has: which unit was confused, in words for a message."""

from typing import Final

import numpy as np

from gaitval.arrays import Array
from gaitval.mocap.recording import PERSON_SPREAD_M

_CONFUSED: Final = {
    1e3: "metres that are called mm",
    1e-3: "millimetres that are called m",
    100.0: "metres that are called cm",
    0.01: "centimetres that are called m",
    25.4: "inches that are called mm",
    10.0: "centimetres that are called mm",
    0.1: "millimetres that are called cm",
}
"""By the factor that corrects it."""

REACH_M: Final = 2.0
"""m. No marker on a tall adult with arms raised is so far from the middle of all markers."""

ADULT_PELVIS: Final = (0.6, 1.1)
"""m, an adult's pelvis above the ankles."""


def looks_like(spread: float) -> str:
    """The unit error that makes a person's markers spread over this many metres, in words."""
    low, high = PERSON_SPREAD_M
    fits = [factor for factor in _CONFUSED if low <= spread * factor <= high]
    if not fits:
        return ""
    # Of two units that are near to each other the one that gives the more usual size.
    usual = np.sqrt(low * high)
    best = min(fits, key=lambda factor: abs(np.log(spread * factor / usual)))
    return f" (it looks like {_CONFUSED[best]})"


def from_middle(points: Array) -> Array:
    """Distance (M,) of each of the markers `points` (M, 3), m, from the median of all: small
    wherever in the laboratory a person stands.
    """
    return np.asarray(np.linalg.norm(points - np.median(points, axis=0), axis=1))


def unit_of(away: Array) -> str:
    """`looks_like` of distances `away` (`from_middle`), half of which may be of markers that went
    astray.
    """
    return looks_like(2.0 * float(np.median(away)))


def wrong_factor(height: float) -> float | None:
    """The power of ten between an adult's and the `height` of a pelvis above the ankles, m, which
    is the likely error of the unit; None if none leads there.
    """
    factors = (1e-3, 1e-2, 0.1, 10.0, 100.0, 1e3)
    low, high = ADULT_PELVIS
    return next((each for each in factors if low <= height * each <= high), None)
