"""The body model as an OpenSim 4 model (`.osim`), with its markers and contact spheres.

OpenSim's names are used, so that a laboratory's own set-up files (external loads, tasks) fit:

| segment here       | body in OpenSim     | joint to its parent | what the body also is there     |
|--------------------|---------------------|---------------------|---------------------------------|
| pelvis             | pelvis              | ground_pelvis       |                                 |
| thigh_r, _l        | femur_r, _l         | hip_r, _l           |                                 |
| shank_r, _l        | tibia_r, _l         | knee_r, _l          | patella                         |
| foot_r, _l         | calcn_r, _l         | ankle_r, _l         | talus; both axes meet in ankle  |
| toes_r, _l         | toes_r, _l          | mtp_r, _l           |                                 |
| torso              | torso               | back                | head                            |
| upper_arm_r, _l    | humerus_r, _l       | acromial_r, _l      |                                 |
| forearm_r, _l      | ulna_r, _l          | elbow_r, _l         | radius, hand                    |

A body's frame is that of its segment, at the joint to its parent, in OpenSim's axes.
The contact forces are in the file but do not act (`appliesForce` false): OpenSim's inverse
dynamics would add them to the measured ground reaction. Set it true for forward simulation.
"""

import re
from collections.abc import Collection, Mapping, Sequence
from pathlib import Path
from typing import NamedTuple
from xml.etree import ElementTree
from xml.etree.ElementTree import Element

import numpy as np
from scipy.spatial.transform import Rotation

from gaitval._internal.io.artefacts import write_text
from gaitval.arrays import Array
from gaitval.configuration import ContactSettings
from gaitval.coordinates import ACTUATED, AXES, Side
from gaitval.errors import ModelError
from gaitval.model.body import JOINT_COORDINATES, PARENTS, SEGMENTS, BodyModel
from gaitval.model.markers import ModelMarker
from gaitval.model.measured_ranges import MEASURED_RANGES
from gaitval.session.opensim.coordinates import (
    PELVIS_ANGLES,
    PELVIS_TRANSLATIONS,
    TO_OPENSIM,
    vectors_to_opensim,
)
from gaitval.walk.contact.law import contact_law

DOCUMENT_VERSION = "40600"
"""Of the file format: OpenSim 4.6 reads the document as it is."""


def _both_sides(names: Mapping[str, str]) -> dict[str, str]:
    return {f"{ours}_{side}": f"{name}_{side}" for side in "rl" for ours, name in names.items()}


BODIES = {"pelvis": "pelvis", "torso": "torso"} | _both_sides(
    {
        "thigh": "femur",
        "shank": "tibia",
        "foot": "calcn",
        "toes": "toes",
        "upper_arm": "humerus",
        "forearm": "ulna",
    }
)
"""OpenSim's name of every segment's body."""

JOINTS = {"pelvis": "ground_pelvis", "torso": "back"} | _both_sides(
    {
        "thigh": "hip",
        "shank": "knee",
        "foot": "ankle",
        "toes": "mtp",
        "upper_arm": "acromial",
        "forearm": "elbow",
    }
)
"""OpenSim's name of the joint between every segment and its parent."""

FLOOR = "floor"


def component_name(name: str) -> str:
    """A `name` as OpenSim accepts it for a component, and in a TRC file for a marker: without
    blanks, control characters, slashes, stars and plus signs, in whose place is an underscore.
    """
    letters = (
        "_" if letter.isspace() or letter in "/\\*+" or not letter.isprintable() else letter
        for letter in name
    )
    return "".join(letters) or "_"


BONE, CLOTH = (0.93, 0.89, 0.78), (0.45, 0.55, 0.70)


