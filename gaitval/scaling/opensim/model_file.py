"""Read an `.osim` file of OpenSim 3 or 4; see `gaitval.scaling.opensim.model`.

| differs             | OpenSim 3 (20000 to 30499)             | OpenSim 4 (40000 and later)   |
|---------------------|----------------------------------------|-------------------------------|
| joints              | inside the child's `<Body>`            | in `<JointSet>`               |
| frames              | `location_in_parent`, `orientation`, … | `<PhysicalOffsetFrame>`       |
| inertia             | `inertia_xx` …                         | `inertia`: xx yy zz xy xz yz  |
| function of an axis | inside `<function>`                    | an element of the axis        |
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Final
from xml.etree.ElementTree import Element

import numpy as np
from scipy.spatial.transform import Rotation

from gaitval.arrays import Array
from gaitval.errors import ModelError
from gaitval.scaling.opensim.fields import (
    child,
    flag,
    number,
    numbers,
    objects,
    read_document,
    text,
)
from gaitval.scaling.opensim.functions import (
    constant,
    is_function,
    read_function,
    slope_and_offset,
)
from gaitval.scaling.opensim.model import (
    GROUND,
    Coordinate,
    Coupler,
    Frame,
    Marker,
    MotionKind,
    OpenSimBody,
    OpenSimJoint,
    OsimModel,
    TransformAxis,
)

OLDEST, BETWEEN, NEWEST = 20000, 30500, 40000
"""Versions of the file: before the first, and between the others, files had other forms."""

DEFAULT_RANGE: Final = (-10.0, 10.0)
"""rad or m, OpenSim's own of a coordinate without a range."""

X, Y, Z = np.eye(3)
NOWHERE: Final = (0.0, 0.0, 0.0)
_Axes = tuple[tuple[int, Array], ...]

SIMPLE: Final[Mapping[str, _Axes]] = {
    "WeldJoint": (),
    "PinJoint": ((0, Z),),
    "SliderJoint": ((3, X),),
    "UniversalJoint": ((0, X), (1, Y)),
    "GimbalJoint": ((0, X), (1, Y), (2, Z)),
    "BallJoint": ((0, X), (1, Y), (2, Z)),
    "PlanarJoint": ((0, Z), (3, X), (4, Y)),
    "FreeJoint": ((0, X), (1, Y), (2, Z), (3, X), (4, Y), (5, Z)),
}
"""Joints whose coordinates each turn about or move along one axis: which of the six movements of a
spatial transform each coordinate is, and its axis."""

PLACES: Final = ("rotation1", "rotation2", "rotation3", "translation1", "translation2",
                 "translation3")  # fmt: skip


@dataclass
class _Parts:
    """What has been read so far."""

    path: Path
    frames: dict[str, Frame] = field(default_factory=dict)
    joints: list[OpenSimJoint] = field(default_factory=list)
    coordinates: dict[str, Coordinate] = field(default_factory=dict)

    def where(self, element: Element) -> str:
        return f"{self.path}: {element.tag} {element.get('name', '')!r:.80}"


def read_model(path: Path) -> OsimModel:
    """The skeleton in the `.osim` file `path`.

    Raises ModelError if it cannot be read, is not a model of OpenSim 3 or 4, a joint or a function
    is of a kind that is not understood, a number is missing or not finite, or a body has no
    joint to a parent.
    """
    path = Path(path)
    document = read_document(path)
    version = _version(path, document)
    model = child(document, "Model", path)
    parts = _Parts(path)
    bodies = _bodies(parts, model, version)
    joined = objects(model, "JointSet")
    if joined:
        _offset_frames(parts, model)
        for element in joined:
            _joint(parts, element, None)
    else:
        for element in objects(model, "BodySet"):
            for one in element.findall("Joint/*"):
                _joint(parts, one, element.get("name", ""))
    found = OsimModel(
        name=model.get("name", path.stem),
        version=version,
        gravity=numbers(model, "gravity", str(path), count=3, default=(0.0, -9.80665, 0.0)),
        bodies=bodies,
        joints=tuple(parts.joints),
        coordinates=parts.coordinates,
        markers=tuple(_markers(parts, model)),
        couplers=tuple(_couplers(parts, model)),
    )
    _check_tree(path, found)
    return found


