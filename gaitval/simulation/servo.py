"""Stiffness of the joint servos, and tables of the reference that they follow; see `walker`."""

from typing import NamedTuple

import numpy as np

from gaitval.arrays import Array
from gaitval.configuration import ServoSettings
from gaitval.coordinates import ACTUATED, ROOT
from gaitval.reference.motion import ReferenceMotion

REFERENCE_MASS = 70.0
"""kg, mass of the body to which the gains in `configuration.ServoSettings` apply."""

_SERVO_OF = {
    "hip": "hip",
    "knee": "knee",
    "ankle": "ankle",
    "subtalar": "subtalar",
    "mtp": "toe",
    "lumbar": "lumbar",
    "arm": "shoulder",
    "elbow": "shoulder",
}


def servo_stiffness(servo: ServoSettings, mass: float) -> Array:
    """Stiffness (25,) Nm/rad of the joint servos of a body of `mass` kg, from the gains `servo` of
    a body of `REFERENCE_MASS`.
    """
    gains = [getattr(servo, _SERVO_OF[name.split("_")[0]]) for name in ACTUATED]
    return np.array(gains, dtype=float) * mass / REFERENCE_MASS


class ReferenceTables(NamedTuple):
    """Reference of the actuated coordinates, sampled over one cycle, with the first sample repeated
    at the end: (N + 1, 25) positions rad, velocities rad/s, moments Nm.
    """

    positions: Array
    velocities: Array
    moments: Array


def closed_cycle(values: Array) -> Array:
    """`values` (N, …) of one cycle with the first repeated at the end, contiguous."""
    return np.ascontiguousarray(np.concatenate([values, values[:1]]))


FEED_FORWARD_HZ = 10.0
"""Frequency at which half of a moment is fed forward: as recorded moments are filtered. What a fit
has above it is the landing of its feet, which no muscle can know before."""


def _as_muscles_give(moments: Array, stride_time: float) -> Array:
    """`moments` (N, …) of a cycle of `stride_time` s without what is far above `FEED_FORWARD_HZ`:
    as a Butterworth filter of the fourth order does it, forward and backward.
    """
    spectrum = np.fft.rfft(moments, axis=0)
    frequency = np.arange(len(spectrum)) / stride_time
    gain = 1.0 / (1.0 + (frequency / FEED_FORWARD_HZ) ** 8)
    spectrum *= gain.reshape(-1, *(1,) * (moments.ndim - 1))
    return np.fft.irfft(spectrum, len(moments), axis=0)


def reference_tables(reference: ReferenceMotion, feed_forward: float) -> ReferenceTables:
    """Tables of a reference motion; the moments, below `FEED_FORWARD_HZ`, are weighted with
    `feed_forward`.
    """
    actuated = slice(len(ROOT), None)
    moments = _as_muscles_give(reference.moments, reference.stride_time)
    return ReferenceTables(
        closed_cycle(reference.positions[:, actuated]),
        closed_cycle(reference.velocities[:, actuated]),
        closed_cycle(feed_forward * moments),
    )
