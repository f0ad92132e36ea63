"""A small change of a motion as splines in time, and the resulting banded matrices."""

from itertools import pairwise

import numpy as np
from scipy.interpolate import BSpline

from gaitval._internal.numba.compiled import njit
from gaitval.arrays import Array
from gaitval.model.tree import COORDINATE_COUNT

DEGREE = 5
"""Quintic, so that accelerations are smooth."""

ACTIVE = DEGREE + 1
"""Number of B-splines that are nonzero at any time."""

BLOCK = ACTIVE * COORDINATE_COUNT
"""Unknowns that interact at any time, and so the width of the band."""


class ChangeSplines:
    """Quintic B-splines on equal knots.

    Parameters
    ----------
    time : (T,) s, increasing.
    knot : s, wanted distance of the knots; at least two frames.

    Attributes
    ----------
    first : (T,) number of the first B-spline that is nonzero at each frame.
    values : (T, 3, 6) the six that are, with their first and second time derivatives.
    count : number of B-splines.
    intervals : number and frames of each interval between knots that has frames.
    """

    def __init__(self, time: Array, knot: float) -> None:
        duration = time[-1] - time[0]
        # Knots closer than two frames could not be distinguished.
        knot = max(knot, 2.0 * float(np.diff(time).max()))
        intervals = max(1, round(duration / knot))
        step = duration / intervals
        at = (time - time[0]) / step
        # The last frame is the end of the last interval and not the start of another.
        self.first = np.minimum(at.astype(np.int64), intervals - 1)
        self.count = intervals + DEGREE
        # On equal knots all B-splines are shifts of one, whose support is 0…6 knots. A frame is at
        # u in the supports of its six active ones, near the end in that of the first. u counts
        # knots, so every derivative in time divides by the knot's length once more.
        cardinal = BSpline.basis_element(np.arange(ACTIVE + 1.0), extrapolate=False)
        u = (at - self.first)[:, None] + np.arange(DEGREE, -1, -1.0)
        self.values = np.stack([np.nan_to_num(cardinal(u, n)) / step**n for n in range(3)], axis=1)
        # Frames of each interval, which contribute to the same block of the normal equations.
        bounds = np.searchsorted(self.first, np.arange(intervals + 1))
        self.intervals = [
            (i, slice(int(a), int(b))) for i, (a, b) in enumerate(pairwise(bounds)) if b > a
        ]

    def evaluate(self, coefficients: Array) -> Array:
        """(T, 3, 31) values, rates and second rates of coefficients (count, 31)."""
        active = coefficients[self.first[:, None] + np.arange(ACTIVE)]
        return np.asarray(np.einsum("tna,tai->tni", self.values, active))


@njit
def add_block(band: Array, start: int, block: Array) -> None:
    """Add a symmetric `block` (n, n) on the diagonal of a `band` matrix (N, W), in place; `band[j,
    d]` is the element (j + d, j). `start` is the row and column of the block's first element; n is
    at most W, and the lower half of the block is read.
    """
    for j in range(len(block)):
        for i in range(j, len(block)):
            band[start + j, i - j] += block[i, j]


def times_band(band: Array, vector: Array) -> Array:
    """Product (N,) of a symmetric `band` matrix (N, W), its lower half as in `add_block`, with a
    `vector` (N,).
    """
    product = band[:, 0] * vector
    for d in range(1, band.shape[1]):
        # Each stored diagonal is that below the main one and, by symmetry, that above it.
        product[d:] += band[:-d, d] * vector[:-d]
        product[:-d] += band[:-d, d] * vector[d:]
    return np.asarray(product)
