"""Forward dynamics of the body and one physics step, compiled.

The equations of motion and the integrator are DART's (tests/simulation/test_dynamics.py compares
them): semi-implicit Euler with the joints' springs and dampers implicit,

    (M + h D + h² K) (q̇⁺ - q̇) = h (f - c - D q̇ - K (q + h q̇)),   q⁺ = q + h q̇⁺,

where the pelvis turns by its new angular velocity, R⁺ = exp(h ω⁺) R. The system is solved by the
articulated-body algorithm (Featherstone 2008, table 7.1) with all spatial quantities in world axes
about one point, the pelvis' origin, so that nothing is transformed between segments. The effect of
velocities and gravity on the accelerations is computed first (by recursive Newton-Euler with q̈ =
0), so that the articulated pass has no velocity terms.
"""

from typing import NamedTuple

import numpy as np

from gaitval.arrays import Array
from gaitval.compiled import njit, njit_borrowing
from gaitval.constants import GRAVITY
from gaitval.model.tree import (
    DOF_COUNT,
    FIRST_DOF,
    PARENT,
    SEGMENT_COUNT,
    Frames,
    Tree,
    turned_inertia,
    turned_vector,
)


class DynamicsWorkspace(NamedTuple):
    """Arrays that `accelerations` works in; spatial vectors are (angular, linear).

    Attributes
    ----------
    acceleration : (14, 6) of every segment, first without q̈ (linear part at its joint), then the
        part due to q̈ (linear part at the pelvis' origin).
    turned : (3, 3) inertia of one segment, world axes.
    inertia : (14, 6, 6) articulated inertia about the pelvis' origin.
    force : (14, 6) its bias force.
    axis : (31, 6) motion of the pelvis' origin with a unit rate of each joint coordinate.
    reaction : (31, 6) inertia times axis.
    compliance, drive : (31,) of each joint coordinate: 1 / (axis · reaction + h D + h² K), and the
        moment that remains for its acceleration.
    """

    acceleration: Array
    turned: Array
    inertia: Array
    force: Array
    axis: Array
    reaction: Array
    compliance: Array
    drive: Array


@njit
def dynamics_workspace() -> DynamicsWorkspace:
    """Arrays to be filled."""
    return DynamicsWorkspace(
        np.empty((14, 6)),
        np.empty((3, 3)),
        np.empty((14, 6, 6)),
        np.empty((14, 6)),
        np.empty((31, 6)),
        np.empty((31, 6)),
        np.empty(31),
        np.empty(31),
    )


