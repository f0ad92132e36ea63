"""The body model as a URDF file: written from the Xacro template, read back exactly.

A URDF joint has one axis, so a joint of two or three coordinates is a chain of revolute joints
through massless links, each named after its coordinate. Numbers are written with all their digits,
so a model is written and read bit for bit.
"""

import hashlib
import json
import re
from collections.abc import Iterator, Mapping, Sequence
from importlib.resources import files
from itertools import pairwise
from pathlib import Path
from typing import Any
from xml.etree.ElementTree import Element

import numpy as np
import xacro

from gaitval._internal.io import file_gate
from gaitval._internal.io.artefacts import scratch, workplace, write_text
from gaitval._internal.text.plain_numbers import plain_float
from gaitval.arrays import Array
from gaitval.coordinates import ACTUATED, AXES, RANGES
from gaitval.errors import ModelError
from gaitval.model.body import (
    JOINT_COORDINATES,
    PARENTS,
    SEGMENTS,
    BodyModel,
    ContactSphere,
    Segment,
)
from gaitval.model.ground import LEVEL, Ground
from gaitval.model.safe_xml import parse_xml

TEMPLATE = "humanoid.urdf.xacro"
LARGEST_FILE = 1_000_000
"""Bytes; a model has about 40,000."""
NAME = re.compile(r"[A-Za-z0-9_. -]+")
_MOMENTS = ("x", "x"), ("x", "y"), ("x", "z"), ("y", "y"), ("y", "z"), ("z", "z")
_ENDS = (0, "parent"), (-1, "child")


def template_folder() -> Path:
    """Folder of the Xacro templates: in the installed package, or in the checkout. Raises
    ModelError if it is in neither.
    """
    package = Path(str(files("gaitval")))
    for folder in (package / "models" / "xacro", package.parent / "models" / "xacro"):
        if (folder / TEMPLATE).is_file():
            return folder
    raise ModelError(
        f"the template {TEMPLATE} is neither in the installed package ({package}) nor in a "
        "checkout beside it. Install gaitval again."
    )


def write_urdf(model: BodyModel, path: Path) -> None:
    """Write `model` to `path` as URDF through the Xacro template, whole or not at all. Raises
    ModelError if its name cannot be used in a URDF, or the template is missing.
    """
    if not NAME.fullmatch(model.name):
        raise ModelError(
            f"the model's name {model.name!r} cannot be used in a URDF: use letters, digits, "
            "spaces, dots, hyphens and underscores."
        )
    with scratch(workplace(path)) as folder:  # xacro looks from its template's
        body = folder / "body.json"
        body.write_text(json.dumps(_template_values(model)), encoding="utf-8")
        values = {"name": model.name, "body": str(body)}
        document = xacro.process_file(str(template_folder() / TEMPLATE), mappings=values)
    # The document also contains xacro's banner, which names a folder of this machine.
    text = document.documentElement.toprettyxml(indent="  ")
    write_text(Path(path), '<?xml version="1.0" encoding="utf-8"?>\n' + text)


def read_urdf(path: Path) -> BodyModel:
    """Read the model that `write_urdf` wrote to `path`, checking everything that later stages rely
    on.

    No other file is opened: entities, document types and meshes are refused. Raises ModelError if
    there is no such file, it is not URDF, or not this humanoid; the message names every link, joint
    or number that is wrong.
    """
    path = Path(path)
    robot = _parse(path)
    try:
        return _body_model(robot)
    except ModelError as error:
        raise ModelError(f"{path}: {error}") from None
    except ValueError as error:
        raise ModelError(
            f"{path}: cannot be read as URDF ({error}). Write it again with "
            "`gaitval stage scale SUBJECT`."
        ) from None


def model_hash(model: BodyModel) -> str:
    """SHA-256 of all numbers of the model, hexadecimal; its name does not count.

    The numbers are first rounded to 1e-10 (SI units), so that the last bits, which differ between
    processors, do not count either.
    """
    digest = hashlib.sha256()
    for each in model.segments:
        numbers = (each.joint_position, each.mass, each.centre_of_mass, each.inertia)
        _update(digest, each.name, *numbers)
    for sphere in model.spheres:
        _update(digest, f"{sphere.segment}/{sphere.name}", sphere.position, sphere.radius)
    if not model.ground.level:
        _update(digest, "ground", model.ground.slope, model.ground.cross_slope)
    return digest.hexdigest()


def _update(digest: Any, name: str, *values: Array | float) -> None:
    digest.update(name.encode())
    for value in values:
        # Adding zero turns -0.0, which equals 0.0, into it.
        digest.update((np.round(np.asarray(value), 10) + 0.0).astype("<f8").tobytes())


def _text(vector: Sequence[float] | Array) -> str:
    return " ".join(repr(float(value)) for value in vector)


