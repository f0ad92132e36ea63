"""A device as a table: `[[devices]]` of a TOML file, and the devices that are shipped.

    [[devices]]
    name = "ankle_spring"
    source = "Collins, Wiggin and Sawicki 2015, Nature 522:212"
    sides = ["right", "left"]

    [[devices.parts]]
    name = "boot"
    segment = "foot"
    mass = 0.4

    [[devices.hinges]]
    joint = "ankle_angle"
    spring = { stiffness = 180.0, pulls = "down" }
    clutch = { while = "loaded", ratchet = true }

A file of devices has these tables; the file of a subject may have them too (a prosthesis is a part
of the person who wears it). A table with no more than the name of a shipped device, perhaps
`sides`, is that device. Lengths are in m, masses in kg, inertias in kg m², angles in rad, torques
in Nm. Signs of angles and torques are those of `gaitval.coordinates`: positive is flexion
or dorsiflexion on both sides.
"""

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Annotated, Any, Final

import numpy as np
import tomli_w
from pydantic import Field, ValidationError, model_validator

from gaitval._internal.io.artefacts import read_toml, write_text
from gaitval._internal.text.any_case import as_known
from gaitval.arrays import Array
from gaitval.coordinates import ACTUATED, SIDES, Side
from gaitval.errors import ConfigurationError
from gaitval.model.body import SEGMENTS
from gaitval.model.devices.controllers import AnyController
from gaitval.model.devices.springs_and_motors import Clutch, Motor, Spring, StanceDamper
from gaitval.model.devices.tables import AboveZero, AtLeastZero, PartOfOne, Table

JOINTS: Final = tuple(
    dict.fromkeys(name.removesuffix("_r").removesuffix("_l") for name in ACTUATED)
)
"""Joints that a hinge can be parallel to, without side."""
KINDS: Final = tuple(dict.fromkeys(name.removesuffix("_r").removesuffix("_l") for name in SEGMENTS))
"""Segments that a part can be on, without side."""
SHIPPED: Final = Path(__file__).parent / "shipped"
"""Folder of the devices that come with gaitval."""
SHORT: Final = frozenset({"name", "sides"})
"""Keys of a table that names a shipped device and says how it is worn."""
HEAVIEST: Final = 200.0
"""kg; no person carries more."""

_Mass = Annotated[float, Field(gt=0, le=HEAVIEST)]
_Place = tuple[float, float, float]


def _one_of(value: str, known: Sequence[str], what: str) -> None:
    if value not in known:
        raise ValueError(f"{value!r} is no {what} of the body; give one of {', '.join(known)}.")


class Part(Table):
    """A rigid part that moves with a segment.

    Attributes
    ----------
    segment : without its side, such as `shank`.
    along : where it is: fraction of the way from the segment's joint to the next one down the limb.
    centre : m, of its centre of mass from there, in the segment's axes of the right side (x
        forward, y to the left, z up); mirrored on the left side.
    inertia : kg m², about the centre of mass: xx, yy, zz, xy, xz, yz in the segment's axes.
    """

    name: str = Field(min_length=1, max_length=60, pattern=r"^[A-Za-z0-9_-]+$")
    segment: str
    mass: _Mass
    along: PartOfOne = 0.0
    centre: _Place = (0.0, 0.0, 0.0)
    inertia: tuple[float, float, float, float, float, float] = (0.0,) * 6

    @model_validator(mode="after")
    def _possible(self) -> "Part":
        _one_of(self.segment, KINDS, "segment")
        if max(abs(each) for each in self.centre) > 1.0:
            raise ValueError(f"centre {list(self.centre)} is more than 1 m away; give metres.")
        moments = np.linalg.eigvalsh(self.tensor)
        if moments[0] < 0.0 or moments[2] > moments[0] + moments[1] + 1e-12:
            raise ValueError(
                f"inertia {list(self.inertia)} is of no body: its principal moments "
                f"{', '.join(f'{each:.3g}' for each in moments)} kg m² must not be negative, and "
                "none larger than the sum of the others. Give xx, yy, zz, xy, xz, yz about the "
                "part's own centre of mass."
            )
        return self

    @property
    def tensor(self) -> Array:
        """(3, 3) kg m², about the centre of mass, on the right side."""
        xx, yy, zz, xy, xz, yz = self.inertia
        return np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]])