@njit_borrowing
def _rigid_bodies(tree: Tree, frames: Frames, qd: Array, work: DynamicsWorkspace) -> None:
    """Inertia of every segment, and the force on it for the motion with q̈ = 0."""
    rotation, origin, axes, angular = frames.rotation, frames.origin, frames.axes, frames.angular
    acceleration, turned = work.acceleration, work.turned
    for s in range(SEGMENT_COUNT):
        w0, w1, w2 = angular[s, 0], angular[s, 1], angular[s, 2]
        if s == 0:
            b0, b1, b2, a0, a1, a2 = 0.0, 0.0, 0.0, 0.0, 0.0, GRAVITY
        else:
            p = PARENT[s]
            b0, b1, b2 = acceleration[p, 0], acceleration[p, 1], acceleration[p, 2]
            x = origin[s, 0] - origin[p, 0]
            y = origin[s, 1] - origin[p, 1]
            z = origin[s, 2] - origin[p, 2]
            o0, o1, o2 = angular[p, 0], angular[p, 1], angular[p, 2]
            t0, t1, t2 = o1 * z - o2 * y, o2 * x - o0 * z, o0 * y - o1 * x
            a0 = acceleration[p, 3] + b1 * z - b2 * y + o1 * t2 - o2 * t1
            a1 = acceleration[p, 4] + b2 * x - b0 * z + o2 * t0 - o0 * t2
            a2 = acceleration[p, 5] + b0 * y - b1 * x + o0 * t1 - o1 * t0
            for d in range(FIRST_DOF[s], FIRST_DOF[s] + DOF_COUNT[s]):
                u0, u1, u2 = axes[d, 0] * qd[d], axes[d, 1] * qd[d], axes[d, 2] * qd[d]
                b0 += o1 * u2 - o2 * u1
                b1 += o2 * u0 - o0 * u2
                b2 += o0 * u1 - o1 * u0
                o0, o1, o2 = o0 + u0, o1 + u1, o2 + u2
        acceleration[s, 0], acceleration[s, 1], acceleration[s, 2] = b0, b1, b2
        acceleration[s, 3], acceleration[s, 4], acceleration[s, 5] = a0, a1, a2

        # Centre of mass from the joint, and inertia about it, in world axes.
        r, m = rotation[s], tree.mass[s]
        k0, k1, k2 = tree.centre_of_mass[s, 0], tree.centre_of_mass[s, 1], tree.centre_of_mass[s, 2]
        c0 = r[0, 0] * k0 + r[0, 1] * k1 + r[0, 2] * k2
        c1 = r[1, 0] * k0 + r[1, 1] * k1 + r[1, 2] * k2
        c2 = r[2, 0] * k0 + r[2, 1] * k1 + r[2, 2] * k2
        turned_inertia(r, tree.inertia[s], turned)
        j00, j01, j02 = turned[0, 0], turned[0, 1], turned[0, 2]
        j11, j12, j22 = turned[1, 1], turned[1, 2], turned[2, 2]

        # Force through the centre of mass, moment about it.
        t0, t1, t2 = w1 * c2 - w2 * c1, w2 * c0 - w0 * c2, w0 * c1 - w1 * c0
        f0 = m * (a0 + b1 * c2 - b2 * c1 + w1 * t2 - w2 * t1)
        f1 = m * (a1 + b2 * c0 - b0 * c2 + w2 * t0 - w0 * t2)
        f2 = m * (a2 + b0 * c1 - b1 * c0 + w0 * t1 - w1 * t0)
        l0 = j00 * w0 + j01 * w1 + j02 * w2
        l1 = j01 * w0 + j11 * w1 + j12 * w2
        l2 = j02 * w0 + j12 * w1 + j22 * w2
        n0 = j00 * b0 + j01 * b1 + j02 * b2 + w1 * l2 - w2 * l1
        n1 = j01 * b0 + j11 * b1 + j12 * b2 + w2 * l0 - w0 * l2
        n2 = j02 * b0 + j12 * b1 + j22 * b2 + w0 * l1 - w1 * l0

        # Both about the pelvis' origin.
        x = c0 + origin[s, 0] - origin[0, 0]
        y = c1 + origin[s, 1] - origin[0, 1]
        z = c2 + origin[s, 2] - origin[0, 2]
        force = work.force[s]
        force[0] = n0 + y * f2 - z * f1
        force[1] = n1 + z * f0 - x * f2
        force[2] = n2 + x * f1 - y * f0
        force[3], force[4], force[5] = f0, f1, f2
        whole = work.inertia[s]  # its lower triangle
        whole[0, 0] = j00 + m * (y * y + z * z)
        whole[1, 0] = j01 - m * x * y
        whole[1, 1] = j11 + m * (x * x + z * z)
        whole[2, 0] = j02 - m * x * z
        whole[2, 1] = j12 - m * y * z
        whole[2, 2] = j22 + m * (x * x + y * y)
        whole[3, 0] = whole[4, 1] = whole[5, 2] = 0.0
        whole[3, 1], whole[3, 2] = m * z, -m * y
        whole[4, 0], whole[4, 2] = -m * z, m * x
        whole[5, 0], whole[5, 1] = m * y, -m * x
        whole[3, 3] = whole[4, 4] = whole[5, 5] = m
        whole[4, 3] = whole[5, 3] = whole[5, 4] = 0.0


@njit_borrowing
def _solve_root(inertia: Array, right: Array) -> None:
    """Solve inertia (6, 6) x = right (6,) in place by its L D Lᵀ factors; both are overwritten."""
    for k in range(6):
        inverse = 1.0 / inertia[k, k]
        for i in range(k + 1, 6):
            share = inertia[i, k] * inverse
            right[i] -= share * right[k]
            for j in range(k + 1, i + 1):
                inertia[i, j] -= share * inertia[j, k]
        inertia[k, k] = inverse
    for k in range(5, -1, -1):
        for i in range(k + 1, 6):
            right[k] -= inertia[i, k] * right[i]
        right[k] *= inertia[k, k]


