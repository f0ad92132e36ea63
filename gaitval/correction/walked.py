"""A walk beside its reference: what the correction looks at."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Final

import numpy as np

from gaitval.arrays import Array
from gaitval.gait.cycle_curves import JOINT_ANGLES, JOINT_MOMENTS
from gaitval.metrics.curve_results import Kind

Accuracies = Mapping[str, Mapping[str, float]]
"""Errors that weigh the same, by kind and curve without side, in the units of `CURVE_UNITS`."""

ACCURACY: Final[Accuracies] = {
    "angles": {**dict.fromkeys(JOINT_ANGLES, 1.5), "hip_rotation": 4.0, "subtalar_angle": 4.0},
    "moments": dict.fromkeys(JOINT_MOMENTS, 0.04),
    "forces": {"vertical": 1.0, "forward": 0.4, "medial": 0.3},
}
"""Errors that weigh the same, in the units of `metrics.curve_results.CURVE_UNITS`: of forces and
moments a fifth to a third of the error of a prediction from other people, of angles less than what
they differ between sessions of a laboratory. Chosen by the walks of four people
(docs/learning.md)."""

PREDICTED: Final[Accuracies] = {
    "angles": {
        **dict.fromkeys(JOINT_ANGLES, 1.0),
        "hip_adduction": 1.5,
        "hip_rotation": 4.0,
        "subtalar_angle": 4.0,
    },
    "moments": dict.fromkeys(JOINT_MOMENTS, 0.03),
    "forces": {"vertical": 1.5, "forward": 0.5, "medial": 0.4},
}
"""The same of curves that are predicted for another speed: about three quarters of how far such
predictions of trials near in speed are off, so that a walk gives up the same share of each
(docs/what-we-tried.md)."""


@dataclass(frozen=True)
class Walked:
    """A walk beside its reference.

    Attributes
    ----------
    deviations : (n,) of the mean fitted curves, over `accuracies`; their sum of squares counts
        `CORRECTION.independent` for a curve that is off by its accuracy throughout.
    rmse : by (kind, curve), in the units of `metrics.curve_results.CURVE_UNITS`; also of curves
        that are not fitted, the pelvis's angles.
    """

    deviations: Array
    rmse: Mapping[tuple[Kind, str], float]
    accuracies: Accuracies = field(default_factory=lambda: ACCURACY)

    def error(self) -> float:
        """Root mean square over the fitted curves of error / accuracy."""
        squares = [
            (self.rmse[key] / accuracy_of(*key, self.accuracies)) ** 2
            for key in self.rmse
            if fitted(*key)
        ]
        return float(np.sqrt(np.mean(squares)))

    def left_out(self) -> float:
        """RMS error of the curves that are not fitted, degrees."""
        return float(np.sqrt(np.mean([v**2 for key, v in self.rmse.items() if not fitted(*key)])))


def fitted(kind: str, curve: str) -> bool:
    """Whether the correction fits a `curve` (with its side, such as `knee_angle_r`) of a `kind`
    (`angles`, `moments` or `forces`); the others only show whether it does harm.
    """
    return curve[:-2] in ACCURACY[kind]


def accuracy_of(kind: str, curve: str, accuracies: Accuracies = ACCURACY) -> float:
    """Error of weight 1 of a `fitted` curve (`kind`, `curve`) by `accuracies`, in the units of
    `CURVE_UNITS`.
    """
    return accuracies[kind][curve[:-2]]