class Stump(Table):
    """What is left of a segment that was amputated, as factors on the sound segment's values.

    Attributes
    ----------
    segment : without its side.
    mass, centre, gyration : factors on its mass, on the distance of its centre of mass from its
        joint, and on its radii of gyration. Half a uniform limb has 0.5, 0.5 and 0.5.
    """

    segment: str
    mass: Annotated[float, Field(gt=0, lt=1)]
    centre: Annotated[float, Field(gt=0, le=1)]
    gyration: Annotated[float, Field(gt=0, le=1)]

    @model_validator(mode="after")
    def _possible(self) -> "Stump":
        _one_of(self.segment, KINDS, "segment")
        return self


class Strap(Table):
    """What ties a hinge to the limb: the device's angle is not the joint's.

    Attributes
    ----------
    stiffness, damping : Nm/rad and Nms/rad, between both.
    inertia : kg m², of what turns with the device's angle (rotor through its gear, cuff).
    """

    stiffness: Annotated[float, Field(ge=10, le=1e5)]
    damping: AboveZero
    inertia: AtLeastZero = 0.0


class Hinge(Table):
    """A hinge parallel to a joint.

    Attributes
    ----------
    joint : coordinate without its side, such as `knee_angle`.
    muscles : whether the person still has muscles there; false where a prosthesis has the joint.
    damping : Nms/rad.
    """

    joint: str
    muscles: bool = True
    spring: Spring | None = None
    damping: AtLeastZero = 0.0
    clutch: Clutch | None = None
    stance_damper: StanceDamper | None = None
    motor: Motor | None = None
    strap: Strap | None = None
    controller: AnyController | None = Field(None, discriminator="kind")

    @model_validator(mode="after")
    def _possible(self) -> "Hinge":
        _one_of(self.joint, JOINTS, "joint")
        if self.controller is not None and self.motor is None:
            raise ValueError(
                f"hinge at {self.joint}: a controller without a motor can do nothing. Add `motor` "
                "with torque, speed and power, or remove `controller`."
            )
        resists = self.spring or self.stance_damper or self.damping > 0.0
        if not (resists or self.motor) and self.muscles:
            raise ValueError(
                f"hinge at {self.joint}: no spring, damping or motor, so it does nothing. Add one "
                "of them, or remove the hinge."
            )
        if self.strap is not None and not self.muscles:
            raise ValueError(
                f"hinge at {self.joint}: a prosthesis has this joint (muscles = false), so there "
                "is no limb below it for a strap to hold. Remove `strap`."
            )
        ratchet = self.clutch is not None and self.clutch.ratchet
        if ratchet and not self.muscles:
            raise ValueError(
                f"hinge at {self.joint}: a ratchet is for a spring beside muscles, and a "
                "prosthesis has this joint (muscles = false). Remove `ratchet`."
            )
        if ratchet and (self.spring is None or self.spring.pulls == "both"):
            raise ValueError(
                f"hinge at {self.joint}: a ratchet takes up slack of a spring that pulls one way. "
                'Give spring.pulls = "down" or "up", or clutch.ratchet = false.'
            )
        if self.controller is not None and self.motor is not None:
            wanted = self.controller.largest
            if wanted is not None and wanted > self.motor.torque:
                raise ValueError(
                    f"hinge at {self.joint}: the controller asks for {wanted:g} Nm, and the motor "
                    f"has {self.motor.torque:g} Nm. Lower the controller's torque, or give "
                    "motor.torque of a stronger one."
                )
        return self


class Device(Table):
    """What a person wears, carries or has instead of a part of the body.

    Attributes
    ----------
    name : of the device.
    source : where its numbers are from.
    sides : of the body that have it; parts on trunk and pelvis are there once.
    stumps, parts, hinges : what is taken away, added, and turns.
    foot_switch : N, load at which the device counts a foot as on the ground.
    """

    name: str = Field(min_length=1, max_length=60, pattern=r"^[A-Za-z0-9_-]+$")
    source: str = Field(min_length=1)
    sides: tuple[Side, ...] = SIDES
    stumps: tuple[Stump, ...] = ()
    parts: tuple[Part, ...] = ()
    hinges: tuple[Hinge, ...] = ()
    foot_switch: AboveZero = 40.0

    @model_validator(mode="after")
    def _possible(self) -> "Device":
        if not self.sides or len(set(self.sides)) < len(self.sides):
            raise ValueError(f'sides {list(self.sides)}: give "right", "left", or both, each once.')
        if not (self.parts or self.hinges):
            raise ValueError(f"{self.name}: neither parts nor hinges, so there is no device.")
        for what, names in (
            ("stump of", [each.segment for each in self.stumps]),
            ("part", [each.name for each in self.parts]),
            ("hinge at", [each.joint for each in self.hinges]),
        ):
            if twice := sorted({name for name in names if names.count(name) > 1}):
                raise ValueError(
                    f"{self.name}: more than one {what} {', '.join(twice)}. Put them into one."
                )
        return self

    @property
    def mass(self) -> float:
        """kg, of all its parts."""
        return sum(len(self.places(part.segment)) * part.mass for part in self.parts)

    def places(self, kind: str) -> tuple[str, ...]:
        """The segments or coordinates of a `kind` that this device has something on."""
        known = (*SEGMENTS, *ACTUATED)
        if kind in known:
            return (kind,)
        return tuple(f"{kind}_{side[0]}" for side in self.sides)


