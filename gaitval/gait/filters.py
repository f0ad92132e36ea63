"""Zero-lag low-pass filters, for recordings and for simulations."""

import numpy as np
from numpy.typing import ArrayLike
from scipy.signal import butter, sosfiltfilt

from gaitval.arrays import Array, runs
from gaitval.errors import RecordError


def low_pass(values: ArrayLike, *, rate: float, cutoff_hz: float, order: int = 4) -> Array:
    """Zero-lag Butterworth low-pass along the first axis, each block between NaN by itself.

    A filter of half the order runs forwards and backwards. Two passes would halve the amplitude
    at its cut-off, so that is raised until the whole has 1/√2 (−3.01 dB) at `cutoff_hz`:
    tan(π f′/rate) = tan(π f/rate) / (√2 − 1)^(1/order), which is the correction of Winter 2009
    (Biomechanics and Motor Control of Human Movement, section 3.4.4.2) carried through the
    bilinear transformation, so that it is exact at every sample rate.

    Parameters
    ----------
    values : (T, ...) uniformly sampled; a column that is NaN at a sample is filtered in blocks.
    rate : Hz.
    cutoff_hz : Hz, below half the rate.
    order : of the whole filter, even.

    Raises
    ------
    RecordError : a cut-off that the rate does not allow, or a signal shorter than one period of
        the cut-off.
    """
    values = np.asarray(values, dtype=float)
    if not 0.0 < cutoff_hz < 0.5 * rate:
        raise RecordError(
            f"A low-pass at {cutoff_hz:g} Hz needs samples at more than {2 * cutoff_hz:g} Hz, but "
            f"these come at {rate:g} Hz. Lower the cut-off in the section [processing] of the "
            "configuration."
        )
    period = int(np.ceil(rate / cutoff_hz))
    if len(values) < period:
        raise RecordError(
            f"{len(values)} samples at {rate:g} Hz are {len(values) / rate:.3g} s, shorter than "
            f"one period of the low-pass at {cutoff_hz:g} Hz: the trial is too short to filter. "
            "Give a longer one."
        )
    passes = 0.5 * order
    warped = np.tan(np.pi * cutoff_hz / rate) / (np.sqrt(2.0) - 1.0) ** (1.0 / order)
    sections = butter(int(passes), np.arctan(warped) / np.pi * rate, fs=rate, output="sos")
    filtered = values.reshape(len(values), -1).copy()
    seen = np.isfinite(filtered)
    if seen.all():
        # the ends are extended over one period of the cut-off, in which the filter settles
        padding = min(period, len(values) - 1)
        filtered = np.asarray(sosfiltfilt(sections, filtered, axis=0, padlen=padding))
    else:
        for column in range(filtered.shape[1]):
            for begin, end in zip(*runs(seen[:, column]), strict=True):
                block = filtered[begin:end, column]
                padding = min(period, len(block) - 1)
                filtered[begin:end, column] = sosfiltfilt(sections, block, padlen=padding)
    return filtered.reshape(values.shape)
