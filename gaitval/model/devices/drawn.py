"""What the replay draws of devices: each part where it is, and as large as its inertia says.

A part is drawn as the solid of even density that has its mass and inertia: a ball, a cylinder along
its segment or a box. A cylinder that would float in water is a frame, and drawn as thin as a solid
one; a socket round a stump is not. A hinge is a disc at its joint, and rods lead from it to the
device's parts on both segments. A part that a strap holds beside a limb has a ring round it. What
was amputated is painted as the device.
"""

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final

import numpy as np
from scipy.spatial.transform import Rotation

from gaitval._internal.io.artefacts import read_toml
from gaitval.arrays import Array
from gaitval.errors import ConfigurationError
from gaitval.model.body import JOINT_COORDINATES, PARENTS, SEGMENTS, BodyModel
from gaitval.model.devices.composite import part_place
from gaitval.model.devices.device import Device, Hinge, Part, devices_of
from gaitval.model.urdf import read_urdf

DEVICES_FILE: Final = "devices.toml"
"""The devices of a run, in its folder."""
_Shape = dict[str, Any]
"""{segment, kind, position, size, turned}, m in the segment's frame: kind "box" with three lengths,
"sphere" with a radius, "cylinder" (along z) with radius and length, all turned by a quaternion x,
y, z, w if there is one; or {segment, kind: "skin"}, the segment itself."""


@dataclass(frozen=True)
class DrawnDevice:
    """How a device is drawn and weighed."""

    density: float = 1000.0
    """kg/m³, of frames, and of a part without inertia, which is drawn as a ball."""
    equal: float = 0.02
    """Two principal moments that differ by less, of the largest, are drawn as equal."""
    ring: float = 0.035
    """m, height of a strap's ring."""
    lost: float = 0.5
    """A segment with less of its mass than this is painted as the device."""


DRAWN: Final = DrawnDevice()

BESIDE: Final = {"hip_flexion": 0.10, "knee_angle": 0.065, "ankle_angle": 0.05}
"""m, of a hinge outward from the joint: beside the skin."""
DISC: Final = {"motor": (0.045, 0.03), "hinge": (0.022, 0.02), "prosthesis": (0.028, 0.07)}
"""Radius and thickness, m."""
ROD: Final = {False: 0.009, True: 0.016}
"""Radius of a rod, m; of a prosthesis if true."""
LIMBS: Final = ("thigh", "shank", "upper_arm", "forearm")
ACROSS: Final = (-math.sqrt(0.5), 0.0, 0.0, math.sqrt(0.5))
"""Quaternion x, y, z, w that turns z to y."""


def drawn(folder: Path) -> list[_Shape]:
    """The shapes of the devices of a run `folder`; none without devices. Raises ConfigurationError,
    ModelError.
    """
    devices = devices_in(folder)
    return shapes(read_urdf(folder / "model.urdf"), devices) if devices else []


def devices_in(folder: Path) -> tuple[Device, ...]:
    """The devices that a run `folder` was made with: of its `DEVICES_FILE`; none without that
    file.
    """
    path = folder / DEVICES_FILE
    return devices_of(read_toml(path, ConfigurationError), str(path)) if path.is_file() else ()


def shapes(model: BodyModel, devices: Sequence[Device]) -> list[_Shape]:
    """The shapes of `devices` on a `model`, in the frames of its segments."""
    found: list[_Shape] = []
    for device in devices:
        for part in device.parts:
            for segment in device.places(part.segment):
                socket = any(segment in device.places(stump.segment) for stump in device.stumps)
                found.append(solid(part, segment, model, socket=socket))
                found.extend(_ring(device, part, segment, model))
        for hinge in device.hinges:
            for joint in device.places(hinge.joint):
                found.extend(_hinge(device, hinge, joint, model))
        found.extend({"segment": name, "kind": "skin"} for name in _lost(device))
    return found