def _template_values(model: BodyModel) -> dict[str, Any]:
    """What the template fills in: numbers as text with all digits; `shape` for drawing only."""
    values: dict[str, Any] = {
        "axes": {name: _text(axis) for name, axis in AXES.items()},
        "ranges": {name: [repr(value) for value in ends] for name, ends in RANGES.items()},
        "shape": _shape(model),
    }
    if not model.ground.level:
        values["ground"] = {
            "slope": repr(float(model.ground.slope)),
            "cross_slope": repr(float(model.ground.cross_slope)),
        }
    for segment in model.segments:
        inertia = segment.inertia
        values[segment.name] = {
            "joint": _text(segment.joint_position),
            "mass": repr(float(segment.mass)),
            "centre": _text(segment.centre_of_mass),
            "spheres": [
                {
                    "name": sphere.name,
                    "position": _text(sphere.position),
                    "radius": repr(float(sphere.radius)),
                }
                for sphere in model.spheres
                if sphere.segment == segment.name
            ],
        } | {
            f"i{row}{column}": repr(float(inertia["xyz".index(row), "xyz".index(column)]))
            for row, column in _MOMENTS
        }
    return values


def _shape(model: BodyModel) -> dict[str, float]:
    """Sizes of the drawn shapes, m, to the millimetre."""
    joint = {segment.name: segment.joint_position for segment in model.segments}
    sizes = {
        "hip_half_width": -joint["thigh_r"][1],
        "lumbar_height": joint["torso"][2],
        # Depth and girth are conventions for drawing; the body has only joints and masses.
        "pelvis_depth": 0.75 * abs(joint["torso"][2]) + 0.05,
        "shoulder_height": joint["upper_arm_r"][2],
        "shoulder_half_width": -joint["upper_arm_r"][1],
    }
    for side in "rl":
        foot, toes = (
            [s for s in model.spheres if s.segment == f"{name}_{side}"] for name in ("foot", "toes")
        )
        heel = min(s.position[0] - s.radius for s in foot)
        ball = joint[f"toes_{side}"][0]
        sizes |= {
            f"thigh_{side}": -joint[f"shank_{side}"][2],
            f"shank_{side}": -joint[f"foot_{side}"][2],
            f"foot_length_{side}": ball - heel,
            f"foot_middle_{side}": (ball + heel) / 2,
            f"sole_depth_{side}": max(s.radius - s.position[2] for s in foot),
            f"toes_length_{side}": max(s.position[0] + s.radius for s in toes),
            f"upper_arm_{side}": -joint[f"forearm_{side}"][2],
        }
    return {name: round(float(size), 3) for name, size in sizes.items()}


def _parse(path: Path) -> Element:
    content = file_gate.read_bytes(path, ModelError, largest=LARGEST_FILE)

    def no_mesh(tag: str) -> None:
        if tag == "mesh":
            raise ModelError(
                f"{path}: refers to a mesh file, but a body model has none. Write it again with "
                "`gaitval stage scale SUBJECT`."
            )

    return parse_xml(path, content, root="robot", kind="a URDF", on_start=no_mesh)


def _vector(of: Element, path: str, key: str, default: str = "0 0 0") -> Array:
    """Three numbers of an element inside `of`; the URDF's `default` where it or they are missing.
    Raises ValueError.
    """
    text = default if (found := of.find(path)) is None else found.get(key, default)
    vector = np.array([plain_float(word) for word in text.split()])
    if vector.shape != (3,):
        raise ValueError(f"{key} = {text!r:.80} of <{path}>: not three numbers")
    return vector


def _number(of: Element, path: str, key: str) -> float:
    """A number of an element inside `of`; NaN where it is missing. Raises ValueError."""
    return plain_float("nan" if (found := of.find(path)) is None else found.get(key, "nan"))


def _inertia(link: Element) -> Array:
    upper = {key: _number(link, "inertial/inertia", f"i{''.join(key)}") for key in _MOMENTS}
    return np.array([[upper[min(i, j), max(i, j)] for j in "xyz"] for i in "xyz"])


def _linked(joint: Element, end: str) -> str:
    """The link at the `parent` or `child` end of a joint."""
    return "nothing" if (found := joint.find(end)) is None else found.get("link", "nothing")


def _body_model(robot: Element) -> BodyModel:
    links = {link.get("name", ""): link for link in robot.iterfind("link")}
    joints = {joint.get("name", ""): joint for joint in robot.iterfind("joint")}
    _check_structure(robot, links, joints)
    segments = tuple(_segment(name, links[name], joints) for name in SEGMENTS)
    spheres = tuple(sphere for name in SEGMENTS for sphere in _spheres_of(name, links[name]))
    _refuse([*_bad_numbers(segments), *_bad_spheres(spheres)])
    name, ground = robot.get("name", ""), _ground_of(robot)
    return BodyModel(name=name, segments=segments, spheres=spheres, ground=ground)


def _ground_of(robot: Element) -> Ground:
    """The ground of a file that says one: an element of gaitval's own, which URDF does not have and
    other programs leave out. Raises ValueError.
    """
    found = robot.find("ground")
    if found is None:
        return LEVEL
    slopes = [plain_float(found.get(key, "0")) for key in ("slope", "cross_slope")]
    if not np.isfinite(slopes).all():
        raise ValueError(f"<ground> with slopes of {slopes} %: not finite")
    return Ground(*slopes)


