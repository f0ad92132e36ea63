"""The square of the Jacobian of a fit whose unknowns are harmonics (compiled).

At equally spaced instants of a cycle the product of two harmonics is the sum of two others, so that
all sums over the instants follow from the Fourier coefficients of one small matrix an instant. That
takes a fifth of the time of matrix products, in the largest part of each Gauss-Newton step.
"""

import numpy as np

from gaitval._internal.numba.compiled import njit_unlocked
from gaitval.arrays import Array

_ORDERS = 3
"""A motion and its first two rates."""


@njit_unlocked
def _add_products(spectrum: Array, powers: Array, dofs: int, matrix: Array) -> None:
    """Add to `matrix` the sums over the instants of products of two coordinates' harmonics,
    weighted by the squares of the slopes.

    With z = (i w)ᵒ exp(i h φ) for the o-th rate of harmonic h, a coordinate's columns are the real
    and the imaginary parts of z. The product of two is ½ Re or Im of (z z'* ± z z'), so it needs
    the spectrum only at the difference and at the sum of the two harmonics.

    Parameters
    ----------
    spectrum : (3 dofs, 3 dofs, 2, 2 H + 1), sums of the squares times cosine and sine of d φ.
    powers : (3, H + 1) 1, w and w² of each harmonic.
    matrix : (dofs (2 H + 1), dofs (2 H + 1)) out; of a coordinate, first its mean, then H cosines,
        then H sines.
    """
    harmonics = powers.shape[1] - 1
    count = harmonics + 1
    terms = 2 * harmonics + 1
    near, far = np.empty((2, terms)), np.empty((2, terms))
    sums = np.empty((4, count, count))
    for k in range(dofs):
        # The matrix is symmetric: blocks above the diagonal are computed and copied below.
        for m in range(k, dofs):
            sums[:] = 0.0
            for i in range(_ORDERS):
                for j in range(_ORDERS):
                    found = spectrum[i * dofs + k, j * dofs + m]
                    # near: of g - h from -H on; far: of g + h. A factor i turns them by 90 degrees.
                    for d in range(terms):
                        far[0, d], far[1, d] = found[0, d], found[1, d]
                        # Sine is odd: at a negative difference its sum changes sign.
                        away = abs(d - harmonics)
                        near[0, d] = found[0, away]
                        near[1, d] = found[1, away] if d > harmonics else -found[1, away]
                    # Every order is a factor of the imaginary unit, conjugated in the first
                    # coordinate: j - i of them for the difference, i + j for the sum.
                    for _ in range((j - i) % 4):
                        for d in range(terms):
                            near[0, d], near[1, d] = -near[1, d], near[0, d]
                    for _ in range((i + j) % 4):
                        for d in range(terms):
                            far[0, d], far[1, d] = -far[1, d], far[0, d]
                    for h in range(count):
                        for g in range(count):
                            size = powers[i, h] * powers[j, g]
                            sums[0, h, g] += size * near[0, g - h + harmonics]
                            sums[1, h, g] += size * near[1, g - h + harmonics]
                            sums[2, h, g] += size * far[0, g + h]
                            sums[3, h, g] += size * far[1, g + h]
            row, column = k * terms, m * terms
            for h in range(count):
                for g in range(count):
                    # cos a cos b = ½ (cos(a - b) + cos(a + b)), and so on for the four pairs; the
                    # sine of harmonic 0 is no unknown.
                    near_0, near_1, far_0, far_1 = sums[:, h, g]
                    matrix[row + h, column + g] += 0.5 * (near_0 + far_0)
                    if g > 0:
                        sine = column + harmonics + g
                        matrix[row + h, sine] += 0.5 * (near_1 + far_1)
                    if h > 0:
                        matrix[row + harmonics + h, column + g] += 0.5 * (far_1 - near_1)
                    if h > 0 and g > 0:
                        matrix[row + harmonics + h, sine] += 0.5 * (near_0 - far_0)
            if m > k:
                for a in range(terms):
                    for b in range(terms):
                        matrix[column + b, row + a] = matrix[row + a, column + b]


def harmonic_square(slope: Array, rates: Array, matrix: Array) -> None:
    """The square JᵀJ of a Jacobian whose numbers depend on some coordinates, each a mean and
    harmonics of the cycle, and on their rates.

    Parameters
    ----------
    slope : (T, N, 3 K) derivatives of N numbers at T equally spaced instants, the first at phase 0,
        by K coordinates, their rates and their second rates.
    rates : (H,) angular frequency of each harmonic, 1/s; T > 4 H.
    matrix : (K (2 H + 1), K (2 H + 1)) out, all zero before; by coordinate: mean, cosines, sines.
    """
    instants, _, inputs = slope.shape
    phase = 2.0 * np.pi * np.arange(instants) / instants
    # Sums of two harmonics reach 2 H; beyond T / 2 they would fold back onto lower ones.
    angles = np.outer(phase, np.arange(2 * len(rates) + 1))
    waves = np.hstack([np.cos(angles), np.sin(angles)])
    squares = (slope.transpose(0, 2, 1) @ slope).reshape(instants, -1)
    spectrum = (squares.T @ waves).reshape(inputs, inputs, 2, -1)
    powers = np.concatenate([[0.0], rates]) ** np.arange(_ORDERS)[:, None]
    _add_products(spectrum, powers, inputs // _ORDERS, matrix)
