"""Interpolate curves between samples, for recordings and for simulations."""

from typing import Final

import numpy as np

from gaitval.arrays import Array, Flags

SAMPLES: Final = 101
"""Points of a normalised gait cycle: 0, 1, … 100 %."""


def interpolated(values: Array, samples: Array, *, lone: bool = False) -> Array:
    """`values` (T, ...) at fractional `samples` (...), counted from 0, linearly interpolated;
    constant beyond the ends. At a whole sample the neighbours of a `lone` one do not count and may
    be NaN; otherwise a NaN next to a sample also hides it.
    """
    samples = np.clip(samples, 0.0, len(values) - 1)
    # The last sample is the upper end of the last pair, with a share of 1.
    below = np.minimum(samples.astype(np.int64), max(len(values) - 2, 0))
    above = np.minimum(below + 1, len(values) - 1)
    share = (samples - below).reshape(samples.shape + (1,) * (values.ndim - 1))
    before, after = values[below], values[above]
    if lone:
        # 0 times NaN is NaN, so a neighbour without weight has to be replaced.
        before = np.where(share < 1.0, before, 0.0)
        after = np.where(share > 0.0, after, 0.0)
    return np.asarray((1.0 - share) * before + share * after)


def bridged(values: Array, known: Flags) -> Array:
    """`values` (T, n), anything where they are not `known` (T,), interpolated linearly there
    between known ones, of which there is at least one; constant before the first and after the
    last.
    """
    samples = np.arange(len(values))
    columns = [np.interp(samples, samples[known], column[known]) for column in values.T]
    return np.stack(columns, axis=1)