def _refuse(problems: Sequence[str]) -> None:
    if problems:
        raise ModelError(
            "not a body model of gaitval:\n  "
            + "\n  ".join(problems)
            + "\nWrite it again with `gaitval stage scale SUBJECT`."
        )


def _check_structure(
    robot: Element, links: Mapping[str, Element], joints: Mapping[str, Element]
) -> None:
    problems = [f"link {name}: missing" for name in SEGMENTS if name not in links]
    problems += [f"joint {name}: missing" for name in ACTUATED if name not in joints]
    problems += [f"joint {name}: unknown" for name in joints if name not in AXES]
    if len(links) + len(joints) != len(robot.findall("link")) + len(robot.findall("joint")):
        problems.append("a link or a joint appears twice")
    _refuse(problems)

    between: set[str] = set()
    for name, coordinates in JOINT_COORDINATES.items():
        first, last = (_linked(joints[coordinates[i]], end) for i, end in _ENDS)
        if (first, last) != (PARENTS[name], name):
            problems.append(
                f"joints {', '.join(coordinates)}: lead from {first} to "
                f"{last}, not from {PARENTS[name]} to {name}"
            )
        for upper, lower in pairwise(coordinates):
            middle = _linked(joints[upper], "child")
            if middle != _linked(joints[lower], "parent"):
                problems.append(f"joint {lower}: does not follow {upper}")
            between.add(middle)
            if np.any(_vector(joints[lower], "origin", "xyz")):
                problems.append(f"joint {lower}: moved away from {upper}")
    for name, joint in joints.items():
        axis = _vector(joint, "axis", "xyz", "1 0 0")
        if joint.get("type") != "revolute":
            problems.append(f"joint {name}: {joint.get('type')}, not revolute")
        if not np.array_equal(axis, AXES[name]):
            problems.append(f"joint {name}: axis {axis}, not {AXES[name]}")
        if np.any(_vector(joint, "origin", "rpy")):
            problems.append(f"joint {name}: rotated by rpy, but all frames must be parallel")
    for name, link in links.items():
        if name in SEGMENTS:
            if link.find("inertial/mass") is None or link.find("inertial/inertia") is None:
                problems.append(f"link {name}: no mass or no inertia")
            elif np.any(_vector(link, "inertial/origin", "rpy")):
                problems.append(f"link {name}: inertia rotated by rpy")
        elif name not in between:
            problems.append(f"link {name}: unknown")
        elif _number(link, "inertial/mass", "value") or np.any(_inertia(link)):
            problems.append(
                f"link {name}: has mass (a link without <inertial> weighs 1 kg in DART)"
            )
    _refuse(problems)


def _segment(name: str, link: Element, joints: Mapping[str, Element]) -> Segment:
    joint = joints[JOINT_COORDINATES[name][0]] if name in JOINT_COORDINATES else None
    return Segment(
        name=name,
        joint_position=np.zeros(3) if joint is None else _vector(joint, "origin", "xyz"),
        mass=_number(link, "inertial/mass", "value"),
        centre_of_mass=_vector(link, "inertial/origin", "xyz"),
        inertia=_inertia(link),
    )


def _spheres_of(segment: str, link: Element) -> Iterator[ContactSphere]:
    for collision in link.iterfind("collision"):
        name = collision.get("name")
        if name is None or collision.find("geometry/sphere") is None:
            raise ModelError(f"link {segment}: a <collision> that is not a named sphere.")
        radius = _number(collision, "geometry/sphere", "radius")
        yield ContactSphere(name, segment, _vector(collision, "origin", "xyz"), radius)


def _bad_numbers(segments: Sequence[Segment]) -> Iterator[str]:
    for segment in segments:
        numbers = (segment.joint_position, segment.centre_of_mass, segment.inertia)
        if not all(np.isfinite(value).all() for value in (*numbers, segment.mass)):
            yield f"link {segment.name}: numbers that are not finite"
        elif segment.mass <= 0:
            yield f"link {segment.name}: mass {segment.mass} kg, not positive"
        else:
            moments = np.linalg.eigvalsh(segment.inertia)
            # Ixx + Iyy - Izz = 2 ∫ z² dm ≥ 0 for any mass, up to the rounding of a thin rod.
            if moments[0] <= 0 or moments[0] + moments[1] < moments[2] * (1 - 1e-9):
                yield (
                    f"link {segment.name}: principal moments {moments} are impossible for a rigid "
                    "body"
                )


def _bad_spheres(spheres: Sequence[ContactSphere]) -> Iterator[str]:
    for side in "rl":
        number = sum(sphere.segment in (f"foot_{side}", f"toes_{side}") for sphere in spheres)
        if number != 6:
            yield f"links foot_{side} and toes_{side}: {number} contact spheres, not 6"
    for sphere in spheres:
        if sphere.segment.split("_")[0] not in ("foot", "toes"):
            yield f"link {sphere.segment}: the contact sphere {sphere.name} is not on a foot"
        if not (np.isfinite(sphere.position).all() and 0 < sphere.radius < 1):
            yield (
                f"contact sphere {sphere.name}: position or radius ({sphere.radius} m) is not "
                "usable"
            )
