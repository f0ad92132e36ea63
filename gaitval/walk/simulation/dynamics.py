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

from typing import Any, NamedTuple

import numpy as np

from gaitval._internal.numba.compiled import njit, njit_borrowing
from gaitval.arrays import Array
from gaitval.model.tree import (
    COORDINATE_COUNT,
    DOF_COUNT,
    FIRST_DOF,
    PARENT,
    SEGMENT_COUNT,
    Frames,
    Tree,
    turned_vector,
)


class DynamicsWorkspace(NamedTuple):
    """Arrays that `accelerations` works in; spatial vectors are (angular, linear).

    Attributes
    ----------
    acceleration : (14, 6) of every segment, first without q̈ (linear part at its joint), then the
        part due to q̈ (linear part at the pelvis' origin).
    inertia : (14, 21) articulated inertia about the pelvis' origin: the lower triangle, row by row.
    force : (14, 6) its bias force.
    axis : (31, 6) motion of the pelvis' origin with a unit rate of each joint coordinate.
    reaction : (31, 6) inertia times axis.
    compliance, drive : (31,) of each joint coordinate: 1 / (axis · reaction + h D + h² K), and the
        moment that remains for its acceleration.
    """

    acceleration: Array
    inertia: Array
    force: Array
    axis: Array
    reaction: Array
    compliance: Array
    drive: Array


@njit
def dynamics_workspace() -> DynamicsWorkspace:
    """Arrays to be filled by `accelerations`."""
    return DynamicsWorkspace(
        np.empty((SEGMENT_COUNT, 6)),
        np.empty((SEGMENT_COUNT, 21)),
        np.empty((SEGMENT_COUNT, 6)),
        np.empty((COORDINATE_COUNT, 6)),
        np.empty((COORDINATE_COUNT, 6)),
        np.empty(COORDINATE_COUNT),
        np.empty(COORDINATE_COUNT),
    )


@njit_borrowing
def _times(r: Array, inertia: Array) -> Any:
    """r I, of a row (3,) and a symmetric matrix (3, 3)."""
    i01, i02, i12 = inertia[0, 1], inertia[0, 2], inertia[1, 2]
    return (
        r[0] * inertia[0, 0] + r[1] * i01 + r[2] * i02,
        r[0] * i01 + r[1] * inertia[1, 1] + r[2] * i12,
        r[0] * i02 + r[1] * i12 + r[2] * inertia[2, 2],
    )


@njit_borrowing
def _dot(a: Any, r: Array) -> Any:
    return a[0] * r[0] + a[1] * r[1] + a[2] * r[2]


@njit_borrowing
def _turned(r: Array, inertia: Array) -> Any:
    """Elements xx, xy, xz, yy, yz, zz of R I Rᵀ, both (3, 3)."""
    x, y, z = r[0], r[1], r[2]
    a, b, c = _times(x, inertia), _times(y, inertia), _times(z, inertia)
    return _dot(a, x), _dot(a, y), _dot(a, z), _dot(b, y), _dot(b, z), _dot(c, z)


