"""What a muscle and its tendon can do: curves of De Groote et al. (2016) Ann Biomed Eng 44:2922.

Lengths are in optimal fibre lengths and tendon slack lengths, velocities in ten optimal fibre
lengths a second, forces in the largest isometric force. The passive curve has each muscle's own
strains, and the shape, with which Uhlrich et al. (2022) made a leg's passive moments those that
Silder et al. (2007) measured; those of muscles that cross the hip are fitted again, so that they
pull a leg in neutral to no side, either (`experiments/passive_hip.py`).
"""

from typing import Final

import numpy as np

from gaitval.arrays import Array

FASTEST: Final = 10.0
"""Fastest shortening, optimal fibre lengths a second (Rajagopal et al. 2016)."""

STRETCHED: Final = 0.049
"""Strain of a tendon at the largest isometric force (Rajagopal et al. 2016)."""

_ACTIVE: Final = np.array(
    [
        [0.8150671134243542, 1.055033428970575, 0.162384573599574, 0.063303448465465],
        [0.433004984392647, 0.716775413397760, -0.029947116970696, 0.200356847296188],
        [0.1, 1.0, 0.353553390593274, 0.0],
    ]
)
"""Three bells: height, middle, and width that changes with length (their b1 to b4; the first height
as OpenSim has it, so that the sum at the optimal length is 1)."""

_VELOCITY: Final = (-0.3211346127989808, -8.149, -0.374, 0.8825327733249912)
_PASSIVE: Final = 2.36
"""Power of the strain: within 0.025 of the spline of Millard et al. (2013) with these strains."""


def active_length(fibre: Array) -> Array:
    """Active force at the normalised length `fibre`, isometric."""
    total = np.zeros_like(fibre)
    for height, middle, width, growth in _ACTIVE:
        total += height * np.exp(-0.5 * ((fibre - middle) / (width + growth * fibre)) ** 2)
    return total


def velocity(fibre_velocity: Array) -> Array:
    """Factor on the active force at a normalised velocity, positive while the fibre lengthens;
    1 at rest.
    """
    d1, d2, d3, d4 = _VELOCITY
    return np.asarray(d1 * np.arcsinh(d2 * fibre_velocity + d3) + d4)


def passive_length(fibre: Array, start: Array, full: Array) -> Array:
    """Passive force: 0 at the strain `start` and below, 1 at the strain `full`."""
    along = (fibre - 1.0 - start) / (full - start)
    return np.asarray(np.clip(along, 0.0, 1.5) ** _PASSIVE)


def tendon_strain(force: Array) -> Array:
    """Strain of a tendon that carries a normalised `force`: the exponential of De Groote et al. as
    OpenSim has it, without force at the slack length.
    """
    return np.asarray(STRETCHED * np.log1p(np.maximum(force, 0.0) / 0.2) / np.log(6.0))
