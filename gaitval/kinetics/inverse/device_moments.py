"""Joint moments of person and device apart: what a device's recorded torque is about each axis.

A device across a joint puts a couple on the distal segment and the opposite one on the proximal
segment. By virtual work its generalised force at a coordinate of that joint is the component of
the couple along the axis that the distal segment turns about with it, and nil at other joints.
"""

from collections.abc import Mapping, Sequence
from typing import Final

import numpy as np

from gaitval.arrays import Array
from gaitval.coordinates import COORDINATES
from gaitval.mocap.recording import DeviceTorque
from gaitval.model.body import SEGMENTS, BodyModel
from gaitval.model.tree import segment_frames

JOINTS: Final[Mapping[str, tuple[str, tuple[str, ...]]]] = {
    "hip": ("thigh", ("hip_flexion", "hip_adduction", "hip_rotation")),
    "knee": ("shank", ("knee_angle",)),
    "ankle": ("foot", ("ankle_angle", "subtalar_angle")),
}
"""The distal segment of each joint, and its coordinates."""

STEP: Final = 1e-6
"""rad, by which a coordinate is changed to see its axis."""


def device_moments(
    model: BodyModel, positions: Array, devices: Sequence[DeviceTorque]
) -> dict[str, Array]:
    """The moments (T,) Nm of `devices` by coordinate ("hip_flexion_r"), positive if they would
    increase it, in the motion `positions` (T, 31) of `model`; torques are in the project's axes.
    Devices whose names say no joint are left out.
    """
    found: dict[str, Array] = {}
    for device in devices:
        if device.joint is None:
            continue
        joint, side = device.joint
        segment, names = JOINTS[joint]
        for name in (f"{each}_{side}" for each in names):
            axis = turning_axis(model, positions, name, f"{segment}_{side}")
            moment = np.einsum("ti,ti->t", axis, device.torque)
            found[name] = found.get(name, np.zeros(len(positions))) + moment
    return found


def turning_axis(model: BodyModel, positions: Array, coordinate: str, segment: str) -> Array:
    """(T, 3) the axis, in the world, that `segment` turns about as a `coordinate` increases."""
    changed = np.array(positions, dtype=float)
    changed[:, COORDINATES.index(coordinate)] += STEP
    place = SEGMENTS.index(segment)
    before, after = (segment_frames(model, each)[:, place, :3, :3] for each in (positions, changed))
    turn = after @ before.transpose(0, 2, 1)
    skew = (turn - turn.transpose(0, 2, 1)) / (2 * STEP)
    return np.stack([skew[:, 2, 1], skew[:, 0, 2], skew[:, 1, 0]], axis=1)