@njit_borrowing
def _rigid_bodies(tree: Tree, frames: Frames, qd: Array, work: DynamicsWorkspace) -> None:
    """Inertia of every segment, and the force on it for the motion with q̈ = 0."""
    rotation, origin, axes, angular = frames.rotation, frames.origin, frames.axes, frames.angular
    acceleration, gravity = work.acceleration, tree.gravity
    for s in range(SEGMENT_COUNT):
        w0, w1, w2 = angular[s, 0], angular[s, 1], angular[s, 2]
        if s == 0:
            # Instead of pulling on every segment, gravity is a pelvis that accelerates upwards.
            b0, b1, b2 = 0.0, 0.0, 0.0
            a0, a1, a2 = 0.0 - gravity[0], 0.0 - gravity[1], 0.0 - gravity[2]
        else:
            p = PARENT[s]
            b0, b1, b2 = acceleration[p, 0], acceleration[p, 1], acceleration[p, 2]
            x = origin[s, 0] - origin[p, 0]
            y = origin[s, 1] - origin[p, 1]
            z = origin[s, 2] - origin[p, 2]
            o0, o1, o2 = angular[p, 0], angular[p, 1], angular[p, 2]
            t0, t1, t2 = o1 * z - o2 * y, o2 * x - o0 * z, o0 * y - o1 * x
            # a + α × r + ω × (ω × r), at the segment's joint.
            a0 = acceleration[p, 3] + b1 * z - b2 * y + o1 * t2 - o2 * t1
            a1 = acceleration[p, 4] + b2 * x - b0 * z + o2 * t0 - o0 * t2
            a2 = acceleration[p, 5] + b0 * y - b1 * x + o0 * t1 - o1 * t0
            for d in range(FIRST_DOF[s], FIRST_DOF[s] + DOF_COUNT[s]):
                u0, u1, u2 = axes[d, 0] * qd[d], axes[d, 1] * qd[d], axes[d, 2] * qd[d]
                # The rate of an axis that turns with ω is ω × axis; each axis turns with those
                # before it.
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
        j00, j01, j02, j11, j12, j22 = _turned(r, tree.inertia[s])

        # Newton: m (a + α × c + ω × (ω × c)). Euler, about the centre of mass: J α + ω × J ω.
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

        # Both about the pelvis' origin. The spatial inertia is [[J + m (c² 1 - c cᵀ), m [c]×],
        # [-m [c]×, m 1]], its lower triangle row by row: element (i, j) at i (i + 1) / 2 + j.
        x = c0 + origin[s, 0] - origin[0, 0]
        y = c1 + origin[s, 1] - origin[0, 1]
        z = c2 + origin[s, 2] - origin[0, 2]
        force = work.force[s]
        force[0] = n0 + y * f2 - z * f1
        force[1] = n1 + z * f0 - x * f2
        force[2] = n2 + x * f1 - y * f0
        force[3], force[4], force[5] = f0, f1, f2
        # 0 m, not 0: in lanes it has eight values.
        x2, y2, z2, none = m * x * x, m * y * y, m * z * z, 0.0 * m
        whole = work.inertia[s]
        whole[0] = j00 + (y2 + z2)
        whole[1], whole[2] = j01 - m * x * y, j11 + (x2 + z2)
        whole[3], whole[4], whole[5] = j02 - m * x * z, j12 - m * y * z, j22 + (x2 + y2)
        whole[6], whole[7], whole[8], whole[9] = none, m * z, -m * y, m
        whole[10], whole[11], whole[12], whole[13], whole[14] = -m * z, none, m * x, none, m
        whole[15], whole[16], whole[17] = m * y, -m * x, none
        whole[18], whole[19], whole[20] = none, none, m


