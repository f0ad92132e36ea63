"""Small changes of a reference motion (found by `correction.correct`)."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from gaitval.arrays import Array
from gaitval.coordinates import COORDINATES, LUMBAR
from gaitval.errors import ArtefactError
from gaitval.model.body import BodyModel
from gaitval.walk.reference.motion import ReferenceMotion, moved

_LEGS = ("hip_flexion", "hip_adduction", "hip_rotation", "knee_angle", "ankle_angle")
JOINTS = (*(f"{name}_{side}" for name in _LEGS for side in "rl"), *LUMBAR)
"""Coordinates that are changed. Those of the trunk were not recorded, but its lean affects the hip
moments."""


@dataclass(frozen=True)
class Adjustment:
    """Change of a reference motion.

    Attributes
    ----------
    harmonics : (13, 1 + 2 H) rad, of `JOINTS` over the right gait cycle: mean, H cosines, H sines.
    height : m, of the pelvis.
    """

    harmonics: Array
    height: float

    def angles(self, phase: Array) -> tuple[Array, Array]:
        """Change (N, 13) rad of the angles at each `phase` (N,), and its slope d/dphase."""
        order = 2.0 * np.pi * np.arange(1, (self.harmonics.shape[1] - 1) // 2 + 1)
        cosines, sines = np.cos(np.outer(phase, order)), np.sin(np.outer(phase, order))
        constant = np.ones((len(phase), 1))
        series = np.hstack([constant, cosines, sines])
        slopes = np.hstack([0.0 * constant, -order * sines, order * cosines])
        return series @ self.harmonics.T, slopes @ self.harmonics.T

    def largest(self) -> float:
        """The largest change of an angle, rad."""
        return float(np.abs(self.angles(np.linspace(0.0, 1.0, 200))[0]).max())

    def as_dict(self) -> dict[str, Any]:
        """The fields by name, to be written as JSON."""
        return {"joints": list(JOINTS), "harmonics": self.harmonics.tolist(), "height": self.height}

    @classmethod
    def from_dict(cls, values: Mapping[str, Any], origin: str) -> "Adjustment":
        """Read the `values` that `as_dict` gave; for others raises ArtefactError, which names
        `origin`.
        """
        try:
            harmonics, height = np.array(values["harmonics"], dtype=float), float(values["height"])
            fits = values["joints"] == list(JOINTS) and harmonics.shape[1] % 2 == 1
            fits = fits and harmonics.shape[0] == len(JOINTS) and harmonics.ndim == 2
        except (KeyError, TypeError, ValueError, IndexError):
            fits = False
        if not fits or not np.isfinite([*harmonics.ravel(), height]).all():
            raise ArtefactError(
                f"{origin}: not a correction of the {len(JOINTS)} angles that this version "
                "corrects. It is damaged or from another version of gaitval; run "
                "`gaitval stage correct SUBJECT` again."
            )
        return cls(harmonics, height)


def adjusted(
    reference: ReferenceMotion, model: BodyModel, correction: Adjustment
) -> ReferenceMotion:
    """The `reference` with its angles and height changed by a `correction`; forces and moments are
    unchanged. Centre of mass and end effectors follow on `model`, the body that it was made for.
    """
    change, slope = correction.angles(reference.phase)
    positions, velocities = reference.positions.copy(), reference.velocities.copy()
    columns = [COORDINATES.index(name) for name in JOINTS]
    positions[:, columns] += change
    # The slope is by phase; one cycle of phase takes a stride time.
    velocities[:, columns] += slope / reference.stride_time
    positions[:, COORDINATES.index("pelvis_tz")] += correction.height
    return moved(reference, model, positions, velocities)
