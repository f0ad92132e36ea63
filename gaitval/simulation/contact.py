"""Hunt-Crossley contact of spheres with the ground plane z = 0.

OpenSim's smooth sphere-half-space force (Serrancolí et al. 2019; simbody's
`SmoothSphereHalfSpaceForce`): with penetration x, its rate v and k = E^(2/3) / 2

    fh = 4/3 k sqrt(R k) (sqrt(x² + cf))^1.5 (1/2 + 1/2 tanh(bd x))
    fn = fh (1 + 1.5 c v) (1/2 + 1/2 tanh(bv (v + 2 / (3 c))))
    ff = fn [min(vs/vt, 1) (μd + 2 (μs - μd) / (1 + (vs/vt)²)) + μv vs],  vs = sqrt(|vt|² + cf)
"""

from typing import NamedTuple

import numba
import numpy as np
from numpy.typing import NDArray

from gaitval.configuration import Contact
from gaitval.kinematics.tree import (
    DOF_COUNT,
    FIRST_DOF,
    PARENT,
    Tree,
    forward,
    velocities,
)

Array = NDArray[np.float64]

SMOOTHING = 1e-5
"""cf, m² and m²/s²."""
PENETRATION_SLOPE = 300.0
"""bd, 1/m."""
RATE_SLOPE = 50.0
"""bv, s/m."""

LEG_SEGMENTS = 9
"""Pelvis and both legs come first in `SEGMENTS`."""


class ContactLaw(NamedTuple):
    """Numbers of the contact law; units as in `configuration.Contact`."""

    stiffness: float
    dissipation: float
    static_friction: float
    dynamic_friction: float
    viscous_friction: float
    transition_velocity: float


def contact_law(contact: Contact, friction: float) -> ContactLaw:
    """The law with a static friction coefficient `friction` (the body parameter sigma)."""
    return ContactLaw(
        stiffness=contact.stiffness,
        dissipation=contact.dissipation,
        static_friction=friction,
        dynamic_friction=friction * contact.dynamic_to_static,
        viscous_friction=contact.viscous_friction,
        transition_velocity=contact.transition_velocity,
    )


@numba.njit(cache=True)
def sphere_force(
    law: ContactLaw, radius: float, height: float, velocity: Array, out: Array
) -> None:
    """Force of the ground on one sphere.

    Parameters
    ----------
    radius, height : m, of the sphere and of its centre above the ground.
    velocity : (3,) m/s, of the sphere's lowest point, world.
    out : (3,) N out, world.
    """
    x = radius - height
    if x < -0.02:  # the smooth form has faded to 2e-4 of its value at the ground
        out[:] = 0.0
        return
    v = -velocity[2]
    k = 0.5 * law.stiffness ** (2.0 / 3.0)
    fh = (
        4.0 / 3.0 * k * np.sqrt(radius * k)
        * (x * x + SMOOTHING) ** 0.75
        * (0.5 + 0.5 * np.tanh(PENETRATION_SLOPE * x))
    )  # fmt: skip
    c = law.dissipation
    fn = fh * (1.0 + 1.5 * c * v) * (0.5 + 0.5 * np.tanh(RATE_SLOPE * (v + 2.0 / (3.0 * c))))
    slip = np.sqrt(velocity[0] ** 2 + velocity[1] ** 2 + SMOOTHING)
    ratio = slip / law.transition_velocity
    excess = law.static_friction - law.dynamic_friction
    ff = fn * (
        min(ratio, 1.0) * (law.dynamic_friction + 2.0 * excess / (1.0 + ratio * ratio))
        + law.viscous_friction * slip
    )
    out[0] = -ff * velocity[0] / slip
    out[1] = -ff * velocity[1] / slip
    out[2] = fn