@njit_borrowing
def _solve_root(inertia: Array, right: Array) -> None:
    """Solve inertia (21,) x = right (6,) in place by its L D Lᵀ factors; both are overwritten."""
    for k in range(6):
        kk = k * (k + 1) // 2 + k
        inverse = 1.0 / inertia[kk]
        for i in range(k + 1, 6):
            row = i * (i + 1) // 2
            share = inertia[row + k] * inverse
            right[i] -= share * right[k]
            for j in range(k + 1, i + 1):
                inertia[row + j] -= share * inertia[j * (j + 1) // 2 + k]
        # The diagonal keeps 1 / D: one division a column.
        inertia[kk] = inverse
    for k in range(5, -1, -1):
        for i in range(k + 1, 6):
            right[k] -= inertia[i * (i + 1) // 2 + k] * right[i]
        right[k] *= inertia[k * (k + 1) // 2 + k]


@njit_borrowing
def _react(body: Array, axis: Array, u: Array) -> Any:
    """u (6,) = body (21,) axis (6,); returns axis · u."""
    e0, e1, e2, e3, e4, e5 = axis[0], axis[1], axis[2], axis[3], axis[4], axis[5]
    # Only the lower triangle of the symmetric matrix is stored: element (j, i) stands for (i, j).
    b1, b3, b4, b6, b7, b8 = body[1], body[3], body[4], body[6], body[7], body[8]
    b10, b11, b12, b13 = body[10], body[11], body[12], body[13]
    b15, b16, b17, b18, b19 = body[15], body[16], body[17], body[18], body[19]
    u0 = (body[0] * e0 + b1 * e1) + (b3 * e2 + b6 * e3) + (b10 * e4 + b15 * e5)
    u1 = (b1 * e0 + body[2] * e1) + (b4 * e2 + b7 * e3) + (b11 * e4 + b16 * e5)
    u2 = (b3 * e0 + b4 * e1) + (body[5] * e2 + b8 * e3) + (b12 * e4 + b17 * e5)
    u3 = (b6 * e0 + b7 * e1) + (b8 * e2 + body[9] * e3) + (b13 * e4 + b18 * e5)
    u4 = (b10 * e0 + b11 * e1) + (b12 * e2 + b13 * e3) + (body[14] * e4 + b19 * e5)
    u5 = (b15 * e0 + b16 * e1) + (b17 * e2 + b18 * e3) + (b19 * e4 + body[20] * e5)
    u[0], u[1], u[2], u[3], u[4], u[5] = u0, u1, u2, u3, u4, u5
    return (e0 * u0 + e1 * u1) + (e2 * u2 + e3 * u3) + (e4 * u4 + e5 * u5)


@njit_borrowing
def _release(body: Array, u: Array, compliance: float) -> None:
    """body (21,) -= u uᵀ compliance, of the lower triangle."""
    for i in range(6):
        share = u[i] * compliance
        for j in range(i + 1):
            body[i * (i + 1) // 2 + j] -= share * u[j]


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
    tree, frames : the body, and the poses and velocities of all segments at `state`.
    state : (2, 31) positions and velocities.
    forces : (31,) generalised, without those of springs, dampers and gravity.
    stiffness, damping : (25,) Nm/rad, Nms/rad, of springs about zero and dampers in the joints.
    step : s, h.
    work : overwritten.
    out : (31,) rad/s² and m/s².
    """
    q, qd = state[0], state[1]
    _rigid_bodies(tree, frames, qd, work)
    origin, axes = frames.origin, frames.axes
    inertia, force, reaction = work.inertia, work.force, work.reaction
    # Towards the pelvis. Children come after their parents in `SEGMENTS`, so a segment's
    # articulated inertia and bias force are complete when the loop reaches it.
    for s in range(SEGMENT_COUNT - 1, 0, -1):
        p = PARENT[s]
        x = origin[s, 0] - origin[0, 0]
        y = origin[s, 1] - origin[0, 1]
        z = origin[s, 2] - origin[0, 2]
        body, load = inertia[s], force[s]
        for d in range(FIRST_DOF[s] + DOF_COUNT[s] - 1, FIRST_DOF[s] - 1, -1):
            e0, e1, e2 = axes[d, 0], axes[d, 1], axes[d, 2]
            # A joint that turns about e at r moves the pelvis' origin with r × e.
            e3, e4, e5 = y * e2 - z * e1, z * e0 - x * e2, x * e1 - y * e0
            axis = work.axis[d]
            axis[0], axis[1], axis[2], axis[3], axis[4], axis[5] = e0, e1, e2, e3, e4, e5
            # U = I S, D = Sᵀ U + h c + h² k (the implicit damper and spring), and the drive is what
            # remains of the joint's force after the bias force Sᵀ p.
            u, k, c = reaction[d], stiffness[d - 6], damping[d - 6]
            resistance = _react(body, axis, u) + (step * c + step * step * k)
            drive = forces[d] - c * qd[d] - k * (q[d] + step * qd[d]) - (
                (e0 * load[0] + e1 * load[1]) + (e2 * load[2]
                + e3 * load[3]) + (e4 * load[4] + e5 * load[5])
            )  # fmt: skip
            compliance = 1.0 / resistance
            work.compliance[d], work.drive[d] = compliance, drive
            # The joint gives way along S: I ← I - U Uᵀ / D, p ← p + U drive / D.
            _release(body, u, compliance)
            push = compliance * drive
            for i in range(6):
                load[i] += u[i] * push
        for i in range(6):
            force[p, i] += load[i]
        for i in range(21):
            inertia[p, i] += body[i]
    acceleration = work.acceleration
    for i in range(6):
        # The free joint: root forces pair with the same spatial coordinates, so no axes are needed.
        acceleration[0, i] = forces[i] - force[0, i]
    _solve_root(inertia[0], acceleration[0])
    for i in range(6):
        out[i] = acceleration[0, i]
    # Back from the pelvis: q̈ = (drive - Uᵀ a) / D, then a ← a + S q̈.
    for s in range(1, SEGMENT_COUNT):
        a, b = acceleration[s], acceleration[PARENT[s]]
        for i in range(6):
            a[i] = b[i]
        for d in range(FIRST_DOF[s], FIRST_DOF[s] + DOF_COUNT[s]):
            u, axis = reaction[d], work.axis[d]
            rate = work.drive[d] - (
                (u[0] * a[0] + u[1] * a[1]) + (u[2] * a[2] + u[3] * a[3]) + (u[4] * a[4]
                + u[5] * a[5])
            )  # fmt: skip
            rate *= work.compliance[d]
            out[d] = rate
            for i in range(6):
                a[i] += axis[i] * rate


@njit_borrowing
def integrate(state: Array, acceleration: Array, step: float) -> None:
    """Semi-implicit Euler over a `step` (s) with an `acceleration` (31,) as from `accelerations`:
    velocities first, then positions with the new velocities; `state` (2, 31) in and out.
    """
    q, qd = state[0], state[1]
    for d in range(COORDINATE_COUNT):
        qd[d] += step * acceleration[d]
    # The pelvis' rotation vector is no integral of its angular velocity: R⁺ = exp(h ω⁺) R.
    turned_vector(q, qd, step)
    for d in range(3, COORDINATE_COUNT):
        q[d] += step * qd[d]