def write_osim(
    path: Path,
    model: BodyModel,
    markers: Sequence[ModelMarker],
    contact: ContactSettings,
    friction: float,
    *,
    locked: Mapping[str, float] | None = None,
    height: float | None = None,
    lost: Mapping[Side, Collection[str]] | None = None,
    person: BodyModel | None = None,
) -> None:
    """Write the model to `path` as `.osim`, whole or not at all; equal arguments give equal bytes.

    Parameters
    ----------
    model : its name may have any character; those that OpenSim does not accept become underscores.
    markers : attached to the model, in the order of the file's MarkerSet, by `component_name`.
    contact : constants of the contact spheres.
    friction : static friction coefficient (the body parameter sigma).
    locked : values (rad) of coordinates that OpenSim's inverse kinematics must not change, because
        no marker determines them (such as `mtp_angle_r` in most marker sets).
    height : of the person, m: the model then has muscles; `lost` are coordinates of joints that a
        prosthesis has, by side, and `person` the own body of whoever wears a load in `model`: the
        muscles are theirs.

    Raises
    ------
    ModelError : two markers have one name, a marker is on an unknown segment, or the model does not
        have a held coordinate.
    """
    locked = locked or {}
    _check(markers, locked)
    document = ElementTree.Element("OpenSimDocument", Version=DOCUMENT_VERSION)
    root = _named(document, "Model", re.sub(r"[^\w.-]", "_", model.name) or "model")
    _text(root, "credits", "Written by gaitval")
    _text(root, "length_units", "meters")
    _text(root, "force_units", "N")
    _vector(root, "gravity", vectors_to_opensim(model.ground.gravity))
    _bodies(_set(root, "BodySet"), model)
    _joints(_set(root, "JointSet"), model, locked)
    forces = _set(root, "ForceSet")
    _contact_forces(forces, model, contact, friction)
    if height is not None:
        from gaitval.session.opensim.osim_muscles import add_muscles

        add_muscles(forces, person or model, height=height, lost=lost)
    _markers(_set(root, "MarkerSet"), markers)
    _contact_geometry(_set(root, "ContactGeometrySet"), model)
    ElementTree.indent(document)
    text = ElementTree.tostring(document, encoding="unicode")
    write_text(Path(path), f'<?xml version="1.0" encoding="UTF-8" ?>\n{text}\n')


def _check(markers: Sequence[ModelMarker], locked: Mapping[str, float]) -> None:
    names = [component_name(marker.name) for marker in markers]
    problems = [
        f"marker {name}: appears {names.count(name)} times, but a marker has one place"
        for name in sorted({name for name in names if names.count(name) > 1})
    ]
    problems += [
        f"marker {marker.name}: on the unknown segment {marker.segment}; the segments are "
        f"{', '.join(SEGMENTS)}"
        for marker in markers
        if marker.segment not in SEGMENTS
    ]
    problems += [
        f"held coordinate {name}: unknown; the coordinates are {', '.join(ACTUATED)}"
        for name in locked
        if name not in ACTUATED
    ]
    if problems:
        raise ModelError("the OpenSim model cannot be written:\n  " + "\n  ".join(problems))


# ---- XML. ----


def _text(parent: Element, tag: str, text: str) -> None:
    ElementTree.SubElement(parent, tag).text = text


def _vector(parent: Element, tag: str, values: Sequence[float] | Array) -> None:
    # Adding zero turns -0.0 into 0.0.
    _text(parent, tag, " ".join(repr(float(value) + 0.0) for value in values))


def _number(parent: Element, tag: str, value: float) -> None:
    _vector(parent, tag, (value,))


def _flag(parent: Element, tag: str, value: bool) -> None:
    _text(parent, tag, "true" if value else "false")


def _named(parent: Element, tag: str, name: str) -> Element:
    return ElementTree.SubElement(parent, tag, name=name)


def _set(parent: Element, tag: str) -> Element:
    """Add a named set of components; returns the element that contains them."""
    return ElementTree.SubElement(_named(parent, tag, tag.lower()), "objects")


# ---- Bodies. ----


class _Shape(NamedTuple):
    """An ellipsoid to draw, in the segment's frame and the project's axes: its centre, its
    half axes (m; the third along `along`) and the direction of its third axis.
    """

    centre: Array
    radii: tuple[float, float, float]
    along: Array
    colour: tuple[float, float, float] = BONE


UP = np.array([0.0, 0.0, 1.0])


def _limb(end: Array, radius: float) -> _Shape:
    length = float(np.linalg.norm(end))
    return _Shape(end / 2, (radius, radius, length / 2), end / length)


def _foot_box(model: BodyModel, segment: str, ahead: float, above: float) -> _Shape:
    """An ellipsoid around the spheres of a segment, up to `ahead` and `above` its origin."""
    spheres = [sphere for sphere in model.spheres if sphere.segment == segment]
    places = np.array([sphere.position for sphere in spheres])
    radii = np.array([[sphere.radius] for sphere in spheres])
    low, high = (places - radii).min(axis=0), (places + radii).max(axis=0)
    high = np.array([max(high[0], ahead), high[1], above])
    depth, width, height = (high - low) / 2
    return _Shape((low + high) / 2, (float(depth), float(width), float(height)), UP)