def _version(path: Path, document: Element) -> int:
    written = document.get("Version", "")
    version = int(written) if written.isdecimal() and len(written) < 9 else 0
    if version < OLDEST or BETWEEN <= version < NEWEST:
        raise ModelError(
            f"{path}: written by another version of OpenSim (Version={written!r:.20}); files of "
            "OpenSim 3 and 4 can be read. Open it in OpenSim 4 and save it."
        )
    return version


# ---- Bodies and frames. ----


def _bodies(parts: _Parts, model: Element, version: int) -> dict[str, OpenSimBody]:
    bodies: dict[str, OpenSimBody] = {}
    parts.frames[GROUND] = Frame(GROUND, np.eye(3), np.zeros(3))
    for element in objects(model, "BodySet"):
        name, where = element.get("name", ""), parts.where(element)
        if name == GROUND:
            continue
        if not name or name in bodies:
            raise ModelError(f"{where}: a body needs a name of its own.")
        if element.tag != "Body":
            raise ModelError(f"{where}: not a <Body>; other kinds are not understood.")
        mass = number(element, "mass", where)
        if mass < 0.0:
            raise ModelError(f"{where}: a mass of {mass:g} kg. OpenSim refuses it too: correct it.")
        bodies[name] = OpenSimBody(
            name,
            mass,
            numbers(element, "mass_center", where, count=3, default=NOWHERE),
            _inertia(element, where, version),
        )
        parts.frames[name] = Frame(name, np.eye(3), np.zeros(3))
    if not bodies:
        raise ModelError(f"{parts.path}: the model has no body. Give a model with a skeleton.")
    return bodies


def _inertia(element: Element, where: str, version: int) -> Array:
    """What is missing is as OpenSim has it: 1 kg m² about an axis in version 3, nothing in 4."""
    if element.find("inertia") is not None or version >= NEWEST:
        six = numbers(element, "inertia", where, count=6, default=(0.0,) * 6)
    else:
        names = {"xx": 1.0, "yy": 1.0, "zz": 1.0, "xy": 0.0, "xz": 0.0, "yz": 0.0}
        six = np.array(
            [number(element, f"inertia_{n}", where, default=usual) for n, usual in names.items()]
        )
    xx, yy, zz, xy, xz, yz = six
    return np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]])


def _offset_frames(parts: _Parts, model: Element) -> None:
    """Frames that are fixed to bodies by name, so that joints and markers find them."""
    for set_ in ("BodySet", "JointSet"):
        for owner in objects(model, set_):
            for element in owner.iter("PhysicalOffsetFrame"):
                if element.get("name") and element.get("name") not in parts.frames:
                    _place_frame(parts, element, owner)


def _place_frame(parts: _Parts, element: Element, owner: Element) -> None:
    name = element.get("name", "")
    socket = _socket(element, "parent") or _socket(element, "parent_frame")
    base = owner.get("name", "") if socket in ("..", "") else socket.rsplit("/", 1)[-1]
    # ".." is the component that contains the frame.
    on = parts.frames.get(base)
    if on is not None:  # geometry may hang on what is no frame; it is not needed
        parts.frames[name] = _fixed_to(on, element, parts.where(element))


def _socket(element: Element, name: str) -> str:
    for tag in (f"socket_{name}", f"socket_{name}_connectee_name"):
        written = text(element, tag)
        if written:
            return written
    return ""


def _fixed_to(
    on: Frame, element: Element, where: str, tags: tuple[str, str] = ("translation", "orientation")
) -> Frame:
    place, turn = (numbers(element, tag, where, count=3, default=NOWHERE) for tag in tags)
    # OpenSim's orientation: body-fixed rotations about X, then Y, then Z.
    rotation = Rotation.from_euler("XYZ", turn).as_matrix()
    return Frame(on.body, on.rotation @ rotation, on.origin + on.rotation @ place)


# ---- Joints. ----


