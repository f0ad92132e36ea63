"""The recorded gait of a subject as periodic curves.

All curves are in the project's convention (REP-103 axes, SI units, radians): angles and
moments by the coordinate's name, a moment positive where it would increase its coordinate.
Each side's curves run over that side's own gait cycle, phase 0 = its heel strike.
"""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from gaitval.coordinates import Side

Curve = NDArray[np.float64]


@dataclass(frozen=True)
class PeriodicCurve:
    """A truncated Fourier series f(φ) = mean + Σ_k cosine_k cos 2πkφ + sine_k sin 2πkφ.

    Periodic to machine precision; φ is the phase, one unit a gait cycle.
    """

    mean: float
    cosine: tuple[float, ...]
    sine: tuple[float, ...]

    def _angles(self, phase: ArrayLike) -> NDArray[np.float64]:
        harmonics = np.arange(1, len(self.cosine) + 1)
        return np.multiply.outer(2 * np.pi * np.asarray(phase, dtype=float), harmonics)

    def __call__(self, phase: ArrayLike) -> NDArray[np.float64]:
        """Value at `phase` (any shape)."""
        angles = self._angles(phase)
        return np.asarray(
            self.mean + np.cos(angles) @ np.array(self.cosine) + np.sin(angles) @ np.array(self.sine)
        )

    def derivative(self, phase: ArrayLike) -> NDArray[np.float64]:
        """d f / d φ at `phase`; divide by the stride time for a rate in time."""
        angles = self._angles(phase)
        k = 2 * np.pi * np.arange(1, len(self.cosine) + 1)
        return np.asarray(
            np.cos(angles) @ (k * np.array(self.sine)) - np.sin(angles) @ (k * np.array(self.cosine))
        )


@dataclass(frozen=True)
class GaitRecord:
    """Mean gait of one subject in one trial.

    Attributes
    ----------
    speed : m/s, mean forward speed.
    stride_time : s.
    left_phase : phase of the right cycle at which the left heel strikes (about 0.5).
    stance_fraction : of each side's own cycle, from the vertical force.
    angles : rad. Keys: `hip_flexion_r`, `hip_adduction_r`, `hip_rotation_r`, `knee_angle_r`,
        `knee_adduction_r`, `knee_rotation_r`, `ankle_angle_r`, `subtalar_angle_r`,
        `ankle_rotation_r`, `pelvis_tilt_r` (anterior tilt +), `pelvis_list_r` (own side up +),
        `pelvis_rotation_r` (own side forward +), `foot_pitch_r` (toes up +), `foot_list_r`,
        `foot_progression_r`; the same with `_l`.
    moments : Nm/kg, internal joint moments. Keys: the hip's, knee's and ankle's as above.
    forces : body weights; `forces["right"]` holds the three curves of the ground reaction on
        that foot in world axes: forward, left, up. Evaluate through `ground_reaction`, which
        is zero in swing.
    """

    speed: float
    stride_time: float
    left_phase: float
    stance_fraction: Mapping[Side, float]
    angles: Mapping[str, PeriodicCurve]
    moments: Mapping[str, PeriodicCurve]
    forces: Mapping[Side, tuple[PeriodicCurve, PeriodicCurve, PeriodicCurve]]

    def ground_reaction(self, side: Side, phase: ArrayLike) -> Curve:
        """Ground reaction on one foot, body weights, shape (*phase.shape, 3), world axes.

        `phase` is that side's own phase.
        """
        phase = np.asarray(phase, dtype=float)
        force = np.stack([curve(phase) for curve in self.forces[side]], axis=-1)
        swing = np.mod(phase, 1.0) > self.stance_fraction[side]
        force[swing] = 0.0
        return force
