"""Hunt-Crossley contact of spheres with the ground plane z = 0, in its smooth form.

OpenSim's smooth sphere-half-space force (Serrancolí et al. 2019; simbody's
`SmoothSphereHalfSpaceForce`), with penetration x, its rate v and k = E^(2/3) / 2:

    fh = 4/3 k sqrt(R k) (sqrt(x² + cf))^1.5 (1/2 + 1/2 tanh(bd x))
    fn = fh (1 + 1.5 c v) (1/2 + 1/2 tanh(bv (v + 2 / (3 c))))
    ff = fn [min(vs/vt, 1) (μd + 2 (μs - μd) / (1 + (vs/vt)²)) + μv vs],  vs = sqrt(|vt|² + cf)
"""

from typing import ClassVar, NamedTuple, Self

import numpy as np

from gaitval._internal.numba.compiled import njit_borrowing
from gaitval._internal.numba.lanes import everywhere, exponential, sqrt, where
from gaitval.arrays import Array
from gaitval.configuration import ContactSettings

SMOOTHING = 1e-5
"""cf, m² and m²/s²."""
PENETRATION_SLOPE = 300.0
"""bd, 1/m."""
RATE_SLOPE = 50.0
"""bv, s/m."""
FADED = -0.02
"""Penetration, m, at which the smooth form has faded to 2e-4 of its value at the ground."""


@njit_borrowing
def _at_rest(factor: float, x: float) -> float:
    """fh at a penetration `x`, of which `factor` is what stiffness and radius make."""
    # 1/2 + 1/2 tanh(y) = 1 / (1 + exp(-2 y)), and y^0.75 = sqrt(y) sqrt(sqrt(y)), cost half.
    root = sqrt(x * x + SMOOTHING)
    force: float = factor * root * sqrt(root) / (1.0 + exponential(-2.0 * PENETRATION_SLOPE * x))
    return force


@njit_borrowing
def smooth_share(radius: float, x: float) -> float:
    """What of a foot's load at rest is on a sphere of a `radius` and a penetration `x`, both m, but
    for a factor that all spheres share. It fades above the ground, as the force does.
    """
    return 0.0 if x < FADED else _at_rest(sqrt(radius), x)


@njit_borrowing
def _force(
    law: "HuntCrossley", radius: float, height: float, velocity: Array, out: Array
) -> tuple[float, float]:
    """`walk.contact.law.ContactLaw.force`."""
    x = radius - height
    far = x < FADED
    none = 0.0 * radius
    if everywhere(far):
        out[0] = out[1] = out[2] = none
        return none, none
    # Penetration rate: velocity[2] is upwards.
    v = -velocity[2]
    fh = where(far, none, _at_rest(4.0 / 3.0 * law.k * sqrt(radius * law.k), x))
    c = law.dissipation
    fn = fh * (1.0 + 1.5 * c * v)
    # -2/(3c) is where 1 + 1.5 c v changes sign; the logistic factor keeps the ground from pulling.
    fn /= 1.0 + exponential(-2.0 * RATE_SLOPE * (v + 2.0 / (3.0 * c)))
    square = velocity[0] * velocity[0] + velocity[1] * velocity[1] + SMOOTHING
    slip, vt = sqrt(square), law.transition_velocity
    # min(vs/vt, 1) / vs = 1 / max(vs, vt), and both fractions in one division
    whole = vt * vt + square
    falling = law.dynamic_friction * whole + 2.0 * (law.static_friction - law.dynamic_friction) * (
        vt * vt
    )
    along = fn * (falling / (whole * where(slip < vt, vt, slip)) + law.viscous_friction)
    out[0] = -along * velocity[0]
    out[1] = -along * velocity[1]
    out[2] = fn
    # ∂fn/∂v at rest, and friction over slip: the slopes that make the force implicit.
    return 1.5 * c * fh, along


class _Numbers(NamedTuple):
    """The numbers of the law; units as in `configuration.ContactSettings`, and k = E^(2/3) / 2."""

    stiffness: float
    k: float
    dissipation: float
    static_friction: float
    dynamic_friction: float
    viscous_friction: float
    transition_velocity: float


class HuntCrossley(_Numbers):
    """The law as `walk.contact.law.ContactLaw` describes it."""

    __slots__ = ()
    force = _force
    settings: ClassVar[tuple[str, ...]] = (
        *("stiffness", "dissipation", "dynamic_to_static"),
        *("viscous_friction", "transition_velocity"),
    )

    @classmethod
    def of(cls, contact: ContactSettings, friction: float) -> Self:
        """The law of these settings, with a static friction coefficient."""
        return cls(
            stiffness=contact.stiffness,
            k=0.5 * contact.stiffness ** (2.0 / 3.0),
            dissipation=contact.dissipation,
            static_friction=friction,
            dynamic_friction=friction * contact.dynamic_to_static,
            viscous_friction=contact.viscous_friction,
            transition_velocity=contact.transition_velocity,
        )

    def static_force(self, radius: Array, depth: Array) -> Array:
        """`walk.contact.law.ContactLaw.static_force`, without the smoothing."""
        return np.asarray(4.0 / 3.0 * self.k * np.sqrt(radius * self.k) * depth**1.5)

    def opensim(self) -> tuple[str, dict[str, float]]:
        """`walk.contact.law.ContactLaw.opensim`."""
        numbers = self._asdict()
        del numbers["k"]
        return "SmoothSphereHalfSpaceForce", numbers | {
            "constant_contact_force": SMOOTHING,
            "hertz_smoothing": PENETRATION_SLOPE,
            "hunt_crossley_smoothing": RATE_SLOPE,
        }
