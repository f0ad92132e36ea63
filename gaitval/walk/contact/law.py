"""What a contact law is, and which there are.

A law is a named tuple of its numbers with a compiled `force`. From the type of the tuple numba
knows which force to compile into the engines, so choosing a law costs nothing in a physics step.
docs/how-to/extend.md#choose-or-add-a-contact-law shows how to add one.
"""

from collections.abc import Callable, Mapping
from typing import Any, ClassVar, Final, Protocol, Self

from numba.extending import overload

from gaitval.arrays import Array
from gaitval.configuration import ContactSettings
from gaitval.walk.contact.hunt_crossley import HuntCrossley


class ContactLaw(Protocol):
    """The force of the ground on a sphere, and the numbers that it depends on, by name.

    Attributes
    ----------
    settings : the names of `configuration.ContactSettings` that it reads.
    """

    settings: ClassVar[tuple[str, ...]]

    @classmethod
    def of(cls, contact: ContactSettings, friction: float) -> Self:
        """The law of these settings, with a static friction coefficient (body parameter sigma)."""

    def force(
        self, radius: float, height: float, velocity: Array, out: Array
    ) -> tuple[float, float]:
        """Force of the ground on one sphere, into `out` (3,) N, world; compiled, for numbers and
        for lanes (`gaitval._internal.numba.lanes`). `radius` and `height` of its centre above the
        ground are m, `velocity` (3,) m/s that of its lowest point, world.

        Returns slopes, Ns/m, neither negative: of the normal force in the penetration rate, at
        rest, and friction / slip. `walk.contact.forces` makes the force implicit in the velocity
        with them.
        """

    def static_force(self, radius: Array, depth: Array) -> Array:
        """Normal force N on spheres of these radii (m) at rest at depths (≥ 0, m)."""

    def opensim(self) -> tuple[str, dict[str, float]] | None:
        """OpenSim's force between a sphere and a half-space: its class and the values of its
        properties; None if OpenSim has no such force.
        """


def _cubic() -> type[ContactLaw]:
    from gaitval.walk.contact.cubic import Cubic

    return Cubic


LAWS: Final[Mapping[str, Callable[[], type[ContactLaw]]]] = {
    "hunt_crossley": lambda: HuntCrossley,
    "cubic": _cubic,
}
"""What gives each law, by its name in the configuration, `contact.law`; a law that is not the
default is loaded only when it is asked for."""


def contact_law(contact: ContactSettings, friction: float) -> ContactLaw:
    """The law that `contact` names, with a static friction coefficient (body parameter sigma)."""
    return LAWS[contact.law]().of(contact, friction)


def _sphere_force(law: Any, radius: Any, height: Any, velocity: Any, out: Any) -> Any:
    """`ContactLaw.force` of any law, in Python and in compiled functions."""
    return law.force(radius, height, velocity, out)


sphere_force: Any = _sphere_force


# As `compiled.njit_borrowing` compiles: no references are counted.
_BORROWING: Any = {"_nrt": False, "error_model": "numpy"}


@overload(sphere_force, jit_options=_BORROWING)
def _force_of_the_type(law, radius, height, velocity, out):  # type: ignore[no-untyped-def]
    # numba calls this once for each type of law, with types instead of values, and compiles what it
    # returns: the named tuple's own `force`, known without a look-up at run time.
    force = law.instance_class.force

    def call(law, radius, height, velocity, out):  # type: ignore[no-untyped-def]
        return force(law, radius, height, velocity, out)

    return call


def _place(law: Any, side: Any, x: Any, z: Any, radius: Any) -> Any:
    """Of a sphere's centre at `x`, `z` (m, world) of the right (0) or left (1) foot: its height
    above the ground, and the height in the world at which the force on it acts, m. A law that has
    no `place` is of level ground at z = 0; the force acts in the middle of the overlap, as in
    OpenSim: half the penetration deep.
    """
    if hasattr(law, "place"):
        return law.place(side, x, z, radius)
    return z, 0.5 * (z - radius)


def _further(
    law: Any,
    side: Any,
    x: Any,
    z: Any,
    radius: Any,
    velocity: Any,
    out: Any,
    normal: Any,
    friction: Any,
) -> Any:
    """What a law with `further` does to a sphere beside its `force`, which is in `out` (3,) N and
    is changed there: the slopes of `ContactLaw.force`, now of both; `side`, `x`, `z` and `radius`
    as in `place`, and `velocity` (3,) m/s of where the force acts.
    """
    if hasattr(law, "further"):
        return law.further(side, x, z, radius, velocity, out, normal, friction)
    return normal, friction


place: Any = _place
further: Any = _further


@overload(place, jit_options=_BORROWING)
def _place_of_the_type(law, side, x, z, radius):  # type: ignore[no-untyped-def]
    own = getattr(law.instance_class, "place", None)
    if own is None:
        return lambda law, side, x, z, radius: (z, 0.5 * (z - radius))
    return lambda law, side, x, z, radius: own(law, side, x, z, radius)


@overload(further, jit_options=_BORROWING)
def _further_of_the_type(  # type: ignore[no-untyped-def]
    law, side, x, z, radius, velocity, out, normal, friction
):
    own = getattr(law.instance_class, "further", None)
    if own is None:
        return lambda law, side, x, z, radius, velocity, out, normal, friction: (normal, friction)

    def call(  # type: ignore[no-untyped-def]
        law, side, x, z, radius, velocity, out, normal, friction
    ):
        return own(law, side, x, z, radius, velocity, out, normal, friction)

    return call