def solid(part: Part, segment: str, model: BodyModel, *, socket: bool = False) -> _Shape:
    """The ball, cylinder or box of even density with the mass and inertia of a `part`; a cylinder
    as thin as `DRAWN.density` makes it if it is no `socket`.
    """
    position, inertia = part_place(part, model[segment], model)
    shape: _Shape = {"segment": segment, "position": position.tolist()}
    if not inertia.any():
        radius = (0.75 * part.mass / (math.pi * DRAWN.density)) ** (1.0 / 3.0)
        return shape | {"kind": "sphere", "size": [radius]}
    # As they are, if they are principal ones: no axes change places.
    turned = np.eye(3)
    if np.count_nonzero(inertia - np.diag(np.diag(inertia))):
        turned = np.linalg.eigh(inertia)[1]
        turned[:, 2] *= np.linalg.det(turned)
    moments = np.diag(turned.T @ inertia @ turned) / part.mass
    near = DRAWN.equal * moments.max()
    if np.ptp(moments) < near:
        return shape | {"kind": "sphere", "size": [math.sqrt(2.5 * moments.mean())]}
    turn = {"turned": Rotation.from_matrix(turned).as_quat().tolist()}
    square = 6.0 * (moments[0] + moments[1] - moments[2])
    if abs(moments[0] - moments[1]) < near and square > 0.0:
        radius, length = math.sqrt(2.0 * moments[2]), math.sqrt(square)
        if not socket:
            radius = min(radius, math.sqrt(part.mass / (math.pi * DRAWN.density * length)))
        return shape | {"kind": "cylinder", "size": [radius, length]} | turn
    lengths = np.sqrt(np.maximum(6.0 * (moments.sum() - 2.0 * moments), 1e-6))
    return shape | {"kind": "box", "size": lengths.tolist()} | turn


def _ring(device: Device, part: Part, segment: str, model: BodyModel) -> Iterator[_Shape]:
    """The ring of the strap that holds a part beside a limb."""
    strapped = any(hinge.strap is not None for hinge in device.hinges)
    place, _ = part_place(part, model[segment], model)
    away = float(np.hypot(*place[:2]))
    if strapped and model[segment].kind in LIMBS and away > 0.02:
        yield {
            "segment": segment,
            "kind": "cylinder",
            "position": [0.0, 0.0, float(place[2])],
            "size": [max(away, 0.05), DRAWN.ring],
        }


def _hinge(device: Device, hinge: Hinge, joint: str, model: BodyModel) -> Iterator[_Shape]:
    """A disc at a joint that turns about the axis across, and rods to the parts on both sides."""
    if hinge.joint.removesuffix("_r").removesuffix("_l") not in BESIDE:
        return
    lower = next(name for name, own in JOINT_COORDINATES.items() if joint in own)
    upper, lost = PARENTS[lower], not hinge.muscles
    out = np.zeros(3)
    if not lost:
        out[1] = BESIDE[joint[:-2]] * (1.0 if joint.endswith("_l") else -1.0)
    kind = "prosthesis" if lost else "motor" if hinge.motor else "hinge"
    yield {
        "segment": lower,
        "kind": "cylinder",
        "position": out.tolist(),
        "size": list(DISC[kind]),
        "turned": list(ACROSS),
    }
    for segment, start in ((upper, model[lower].joint_position + out), (lower, out)):
        for part in device.parts:
            if segment in device.places(part.segment):
                place, _ = part_place(part, model[segment], model)
                yield from _rod(segment, start, place, ROD[lost])


def _rod(segment: str, start: Array, end: Array, radius: float) -> Iterator[_Shape]:
    length = float(np.linalg.norm(end - start))
    if length > 0.02:
        turn, _ = Rotation.align_vectors((end - start)[None], np.array([[0.0, 0.0, 1.0]]))
        yield {
            "segment": segment,
            "kind": "cylinder",
            "position": (0.5 * (start + end)).tolist(),
            "size": [radius, length],
            "turned": turn.as_quat().tolist(),
        }


def _lost(device: Device) -> list[str]:
    """Segments of which a prosthesis has the most, and those beyond them."""
    gone = {
        name
        for stump in device.stumps
        if stump.mass < DRAWN.lost
        for name in device.places(stump.segment)
    }
    for name in SEGMENTS:  # from the pelvis outward
        if PARENTS.get(name) in gone:
            gone.add(name)
    return [name for name in SEGMENTS if name in gone]
