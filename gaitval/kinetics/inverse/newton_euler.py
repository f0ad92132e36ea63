"""Newton's and Euler's equations of the whole body, segment by segment (compiled).

A recursive scheme from the feet to the pelvis (Winter 2009, chapters 5 and 7; Featherstone 2008,
table 5.1), in world axes about the joint of each segment. The whole ground reaction of a side acts
on its foot segment and none on its toes.

Gravity is that of the `Tree`.
"""

from typing import NamedTuple

import numpy as np

from gaitval._internal.numba.compiled import njit, njit_borrowing
from gaitval.arrays import Array, Index
from gaitval.model.body import SEGMENTS
from gaitval.model.tree import (
    DOF_COUNT,
    FIRST_DOF,
    PARENT,
    SEGMENT_COUNT,
    Frames,
    Tree,
    empty_frames,
    forward,
    velocities,
)

FOOT: Index = np.array([SEGMENTS.index("foot_r"), SEGMENTS.index("foot_l")])
"""(2,) segment that the ground reaction of the right and of the left side acts on."""


class SegmentDynamics(NamedTuple):
    """How the segments move in a frame, and what their parents exert on them.

    Attributes
    ----------
    frames : where they are, and their velocities.
    turning : (14, 2, 3) angular acceleration and acceleration of the joint less gravity.
    wrench : (14, 2, 3) moment about its joint and force of the parent on each segment.
    """

    frames: Frames
    turning: Array
    wrench: Array


@njit
def empty_dynamics() -> SegmentDynamics:
    """Arrays for `newton_euler` to fill, frame after frame."""
    return SegmentDynamics(
        empty_frames(), np.empty((SEGMENT_COUNT, 2, 3)), np.empty((SEGMENT_COUNT, 2, 3))
    )


@njit_borrowing
def inertial_wrenches(
    tree: Tree, q: Array, qd: Array, qdd: Array, segments: SegmentDynamics
) -> None:
    """What each segment of the body `tree` needs for its own motion, with positions, velocities and
    accelerations `q`, `qd`, `qdd` (31,), root convention of `model.tree`, into `segments`: `wrench`
    gets the moment about the segment's joint and the force, world axes.

    It is long because it is one recursion, written out in scalars: numba would allocate vectors on
    the heap, which takes longer than the sums.
    """
    frames, turning, wrench = segments
    rotation, origin, axes, angular, _ = frames
    mass, centre_of_mass, inertia = tree.mass, tree.centre_of_mass, tree.inertia
    forward(tree.joint_position, q, frames, SEGMENT_COUNT)
    velocities(qd, frames, SEGMENT_COUNT)
    # A base that accelerates upwards with g loads every segment with its weight, so no weights are
    # added below.
    for i in range(3):
        turning[0, 0, i] = qdd[i]
        turning[0, 1, i] = qdd[3 + i] - tree.gravity[i]
    for s in range(1, SEGMENT_COUNT):
        p = PARENT[s]
        w0, w1, w2 = angular[p, 0], angular[p, 1], angular[p, 2]
        e0, e1, e2 = turning[p, 0, 0], turning[p, 0, 1], turning[p, 0, 2]
        r0 = origin[s, 0] - origin[p, 0]
        r1 = origin[s, 1] - origin[p, 1]
        r2 = origin[s, 2] - origin[p, 2]
        v0, v1, v2 = w1 * r2 - w2 * r1, w2 * r0 - w0 * r2, w0 * r1 - w1 * r0
        # Acceleration of the joint: a + α × r + ω × (ω × r), with ω × r in v.
        turning[s, 1, 0] = turning[p, 1, 0] + e1 * r2 - e2 * r1 + w1 * v2 - w2 * v1
        turning[s, 1, 1] = turning[p, 1, 1] + e2 * r0 - e0 * r2 + w2 * v0 - w0 * v2
        turning[s, 1, 2] = turning[p, 1, 2] + e0 * r1 - e1 * r0 + w0 * v1 - w1 * v0
        for d in range(FIRST_DOF[s], FIRST_DOF[s] + DOF_COUNT[s]):
            a0, a1, a2 = axes[d, 0], axes[d, 1], axes[d, 2]
            # An axis rotates with all rotations before it.
            e0 += a0 * qdd[d] + (w1 * a2 - w2 * a1) * qd[d]
            e1 += a1 * qdd[d] + (w2 * a0 - w0 * a2) * qd[d]
            e2 += a2 * qdd[d] + (w0 * a1 - w1 * a0) * qd[d]
            w0 += a0 * qd[d]
            w1 += a1 * qd[d]
            w2 += a2 * qd[d]
        turning[s, 0, 0], turning[s, 0, 1], turning[s, 0, 2] = e0, e1, e2

    for s in range(SEGMENT_COUNT):
        c0 = c1 = c2 = 0.0
        l0 = l1 = l2 = 0.0  # ω and α in the segment's axes
        k0 = k1 = k2 = 0.0
        for i in range(3):
            c0 += rotation[s, 0, i] * centre_of_mass[s, i]
            c1 += rotation[s, 1, i] * centre_of_mass[s, i]
            c2 += rotation[s, 2, i] * centre_of_mass[s, i]
            l0 += rotation[s, i, 0] * angular[s, i]
            l1 += rotation[s, i, 1] * angular[s, i]
            l2 += rotation[s, i, 2] * angular[s, i]
            k0 += rotation[s, i, 0] * turning[s, 0, i]
            k1 += rotation[s, i, 1] * turning[s, 0, i]
            k2 += rotation[s, i, 2] * turning[s, 0, i]
        w0, w1, w2 = angular[s, 0], angular[s, 1], angular[s, 2]
        e0, e1, e2 = turning[s, 0, 0], turning[s, 0, 1], turning[s, 0, 2]
        v0, v1, v2 = w1 * c2 - w2 * c1, w2 * c0 - w0 * c2, w0 * c1 - w1 * c0
        m = mass[s]
        # Newton's equation for the centre of mass, at c from the joint.
        f0 = m * (turning[s, 1, 0] + e1 * c2 - e2 * c1 + w1 * v2 - w2 * v1)
        f1 = m * (turning[s, 1, 1] + e2 * c0 - e0 * c2 + w2 * v0 - w0 * v2)
        f2 = m * (turning[s, 1, 2] + e0 * c1 - e1 * c0 + w0 * v1 - w1 * v0)
        # Euler's equation in the segment's axes: I α + ω × I ω.
        h0 = inertia[s, 0, 0] * l0 + inertia[s, 0, 1] * l1 + inertia[s, 0, 2] * l2
        h1 = inertia[s, 1, 0] * l0 + inertia[s, 1, 1] * l1 + inertia[s, 1, 2] * l2
        h2 = inertia[s, 2, 0] * l0 + inertia[s, 2, 1] * l1 + inertia[s, 2, 2] * l2
        n0 = inertia[s, 0, 0] * k0 + inertia[s, 0, 1] * k1 + inertia[s, 0, 2] * k2
        n1 = inertia[s, 1, 0] * k0 + inertia[s, 1, 1] * k1 + inertia[s, 1, 2] * k2
        n2 = inertia[s, 2, 0] * k0 + inertia[s, 2, 1] * k1 + inertia[s, 2, 2] * k2
        n0 += l1 * h2 - l2 * h1
        n1 += l2 * h0 - l0 * h2
        n2 += l0 * h1 - l1 * h0
        for i in range(3):
            # Back to the world's axes, and then from the centre of mass to the joint: n + c × f.
            wrench[s, 0, i] = rotation[s, i, 0] * n0 + rotation[s, i, 1] * n1
            wrench[s, 0, i] += rotation[s, i, 2] * n2
        wrench[s, 0, 0] += c1 * f2 - c2 * f1
        wrench[s, 0, 1] += c2 * f0 - c0 * f2
        wrench[s, 0, 2] += c0 * f1 - c1 * f0
        wrench[s, 1, 0], wrench[s, 1, 1], wrench[s, 1, 2] = f0, f1, f2