def _joint(parts: _Parts, element: Element, body: str | None) -> None:
    """Add a joint; `body` is the one that contains it in a file of OpenSim 3."""
    where = parts.where(element)
    parent, on = _ends(parts, element, body, where)
    coordinates = _coordinate_elements(element)
    if element.tag == "CustomJoint":
        axes = _spatial_transform(element, where, [c.get("name", "") for c in coordinates])
    elif element.tag in SIMPLE:
        axes = _simple_axes(element, where, [c.get("name", "") for c in coordinates])
    else:
        raise ModelError(
            f"{where}: this kind of joint is not understood; those that are: CustomJoint, "
            f"{', '.join(SIMPLE)}. Replace it by a CustomJoint."
        )
    joint = OpenSimJoint(
        element.get("name", ""),
        parent,
        on,
        tuple(each.get("name", "") for each in coordinates),
        tuple(axis for axis, _ in axes),
    )
    parts.joints.append(joint)
    for one in coordinates:
        coordinate = _coordinate(parts, one, joint.name, axes)
        if not coordinate.name or coordinate.name in parts.coordinates:
            raise ModelError(f"{where}: a coordinate needs a name of its own.")
        parts.coordinates[coordinate.name] = coordinate


def _ends(parts: _Parts, element: Element, body: str | None, where: str) -> tuple[Frame, Frame]:
    """Frames of the joint on its parent and on its child."""
    if body is not None:
        parent = _frame(parts.frames, text(element, "parent_body"), where)
        first = _fixed_to(parent, element, where, ("location_in_parent", "orientation_in_parent"))
        second = _fixed_to(parts.frames[body], element, where, ("location", "orientation"))
        # A reversed joint moves its parent in the child's frame.
        return (second, first) if flag(element, "reverse") else (first, second)
    own = dict(parts.frames)
    for one in element.findall("frames/PhysicalOffsetFrame"):
        # Names of frames need to be unique in their joint only.
        socket = _socket(one, "parent").rsplit("/", 1)[-1]
        own[one.get("name", "")] = _fixed_to(
            _frame(parts.frames, socket, where), one, parts.where(one)
        )
    first, second = (
        _frame(own, _socket(element, f"{end}_frame").rsplit("/", 1)[-1], where)
        for end in ("parent", "child")
    )
    return first, second


def _frame(frames: Mapping[str, Frame], name: str, where: str) -> Frame:
    if name not in frames:
        raise ModelError(f"{where}: it is on {name!r:.80}, which is no body or frame of the model.")
    return frames[name]


def _coordinate_elements(element: Element) -> list[Element]:
    found = element.find("coordinates")
    return objects(element, "CoordinateSet") if found is None else list(found)


def _coordinate(
    parts: _Parts,
    element: Element,
    joint: str,
    axes: Sequence[tuple[TransformAxis, bool]],
) -> Coordinate:
    name, where = element.get("name", ""), parts.where(element)
    low, high = numbers(element, "range", where, count=2, default=DEFAULT_RANGE)
    return Coordinate(
        name=name,
        joint=joint,
        default=number(element, "default_value", where, default=0.0),
        range=(float(low), float(high)),
        locked=flag(element, "locked"),
        motion=_motion(name, axes),
    )


def _motion(name: str, axes: Sequence[tuple[TransformAxis, bool]]) -> MotionKind:
    """As OpenSim decides it: by the last movement that is the coordinate itself."""
    for place, (axis, itself) in reversed(list(enumerate(axes))):
        if axis.coordinate == name and itself:
            return "rotational" if place < 3 else "translational"
    return "coupled"


def _simple_axes(
    element: Element, where: str, names: Sequence[str]
) -> list[tuple[TransformAxis, bool]]:
    axes = _still()
    moved = SIMPLE[element.tag]
    if len(names) != len(moved):
        raise ModelError(
            f"{where}: has {len(names)} coordinates, but a {element.tag} has {len(moved)}."
        )
    for name, (place, axis) in zip(names, moved, strict=True):
        axes[place] = (TransformAxis(name, axis, lambda x: x), True)
    return axes


def _still() -> list[tuple[TransformAxis, bool]]:
    return [(TransformAxis(None, axis, constant(0.0)), False) for axis in (X, Y, Z, X, Y, Z)]


def _spatial_transform(
    element: Element, where: str, names: Sequence[str]
) -> list[tuple[TransformAxis, bool]]:
    """The six movements, and of each whether its coordinate moves it one to one."""
    axes = _still()
    transform = element.find("SpatialTransform")
    for one in [] if transform is None else transform:
        place = one.get("name", "")
        if place in PLACES:
            axes[PLACES.index(place)] = _transform_axis(one, f"{where}, {place}", names)
    return axes


