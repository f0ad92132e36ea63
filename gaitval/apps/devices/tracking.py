"""How well a device gives the torque that it is asked for."""

import numpy as np

from gaitval.apps.devices.device_walk import DeviceWalk
from gaitval.arrays import Array
from gaitval.model.devices.device import Device
from gaitval.model.devices.springs_and_motors import Motor


def lagged(command: Array, motor: Motor, step: float) -> Array:
    """(T,) Nm, what the motor's bandwidth alone makes of a `command` (T,) at steps of `step` s."""
    part = -np.expm1(-2.0 * np.pi * motor.bandwidth * step)
    found, torque = np.empty_like(command), 0.0
    for t, commanded in enumerate(command):
        torque += part * (commanded - torque)
        found[t] = torque
    return found


def torque_errors(walk: DeviceWalk, device: Device) -> dict[str, float]:
    """RMS difference of the torque on the limb from the command, bandwidth and delay aside, over
    the command's largest value; by hinge with a motor.

    What is left are the limits of torque, speed and power, the rotor's inertia and the strap.
    """
    step = float(walk.rollout.time[1] - walk.rollout.time[0])
    motors = {hinge.joint: hinge.motor for hinge in device.hinges if hinge.motor is not None}
    found = {}
    for h, name in enumerate(walk.hinges):
        motor = motors.get(name[:-2])
        if motor is None:
            continue
        wanted = lagged(walk.command[:, h], motor, step)
        rms = np.sqrt(np.mean((walk.limb[:, h] - wanted) ** 2))
        found[name] = float(rms / np.abs(wanted).max())
    return found
