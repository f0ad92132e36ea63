"""What the ground does to a body: the forces of a contact law on all spheres of its feet.

At small slip friction acts like a damper of about μ fn / vt, some 3 kNs/m under a whole body, on a
foot of less than a kilogram: evaluated at the velocity before a step, it chatters unless the step
is below 0.25 ms. The forces are therefore linearly implicit in the velocity: with the slope κ =
∂f/∂v of a foot's contact and the mass m that it moves, the velocity at the end of the step is v +
(h/m) (f - f'), where f' is the force of the previous step, whose effect is already in v. Hence f =
(f(v) + a f') / (1 + a) with a = h κ / m. A constant force is unchanged, and the law holds exactly
as h goes to 0 (measured in docs/paper.md and docs/speed.md).
"""

from typing import NamedTuple

import numpy as np

from gaitval._internal.numba.compiled import njit, njit_borrowing
from gaitval._internal.numba.lanes import everywhere
from gaitval.arrays import Array
from gaitval.model.tree import (
    DOF_COUNT,
    FIRST_DOF,
    PARENT,
    Frames,
    Tree,
    empty_frames,
    forward,
    velocities,
)
from gaitval.walk.contact.law import ContactLaw, further, sphere_force
from gaitval.walk.contact.law import place as place_of

LEG_SEGMENTS = 9
"""Pelvis and both legs come first in `SEGMENTS`."""


class ContactWorkspace(NamedTuple):
    """Arrays that `contact_forces` works in.

    Attributes
    ----------
    place : (K, 3) m, where the force acts on each sphere, relative to the segment's joint, world
        axes.
    force : (K, 3) N, from the law at the velocity before the step.
    velocity : (3,) m/s of one of these places.
    slope : (2, 2) Ns/m, right and left foot: of the normal force and of friction.
    wrench : (9, 6) force and moment about the world origin on each segment and all segments below
        it.
    """

    place: Array
    force: Array
    velocity: Array
    slope: Array
    wrench: Array


@njit
def contact_workspace(spheres: int) -> ContactWorkspace:
    """Arrays to be filled, for a body with this many contact spheres (`spheres`)."""
    return ContactWorkspace(
        np.empty((spheres, 3)),
        np.empty((spheres, 3)),
        np.empty(3),
        np.empty((2, 2)),
        np.empty((LEG_SEGMENTS, 6)),
    )


@njit_borrowing
def contact_forces(
    tree: Tree,
    law: ContactLaw,
    frames: Frames,
    lag: Array,
    memory: Array,
    generalised: Array,
    feet: Array,
    work: ContactWorkspace,
) -> None:
    """Generalised forces of the ground on the body.

    It is long because its three passes, two over spheres and one over segments, work in the same
    arrays; none makes sense without the others.

    Parameters
    ----------
    tree, law : the body's geometry, and the contact law of its spheres.
    frames : of pelvis and legs at least.
    lag : (2,) m/(Ns): physics step / the mass that the contact of the right and left foot moves;
        zeros for the plain law.
    memory : (K, 3) in and out, N: the spheres' forces in the previous step, and in this one.
    generalised : (31,) in and out: the ground's generalised forces are added.
    feet : (2, 6) out: right and left foot, force N and moment Nm about the world origin.
    work : overwritten.
    """
    rotation, origin, axes = frames.rotation, frames.origin, frames.axes
    place, force, velocity, slope, wrench = work
    spheres = tree.sphere_segment.shape[0]
    for side in range(2):
        for i in range(2):
            slope[side, i] = 0.0
    for n in range(spheres):
        s = tree.sphere_segment[n]
        p = tree.sphere_position[n]
        r = place[n]
        for i in range(3):
            r[i] = rotation[s, i, 0] * p[0] + rotation[s, i, 1] * p[1] + rotation[s, i, 2] * p[2]
        radius = tree.sphere_radius[n]
        # The right foot's spheres come first in `BodyModel.spheres`.
        side = 0 if n < spheres // 2 else 1
        x, z = origin[s, 0] + r[0], origin[s, 2] + r[2]
        height, acting = place_of(law, side, x, z, radius)
        r[2] = acting - origin[s, 2]
        w, v = frames.angular[s], frames.linear[s]
        # Velocity of that point: v + ω × r.
        velocity[0] = v[0] + w[1] * r[2] - w[2] * r[1]
        velocity[1] = v[1] + w[2] * r[0] - w[0] * r[2]
        velocity[2] = v[2] + w[0] * r[1] - w[1] * r[0]
        normal, friction = sphere_force(law, radius, height, velocity, force[n])
        normal, friction = further(law, side, x, z, radius, velocity, force[n], normal, friction)
        slope[side, 0] += normal
        slope[side, 1] += friction
    part = slope  # a / (1 + a), the share of the previous step's force
    for side in range(2):
        for i in range(2):
            a = lag[side] * slope[side, i]
            part[side, i] = a / (1.0 + a)
    for s in range(LEG_SEGMENTS):
        for i in range(6):
            wrench[s, i] = 0.0
    for side in range(2):
        for i in range(6):
            feet[side, i] = 0.0
    for n in range(spheres):
        s = tree.sphere_segment[n]
        side = 0 if n < spheres // 2 else 1
        # f = (f(v) + a f') / (1 + a), with f' in `memory`; friction and the normal force have
        # different a. The result stays in `memory` for the next step.
        f, across, along = memory[n], part[side, 0], part[side, 1]
        f[0] = force[n, 0] + along * (f[0] - force[n, 0])
        f[1] = force[n, 1] + along * (f[1] - force[n, 1])
        f[2] = force[n, 2] + across * (f[2] - force[n, 2])
        x = origin[s, 0] + place[n, 0]
        y = origin[s, 1] + place[n, 1]
        z = origin[s, 2] + place[n, 2]
        m0, m1, m2 = y * f[2] - z * f[1], z * f[0] - x * f[2], x * f[1] - y * f[0]
        for total in (wrench[s], feet[side]):
            for i in range(3):
                total[i] += f[i]
            total[3] += m0
            total[4] += m1
            total[5] += m2
    # From the toes to the pelvis: a joint carries the wrenches of all segments below it. Its
    # generalised force is its axis times the moment about the joint, m - o × f.
    for s in range(LEG_SEGMENTS - 1, 0, -1):
        f = wrench[s]
        # A leg in the air adds nothing; in lanes it is skipped only if it is in the air for all
        # eight.
        if everywhere(f[0] == 0.0) and everywhere(f[1] == 0.0) and everywhere(f[2] == 0.0):
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


@njit
def ground_forces(
    tree: Tree,
    law: ContactLaw,
    q: Array,
    qd: Array,
    lag: Array,
    memory: Array,
    generalised: Array,
    feet: Array,
) -> None:
    """`contact_forces` for positions `q` and velocities `qd` (31,), with new frames and work
    arrays; `tree`, `law`, `lag`, `memory`, `generalised` and `feet` as it takes them.
    """
    frames = empty_frames()
    forward(tree.joint_position, q, frames, LEG_SEGMENTS)
    velocities(qd, frames, LEG_SEGMENTS)
    work = contact_workspace(tree.sphere_segment.shape[0])
    contact_forces(tree, law, frames, lag, memory, generalised, feet, work)
