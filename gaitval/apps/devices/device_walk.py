"""A walk with devices: what a `Rollout` has, and what the hinges of the devices did."""

from dataclasses import dataclass
from typing import Final

import numpy as np

from gaitval.apps.devices import hinge_step as column
from gaitval.arrays import Array
from gaitval.coordinates import ACTUATED
from gaitval.model.tree import ROOT_DOFS
from gaitval.walk.simulation.rollout import Rollout

LOGGED: Final = (column.LIMB, column.MOTOR, column.COMMAND, column.ANGLE, column.SPEED)
"""What is kept of a hinge in every physics step, see `hinge_step`."""


@dataclass(frozen=True)
class DeviceWalk:
    """A walk with devices.

    Attributes
    ----------
    rollout : its moments are those of the person's muscles.
    hinges : names of the hinges' coordinates, H of them.
    limb, motor, command : (T, H) Nm: torque of the device on the limb (what its straps carry), of
        its motor, and what the motor was asked for.
    angle, speed : (T, H) rad and rad/s, of the device.
    """

    rollout: Rollout
    hinges: tuple[str, ...]
    limb: Array
    motor: Array
    command: Array
    angle: Array
    speed: Array

    @property
    def joints(self) -> Array:
        """(H,) which of the actuated coordinates each hinge is parallel to."""
        return np.array([ACTUATED.index(name) for name in self.hinges], dtype=int)

    @property
    def power(self) -> Array:
        """(T, H) W, that the device gives the limbs: torque times rate of the joint."""
        rates = self.rollout.velocities[:, ROOT_DOFS + self.joints]
        return np.asarray(self.limb * rates, dtype=float)

    @property
    def total_moments(self) -> Array:
        """(T, 25) Nm, of muscles and devices together."""
        total = self.rollout.moments.copy()
        for h, joint in enumerate(self.joints):
            total[:, joint] += self.limb[:, h]
        return total


def at_states(log: Array) -> Array:
    """(T - 1, H, 5) at the states of a `Rollout`, of a log (T, H, 5) of physics steps: the torques
    of the step that follows a state, and the rate as the mean of both steps.
    """
    torques, angle, rate = log[1:, :, :3], log[:-1, :, 3:4], log[:, :, 4:]
    return np.concatenate([torques, angle, 0.5 * (rate[:-1] + rate[1:])], axis=2)