def _shapes(model: BodyModel) -> dict[str, tuple[_Shape, ...]]:
    """What is drawn for every segment: its lengths are right, its girth is a convention."""
    joint = {segment.name: segment.joint_position for segment in model.segments}
    hip, lumbar, shoulder = abs(joint["thigh_r"][1]), joint["torso"], joint["upper_arm_r"]
    neck = np.array([0.0, 0.0, shoulder[2]])
    shapes = {
        "pelvis": (_Shape(lumbar / 2, (0.09, hip + 0.06, abs(lumbar[2]) / 2 + 0.05), UP, CLOTH),),
        "torso": (
            _Shape(neck / 2, (0.10, abs(shoulder[1]), shoulder[2] / 2 + 0.05), UP, CLOTH),
            _Shape(neck + 0.19 * UP, (0.10, 0.075, 0.13), UP),
        ),
    }
    for side in "rl":
        forearm = model[f"forearm_{side}"].centre_of_mass
        shapes |= {
            f"thigh_{side}": (_limb(joint[f"shank_{side}"], 0.065),),
            f"shank_{side}": (_limb(joint[f"foot_{side}"], 0.045),),
            f"foot_{side}": (_foot_box(model, f"foot_{side}", joint[f"toes_{side}"][0], 0.0),),
            f"toes_{side}": (_foot_box(model, f"toes_{side}", 0.0, 0.01),),
            f"upper_arm_{side}": (_limb(joint[f"forearm_{side}"], 0.04),),
            f"forearm_{side}": (_limb(2 * forearm, 0.032),),
        }
    return shapes


def _bodies(bodies: Element, model: BodyModel) -> None:
    shapes = _shapes(model)
    for segment in model.segments:
        body = _named(bodies, "Body", BODIES[segment.name])
        components = ElementTree.SubElement(body, "components")
        for number, shape in enumerate(shapes[segment.name], start=1):
            _draw(components, f"{BODIES[segment.name]}_shape_{number}", shape)
        _number(body, "mass", segment.mass)
        _vector(body, "mass_center", vectors_to_opensim(segment.centre_of_mass))
        inertia = TO_OPENSIM @ segment.inertia @ TO_OPENSIM.T
        # OpenSim's order: xx yy zz xy xz yz.
        order = ((0, 0), (1, 1), (2, 2), (0, 1), (0, 2), (1, 2))
        _vector(body, "inertia", [inertia[index] for index in order])


def _draw(components: Element, name: str, shape: _Shape) -> None:
    frame = _named(components, "PhysicalOffsetFrame", name)
    geometry = ElementTree.SubElement(frame, "attached_geometry")
    ellipsoid = _named(geometry, "Ellipsoid", f"{name}_ellipsoid")
    _text(ellipsoid, "socket_frame", "..")
    appearance = ElementTree.SubElement(ellipsoid, "Appearance")
    _vector(appearance, "color", shape.colour)
    # OpenSim's half axes are along X, Y, Z: forward, up, right.
    forward, left, up = np.round(shape.radii, 3)
    _vector(ellipsoid, "radii", (forward, up, left))
    _text(frame, "socket_parent", "..")
    _vector(frame, "translation", np.round(vectors_to_opensim(shape.centre), 3))
    turn, _ = Rotation.align_vectors([vectors_to_opensim(shape.along)], [(0.0, 1.0, 0.0)])
    _vector(frame, "orientation", np.round(turn.as_euler("XYZ"), 3))


# ---- Joints. ----