@njit_borrowing
def joint_wrenches(segments: SegmentDynamics, generalised: Array) -> None:
    """Add to each segment's wrench in `segments`, which has what it needs itself, those of the
    segments below it: what its parent exerts. `generalised` (31,) out: of the root the moment about
    the pelvis' origin, Nm, and the force, N; of the joints the moments about their axes, Nm.
    """
    (_, origin, axes, _, _), _, wrench = segments
    for s in range(SEGMENT_COUNT - 1, 0, -1):
        # Children have higher numbers than their parents, so this wrench is complete.
        p = PARENT[s]
        for d in range(FIRST_DOF[s], FIRST_DOF[s] + DOF_COUNT[s]):
            generalised[d] = (
                axes[d, 0] * wrench[s, 0, 0]
                + axes[d, 1] * wrench[s, 0, 1]
                + axes[d, 2] * wrench[s, 0, 2]
            )
        r0 = origin[s, 0] - origin[p, 0]
        r1 = origin[s, 1] - origin[p, 1]
        r2 = origin[s, 2] - origin[p, 2]
        f0, f1, f2 = wrench[s, 1, 0], wrench[s, 1, 1], wrench[s, 1, 2]
        # About the parent's joint: n + r × f.
        wrench[p, 0, 0] += wrench[s, 0, 0] + r1 * f2 - r2 * f1
        wrench[p, 0, 1] += wrench[s, 0, 1] + r2 * f0 - r0 * f2
        wrench[p, 0, 2] += wrench[s, 0, 2] + r0 * f1 - r1 * f0
        for i in range(3):
            wrench[p, 1, i] += wrench[s, 1, i]
    for i in range(3):
        generalised[i] = wrench[0, 0, i]
        generalised[3 + i] = wrench[0, 1, i]


@njit
def newton_euler(
    tree: Tree,
    q: Array,
    qd: Array,
    qdd: Array,
    force: Array,
    point: Array,
    free_moment: Array,
    segments: SegmentDynamics,
    generalised: Array,
) -> None:
    """Generalised forces of one frame.

    Parameters
    ----------
    tree : the body.
    q, qd, qdd : (31,) positions, velocities, accelerations, root convention of `model.tree`.
    force, point, free_moment : (2, 3) N, m, Nm on the right and the left foot, world; a point
        that is NaN is a foot in the air.
    segments : of `empty_dynamics`, out.
    generalised : (31,) out: of the root the moment about the pelvis' origin, Nm, and the force, N;
        of the joints the moments, Nm, positive if they would increase their coordinates.
    """
    inertial_wrenches(tree, q, qd, qdd, segments)
    origin, wrench = segments.frames.origin, segments.wrench
    for side in range(2):
        if np.isnan(point[side, 0]):
            continue
        s = FOOT[side]
        r0 = point[side, 0] - origin[s, 0]
        r1 = point[side, 1] - origin[s, 1]
        r2 = point[side, 2] - origin[s, 2]
        f0, f1, f2 = force[side, 0], force[side, 1], force[side, 2]
        # What the ground exerts on the foot, the shank need not.
        wrench[s, 0, 0] -= free_moment[side, 0] + r1 * f2 - r2 * f1
        wrench[s, 0, 1] -= free_moment[side, 1] + r2 * f0 - r0 * f2
        wrench[s, 0, 2] -= free_moment[side, 2] + r0 * f1 - r1 * f0
        for i in range(3):
            wrench[s, 1, i] -= force[side, i]

    joint_wrenches(segments, generalised)