@njit_borrowing
def accelerations(
    tree: Tree,
    frames: Frames,
    state: Array,
    forces: Array,
    stiffness: Array,
    damping: Array,
    step: float,
    work: DynamicsWorkspace,
    out: Array,
) -> None:
    """(q̇⁺ - q̇) / h of one step: the accelerations for h = 0.

    It is long because the articulated-body algorithm is one sweep to the pelvis and one back, which
    share all intermediate results.

    Parameters
    ----------
    frames : of all segments at `state`.
    state : (2, 31) positions and velocities.
    forces : (31,) generalised, without those of springs, dampers and gravity.
    stiffness, damping : (25,) Nm/rad, Nms/rad, of springs about zero and dampers in the joints.
    step : s, h.
    out : (31,) rad/s² and m/s².
    """
    q, qd = state[0], state[1]
    _rigid_bodies(tree, frames, qd, work)
    origin, axes = frames.origin, frames.axes
    inertia, force, reaction = work.inertia, work.force, work.reaction
    for s in range(SEGMENT_COUNT - 1, 0, -1):
        p = PARENT[s]
        x = origin[s, 0] - origin[0, 0]
        y = origin[s, 1] - origin[0, 1]
        z = origin[s, 2] - origin[0, 2]
        body, load = inertia[s], force[s]
        for d in range(FIRST_DOF[s] + DOF_COUNT[s] - 1, FIRST_DOF[s] - 1, -1):
            e0, e1, e2 = axes[d, 0], axes[d, 1], axes[d, 2]
            e3, e4, e5 = y * e2 - z * e1, z * e0 - x * e2, x * e1 - y * e0
            axis = work.axis[d]
            axis[0], axis[1], axis[2], axis[3], axis[4], axis[5] = e0, e1, e2, e3, e4, e5
            u = reaction[d]
            for i in range(6):
                total = body[i, 0] * e0
                for j in range(1, i + 1):
                    total += body[i, j] * axis[j]
                for j in range(i + 1, 6):
                    total += body[j, i] * axis[j]
                u[i] = total
            k, c = stiffness[d - 6], damping[d - 6]
            resistance = (
                e0 * u[0] + e1 * u[1] + e2 * u[2] + e3 * u[3] + e4 * u[4] + e5 * u[5]
                + step * c + step * step * k
            )  # fmt: skip
            drive = forces[d] - c * qd[d] - k * (q[d] + step * qd[d]) - (
                e0 * load[0] + e1 * load[1] + e2 * load[2]
                + e3 * load[3] + e4 * load[4] + e5 * load[5]
            )  # fmt: skip
            compliance = 1.0 / resistance
            work.compliance[d], work.drive[d] = compliance, drive
            for i in range(6):
                share = u[i] * compliance
                load[i] += share * drive
                for j in range(i + 1):
                    body[i, j] -= share * u[j]
        for i in range(6):
            force[p, i] += load[i]
            for j in range(i + 1):
                inertia[p, i, j] += body[i, j]
    acceleration = work.acceleration
    for i in range(6):
        acceleration[0, i] = forces[i] - force[0, i]
    _solve_root(inertia[0], acceleration[0])
    for i in range(6):
        out[i] = acceleration[0, i]
    for s in range(1, SEGMENT_COUNT):
        a, b = acceleration[s], acceleration[PARENT[s]]
        for i in range(6):
            a[i] = b[i]
        for d in range(FIRST_DOF[s], FIRST_DOF[s] + DOF_COUNT[s]):
            u, axis = reaction[d], work.axis[d]
            rate = work.drive[d] - (
                u[0] * a[0] + u[1] * a[1] + u[2] * a[2] + u[3] * a[3] + u[4] * a[4] + u[5] * a[5]
            )
            rate *= work.compliance[d]
            out[d] = rate
            for i in range(6):
                a[i] += axis[i] * rate


@njit_borrowing
def integrate(state: Array, acceleration: Array, step: float) -> None:
    """Semi-implicit Euler: velocities first, then positions with the new velocities.

    Parameters
    ----------
    state : (2, 31) in and out.
    acceleration : (31,) as from `accelerations`.
    """
    q, qd = state[0], state[1]
    for d in range(31):
        qd[d] += step * acceleration[d]
    turned_vector(q, qd, step)
    for d in range(3, 31):
        q[d] += step * qd[d]
