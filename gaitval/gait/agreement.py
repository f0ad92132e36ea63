"""Where a trial's forces can be held against its motion."""

from typing import Final

import numpy as np
from scipy.ndimage import binary_erosion

from gaitval.arrays import Flags
from gaitval.mocap.recording import FootForces

EDGE_SECONDS: Final = 0.1
"""s at the edges of what is known of both feet that are not used: events from markers are accurate
to 20 ms, and the low-pass reaches further."""


def both_known(loads: FootForces) -> Flags:
    """Where the `loads` of both feet are known, less `EDGE_SECONDS` at the edges.

    Where a foot lands that no plate shows, its force is missing a little before the markers show
    the landing.
    """
    # `border_value` 1: at an end of the trial no foot comes or goes.
    return binary_erosion(
        np.asarray(loads.valid.all(axis=1)),
        iterations=round(EDGE_SECONDS * loads.rate),
        border_value=1,
    )


def residuals_known(loads: FootForces) -> Flags:
    """As `both_known` of these `loads`, less `EDGE_SECONDS` at both ends of the trial, too: the
    acceleration there is seen from one side only, and what low-pass and derivative make of it is no
    residual.
    """
    known, edge = both_known(loads), round(EDGE_SECONDS * loads.rate)
    known[:edge] = False
    known[max(len(known) - edge, 0) :] = False
    return known
