"""A second-order Butterworth low-pass, forwards and backwards: what SciPy computes, bit for bit.

SciPy's own (`scipy.signal.butter`, `sosfiltfilt`) loads its statistics and its optimisation with
it: half a second of every command.
"""

import numpy as np

from gaitval.arrays import Array
from gaitval.compiled import njit


def low_pass_section(frequency: float, rate: float) -> Array:
    """b0, b1, b2, 1, a1, a2 of the filter with this cut-off at this sample `rate`, both Hz: the two
    analogue poles, moved to the cut-off and mapped bilinearly (`scipy.signal.butter`, whose order
    of operations this has).
    """
    doubled = 4.0  # twice the sample rate for which the mapping is made
    cut_off = doubled * np.tan(np.pi * (2 * frequency / rate) / 2.0)
    analogue = cut_off * -np.exp(1j * np.pi * np.arange(-1, 2, 2) / 4)
    poles = (doubled + analogue) / (doubled - analogue)
    gain = cut_off**2 * np.real(1.0 / np.prod(doubled - analogue))
    return np.array([*(gain * np.array([1.0, 2.0, 1.0])), *np.real(np.poly(poles))])


def both_ways(section: Array, values: Array, padding: int) -> Array:
    """Filter `values` (T, C) by a `section` forwards, then backwards, as `scipy.signal.sosfiltfilt`
    does: beyond both ends, `padding` samples turned about the end's value; the filter begins as if
    the first of them had been there always.
    """
    before = 2 * values[:1] - values[padding:0:-1]
    after = 2 * values[-1:] - values[-2 : -(padding + 2) : -1]
    extended = np.concatenate([before, values, after]) if padding else values.copy()
    start = _settled(section)
    _filter(extended, section, start[:, None] * extended[0])
    backwards = extended[::-1].copy()
    _filter(backwards, section, start[:, None] * backwards[0])
    filtered = backwards[::-1]
    return np.ascontiguousarray(filtered[padding : len(filtered) - padding])


def _settled(section: Array) -> Array:
    """State (2,) of the filter under a constant 1 (`scipy.signal.lfilter_zi`)."""
    b, a = section[:3], section[3:]
    left = b[1:] - a[1:] * b[0]
    companion = np.array([[-a[1] / a[0], -a[2] / a[0]], [1.0, 0.0]])
    return np.asarray(np.linalg.solve(np.eye(2) - companion.T, left))


@njit
def _filter(values: Array, section: Array, state: Array) -> None:
    """Filter the columns of `values` (T, C) in place, from `state` (2, C) on: direct form II,
    transposed.
    """
    b0, b1, b2, _, a1, a2 = section
    for column in range(values.shape[1]):
        first, second = state[0, column], state[1, column]
        for row in range(values.shape[0]):
            here = values[row, column]
            made = b0 * here + first
            first = b1 * here - a1 * made + second
            second = b2 * here - a2 * made
            values[row, column] = made
