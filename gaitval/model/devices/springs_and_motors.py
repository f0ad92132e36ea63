"""What turns the hinge of a device: springs, clutches, motors and dampers, as a device's file
declares them. How they act in a walk is in `gaitval.apps.devices.walking`.
"""

from typing import Annotated, Literal

from pydantic import Field

from gaitval.model.devices.tables import AboveZero, Angle, AtLeastZero, PartOfOne, Table


class Spring(Table):
    """A spring of a hinge: torque = stiffness x (rest - angle of the device).

    Attributes
    ----------
    stiffness : Nm/rad.
    rest : rad.
    pulls : `both` ways; or `down` or `up`, a cable or a stop that only lowers or only raises the
        joint's coordinate.
    """

    stiffness: AboveZero
    rest: Angle = 0.0
    pulls: Literal["both", "down", "up"] = "both"


class Clutch(Table):
    """When spring and damper of a hinge act.

    Attributes
    ----------
    during : `loaded` or `unloaded`, while the foot switch of this side is; or `phase`.
    phases : first and last phase of this side's gait cycle, as the device estimates it; from heel
        strike, 0 to 1. The first may be larger than the last.
    ratchet : the clutch takes up slack of a spring that pulls one way, so that the spring rests at
        the lowest (pulls down) or highest angle since it was engaged.
    """

    during: Literal["loaded", "unloaded", "phase"] = Field(alias="while")
    phases: tuple[PartOfOne, PartOfOne] = (0.0, 1.0)
    ratchet: bool = False


class Motor(Table):
    """A motor of a hinge.

    Attributes
    ----------
    torque, speed, power : largest, Nm, rad/s and W. It drives with no more; it brakes up to
        `torque`.
    bandwidth : Hz, of its torque: a first-order lag.
    delay : s, from measurement to command.
    noise : Nm, standard deviation of its torque.
    """

    torque: AboveZero
    speed: AboveZero
    power: AboveZero
    bandwidth: AboveZero = 20.0
    delay: Annotated[float, Field(ge=0, le=0.5)] = 0.0
    noise: AtLeastZero = 0.0


class StanceDamper(Table):
    """A damper of a prosthetic knee that yields slowly under load.

    Attributes
    ----------
    damping : Nms/rad, added while the foot switch is closed ...
    until : ... and this side's phase is below this.
    """

    damping: AboveZero
    until: Annotated[float, Field(gt=0, le=1)] = 1.0
