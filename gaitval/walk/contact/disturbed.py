"""Ground that is not as a walker expects it: slippery under a foot, lower from a line on, or with a
wall in the way of a foot.

`Disturbed` is a contact law around another one, which still says what a sphere and a plane do to
each other. It adds what only the place decides: the share of friction under each foot, the height
of the ground, and a vertical wall across the path of one foot, which pushes by the same law, turned
so that its normal points backwards. The law is a named tuple as all others, so a walk on level
ground pays nothing for it: what its type does not have is not compiled.
"""

from typing import Any, ClassVar, NamedTuple, Self

import numpy as np

from gaitval._internal.numba.compiled import njit_borrowing
from gaitval.arrays import Array
from gaitval.configuration import ContactSettings
from gaitval.walk.contact.law import ContactLaw, contact_law, sphere_force

IN_THE_AIR = 0.02
"""m above the ground, from which a sphere touches nothing but the wall; as `hunt_crossley.FADED`.
"""


@njit_borrowing
def _force(
    law: "Disturbed", radius: float, height: float, velocity: Array, out: Array
) -> tuple[float, float]:
    """`walk.contact.law.ContactLaw.force`, of the law around which this one is."""
    normal, friction = sphere_force(law.law, radius, height, velocity, out)
    return normal, friction


@njit_borrowing
def _place(law: "Disturbed", side: int, x: float, z: float, radius: float) -> tuple[float, float]:
    """`walk.contact.law.place`: the height above the ground there, and where the force acts."""
    ground = -law.drop if x > law.edge else 0.0
    height = z - ground
    if height - radius > IN_THE_AIR and _at_wall(law, side, x, z, radius):
        return height, z
    return height, ground + 0.5 * (height - radius)


@njit_borrowing
def _at_wall(law: "Disturbed", side: int, x: float, z: float, radius: float) -> bool:
    """Whether a sphere touches the wall."""
    return bool(
        law.wall_side == side
        and x + radius > law.wall - IN_THE_AIR
        and z - radius < law.wall_height
    )


@njit_borrowing
def _further(
    law: "Disturbed",
    side: int,
    x: float,
    z: float,
    radius: float,
    velocity: Array,
    out: Array,
    normal: float,
    friction: float,
) -> tuple[float, float]:
    """`walk.contact.law.further`: less friction, and the wall."""
    grip = law.grip_right if side == 0 else law.grip_left
    out[0] *= grip
    out[1] *= grip
    friction *= grip
    if _at_wall(law, side, x, z, radius):
        f0, f1, f2 = out[0], out[1], out[2]
        v0, v1, v2 = velocity[0], velocity[1], velocity[2]
        # The wall's own axes: its normal is -x, so what is forward in the world is downward there.
        velocity[0], velocity[1], velocity[2] = v1, v2, -v0
        steep, rough = sphere_force(law.law, radius, law.wall - x, velocity, out)
        w0, w1, w2 = -out[2], out[0], out[1]
        velocity[0], velocity[1], velocity[2] = v0, v1, v2
        out[0], out[1], out[2] = f0 + w0, f1 + w1, f2 + w2
        # What is implicit along x is the wall's normal force, and upwards its friction.
        friction += steep + rough
        normal += rough
    return normal, friction


class _Numbers(NamedTuple):
    """The numbers of the law.

    Attributes
    ----------
    law : of a sphere and a plane.
    grip_right, grip_left : share of its friction under the right and the left foot.
    edge, drop : m, x in the world from which on the ground is by `drop` lower.
    wall_side : whose path the wall crosses: 0 the right foot's, 1 the left one's, -1 none.
    wall, wall_height : m, x of the wall in the world, and its height above level ground.
    """

    law: Any
    grip_right: float
    grip_left: float
    edge: float
    drop: float
    wall_side: int
    wall: float
    wall_height: float


class Disturbed(_Numbers):
    """The law as `walk.contact.law.ContactLaw` says, with `place` and `further` of its own."""

    __slots__ = ()
    force = _force
    place = _place
    further = _further
    settings: ClassVar[tuple[str, ...]] = ()

    @classmethod
    def around(cls, law: ContactLaw) -> Self:
        """Ground as usual, until a number is replaced."""
        return cls(law, 1.0, 1.0, np.inf, 0.0, -1, np.inf, 0.0)

    @classmethod
    def of(cls, contact: ContactSettings, friction: float) -> Self:
        """Around the law that `contact` names."""
        return cls.around(contact_law(contact, friction))

    def static_force(self, radius: Array, depth: Array) -> Array:
        """`walk.contact.law.ContactLaw.static_force`, on level ground."""
        return np.asarray(self.law.static_force(radius, depth))

    def opensim(self) -> None:
        """`walk.contact.law.ContactLaw.opensim`: OpenSim has no such ground."""
