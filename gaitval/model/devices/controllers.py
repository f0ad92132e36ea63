"""Controllers of a device's motors.

A controller is anything with a method `torque(measured)`, which gets what the device's own sensors
measure (`Measured`) and gives the torque in Nm that its motor is asked for. Those here are also
tables of a device's file:

    controller = { kind = "phase_spline", bumps = [[0.52, 0.26, 0.10, -40.0]] }
"""

import math
from dataclasses import dataclass
from typing import Annotated, Literal, Protocol

import numpy as np
from pydantic import Field, model_validator

from gaitval.coordinates import Side
from gaitval.model.devices.tables import Angle, Table

STANDARD_GRAVITY = 9.80665


@dataclass
class Measured:
    """What a device's sensors measure at a hinge.

    Attributes
    ----------
    time : s, since the device was switched on.
    side : of the body.
    phase : of this side's gait cycle from heel strike, 0 to 1, as the device estimates it from its
        foot switch; NaN until it has seen a heel strike.
    stride_time : s, estimated likewise.
    loaded : whether the foot switch is closed.
    angle, speed : rad and rad/s, of the device's hinge (which straps let differ from the joint).
    torque : Nm, that the device exerts on the limb.
    moment : Nm, of the wearer's own muscles at the joint, as electromyography would estimate it.
    inclination : rad, of the segment below the hinge, or of the trunk, from the vertical, forward
        positive, as an inertial sensor measures it.
    forward : 1 where a larger coordinate inclines that segment forward, -1 at a knee and where it
        extends the trunk.
    mass : kg, of the wearer, which the device is set to.
    """

    time: float
    side: Side
    phase: float
    stride_time: float
    loaded: bool
    angle: float
    speed: float
    torque: float
    moment: float
    inclination: float
    forward: float
    mass: float


class Controller(Protocol):
    """What decides the torque of a motor."""

    def torque(self, measured: Measured) -> float:
        """Nm, that the motor is asked for; positive raises the joint's coordinate."""
        ...


class _Controller(Table):
    @property
    def largest(self) -> float | None:
        """Nm, the largest torque that it can ask for; None if that depends on the walk."""
        return None


Bump = tuple[
    Annotated[float, Field(ge=0, lt=1)],
    Annotated[float, Field(gt=0, le=0.6)],
    Annotated[float, Field(gt=0, le=0.6)],
    float,
]


class PhaseSpline(_Controller):
    """Torque as a cubic spline of the phase (Zhang et al. 2017, Science 356:1280). Each of `bumps`
    has the phase of the peak, rise and fall time as fractions of the cycle, and the torque of the
    peak, Nm.
    """

    kind: Literal["phase_spline"] = "phase_spline"
    bumps: tuple[Bump, ...] = Field(min_length=1, max_length=20)

    @property
    def largest(self) -> float:
        """Nm, of the highest peak."""
        return max(abs(peak) for *_, peak in self.bumps)

    def torque(self, measured: Measured) -> float:
        """Nm; 0 until the phase is known."""
        if math.isnan(measured.phase):
            return 0.0
        total = 0.0
        for at, rise, fall, peak in self.bumps:
            # Distance from the peaks of this cycle and the next: a rise may be longer than half.
            after = (measured.phase - at) % 1.0
            for part in (1.0 - after / fall, 1.0 - (1.0 - after) / rise):
                if part > 0.0:
                    # The cubic from 0 to 1 with no slope at either end.
                    total += peak * part * part * (3.0 - 2.0 * part)
        return total


class ProportionalMoment(_Controller):
    """Torque in proportion to the wearer's own moment (Sawicki and Ferris 2008, J Exp Biol 211:1402
    did so with its electromyogram).

    Attributes
    ----------
    gain : device's torque over the wearer's moment.
    direction : `both`, or only torques that lower (`down`) or raise (`up`) the coordinate.
    """

    kind: Literal["proportional"] = "proportional"
    gain: Annotated[float, Field(gt=0, le=2)]
    direction: Literal["both", "down", "up"] = "both"

    def torque(self, measured: Measured) -> float:
        """Nm."""
        wanted = self.gain * measured.moment
        if self.direction == "down":
            return min(wanted, 0.0)
        return max(wanted, 0.0) if self.direction == "up" else wanted


