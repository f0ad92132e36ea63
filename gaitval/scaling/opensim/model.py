"""A model of OpenSim as it is read from an `.osim` file: bodies, joints, coordinates, markers.

`read_model` reads files of OpenSim 3 and 4. Every joint is a spatial transform: three rotations,
one after the other, about axes that turn with those before, then three translations along axes of
the parent's frame (Delp et al. 2007; OpenSim's `CustomJoint`). The simpler joints are special cases
of it. Muscles, contact, controllers and the like are left out: nothing here needs them.

Axes are those of the file (X forward, Y up, Z right in gait models), SI units, rad.
"""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from functools import cached_property
from typing import Final, Literal

import numpy as np

from gaitval.arrays import Array
from gaitval.scaling.opensim.functions import CoordinateFunction

GROUND: Final = "ground"

MotionKind = Literal["rotational", "translational", "coupled"]
"""OpenSim's: only values of rotational coordinates are in degrees in a file in degrees. A
coordinate that drives its joint by anything but a straight line of slope 1 is coupled."""


@dataclass(frozen=True)
class OpenSimBody:
    """A rigid body; mass kg, centre of mass m, inertia (3, 3) kg m² about it, in its frame."""

    name: str
    mass: float
    centre: Array
    inertia: Array


@dataclass(frozen=True)
class Coordinate:
    """A generalised coordinate.

    Attributes
    ----------
    default : its value where a motion does not give it, rad or m.
    range : lowest and highest value, rad or m.
    """

    name: str
    joint: str
    default: float
    range: tuple[float, float]
    locked: bool
    motion: MotionKind


@dataclass(frozen=True)
class TransformAxis:
    """One of the six movements of a joint: about or along `axis` by `function` of `coordinate`.

    Attributes
    ----------
    coordinate : None for a movement that no coordinate drives.
    axis : (3,) of length 1.
    """

    coordinate: str | None
    axis: Array
    function: CoordinateFunction


@dataclass(frozen=True)
class Frame:
    """A frame that is fixed to a body: rotation (3, 3) and origin (3,) m in the body's frame."""

    body: str
    rotation: Array
    origin: Array


@dataclass(frozen=True)
class OpenSimJoint:
    """A joint between frames of two bodies; `axes` are its three rotations and translations."""

    name: str
    parent: Frame
    child: Frame
    coordinates: tuple[str, ...]
    axes: tuple[TransformAxis, ...]


@dataclass(frozen=True)
class Marker:
    """A marker at `location` (3,) m in a body's frame."""

    name: str
    body: str
    location: Array


@dataclass(frozen=True)
class Coupler:
    """A coordinate that follows another: dependent = scale · function(independent)."""

    dependent: str
    independent: str
    function: CoordinateFunction


@dataclass(frozen=True)
class OsimModel:
    """What a file says of the skeleton.

    Attributes
    ----------
    version : of the file format, such as 30000 or 40600.
    gravity : (3,) m/s².
    """

    name: str
    version: int
    gravity: Array
    bodies: Mapping[str, OpenSimBody]
    joints: tuple[OpenSimJoint, ...]
    coordinates: Mapping[str, Coordinate]
    markers: tuple[Marker, ...]
    couplers: tuple[Coupler, ...]

    @property
    def mass(self) -> float:
        """Of all bodies, kg."""
        return sum(body.mass for body in self.bodies.values())

    @cached_property
    def up(self) -> Array:
        """Unit vector (3,) against gravity; Y without gravity."""
        size = float(np.linalg.norm(self.gravity))
        return -self.gravity / size if size > 0 else np.array([0.0, 1.0, 0.0])

    @cached_property
    def tree(self) -> tuple[tuple[OpenSimJoint, bool], ...]:
        """The joints in an order in which one end of each is already placed; True where that
        end is the child's.
        """
        placed, left = {GROUND}, list(self.joints)
        found: list[tuple[OpenSimJoint, bool]] = []
        while left:
            ready = [j for j in left if (j.parent.body in placed) != (j.child.body in placed)]
            if not ready:
                break
            joint = ready[0]
            left.remove(joint)
            found.append((joint, joint.child.body in placed))
            placed |= {joint.parent.body, joint.child.body}
        return tuple(found)

    def root(self) -> OpenSimJoint | None:
        """The joint that joins the model to the ground, if there is exactly one."""
        roots = [j for j in self.joints if GROUND in (j.parent.body, j.child.body)]
        return roots[0] if len(roots) == 1 else None

    def joint_of(self, coordinate: str) -> OpenSimJoint:
        """The joint that a coordinate moves."""
        name = self.coordinates[coordinate].joint
        return next(joint for joint in self.joints if joint.name == name)

    def children(self, body: str) -> Iterator[str]:
        """Bodies that hang on a body, near ones first."""
        for joint, reverse in self.tree:
            near, far = (joint.child, joint.parent) if reverse else (joint.parent, joint.child)
            if near.body == body:
                yield far.body
                yield from self.children(far.body)
