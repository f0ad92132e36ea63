"""The recorded gait of a subject as periodic curves.

All curves are in the project's convention (REP-103 axes, SI units, radians): angles and moments
have the coordinate's name, and a moment is positive if it would increase its coordinate. Each
side's curves run over that side's own gait cycle, phase 0 = its heel strike.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import lru_cache
from typing import Annotated, Final, Literal, Self

import numpy as np
from numpy.typing import ArrayLike, NDArray
from pydantic import BaseModel, ConfigDict, Field, Strict, model_validator

from gaitval.arrays import Array
from gaitval.coordinates import Side

Origin = Literal["recorded", "predicted", "mirrored", "expected"]
"""Source of the values that a walk is compared with. Only *recorded* ones may be judged.
*Predicted* ones are for a speed or quantity that nobody recorded, from gaitval or from the gait of
other people. *Mirrored* is a side that the user asked to fill in with the other one. *Expected* is
a side that a subject lacks, for which the walker is asked to be symmetric."""

OneSide = dict[Literal["angles", "kinetics"], Side]
"""A side of the angles, and one of moments and forces."""

Mirrored = OneSide
"""The side that was not recorded, of the angles and of moments and forces: its curves are those of
the other side, mirrored."""

_JOINT_ANGLES = (
    "hip_flexion",
    "hip_adduction",
    "hip_rotation",
    "knee_angle",
    "knee_adduction",
    "knee_rotation",
    "ankle_angle",
    "subtalar_angle",
    "ankle_rotation",
)
_SEGMENT_ANGLES = (
    "pelvis_tilt",
    "pelvis_list",
    "pelvis_rotation",
    "foot_pitch",
    "foot_list",
    "foot_progression",
)

ANGLE_NAMES = tuple(
    f"{name}_{side}" for side in "rl" for name in (*_JOINT_ANGLES, *_SEGMENT_ANGLES)
)
"""Keys of `GaitRecord.angles`; only `REQUIRED_ANGLES` are always there."""

RECORDED_ANGLES = (
    "hip_flexion",
    "hip_adduction",
    "hip_rotation",
    "knee_angle",
    "ankle_angle",
    "subtalar_angle",
)
"""The angles of a leg that the model has a coordinate for."""

REQUIRED_ANGLES = tuple(
    f"{name}_{side}"
    for side in "rl"
    for name in (*RECORDED_ANGLES, "pelvis_tilt", "pelvis_list", "pelvis_rotation")
)
"""The angles that every record has: those of the coordinates of the model."""

MOMENT_NAMES = tuple(f"{name}_{side}" for side in "rl" for name in _JOINT_ANGLES)
"""Keys of `GaitRecord.moments`."""

REQUIRED_MOMENTS = tuple(
    f"{name}_{side}"
    for side in "rl"
    for name in ("hip_flexion", "hip_adduction", "knee_angle", "ankle_angle")
)
"""The moments that every record with kinetics has: those that walks are compared with."""


@dataclass(frozen=True)
class HarmonicSettings:
    """How a mean curve becomes a Fourier series."""

    harmonics_cap: int = 40
    """Most harmonics that `fit_periodic` tries; rows 1 % of the cycle apart resolve fewer than
    50."""
    roughness: float = 1e-6
    """Weight of Σ k⁴(cosine² + sine²) beside the sum of squared residuals in `fit_periodic`.

    It matters only where samples are missing (moments around the seam, forces in swing): there it
    keeps every force below 5 body weights, instead of 100, and changes the number of harmonics of a
    fit by at most three.
    """
    few: int = 1000
    """Most phases whose cosines and sines are kept: the many curves of a record are asked for the
    same ones, and cosines and sines are nearly all of the work."""


HARMONICS: Final = HarmonicSettings()


@dataclass(frozen=True)
class PeriodicCurve:
    """A truncated Fourier series f(φ) = mean + Σ_k cosine_k cos 2πkφ + sine_k sin 2πkφ.

    Periodic to machine precision; φ is the phase, one unit per gait cycle.
    """

    mean: float
    cosine: tuple[float, ...]
    sine: tuple[float, ...]

    def __call__(self, phase: ArrayLike) -> NDArray[np.float64]:
        """Value at `phase` (any shape)."""
        cosines, sines = _waves(phase, len(self.cosine))
        return np.asarray(self.mean + cosines @ np.array(self.cosine) + sines @ np.array(self.sine))

    def derivative(self, phase: ArrayLike) -> NDArray[np.float64]:
        """d f / d φ at `phase`; divide by the stride time for a rate in time."""
        cosines, sines = _waves(phase, len(self.cosine))
        k = 2 * np.pi * np.arange(1, len(self.cosine) + 1)
        return np.asarray(cosines @ (k * np.array(self.sine)) - sines @ (k * np.array(self.cosine)))


def _waves(phase: ArrayLike, harmonics: int) -> tuple[Array, Array]:
    """Cosines and sines (…, H) of 2πkφ at `phase` (…) for k = 1 to H, the number of `harmonics`."""
    at, most = np.asarray(phase, dtype=float), max(harmonics, HARMONICS.harmonics_cap)
    find = _kept_waves if at.size <= HARMONICS.few else _kept_waves.__wrapped__
    cosines, sines = (each[:, :harmonics] for each in find(at.tobytes(), most))
    return cosines.reshape(*at.shape, harmonics), sines.reshape(*at.shape, harmonics)


@lru_cache(maxsize=16)
def _kept_waves(phase: bytes, harmonics: int) -> tuple[Array, Array]:
    angles = np.multiply.outer(2 * np.pi * np.frombuffer(phase), np.arange(1, harmonics + 1))
    found = np.cos(angles), np.sin(angles)
    for each in found:
        each.flags.writeable = False
    return found


def periodic_through(samples: Array, harmonics: int) -> PeriodicCurve:
    """The Fourier series of one cycle of `samples` (N,), equally spaced, without its end, cut after
    its first `harmonics`, less than N / 2; in their unit.
    """
    # rfft sums f e^(−2πikφ), so a cosine coefficient is twice the real part, and a sine coefficient
    # minus twice the imaginary one.
    spectrum = np.fft.rfft(samples) / len(samples)
    return PeriodicCurve(
        mean=float(spectrum[0].real),
        cosine=tuple((2 * spectrum[1 : harmonics + 1].real).tolist()),
        sine=tuple((-2 * spectrum[1 : harmonics + 1].imag).tolist()),
    )


def weighted_sum(curves: Sequence[PeriodicCurve], weights: Sequence[float]) -> PeriodicCurve:
    """The sum of `curves`, each times one of `weights`, with as many harmonics as the longest."""
    terms = max(len(curve.cosine) for curve in curves)
    total = np.zeros((2, terms))
    for curve, weight in zip(curves, weights, strict=True):
        for row, part in zip(total, (curve.cosine, curve.sine), strict=True):
            row[: len(part)] += weight * np.asarray(part)
    mean = sum(weight * curve.mean for curve, weight in zip(curves, weights, strict=True))
    return PeriodicCurve(float(mean), tuple(total[0].tolist()), tuple(total[1].tolist()))


def fit_periodic(
    phase: ArrayLike, values: ArrayLike, tolerance: float
) -> tuple[PeriodicCurve, float]:
    """The shortest Fourier series that passes every one of `values` (n,) at `phase` (n,) in 0…1
    within `tolerance`, and its largest absolute residual, all in one unit; that exceeds the
    tolerance where `HARMONICS.harmonics_cap` harmonics are not enough.

    Samples at phase 0 and 1 are the same instant, one cycle apart. Each gets half the weight, so
    the curve passes through their mean and the residual contains their difference. Parts of the
    cycle may be left out; there the curve is the smoothest continuation (`HARMONICS.roughness`),
    not a measurement.
    """
    phase = np.asarray(phase, dtype=float)
    values = np.asarray(values, dtype=float)
    # √½, because residuals are multiplied by it before they are squared.
    weight = np.where((phase == 0) | (phase == 1), np.sqrt(0.5), 1.0)
    curve, residual = PeriodicCurve(float(values.mean()), (), ()), np.inf
    # From few to many: the shortest series that is close enough follows noise least.
    for harmonics in range(1, HARMONICS.harmonics_cap + 1):
        order = np.arange(1, harmonics + 1)
        angles = 2 * np.pi * np.outer(phase, order)
        design = np.hstack([np.ones((len(phase), 1)), np.cos(angles), np.sin(angles)])
        # Extra rows of the least-squares problem, one for each coefficient: their squares add
        # `HARMONICS.roughness` Σ k⁴ (cosine² + sine²). The mean is free.
        roughness = np.sqrt(HARMONICS.roughness) * np.diag(
            np.concatenate([[0], order**2, order**2])
        )
        coefficients = np.linalg.lstsq(
            np.vstack([design * weight[:, None], roughness]),
            np.concatenate([values * weight, np.zeros(len(roughness))]),
            rcond=None,
        )[0]
        curve = PeriodicCurve(
            float(coefficients[0]),
            tuple(coefficients[1 : harmonics + 1].tolist()),
            tuple(coefficients[harmonics + 1 :].tolist()),
        )
        residual = float(np.abs(design @ coefficients - values).max())
        if residual <= tolerance:
            break
    return curve, residual


@dataclass(frozen=True)
class LowPass:
    """Cut-offs of the zero-lag fourth-order Butterworth filter on joint moments and on the ground
    reaction, Hz.
    """

    moments_hz: float
    forces_hz: float


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
        `foot_progression_r` (toes towards the midline +); the same with `_l`. `ANGLE_NAMES`; knee
        adduction and rotation, ankle rotation and the foot's angles may be absent.
    moments : Nm/kg, internal joint moments. Keys: the hip's, knee's and ankle's as above,
        `MOMENT_NAMES`. The source does not state the axes of the frontal and transverse ones (its
        transverse ankle moment suggests the foot's): compare with care.
    forces : body weights; `forces["right"]` contains the three curves of the ground reaction on
        that foot in world axes: forward, left, up. They are fitted to stance only and are
        meaningless in swing: evaluate them with `ground_reaction`, which is zero there.
    low_pass : filters applied to moments and forces before they were averaged; None if not known.
    steps : None if they were not measured.
    """

    speed: float
    stride_time: float
    left_phase: float
    stance_fraction: Mapping[Side, float]
    angles: Mapping[str, PeriodicCurve]
    moments: Mapping[str, PeriodicCurve]
    forces: Mapping[Side, tuple[PeriodicCurve, PeriodicCurve, PeriodicCurve]]
    low_pass: LowPass | None = None
    steps: "MeanSteps | None" = None

    def ground_reaction(self, side: Side, phase: ArrayLike) -> Array:
        """Ground reaction on one foot, body weights, shape (*phase.shape, 3), world axes.

        `phase` is that side's own phase.
        """
        phase = np.asarray(phase, dtype=float)
        force = np.stack([curve(phase) for curve in self.forces[side]], axis=-1)
        swing = np.mod(phase, 1.0) > self.stance_fraction[side]
        force[swing] = 0.0
        return force


