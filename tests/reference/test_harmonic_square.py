"""`walk.reference.harmonic_square` against the product that it replaces."""

import numpy as np

from gaitval.walk.reference.harmonic_square import harmonic_square


def test_it_is_the_square_of_the_whole_jacobian():
    instants, numbers, coordinates, harmonics, cycle = 20, 5, 3, 4, 1.3
    rng = np.random.default_rng(1)
    slope = rng.standard_normal((instants, numbers, 3 * coordinates))
    rates = 2.0 * np.pi * np.arange(1, harmonics + 1) / cycle
    found = np.zeros((coordinates * (2 * harmonics + 1),) * 2)
    harmonic_square(slope, rates, found)

    time = cycle * np.arange(instants) / instants
    angle = np.outer(time, rates)
    zero, one = np.zeros((instants, 1)), np.ones((instants, 1))
    series = np.stack(
        [
            np.hstack([one, np.cos(angle), np.sin(angle)]),
            np.hstack([zero, -rates * np.sin(angle), rates * np.cos(angle)]),
            np.hstack([zero, -(rates**2) * np.cos(angle), -(rates**2) * np.sin(angle)]),
        ]
    )
    by_order = slope.reshape(instants, numbers, 3, coordinates)
    jacobian = np.einsum("tojk,jtn->tokn", by_order, series).reshape(instants * numbers, -1)
    np.testing.assert_allclose(found, jacobian.T @ jacobian, rtol=1e-12, atol=1e-7)
