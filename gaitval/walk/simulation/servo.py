"""Stiffness of the joint servos, and tables of the reference that they follow; see `walker`."""

from dataclasses import dataclass
from typing import Final, NamedTuple

import numpy as np

from gaitval.arrays import Array
from gaitval.configuration import ServoSettings
from gaitval.coordinates import ACTUATED, ROOT
from gaitval.walk.reference.motion import ReferenceMotion


@dataclass(frozen=True)
class ServoConstants:
    """How joints follow their targets."""

    reference_mass: float = 70.0
    """kg, mass of the body to which the gains in `configuration.ServoSettings` apply."""
    feed_forward_hz: float = 10.0
    """Frequency at which half of a moment is fed forward: as recorded moments are filtered. What a
    fit has above it is the landing of its feet, which no muscle can know before."""
    target_lag: float = 0.002
    """s, by which what the servos ask for is behind the state that their springs and dampers, which
    are implicit, act on. It was one physics step, of the default's length: so a finer step made
    another walker, and a third of what a walk changed at a quarter of the step came from it."""


SERVO: Final = ServoConstants()


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
    a body of `SERVO.reference_mass`.
    """
    gains = [getattr(servo, _SERVO_OF[name.split("_")[0]]) for name in ACTUATED]
    return np.array(gains, dtype=float) * mass / SERVO.reference_mass


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


def _as_muscles_give(moments: Array, stride_time: float) -> Array:
    """`moments` (N, …) of a cycle of `stride_time` s without what is far above
    `SERVO.feed_forward_hz`: as a Butterworth filter of the fourth order does it, forward and
    backward.
    """
    spectrum = np.fft.rfft(moments, axis=0)
    frequency = np.arange(len(spectrum)) / stride_time
    gain = 1.0 / (1.0 + (frequency / SERVO.feed_forward_hz) ** 8)
    spectrum *= gain.reshape(-1, *(1,) * (moments.ndim - 1))
    return np.fft.irfft(spectrum, len(moments), axis=0)


def _later(values: Array, share: float) -> Array:
    """`values` (N, …) of a cycle, a `share` of the cycle later."""
    spectrum = np.fft.rfft(values, axis=0)
    turn = np.exp(-2j * np.pi * share * np.arange(len(spectrum)))
    spectrum *= turn.reshape(-1, *(1,) * (values.ndim - 1))
    return np.fft.irfft(spectrum, len(values), axis=0)


def reference_tables(
    reference: ReferenceMotion, feed_forward: float, step: float = SERVO.target_lag
) -> ReferenceTables:
    """Tables of a reference motion; the moments, below `SERVO.feed_forward_hz`, are weighted with
    `feed_forward`. An engine whose `step` (s) is another than `SERVO.target_lag` reads them once a
    step, one step before the state that it reaches, so they are later by what is left of the lag.
    """
    actuated = slice(len(ROOT), None)
    values = (
        reference.positions[:, actuated],
        reference.velocities[:, actuated],
        feed_forward * _as_muscles_give(reference.moments, reference.stride_time),
    )
    late = (SERVO.target_lag - step) / reference.stride_time
    # Not by nothing: the usual tables are the reference's own numbers.
    return ReferenceTables(*(closed_cycle(_later(each, late) if late else each) for each in values))
