"""What is known of how the deviations of a walk answer to changes of its reference.

To measure it takes a walk for each change, and leaves the scatter of two walks in each. But walkers
answer much alike. So a search begins with the slopes of other people at the speed and how they
differ, and every walk teaches it more: Bayesian linear regression, as a Kalman filter whose state
does not move (Bishop 2006, Pattern Recognition and Machine Learning, 3.3).
"""

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cache
from importlib import resources
from typing import Final

import numpy as np
from safetensors.numpy import load
from scipy.interpolate import CubicSpline

from gaitval.arrays import Array, Index

STORED: Final = "shared_slopes.safetensors"
"""Slopes of people whom no table of the project contains; experiments/shared_slopes.py makes it."""


@dataclass(frozen=True)
class SlopeSettings:
    """How a correction changes a walk."""

    harmonics: int = 12
    """Harmonics of the gait cycle in each change whose slopes are stored."""
    every: int = 2
    """Of so many samples of a curve one is stored: curves have nothing above 10 Hz."""
    speed: float = 0.35
    """Dimensionless speed of the stored slopes; they change with it by a line within `speeds`."""
    noise: float = 100.0
    """Sum of squares that a linear answer leaves of a walk; 30 or 300 do as well
    (docs/learning.md)."""


SLOPES: Final = SlopeSettings()


@dataclass(frozen=True)
class Slopes:
    """Derivatives of the deviations by the unknowns, as far as they are known.

    Attributes
    ----------
    mean : (m, n).
    covariance : (n, n) of a row, summed over the rows.
    """

    mean: Array
    covariance: Array

    def scaled(self, units: Array) -> "Slopes":
        """The same by unknowns in other `units`, (n,) of those that they have here."""
        return Slopes(self.mean * units, self.covariance * np.outer(units, units))

    def reweighted(self, factors: Array) -> "Slopes":
        """The same of deviations that are (m,) `factors` times as large."""
        # the covariance is summed over the rows, which it does not tell apart
        return Slopes(self.mean * factors[:, None], self.covariance * float(np.mean(factors**2)))

    def learned(self, steps: Array, changes: Array) -> "Slopes":
        """The same after `steps` (k, n) from a point changed the deviations by `changes` (k, m)."""
        crossed = steps @ self.covariance
        scatter = crossed @ steps.T + SLOPES.noise * np.eye(len(steps))
        gain = np.linalg.solve(scatter, crossed)
        covariance = self.covariance - crossed.T @ gain
        return Slopes(
            self.mean + (changes - steps @ self.mean.T).T @ gain,
            # It is symmetric but for rounding, which would grow.
            0.5 * (covariance + covariance.T),
        )


def places(harmonics: int, joints: int) -> Index:
    """Places of fewer `harmonics` of some `joints` among the stored unknowns; last the height."""
    of_joint = np.concatenate(
        [[0], np.arange(1, 1 + harmonics), SLOPES.harmonics + np.arange(1, 1 + harmonics)]
    )
    first = (1 + 2 * SLOPES.harmonics) * np.arange(joints)
    return np.append((first[:, None] + of_joint).ravel(), (1 + 2 * SLOPES.harmonics) * joints)


@cache
def _stored() -> Mapping[str, Array]:
    content = resources.files("gaitval.correction").joinpath(STORED).read_bytes()
    return {name: np.asarray(values, dtype=float) for name, values in load(content).items()}


def shared_slopes(speed: float, harmonics: int, joints: int, samples: int) -> Slopes:
    """What other people's walks say of the slopes, by rad and m, at a dimensionless `speed`, of so
    many `harmonics` of each of the `joints`, and of curves with so many `samples` each.
    """
    stored, which = _stored(), places(harmonics, joints)
    away = np.clip(speed, *stored["speeds"]) - SLOPES.speed
    at_speed = stored["mean"] + away * stored["by_speed"]
    kept = np.arange(0, samples, SLOPES.every)
    mean = CubicSpline(kept, at_speed[..., which], axis=1)(np.arange(samples))
    return Slopes(mean.reshape(-1, len(which)), stored["covariance"][np.ix_(which, which)])