FiniteNumber = Annotated[float, Strict(), Field(allow_inf_nan=False)]


class StoredPart(BaseModel):
    """A part of a stored subject: fixed, with no unknown keys."""

    model_config = ConfigDict(frozen=True, extra="forbid", use_attribute_docstrings=True)


class FittedCurve(StoredPart):
    """A fitted mean curve; see `PeriodicCurve` and `fit_periodic`."""

    mean: FiniteNumber
    cosine: tuple[FiniteNumber, ...]
    sine: tuple[FiniteNumber, ...]
    residual: FiniteNumber
    """Largest absolute difference from the samples it was fitted to, in the curve's unit."""

    @model_validator(mode="after")
    def _same_length(self) -> Self:
        if len(self.cosine) != len(self.sine):
            raise ValueError(
                f"{len(self.cosine)} cosine but {len(self.sine)} sine coefficients; give one of "
                "each for every harmonic."
            )
        return self

    @classmethod
    def fitted(cls, fit: tuple[PeriodicCurve, float]) -> Self:
        """From the result of `fit_periodic`."""
        curve, residual = fit
        return cls(mean=curve.mean, cosine=curve.cosine, sine=curve.sine, residual=residual)

    def periodic(self) -> PeriodicCurve:
        """The curve as a function of phase."""
        return PeriodicCurve(self.mean, self.cosine, self.sine)


class MeanSteps(StoredPart):
    """Mean length of the steps that end with each foot's heel strike, and their width, m."""

    right: FiniteNumber
    left: FiniteNumber
    width: FiniteNumber


class Force(StoredPart):
    """Ground reaction on one foot, body weights, world axes; stance only."""

    forward: FittedCurve
    left: FittedCurve
    up: FittedCurve
