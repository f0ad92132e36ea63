"""What of a person was not recorded, estimated with an interval.

An `EstimatedValue` is a value with the standard deviation of what it may be off by; one that was
measured has a standard deviation of 0. Intervals are 90 %.
"""

from collections.abc import Mapping
from typing import Final, NamedTuple

import numpy as np

from gaitval.constants import GRAVITY
from gaitval.coordinates import Side
from gaitval.scaling.stature import mean_lengths
from gaitval.session.measurement.sources import NINETY

LEG_SD: Final = 0.036
"""Of a leg's length from stature, as a share: thigh and shank of the ten built-in people
(`scaling.stature`)."""
LEG_LENGTH_ERROR: Final = 0.006
"""m, SD of a leg length by tape from ASIS to malleolus or trochanter to floor (Sabharwal & Kumar
2008, Clin Orthop Relat Res 466:2910, from memory: 5 to 10 mm against radiographs). A difference of
two has this times the square root of two."""

WALK: Final = (1.212, -0.737, 0.132)
"""Logarithm of stride time over sqrt(leg / g): at a stride of 1.5 legs, its slope on the logarithm
of stride length over leg, and the standard deviation about this line between people: the 21 people
of odd number in WBDS at eight speeds (Fukuchi et al. 2018). It says what a walk ratio says (Sekiya
& Nagasaki 1998, Gait Posture 7:225), but without a dimension."""
STRIDE_OF_LINE: Final = 1.5
FREE_STRIDE: Final = 1.45
"""Stride length over leg of healthy adults at their own speed (the same source, over ground). A
patient's stride that is shorter is taken to be so at the stride time of this one: in Parkinson's
disease stride length is what is lost, and cadence is kept (Morris et al. 1994, Brain 117:1169)."""
PATIENT_SD: Final = 0.15
"""Standard deviation of the logarithm of a patient's stride time about that; our judgement."""


class EstimatedValue(NamedTuple):
    """A value that was measured (`sd` 0) or estimated; `how` in words."""

    value: float
    sd: float
    how: str

    def interval(self) -> tuple[float, float]:
        """90 %."""
        return self.value - NINETY * self.sd, self.value + NINETY * self.sd


def leg_length(height: EstimatedValue, measured: float | None) -> EstimatedValue:
    """Hip to floor, m, as `measured` or by the stature `height`, m."""
    if measured is not None:
        return EstimatedValue(measured, 0.0, "recorded")
    mean = mean_lengths(height.value)["hip_height"]
    share = float(np.hypot(LEG_SD, height.sd / height.value))
    return EstimatedValue(mean, share * mean, "of stature, as in WBDS")


def stride_time(stride_length: float, leg: float, *, patient: bool) -> EstimatedValue:
    """Stride time, s, of a stride of a length (m) on a leg (m)."""
    at, slope, sd = WALK
    of_legs = stride_length / leg
    if patient:
        of_legs, sd = max(of_legs, FREE_STRIDE), PATIENT_SD
    time = np.exp(at + slope * np.log(of_legs / STRIDE_OF_LINE))
    value = float(time * np.sqrt(leg / GRAVITY))
    how = "the walk ratio of healthy adults"
    return EstimatedValue(
        value, value * sd, f"{how}, short strides at the cadence of free ones" if patient else how
    )


class Pace(NamedTuple):
    """Speed (m/s), stride time (s) and stride length (m) of a walk."""

    speed: EstimatedValue
    stride_time: EstimatedValue
    stride_length: EstimatedValue


def pace(
    stride_length: EstimatedValue, leg: EstimatedValue, speed: float | None, *, patient: bool
) -> Pace:
    """Speed and stride time of a walk whose stride has an estimated length (`stride_length` m, with
    the error that the leg's length makes) of a person whose `leg` is known in m.

    Where the `speed` m/s was recorded, stride time is length over speed. Otherwise (None) the walk
    ratio gives stride time; it is less certain of a `patient`.
    """
    share = stride_length.sd / stride_length.value
    if speed is not None:
        time = stride_length.value / speed
        return Pace(
            EstimatedValue(speed, 0.0, "recorded"),
            EstimatedValue(time, time * share, "stride length of the rolling foot, by the speed"),
            stride_length,
        )
    time_of = stride_time(stride_length.value, leg.value, patient=patient)
    # Short strides of patients have the cadence of free ones, whatever their length.
    short = patient and stride_length.value / leg.value < FREE_STRIDE
    slope = 0.0 if short else WALK[1]
    # The line's own error and, through its slope, that of the stride length.
    own = time_of.sd / time_of.value
    value = stride_length.value / time_of.value
    return Pace(
        EstimatedValue(
            value,
            value * float(np.hypot(own, (1.0 - slope) * share)),
            "stride length of the rolling foot, by the stride time",
        ),
        EstimatedValue(
            time_of.value, time_of.value * float(np.hypot(own, slope * share)), time_of.how
        ),
        stride_length,
    )


def leg_difference(legs: Mapping[Side, float]) -> EstimatedValue:
    """Right leg less left leg, m, with its error, where both were measured."""
    sd = LEG_LENGTH_ERROR * float(np.sqrt(2.0))
    return EstimatedValue(legs["right"] - legs["left"], sd, "both legs measured")
