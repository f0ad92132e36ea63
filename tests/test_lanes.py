"""Lanes compute what doubles do, bit for bit; sine, cosine and exponential are those of NumPy."""

import numpy as np
import pytest

from gaitval._internal.numba.compiled import njit
from gaitval._internal.numba.lanes import (
    arctangent,
    everywhere,
    exponential,
    floor,
    fused,
    in_lanes,
    magnitude,
    remainder,
    sine_cosine,
    sqrt,
    where,
    with_lanes,
)

RANDOM = np.random.default_rng(0)
ANGLES = np.concatenate(
    [RANDOM.uniform(-4.0, 4.0, 4000), RANDOM.uniform(-1e3, 1e3, 3992), np.arange(-4, 4) * np.pi / 4]
).reshape(-1, 8)
KINDS = 13


def results(x, y, out, i):
    """All functions and operators of two numbers."""
    sine, cosine = sine_cosine(x)
    less = x < y
    out[i, 0], out[i, 1], out[i, 2] = sine, cosine, exponential(0.7 * x)
    out[i, 3], out[i, 4], out[i, 5] = sqrt(magnitude(x)), floor(x), arctangent(x, y)
    out[i, 6], out[i, 7], out[i, 8] = x * y + x - y / x, -x, where(less, x, y)
    out[i, 9] = where(x >= y, 1.0, where(x == y, 2.0, 3.0))
    out[i, 10] = where(x != y, 1.0, 0.5) + where(x > 2.0, y, 1.0)
    out[i, 11], out[i, 12] = fused(x, y, -x * y), remainder(x, 0.5)


compiled = njit(results)


@njit
def of_lanes(x, y, out):
    in_x, in_y, in_out = in_lanes(x), in_lanes(y), in_lanes(out)
    for i in range(in_x.shape[0]):
        compiled(in_x[i], in_y[i], in_out, i)


@njit
def of_doubles(x, y, out):
    for i in range(x.shape[0]):
        for k in range(8):
            compiled(x[i, k], y[i, k], out[:, :, k], i)


@njit
def all_below(x, bound):
    return everywhere(in_lanes(x)[0] < bound)


@pytest.fixture(scope="module")
def both():
    other = np.random.default_rng(1).permutation(ANGLES.ravel()).reshape(ANGLES.shape)
    lanes, doubles = np.empty((2, len(ANGLES), KINDS, 8))
    of_lanes(ANGLES, other, lanes)
    of_doubles(ANGLES, other, doubles)
    return lanes, doubles


def test_a_lane_is_a_double_bit_for_bit(both):
    np.testing.assert_array_equal(*both)


def test_a_fused_product_is_rounded_once(both):
    """So x y less what it is rounded to is what the rounding took, exactly (Dekker 1971)."""
    x, y = ANGLES, np.random.default_rng(1).permutation(ANGLES.ravel()).reshape(ANGLES.shape)
    high = [value.astype(np.float32).astype(float) for value in (x, y)]
    low = x - high[0], y - high[1]
    lost = ((high[0] * high[1] - x * y) + high[0] * low[1] + low[0] * high[1]) + low[0] * low[1]
    np.testing.assert_allclose(both[0][:, 11], lost, rtol=1e-6, atol=1e-25)
    assert np.count_nonzero(lost) > 0.9 * lost.size


@pytest.mark.parametrize(
    ("kind", "expected"),
    [(0, np.sin(ANGLES)), (1, np.cos(ANGLES)), (2, np.exp(0.7 * ANGLES)), (12, ANGLES % 0.5)],
    ids=["sine", "cosine", "exponential", "remainder"],
)
def test_functions_are_right_to_the_last_place(both, kind, expected):
    """Two units in the last place. The reduction leaves an angle of up to 1e3 (637 quarter turns)
    an error of 637 x 8e-37, so a sine or cosine is as accurate near its zeros."""
    seen, inside = both[0][:, kind], np.abs(0.7 * ANGLES) < 700.0
    error = np.abs(seen - expected)[inside] / np.spacing(np.abs(expected))[inside]
    assert error.max() <= 2.0


def test_beyond_its_bounds_the_exponential_stays_finite():
    seen = np.empty((1, KINDS, 8))
    of_lanes(np.full((1, 8), 1e4), np.ones((1, 8)), seen)
    assert np.isfinite(seen[0, 2]).all()
    assert (seen[0, 2] > 1e300).all()


@pytest.mark.parametrize("lane", range(8))
def test_everywhere_sees_every_lane(lane):
    x = np.zeros((1, 8))
    assert all_below(x, 0.5)
    x[0, lane] = 1.0
    assert not all_below(x, 0.5)


@pytest.mark.parametrize("shape", [(1,), (5, 3), (31, 6), (0, 3)])
def test_lanes_begin_with_a_line_of_the_cache(shape):
    for array in [with_lanes(np.ones(shape)) for _ in range(5)]:  # wherever the memory is
        assert array.ctypes.data % 64 == 0
        assert array.shape == (*shape, 8)
        assert not array.any()
        assert array.flags.c_contiguous
