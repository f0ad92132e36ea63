"""Controllers of a device's motors.

A controller is anything with a method `torque(measured)`, which gets what the device's own sensors
measure (`Measured`) and gives the torque in Nm that its motor is asked for. Those here are also
tables of a device's file:

    controller = { kind = "phase_spline", bumps = [[0.52, 0.26, 0.10, -40.0]] }
"""

import math
from dataclasses import dataclass
from typing import Annotated, Literal, Protocol

from pydantic import Field, model_validator

from gaitval.coordinates import Side
from gaitval.model.devices.tables import Angle, Table


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


AnyController = PhaseSpline | Impedance