class _File(Table):
    devices: tuple[Device, ...] = Field(min_length=1)


def devices_of(values: Mapping[str, Any], where: str) -> tuple[Device, ...]:
    """The devices in the tables `values` of a file; `where` names it in messages. Raises
    ConfigurationError, which lists every problem.
    """
    tables = values.get("devices", ())
    if isinstance(tables, list | tuple):
        tables = [_whole(each, where) for each in tables]
    try:
        found = _File.model_validate({"devices": tables}).devices
    except ValidationError as error:
        from gaitval._internal.text.refused_values import in_subject

        problems = error.errors()
        # A tuple whose only item cannot be also counts as empty, which it is not.
        inner = [each for each in problems if each["type"] != "too_short" or not each["input"]]
        lines = in_subject(_File, inner or problems)
        raise ConfigurationError(
            f"{where}: not a device:\n  "
            + "\n  ".join(lines)
            + "\nSee docs/how-to/devices.md for the tables of a device."
        ) from None
    return found


def _whole(table: Any, where: str) -> Any:
    """The table of the shipped device that a short `table` names, with what it says otherwise; any
    other `table` as it is.
    """
    if not (
        isinstance(table, dict) and isinstance(table.get("name"), str) and SHORT.issuperset(table)
    ):
        return table
    try:
        shipped = shipped_device(table["name"])
    except ConfigurationError as error:
        raise ConfigurationError(f"{where}: {error}") from None
    return shipped.model_dump(by_alias=True, exclude_none=True) | table


def check_together(devices: Sequence[Device]) -> None:
    """Raise ConfigurationError if two of `devices` replace one segment or joint of the body."""
    taken: dict[str, str] = {}
    for device in devices:
        kinds = [each.segment for each in device.stumps]
        kinds += [each.joint for each in device.hinges if not each.muscles]
        own = dict.fromkeys((name for kind in kinds for name in device.places(kind)), device.name)
        if twice := sorted(own.keys() & taken.keys()):
            raise ConfigurationError(
                f"{taken[twice[0]]} and {device.name} both replace {', '.join(twice)}, which the "
                "body has once. Leave one of them out, or give them other sides."
            )
        taken |= own


def write_devices(path: Path, devices: Sequence[Device]) -> None:
    """Write a file of `devices`, as `load_devices` reads it."""
    write_text(path, tomli_w.dumps({"devices": tables_of(devices)}))


def tables_of(devices: Sequence[Device]) -> list[dict[str, Any]]:
    """The tables of `devices`, as `devices_of` takes them."""
    return [each.model_dump(mode="json", by_alias=True, exclude_none=True) for each in devices]


def shipped_names() -> tuple[str, ...]:
    """Names of the devices that come with gaitval."""
    return tuple(sorted(each.stem for each in SHIPPED.glob("*.toml")))


def shipped_device(name: str) -> Device:
    """A device that comes with gaitval, by its `name`. Raises ConfigurationError."""
    name = as_known(name, shipped_names())
    if name not in shipped_names():
        raise ConfigurationError(
            f"{name!r}: no such device. Those that come with gaitval are "
            f"{', '.join(shipped_names())}; or give the path of a .toml file with [[devices]]."
        )
    path = SHIPPED / f"{name}.toml"
    (found,) = devices_of(read_toml(path, ConfigurationError), path.name)
    return found


def load_devices(name_or_path: str) -> tuple[Device, ...]:
    """The devices of a file, or the shipped one of a name. Raises ConfigurationError."""
    if name_or_path.lower().endswith(".toml") or "/" in name_or_path:
        path = Path(name_or_path)
        fix = "Check the path of the device's file"
        return devices_of(read_toml(path, ConfigurationError, fix), str(path))
    return (shipped_device(name_or_path),)
