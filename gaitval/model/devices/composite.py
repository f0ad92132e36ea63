"""The body with a device: rigid parts become part of the segments that they move with.

A segment of mass m₀ and a part of mass m₁ that is fixed to it are one rigid body: the centre of
mass is c = (m₀ c₀ + m₁ c₁) / (m₀ + m₁), and the inertia about it is the sum of Iᵢ + mᵢ (d² 1 - d
dᵀ) with d = cᵢ - c (Steiner's parallel axes). So every engine has the device in its body.
"""

from collections.abc import Sequence
from dataclasses import replace
from typing import Final

import numpy as np

from gaitval.arrays import Array
from gaitval.model.body import SEGMENTS, BodyModel, Segment
from gaitval.model.devices.device import Device, Part, Stump

_NEXT: Final = {
    "thigh": "shank",
    "shank": "foot",
    "foot": "toes",
    "pelvis": "torso",
    "torso": "upper_arm",
    "upper_arm": "forearm",
}
"""The segment whose joint ends a segment; toes and forearms have no further joint."""
_MIRROR: Final = np.diag([1.0, -1.0, 1.0])


def parallel_axes(offset: Array) -> Array:
    """d² 1 - d dᵀ (3, 3) of an `offset` d (3,): inertia that a unit mass gains by it."""
    return np.asarray(offset @ offset * np.eye(3) - np.outer(offset, offset), dtype=float)


def united(
    masses: Sequence[float] | Array,
    centres: Sequence[Array] | Array,
    inertias: Sequence[Array] | Array,
) -> tuple[float, Array, Array]:
    """Mass, centre (3,) and inertia (3, 3) about it of rigid bodies that are fixed to each other,
    from their `masses` kg, `centres` of mass (3,) m in common axes, and `inertias` (3, 3) kg m²,
    each about its own centre.
    """
    mass = float(sum(masses))
    centre = np.zeros(3)
    for m, c in zip(masses, centres, strict=True):
        centre += m * c / mass
    inertia = np.zeros((3, 3))
    for m, c, own in zip(masses, centres, inertias, strict=True):
        inertia += own + m * parallel_axes(c - centre)
    return mass, centre, inertia


def part_place(part: Part, segment: Segment, model: BodyModel) -> tuple[Array, Array]:
    """Centre of mass (3,) m of a `part` in the frame of the `segment` of a `model` that it is on,
    and its inertia (3, 3) about it.
    """
    left = segment.side == "left"
    centre, inertia = np.array(part.centre), part.tensor
    if left:
        centre, inertia = _MIRROR @ centre, _MIRROR @ inertia @ _MIRROR
    name = _NEXT.get(segment.kind)
    if part.along and name is not None:
        side = "" if name == "torso" else segment.name[-2:] if segment.side else "_r"
        end = model[f"{name}{side}"].joint_position.copy()
        if segment.side is None:
            end[1] = 0.0  # the shoulders' height, in the middle
        centre = centre + part.along * end
    return centre, inertia


def _stump(segment: Segment, stump: Stump) -> Segment:
    """What is left of a segment."""
    return replace(
        segment,
        mass=stump.mass * segment.mass,
        centre_of_mass=stump.centre * segment.centre_of_mass,
        inertia=stump.mass * stump.gyration**2 * segment.inertia,
    )


def fitted(model: BodyModel, devices: Sequence[Device]) -> BodyModel:
    """The body of a `model` with `devices` on it."""
    segments = {segment.name: segment for segment in model.segments}
    for device in devices:
        for stump in device.stumps:
            for name in device.places(stump.segment):
                segments[name] = _stump(segments[name], stump)
    for name in SEGMENTS:
        segment = segments[name]
        parts = [
            part
            for device in devices
            for part in device.parts
            if name in device.places(part.segment)
        ]
        if not parts:
            continue
        places = [part_place(part, segment, model) for part in parts]
        mass, centre, inertia = united(
            [segment.mass, *(part.mass for part in parts)],
            [segment.centre_of_mass, *(centre for centre, _ in places)],
            [segment.inertia, *(own for _, own in places)],
        )
        segments[name] = replace(segment, mass=mass, centre_of_mass=centre, inertia=inertia)
    return replace(model, segments=tuple(segments[name] for name in SEGMENTS))