class GravityCompensation(_Controller):
    """Carries a part of the weight below the hinge while the foot is off the ground.

    Attributes
    ----------
    share : fraction of the weight's moment.
    mass, arm : kg and m, of what is carried and its distance from the hinge.
    """

    kind: Literal["gravity"] = "gravity"
    share: Annotated[float, Field(gt=0, le=1)]
    mass: Annotated[float, Field(gt=0, le=100)]
    arm: Annotated[float, Field(gt=0, le=1)]

    def torque(self, measured: Measured) -> float:
        """Nm; lifts a segment that is inclined forward, which extends a knee."""
        if measured.loaded:
            return 0.0
        weight = self.share * self.mass * STANDARD_GRAVITY
        return measured.forward * weight * self.arm * math.sin(measured.inclination)


class ImpedanceStage(_Controller):
    """A stage of an `Impedance`: until which phase, stiffness Nm/rad, damping Nms/rad, rest rad."""

    until: Annotated[float, Field(gt=0, le=1)]
    stiffness: Annotated[float, Field(ge=0, le=1e4)]
    damping: Annotated[float, Field(ge=0, le=1e3)]
    rest: Angle


class Impedance(_Controller):
    """A spring and a damper whose values change with the phase (Sup et al. 2008, Int J Robotics Res
    27:263).
    """

    kind: Literal["impedance"] = "impedance"
    stages: tuple[ImpedanceStage, ...] = Field(min_length=1, max_length=20)

    @model_validator(mode="after")
    def _whole(self) -> "Impedance":
        ends = [stage.until for stage in self.stages]
        if ends != sorted(set(ends)) or ends[-1] != 1.0:
            raise ValueError(f"stages end at {ends}; `until` must rise and end with 1.0.")
        return self

    def torque(self, measured: Measured) -> float:
        """Nm; 0 until the phase is known."""
        if math.isnan(measured.phase):
            return 0.0
        stage = next(each for each in self.stages if measured.phase <= each.until)
        away = stage.rest - measured.angle
        return stage.stiffness * away - stage.damping * measured.speed


class VirtualConstraint(_Controller):
    """Holds the hinge on an angle that depends on the phase alone (Gregg et al. 2014, IEEE Trans
    Robotics 30:1455).

    Attributes
    ----------
    angles : rad, at equal steps of the phase from 0; periodic, a cubic in between.
    stiffness, damping : Nm/rad and Nms/rad.
    """

    kind: Literal["virtual_constraint"] = "virtual_constraint"
    angles: tuple[Angle, ...] = Field(min_length=4, max_length=200)
    stiffness: Annotated[float, Field(gt=0, le=1e4)]
    damping: Annotated[float, Field(ge=0, le=1e3)]

    def wanted(self, phase: float) -> tuple[float, float]:
        """Angle rad at a `phase`, and its slope, rad per cycle (Catmull and Rom's cubic)."""
        count = len(self.angles)
        first, part = divmod(phase % 1.0 * count, 1.0)
        before, a, b, after = (self.angles[(int(first) + k) % count] for k in (-1, 0, 1, 2))
        slopes = 0.5 * (b - before), 0.5 * (after - a)
        polynomial = np.polynomial.Polynomial(
            [a, slopes[0], 3 * (b - a) - 2 * slopes[0] - slopes[1], 2 * (a - b) + sum(slopes)]
        )
        return float(polynomial(part)), float(count * polynomial.deriv()(part))

    def torque(self, measured: Measured) -> float:
        """Nm; 0 until the phase is known."""
        if math.isnan(measured.phase):
            return 0.0
        angle, slope = self.wanted(measured.phase)
        rate = slope / measured.stride_time
        return self.stiffness * (angle - measured.angle) + self.damping * (rate - measured.speed)


AnyController = (
    PhaseSpline | ProportionalMoment | GravityCompensation | Impedance | VirtualConstraint
)
