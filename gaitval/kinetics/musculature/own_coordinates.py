"""Lengths of a person's muscles as plain polynomials of gaitval's own coordinates.

For other programs, which know no Chebyshev series and no second skeleton: OpenSim 4.6 takes such
polynomials as paths. They are fitted to `paths.geometry` over the range of gait.
"""

from dataclasses import dataclass
from functools import cache
from itertools import product
from typing import Final, NamedTuple

import numpy as np
from scipy.stats import qmc

from gaitval.arrays import Array
from gaitval.kinetics.musculature.mapping import published_angles
from gaitval.kinetics.musculature.paths import COORDINATES, geometry, table


@dataclass(frozen=True)
class OwnPathSettings:
    """How paths of muscles become functions of coordinates."""

    inward: float = np.radians(15.0)
    """How far inside the range of the table poses are taken: gait, and 5 degrees beyond."""
    good_length: float = 0.2e-3
    good_arm: float = 1.0e-3
    """m, 95 % of poses: a higher order is tried until both are kept."""
    orders: tuple[int, int, int, int, int] = (3, 4, 5, 6, 7)
    poses: int = 1024


OWN_PATHS: Final = OwnPathSettings()


_TRAIN: Final = np.arange(OWN_PATHS.poses) % 4 != 0


class PlainPath(NamedTuple):
    """A muscle's length, m, as Σ c x₁ᵖ¹ x₂ᵖ² … of gaitval's coordinates, rad.

    Attributes
    ----------
    coordinates : names of x, of `paths.COORDINATES`.
    order : largest sum of powers.
    powers : (terms, x), in the order of OpenSim's `MultivariatePolynomialFunction`: the last
        coordinate's power rises first.
    coefficients : (terms,).
    length_error, arm_error : m, 95 % of poses that were not fitted.
    """

    coordinates: tuple[str, ...]
    order: int
    powers: Array
    coefficients: Array
    length_error: float
    arm_error: float

    def lengths(self, angles: Array) -> Array:
        """(N,) m at `angles` (N, x) rad of `coordinates`."""
        found: Array = _terms(angles, self.powers) @ self.coefficients
        return found


@cache
def _poses() -> Array:
    """(N, 6) rad of gaitval's coordinates, over the range of gait and at its ends."""
    low, high = table().ranges.T
    unit = 1.04 * (2 * qmc.Sobol(6, seed=2).random(OWN_PATHS.poses) - 1)
    middle, half = (low + high) / 2, (high - low) / 2 - OWN_PATHS.inward
    found = middle + half * np.clip(unit, -1, 1)
    found[:, 0] -= table().skeleton.hip_zero
    found[:, COORDINATES.index("knee_angle")] -= table().skeleton.knee_zero
    # The foot's own axes turn less about the shank's than the oblique ones may.
    found[:, 4:] *= 0.9
    return np.asarray(found)


def plain_paths(factors: Array) -> tuple[PlainPath, ...]:
    """Paths of the 40 muscles of a leg whose bones are of `factors` (4,), see
    `mapping.BoneSizes`.
    """
    poses = _poses()
    lengths, arms = own_lengths(poses, factors)
    return tuple(_fitted(number, lengths, arms) for number in range(len(table().names)))


def own_lengths(leg: Array, factors: Array) -> tuple[Array, Array]:
    """Lengths (N, 40) m and their slopes (N, 40, 6) m/rad in gaitval's coordinates `leg` (N, 6)."""
    at = published_angles(leg)
    found = geometry(at)
    slopes = found.slope @ factors
    # By the chain of the foot's angles; those of hip and knee only have another zero.
    step, foot = 1e-5, slopes[:, :, 4:].copy()
    for i in (4, 5):
        aside = np.zeros(6)
        aside[i] = step
        change = (published_angles(leg + aside) - published_angles(leg - aside))[:, 4:] / (2 * step)
        slopes[:, :, i] = np.einsum("nmk,nk->nm", foot, change)
    return found.length @ factors, slopes


class _Basis(NamedTuple):
    """Terms of an order of some coordinates at `_poses`: see `_basis`."""

    powers: Array
    scale: Array
    value: Array
    down: Array
    inverse: Array


@cache
def _basis(spans: tuple[int, ...], order: int) -> _Basis:
    """Powers, scale of each coordinate, terms (N, terms), their slopes (x, N, terms), and what
    takes weighted lengths and slopes of the fitted poses to coefficients.
    """
    x = _poses()[:, spans]
    scale = np.abs(x).max(axis=0)
    every = product(range(order + 1), repeat=len(spans))
    powers = np.array([each for each in every if sum(each) <= order])
    value = _terms(x / scale, powers)
    down = np.stack([_slope(x / scale, powers, i) / scale[i] for i in range(len(spans))])
    rows = np.concatenate(
        [
            value[_TRAIN] / OWN_PATHS.good_length,
            *(each[_TRAIN] / OWN_PATHS.good_arm for each in down),
        ]
    )
    gram = rows.T @ rows
    gram[np.diag_indices(len(gram))] *= 1.0 + 1e-11
    return _Basis(powers, scale, value, down, np.linalg.solve(gram, rows.T))


def _fitted(number: int, lengths: Array, slopes: Array) -> PlainPath:
    of = table().muscles[number].coordinates
    spans = (*(i for i in of if i < 4), *((4, 5) if any(i >= 4 for i in of) else ()))
    y, slope = lengths[:, number], slopes[:, number][:, spans]
    wanted = np.concatenate(
        [
            y[_TRAIN] / OWN_PATHS.good_length,
            *(each[_TRAIN] / OWN_PATHS.good_arm for each in slope.T),
        ]
    )
    for order in OWN_PATHS.orders:
        basis = _basis(spans, order)
        found = basis.inverse @ wanted
        off = np.abs(basis.value @ found - y)[~_TRAIN]
        arm_off = np.abs(np.einsum("int,t->ni", basis.down, found) - slope)[~_TRAIN]
        length_error, arm_error = (float(np.quantile(each, 0.95)) for each in (off, arm_off))
        if length_error < OWN_PATHS.good_length and arm_error < OWN_PATHS.good_arm:
            break
    return PlainPath(
        tuple(COORDINATES[i] for i in spans),
        order,
        basis.powers,
        found / np.prod(basis.scale**basis.powers, axis=1),
        length_error,
        arm_error,
    )


def _terms(x: Array, powers: Array) -> Array:
    """(N, terms)."""
    most = int(powers.max(initial=0))
    value = np.ones((len(x), len(powers)))
    for i in range(x.shape[1]):
        value *= np.vander(x[:, i], most + 1, increasing=True)[:, powers[:, i]]
    return value


def _slope(x: Array, powers: Array, i: int) -> Array:
    """∂/∂xᵢ of `_terms`."""
    lower = powers.copy()
    lower[:, i] = np.maximum(lower[:, i] - 1, 0)
    return np.asarray(powers[:, i] * _terms(x, lower))