def _transform_axis(
    element: Element, where: str, names: Sequence[str]
) -> tuple[TransformAxis, bool]:
    axis = numbers(element, "axis", where, count=3)
    size = float(np.linalg.norm(axis))
    if size == 0.0:
        raise ModelError(f"{where}: its axis has no length.")
    driven = text(element, "coordinates").split()
    written = [part for each in element for part in (each, *each) if is_function(part)]
    others = [
        each.tag for each in element if each.tag not in ("coordinates", "axis", "function")
    ] or [each.tag for each in element.findall("function/*")]
    if not written and others:
        raise ModelError(f"{where}: the function {others[0]:.80} is not understood.")
    if len(driven) > 1 or (driven and driven[0] not in names):
        raise ModelError(
            f"{where}: it is driven by {', '.join(driven):.80}; one coordinate of the same joint "
            "is understood."
        )
    if not written:
        # As in OpenSim: an empty <function> is the coordinate itself, and without one it rests.
        itself = bool(driven) and element.find("function") is not None
        function = (lambda x: x) if itself else constant(0.0)
    else:
        function = read_function(written[0], where)
        slope, _ = slope_and_offset(written[0], where) or (0.0, 0.0)
        # OpenSim asks for a slope of 1 or -1: then the coordinate is itself an angle or a distance.
        itself = bool(driven) and abs(slope) == 1.0
    return TransformAxis(driven[0] if driven else None, axis / size, function), itself


# ---- Markers and constraints. ----


def _markers(parts: _Parts, model: Element) -> list[Marker]:
    found = []
    for element in objects(model, "MarkerSet"):
        if element.tag != "Marker":
            continue
        where = parts.where(element)
        named = _socket(element, "parent_frame") or text(element, "body")
        frame = _frame(parts.frames, named.rsplit("/", 1)[-1], where)
        place = numbers(element, "location", where, count=3)
        found.append(
            Marker(element.get("name", ""), frame.body, frame.origin + frame.rotation @ place)
        )
    names = [marker.name for marker in found]
    twice = sorted({name for name in names if names.count(name) > 1})
    if twice:
        raise ModelError(f"{parts.path}: the marker {twice[0]!r:.80} appears twice. Keep one.")
    return found


def _couplers(parts: _Parts, model: Element) -> list[Coupler]:
    found = []
    for element in objects(model, "ConstraintSet"):
        enforced = flag(element, "isEnforced", default=True) and not flag(element, "isDisabled")
        if element.tag != "CoordinateCouplerConstraint" or not enforced:
            continue
        where = parts.where(element)
        dependent = text(element, "dependent_coordinate_name")
        independent = text(element, "independent_coordinate_names").split()
        unknown = [n for n in (dependent, *independent) if n not in parts.coordinates]
        if unknown or len(independent) != 1:
            raise ModelError(
                f"{where}: it must join two coordinates of the model, not {dependent:.80} and "
                f"{', '.join(independent) or 'none'!s:.80}."
            )
        inner = element.find("coupled_coordinates_function")
        functions = [] if inner is None else [part for part in inner if is_function(part)]
        if not functions:
            raise ModelError(f"{where}: its function is missing or not understood.")
        found.append(Coupler(dependent, independent[0], read_function(functions[0], where)))
    return found


def _check_tree(path: Path, model: OsimModel) -> None:
    reached = {end.body for joint, _ in model.tree for end in (joint.parent, joint.child)}
    loose = [name for name in model.bodies if name not in reached]
    if loose:
        raise ModelError(
            f"{path}: the body {loose[0]!r:.80} has no joint to a parent body. Join it to "
            "the model, or to the ground by a FreeJoint."
        )
    # A joint whose both ends are placed by others is in no tree.
    if len(model.tree) < len(model.joints):
        inside = {joint.name for joint, _ in model.tree}
        loop = next(joint.name for joint in model.joints if joint.name not in inside)
        raise ModelError(
            f"{path}: the joint {loop!r:.80} closes a loop of bodies, whose pose the coordinates "
            "alone do not say. Replace it by a constraint."
        )
