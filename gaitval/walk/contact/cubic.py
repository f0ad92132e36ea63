"""Contact with a cubic spring: the ground of Ackermann and van den Bogert's predicted gaits.

Ackermann and van den Bogert (2010) Optimality principles for model-based prediction of human gait,
J Biomech 43:1055-1060; the equations are those of their group's public model gait2d and of OpenSim
Moco's `AckermannVanDenBogert2010Force`. With penetration x, its rate v and slip s:

    fn = K x³ max(1 + b v, 0)  where x > 0, else 0
    ff = μ fn (2 / (1 + exp(-s/v0)) - 1)

Theirs acts at points in the sagittal plane; here it acts at the lowest point of each sphere, and
friction opposes the slip in any direction. Left out is their pull of 1 N for each metre above the
ground, which an optimiser needs and a walker does not. The force and its slopes in x are continuous
up to the second one.
"""

from typing import ClassVar, NamedTuple, Self

import numpy as np

from gaitval._internal.numba.compiled import njit_borrowing
from gaitval._internal.numba.lanes import everywhere, exponential, sqrt, where
from gaitval.arrays import Array
from gaitval.configuration import ContactSettings

SLOWEST = 1e-12
"""m²/s², added to the square of the slip, by which friction is divided."""


@njit_borrowing
def _force(
    law: "Cubic", radius: float, height: float, velocity: Array, out: Array
) -> tuple[float, float]:
    """`walk.contact.law.ContactLaw.force`."""
    x = radius - height
    none = 0.0 * radius
    far = x < none
    if everywhere(far):
        out[0] = out[1] = out[2] = none
        return none, none
    spring = where(far, none, law.stiffness * x * x * x)
    # velocity[2] is upwards, so the penetration rate v is its negative. The ground never pulls:
    # max(1 + b v, 0).
    given = 1.0 - law.dissipation * velocity[2]
    fn = spring * where(given < none, none, given)
    slip = sqrt(velocity[0] * velocity[0] + velocity[1] * velocity[1] + SLOWEST)
    # Friction over slip, so that its product with the horizontal velocity opposes the slip.
    along = law.friction * fn * (2.0 / (1.0 + exponential(-slip / law.friction_velocity)) - 1.0)
    along /= slip
    out[0] = -along * velocity[0]
    out[1] = -along * velocity[1]
    out[2] = fn
    # ∂fn/∂v at rest, and friction over slip: the slopes that make the force implicit.
    return law.dissipation * spring, along


class _Numbers(NamedTuple):
    """The numbers of the law; units as in `configuration.ContactSettings`."""

    stiffness: float
    dissipation: float
    friction: float
    friction_velocity: float


class Cubic(_Numbers):
    """The law as `walk.contact.law.ContactLaw` describes it."""

    __slots__ = ()
    force = _force
    settings: ClassVar[tuple[str, ...]] = (
        "cubic_stiffness",
        "cubic_dissipation",
        "cubic_friction_velocity",
    )

    @classmethod
    def of(cls, contact: ContactSettings, friction: float) -> Self:
        """The law of these settings, with a friction coefficient."""
        return cls(
            stiffness=contact.cubic_stiffness,
            dissipation=contact.cubic_dissipation,
            friction=friction,
            friction_velocity=contact.cubic_friction_velocity,
        )

    def static_force(self, radius: Array, depth: Array) -> Array:
        """`walk.contact.law.ContactLaw.static_force`."""
        return np.asarray(self.stiffness * depth**3 + 0.0 * radius)

    def opensim(self) -> None:
        """`walk.contact.law.ContactLaw.opensim`: OpenSim has it for points in a plane only."""
