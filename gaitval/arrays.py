"""Array types for annotations, arrays in whole lines of the cache, standard deviations of samples,
and runs of True in an array.
"""

import math

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
Flags = NDArray[np.bool_]
Index = NDArray[np.int64]


def aligned(shape: tuple[int, ...]) -> Array:
    """Zeros of a `shape` that begin where a line of the processor's cache does: a vector of eight
    numbers that lies in two takes twice as long to read or write (a physics step, a sixth longer).
    """
    room = np.zeros(math.prod(shape) + 7)
    return room[-room.ctypes.data % 64 // 8 :][: math.prod(shape)].reshape(shape)


def sample_deviation(values: Array) -> Array | None:
    """Standard deviation (n - 1) over the rows of `values` (n, ...), such as the curves of n
    strides; None of fewer than two, which have none.
    """
    return np.asarray(values.std(axis=0, ddof=1)) if len(values) > 1 else None


def spread_out(values: Array, rows: Index, count: int, axis: int = 0) -> Array:
    """An array with `count` places along an `axis`, of which `rows` have the `values`, and the
    others NaN, or False if these are flags.
    """
    shape = *values.shape[:axis], count, *values.shape[axis + 1 :]
    whole = np.full(shape, False if values.dtype == bool else np.nan, values.dtype)
    whole[(slice(None),) * axis + (rows,)] = values
    return whole


def runs(on: Flags) -> tuple[Index, Index]:
    """Runs of True in the flags `on` (samples,): the first sample of each, and the first sample
    after it, (runs,) each, in order of time.
    """
    # A zero on either side, so that a run at the first or last sample has both edges; signed bytes,
    # because the difference of truth values has no sign.
    edges = np.diff(np.concatenate(([0], on.astype(np.int8), [0])))
    return np.flatnonzero(edges == 1), np.flatnonzero(edges == -1)