def _joints(joints: Element, model: BodyModel, locked: Mapping[str, float]) -> None:
    for segment in model.segments:
        name = JOINTS[segment.name]
        parent = PARENTS.get(segment.name)
        joint = _named(joints, "CustomJoint", name)
        _text(joint, "socket_parent_frame", f"{name}_parent")
        _text(joint, "socket_child_frame", f"/bodyset/{BODIES[segment.name]}")
        coordinates = ElementTree.SubElement(joint, "coordinates")
        frames = ElementTree.SubElement(joint, "frames")
        frame = _named(frames, "PhysicalOffsetFrame", f"{name}_parent")
        _text(frame, "socket_parent", f"/bodyset/{BODIES[parent]}" if parent else "/ground")
        _vector(frame, "translation", vectors_to_opensim(segment.joint_position))
        _vector(frame, "orientation", np.zeros(3))
        if parent is None:
            for angle in PELVIS_ANGLES:
                _coordinate(coordinates, angle, (-np.pi, np.pi))
            for translation in PELVIS_TRANSLATIONS:
                _coordinate(coordinates, translation, (-100.0, 100.0))
            # Tilt about Z, list about X, rotation about Y.
            axes = dict(zip(PELVIS_ANGLES, np.eye(3)[[2, 0, 1]], strict=True))
            _transform(joint, axes, PELVIS_TRANSLATIONS)
        else:
            axes = {
                coordinate: vectors_to_opensim(np.array(AXES[coordinate]))
                for coordinate in JOINT_COORDINATES[segment.name]
            }
            for coordinate in axes:
                _coordinate(
                    coordinates, coordinate, MEASURED_RANGES[coordinate], locked.get(coordinate)
                )
            _transform(joint, axes, ())


def _coordinate(
    coordinates: Element, name: str, limits: tuple[float, float], locked: float | None = None
) -> None:
    coordinate = _named(coordinates, "Coordinate", name)
    _number(coordinate, "default_value", locked or 0.0)
    _number(coordinate, "default_speed_value", 0.0)
    _vector(coordinate, "range", limits)
    _flag(coordinate, "clamped", name in ACTUATED)
    _flag(coordinate, "locked", locked is not None)


def _transform(joint: Element, rotations: Mapping[str, Array], translations: Sequence[str]) -> None:
    """The joint's motion: successive rotations, and translations along X, Y, Z."""
    transform = ElementTree.SubElement(joint, "SpatialTransform")
    axes = list(rotations.values())
    # Unused rotations need axes too, different from those of the others.
    axes += [axis for axis in np.eye(3) if not any(abs(axis @ used) > 0.5 for used in axes)]
    names = [*rotations, *[""] * (3 - len(rotations))]
    for number, (name, axis) in enumerate(zip(names, axes, strict=True), start=1):
        _transform_axis(transform, f"rotation{number}", name, axis)
    names = list(translations) or [""] * 3
    for number, (name, axis) in enumerate(zip(names, np.eye(3), strict=True), start=1):
        _transform_axis(transform, f"translation{number}", name, axis)


def _transform_axis(transform: Element, place: str, coordinate: str, axis: Array) -> None:
    element = _named(transform, "TransformAxis", place)
    _text(element, "coordinates", coordinate)
    _vector(element, "axis", axis)
    if coordinate:
        _vector(_named(element, "LinearFunction", "function"), "coefficients", (1.0, 0.0))
    else:
        _number(_named(element, "Constant", "function"), "value", 0.0)


# ---- Markers and contact. ----


def _markers(set_: Element, markers: Sequence[ModelMarker]) -> None:
    for marker in markers:
        element = _named(set_, "Marker", component_name(marker.name))
        _text(element, "socket_parent_frame", f"/bodyset/{BODIES[marker.segment]}")
        _vector(element, "location", vectors_to_opensim(marker.position))
        _flag(element, "fixed", True)


def _contact_geometry(set_: Element, model: BodyModel) -> None:
    floor = _named(set_, "ContactHalfSpace", FLOOR)
    _text(floor, "socket_frame", "/ground")
    _vector(floor, "location", np.zeros(3))
    # A half-space is where its own X is positive: downwards.
    _vector(floor, "orientation", (0.0, 0.0, -np.pi / 2))
    for sphere in model.spheres:
        element = _named(set_, "ContactSphere", sphere.name)
        _text(element, "socket_frame", f"/bodyset/{BODIES[sphere.segment]}")
        _vector(element, "location", vectors_to_opensim(sphere.position))
        _vector(element, "orientation", np.zeros(3))
        _number(element, "radius", sphere.radius)


def _contact_forces(
    set_: Element, model: BodyModel, contact: ContactSettings, friction: float
) -> None:
    known = contact_law(contact, friction).opensim()
    if known is None:
        return
    kind, properties = known
    for sphere in model.spheres:
        force = _named(set_, kind, f"{sphere.name}_force")
        _flag(force, "appliesForce", False)
        _text(force, "socket_sphere", f"/contactgeometryset/{sphere.name}")
        _text(force, "socket_half_space", f"/contactgeometryset/{FLOOR}")
        for name, value in properties.items():
            _number(force, name, value)
