"""One recorded stride as a periodic curve.

A stride does not end where it began, and a prosthetic ankle jumps. Both are kept as errors that are
reported, and neither is refused. The rule: half of what the stride's ends differ by is taken from
either end, and linearly less towards the middle; the rest is the Fourier series of the fewest
harmonics, at most `MOST_HARMONICS`, whose root-mean-square error is within `TOLERANCE`. A person's
means over many strides need no more than that (Winter 2009, chapter 3: 99.7 % of the power of
markers in walking is below 6 Hz, which is the sixth to ninth harmonic of a stride).
"""

from typing import Final, NamedTuple

import numpy as np
from scipy.optimize import minimize_scalar

from gaitval.apps.patients.estimates import EstimatedValue
from gaitval.arrays import Array
from gaitval.gait.record import FittedCurve, PeriodicCurve, periodic_through
from gaitval.gait.sampling import SAMPLES

MOST_HARMONICS: Final = 12
TOLERANCE: Final = float(np.radians(0.4))
"""rad, RMS; markers repeat to 2-5 degrees between sessions (McGinley 2009)."""

LEFT_PHASE: Final = (0.25, 0.75)
"""Within which the left heel strikes: half of what `subjects.plausible` lets pass, for the shape of
a pelvis repeats every half stride."""
STRIKE_PRIOR: Final = EstimatedValue(0.5, 0.05, "steps of equal time")
"""Phase of left heel strike before the pelvis is looked at: steps may be as unequal as 40 to 60
without being unlikely."""
_POINTS: Final = np.arange(SAMPLES - 1) / (SAMPLES - 1)


class Smoothed(NamedTuple):
    """A periodic curve, and how far from the stride it is, in the unit of the stride.

    Attributes
    ----------
    curve : its `residual` is the largest difference from a sample.
    closure : by how much the stride's end is above its beginning.
    rms : root-mean-square difference from all samples.
    """

    curve: FittedCurve
    closure: float
    rms: float


def smoothed(values: Array) -> Smoothed:
    """The periodic curve of one stride, `values` (101,) rad at 0 to 100 % of it."""
    phase = np.arange(SAMPLES) / (SAMPLES - 1)
    closure = float(values[-1] - values[0])
    closed = values - closure * (phase - 0.5)
    for harmonics in range(1, MOST_HARMONICS + 1):
        curve = periodic_through(closed[:-1], harmonics)
        if np.sqrt(np.mean((curve(phase) - closed) ** 2)) <= TOLERANCE:
            break
    error = curve(phase) - values
    stored = FittedCurve.fitted((curve, float(np.abs(error).max())))
    return Smoothed(stored, closure, float(np.sqrt(np.mean(error**2))))


class LeftStrike(NamedTuple):
    """When the left heel strikes, and how well that is known.

    Attributes
    ----------
    phase : of the right cycle.
    sd : standard deviation of it.
    mismatch : rad, root-mean-square difference of the worst pelvis curve of the two sides then.
    """

    phase: float
    sd: float
    mismatch: float


def left_strike(angles: dict[str, PeriodicCurve], prior: EstimatedValue) -> LeftStrike:
    """Phase of the right cycle at left heel strike, from both sides' curves of the one pelvis:
    `angles` rad, `pelvis_tilt_r` and the others of the pelvis.

    As `left_phase` of `gaitval.subjects`, but of single strides, which may be of two trials, and of
    people whose steps are unequal: the shift with the least sum of squares in `LEFT_PHASE`, with
    what is known beforehand as a `prior`. A pelvis that hardly moves leaves the prior.
    """

    def differences(shift: float) -> Array:
        found = []
        for name, sign in (("tilt", 1), ("list", -1), ("rotation", -1)):
            right, left = angles[f"pelvis_{name}_r"], angles[f"pelvis_{name}_l"]
            own = right(_POINTS) - right.mean
            found.append(own - sign * (left(_POINTS - shift) - left.mean))
        return np.array(found)

    grid = np.arange(LEFT_PHASE[0], LEFT_PHASE[1], 0.01)
    # Two strides differ by this much however they are shifted, and curves have about eight
    # independent values each.
    noise = max(min(float(np.mean(differences(each) ** 2)) for each in grid), np.radians(0.3) ** 2)
    independent = 8.0

    def cost(shift: float) -> float:
        misfit = independent * float(np.sum(np.mean(differences(shift) ** 2, axis=1))) / noise
        return float(misfit + ((shift - prior.value) / prior.sd) ** 2)

    start = min(grid, key=cost)
    best = minimize_scalar(cost, bounds=(start - 0.01, start + 0.01), method="bounded")
    phase, step = float(best.x), 0.01
    bend = (cost(phase + step) - 2.0 * cost(phase) + cost(phase - step)) / step**2
    sd = float(np.sqrt(2.0 / bend)) if bend > 2.0 / prior.sd**2 else prior.sd
    worst = float(np.sqrt(np.mean(differences(phase) ** 2, axis=1)).max())
    return LeftStrike(phase, sd, worst)