@numba.njit(cache=True)
def ground_forces(
    tree: Tree,
    law: ContactLaw,
    q: Array,
    qd: Array,
    generalised: Array,
    feet: Array,
) -> None:
    """Generalised forces of the ground on the body.

    Parameters
    ----------
    q, qd : (31,) positions and velocities.
    generalised : (31,) in and out: the ground's generalised forces are added.
    feet : (2, 6) out: right and left foot, force N and moment Nm about the world origin.
    """
    rotation = np.empty((LEG_SEGMENTS, 3, 3))
    origin = np.empty((LEG_SEGMENTS, 3))
    axes = np.empty((31, 3))
    forward(tree.joint_position, q, rotation, origin, axes, LEG_SEGMENTS)
    angular = np.empty((LEG_SEGMENTS, 3))
    linear = np.empty((LEG_SEGMENTS, 3))
    velocities(origin, axes, qd, angular, linear, LEG_SEGMENTS)
    wrench = np.zeros((LEG_SEGMENTS, 6))  # force, moment about the world origin
    velocity = np.empty(3)
    force = np.empty(3)
    feet[:] = 0.0
    spheres = tree.sphere_segment.shape[0]
    for n in range(spheres):
        s = tree.sphere_segment[n]
        p = tree.sphere_position[n]
        r0 = rotation[s, 0, 0] * p[0] + rotation[s, 0, 1] * p[1] + rotation[s, 0, 2] * p[2]
        r1 = rotation[s, 1, 0] * p[0] + rotation[s, 1, 1] * p[1] + rotation[s, 1, 2] * p[2]
        r2 = rotation[s, 2, 0] * p[0] + rotation[s, 2, 1] * p[1] + rotation[s, 2, 2] * p[2]
        radius = tree.sphere_radius[n]
        height = origin[s, 2] + r2
        if height > radius + 0.02:
            continue
        # The force acts in the middle of the overlap, as in OpenSim: half the penetration deep.
        z = 0.5 * (height - radius)
        arm = z - origin[s, 2]
        velocity[0] = linear[s, 0] + angular[s, 1] * arm - angular[s, 2] * r1
        velocity[1] = linear[s, 1] + angular[s, 2] * r0 - angular[s, 0] * arm
        velocity[2] = linear[s, 2] + angular[s, 0] * r1 - angular[s, 1] * r0
        sphere_force(law, radius, height, velocity, force)
        x = origin[s, 0] + r0
        y = origin[s, 1] + r1
        m0 = y * force[2] - z * force[1]
        m1 = z * force[0] - x * force[2]
        m2 = x * force[1] - y * force[0]
        side = 0 if n < spheres // 2 else 1
        for i in range(3):
            wrench[s, i] += force[i]
            feet[side, i] += force[i]
        wrench[s, 3] += m0
        wrench[s, 4] += m1
        wrench[s, 5] += m2
        feet[side, 3] += m0
        feet[side, 4] += m1
        feet[side, 5] += m2
    for s in range(LEG_SEGMENTS - 1, 0, -1):
        f = wrench[s]
        if f[0] == 0.0 and f[1] == 0.0 and f[2] == 0.0:
            continue
        o = origin[s]
        m0 = f[3] - (o[1] * f[2] - o[2] * f[1])
        m1 = f[4] - (o[2] * f[0] - o[0] * f[2])
        m2 = f[5] - (o[0] * f[1] - o[1] * f[0])
        for d in range(FIRST_DOF[s], FIRST_DOF[s] + DOF_COUNT[s]):
            generalised[d] += axes[d, 0] * m0 + axes[d, 1] * m1 + axes[d, 2] * m2
        for i in range(6):
            wrench[PARENT[s], i] += f[i]
    f = wrench[0]
    o = origin[0]
    generalised[0] += f[3] - (o[1] * f[2] - o[2] * f[1])
    generalised[1] += f[4] - (o[2] * f[0] - o[0] * f[2])
    generalised[2] += f[5] - (o[0] * f[1] - o[1] * f[0])
    for i in range(3):
        generalised[3 + i] += f[i]
