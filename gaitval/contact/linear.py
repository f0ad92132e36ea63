"""Contact with a linear spring, shown in docs/how-to/contact-law.md.

With penetration x, its rate v and slip s:

    fn = K x max(1 + b v, 0)  where x > 0, else 0
    ff = μ fn s / sqrt(s² + v0²)
"""

from typing import ClassVar, NamedTuple, Self

import numpy as np

from gaitval.arrays import Array
from gaitval.compiled import njit_borrowing
from gaitval.configuration import ContactSettings
from gaitval.lanes import sqrt, where

SLIP = 0.05
"""m/s, slip velocity v0 at which friction is 71 % developed."""


@njit_borrowing
def _force(
    law: "Linear", radius: float, height: float, velocity: Array, out: Array
) -> tuple[float, float]:
    """`contact.law.ContactLaw.force`."""
    x, none = radius - height, 0.0 * radius
    spring = where(x < none, none, law.stiffness * x)
    given = 1.0 - law.dissipation * velocity[2]
    load = spring * where(given < none, none, given)
    slip = velocity[0] * velocity[0] + velocity[1] * velocity[1]
    drag = law.friction * load / sqrt(slip + SLIP * SLIP)
    out[0] = -drag * velocity[0]
    out[1] = -drag * velocity[1]
    out[2] = load
    return law.dissipation * spring, drag


class _Numbers(NamedTuple):
    """The numbers of the law; units as in `configuration.ContactSettings`."""

    stiffness: float
    dissipation: float
    friction: float


class Linear(_Numbers):
    """The law as `contact.law.ContactLaw` describes it."""

    __slots__ = ()
    force = _force
    settings: ClassVar[tuple[str, ...]] = ("linear_stiffness", "linear_dissipation")

    @classmethod
    def of(cls, contact: ContactSettings, friction: float) -> Self:
        """The law of these settings, with a `friction` coefficient, from `contact`."""
        return cls(contact.linear_stiffness, contact.linear_dissipation, friction)

    def static_force(self, radius: Array, depth: Array) -> Array:
        """`contact.law.ContactLaw.static_force` at a `depth` of spheres of a `radius`."""
        return np.asarray(self.stiffness * depth + 0.0 * radius)

    def opensim(self) -> None:
        """`contact.law.ContactLaw.opensim`: OpenSim has no such force."""
