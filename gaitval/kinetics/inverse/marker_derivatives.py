"""The cost of a pose with respect to measured markers, with its first two derivatives.

Both are as cheap as forward kinematics, and hardly depend on the number of markers. JᵀWJ is the
joint-space inertia of the tree if each marker were a point mass w, so the composite-rigid-body
algorithm gives it from the sums Σw, Σwp and Σwppᵀ of the markers outboard of a joint; JᵀWr and the
second-order term follow from Σwr and Σwprᵀ in the same way (Featherstone 2008, Rigid Body Dynamics
Algorithms, section 6.2). Matrices are filled only below the diagonal and along the branches:
coordinates of different branches do not interact.
"""

from typing import NamedTuple

import numpy as np

from gaitval._internal.numba.compiled import njit
from gaitval.arrays import Array, Flags, Index
from gaitval.coordinates import COORDINATES
from gaitval.kinetics.inverse.marked_body import MarkerTrial
from gaitval.model.body import SEGMENTS
from gaitval.model.tree import (
    DOF_COUNT,
    FIRST_DOF,
    PARENT,
    ROOT_DOFS,
    SEGMENT_COUNT,
    Frames,
    empty_frames,
    forward,
)

_LAST_COORDINATE = np.array(
    [FIRST_DOF[s] + DOF_COUNT[s] - 1 if s else ROOT_DOFS - 1 for s in range(len(SEGMENTS))]
)

SEGMENT_OF_COORDINATE: Index = np.array(
    [0] * ROOT_DOFS
    + [
        next(s for s in range(1, len(SEGMENTS)) if FIRST_DOF[s] <= d <= _LAST_COORDINATE[s])
        for d in range(ROOT_DOFS, len(COORDINATES))
    ]
)
"""(31,) segment that a coordinate moves first."""

PARENT_COORDINATE: Index = np.array(
    [
        d - 1
        if d < ROOT_DOFS or d > FIRST_DOF[SEGMENT_OF_COORDINATE[d]]
        else _LAST_COORDINATE[PARENT[SEGMENT_OF_COORDINATE[d]]]
        for d in range(len(COORDINATES))
    ]
)
"""(31,) next coordinate towards the pelvis; -1 for the first."""


class MarkerWorkspace(NamedTuple):
    """Arrays that the solver writes into, so that it allocates none per frame."""

    frames: Frames  # without velocities
    weight_sum: Array  # of the markers outboard of each segment: Σw
    first: Array  # Σ w p
    second: Array  # Σ w p pᵀ
    force: Array  # Σ w r
    torque: Array  # Σ w p rᵀ
    normal: Array  # JᵀWJ, lower triangle along each branch
    curvature: Array  # Σ w r ∂²p/∂q²
    gradient: Array
    matrix: Array
    step: Array
    trial: Array
    other: Array  # another pose
    cost: Array  # (1,) of the last pose that was solved
    fixed: Flags
    stiff: Flags


def workspace() -> MarkerWorkspace:
    """Arrays for `evaluate` and the solver to fill, for one pose; see `MarkerWorkspace`."""
    n, segments = len(COORDINATES), len(SEGMENTS)
    return MarkerWorkspace(
        frames=empty_frames(),
        weight_sum=np.zeros(segments),
        first=np.zeros((segments, 3)),
        second=np.zeros((segments, 3, 3)),
        force=np.zeros((segments, 3)),
        torque=np.zeros((segments, 3, 3)),
        normal=np.zeros((n, n)),
        curvature=np.zeros((n, n)),
        gradient=np.zeros(n),
        matrix=np.zeros((n, n)),
        step=np.zeros(n),
        trial=np.zeros(n),
        other=np.zeros(n),
        cost=np.zeros(1),
        fixed=np.zeros(n, dtype=np.bool_),
        stiff=np.zeros(n, dtype=np.bool_),
    )


@njit
def evaluate(problem: MarkerTrial, frame: int, q: Array, work: MarkerWorkspace) -> float:
    """Cost ½ Σ w r² at a pose with its derivatives, into `work.normal`, `.curvature`, `.gradient`.

    Points are taken from the pelvis origin. With p(q) outboard of a coordinate that turns about
    the axis a through o, ∂p/∂q = a × (p − o), and with i nearer to the pelvis than j,
    ∂²p/∂qᵢ∂qⱼ = aᵢ × (aⱼ × (p − oⱼ)).

    It is long because it is one sweep outwards and one inwards over the same sums, written out in
    scalars: numba would allocate vectors on the heap, which takes longer than the sums.

    Parameters
    ----------
    problem : the body, the places of its M markers, their weights w and where they were.
    frame : of the trial.
    q : (31,) pose, root convention of `model.tree`.
    work : of `workspace`; its lower triangles are filled along the branches only.

    Returns
    -------
    float
        The cost, m² times the unit of the weights.
    """
    forward(problem.joint_position, q, work.frames, SEGMENT_COUNT)
    rotation, origin, axes = work.frames.rotation, work.frames.origin, work.frames.axes
    weight_sum, first, second = work.weight_sum, work.first, work.second
    force, torque = work.force, work.torque
    weight_sum[:] = 0.0
    first[:] = 0.0
    second[:] = 0.0
    force[:] = 0.0
    torque[:] = 0.0
    weight, measured, cost = problem.weight[frame], problem.measured[frame], 0.0
    # Allocated once: an array made in the loop would cost more than the sums.
    p = np.empty(3)
    r = np.empty(3)
    for m in range(len(weight)):
        w = weight[m]
        if w == 0.0:
            continue
        s = problem.segment[m]
        for i in range(3):
            p[i] = (
                origin[s, i]
                - origin[0, i]
                + rotation[s, i, 0] * problem.position[m, 0]
                + rotation[s, i, 1] * problem.position[m, 1]
                + rotation[s, i, 2] * problem.position[m, 2]
            )
            r[i] = measured[m, i] - origin[0, i] - p[i]
        weight_sum[s] += w
        for i in range(3):
            cost += 0.5 * w * r[i] * r[i]
            first[s, i] += w * p[i]
            force[s, i] += w * r[i]
            for j in range(3):
                second[s, i, j] += w * p[i] * p[j]
                torque[s, i, j] += w * p[i] * r[j]
    # Inwards. A parent has a lower number than its children, so the sums of a segment are complete
    # when its parent takes them.
    for s in range(len(weight_sum) - 1, 0, -1):
        parent = PARENT[s]
        weight_sum[parent] += weight_sum[s]
        for i in range(3):
            first[parent, i] += first[s, i]
            force[parent, i] += force[s, i]
            for j in range(3):
                second[parent, i, j] += second[s, i, j]
                torque[parent, i, j] += torque[s, i, j]

    normal, curvature, gradient = work.normal, work.curvature, work.gradient
    _root_derivatives(weight_sum[0], first[0], second[0], force[0], torque[0], work)
    for j in range(ROOT_DOFS, len(q)):
        s = SEGMENT_OF_COORDINATE[j]
        a0, a1, a2 = axes[j, 0], axes[j, 1], axes[j, 2]
        o0 = origin[s, 0] - origin[0, 0]
        o1 = origin[s, 1] - origin[0, 1]
        o2 = origin[s, 2] - origin[0, 2]
        # resultant and moment about the pelvis origin of the forces w a × (p − o)
        # Let d = p − o. Then Σ w d = Σ w p − o Σ w, and the resultant is f = a × Σ w d.
        d0 = first[s, 0] - weight_sum[s] * o0
        d1 = first[s, 1] - weight_sum[s] * o1
        d2 = first[s, 2] - weight_sum[s] * o2
        f0, f1, f2 = a1 * d2 - a2 * d1, a2 * d0 - a0 * d2, a0 * d1 - a1 * d0
        # The moment n = Σ w p × (a × d), by p × (a × d) = a (p·d) − d (p·a).
        along = first[s, 0] * a0 + first[s, 1] * a1 + first[s, 2] * a2
        spread = second[s, 0, 0] + second[s, 1, 1] + second[s, 2, 2]
        spread -= first[s, 0] * o0 + first[s, 1] * o1 + first[s, 2] * o2
        n0 = spread * a0 + along * o0
        n1 = spread * a1 + along * o1
        n2 = spread * a2 + along * o2
        n0 -= second[s, 0, 0] * a0 + second[s, 0, 1] * a1 + second[s, 0, 2] * a2
        n1 -= second[s, 1, 0] * a0 + second[s, 1, 1] * a1 + second[s, 1, 2] * a2
        n2 -= second[s, 2, 0] * a0 + second[s, 2, 1] * a1 + second[s, 2, 2] * a2
        # Q = Σ w (p − o) rᵀ, and Qa − tr(Q) a
        # It is Σ w (a × d) × r, by (a × d) × r = d (a·r) − a (d·r).
        e = force[s]
        t = torque[s]
        lever = o0 * e[0] + o1 * e[1] + o2 * e[2]
        trace = t[0, 0] + t[1, 1] + t[2, 2] - lever
        turned = e[0] * a0 + e[1] * a1 + e[2] * a2
        c0 = t[0, 0] * a0 + t[0, 1] * a1 + t[0, 2] * a2 - turned * o0 - trace * a0
        c1 = t[1, 0] * a0 + t[1, 1] * a1 + t[1, 2] * a2 - turned * o1 - trace * a1
        c2 = t[2, 0] * a0 + t[2, 1] * a1 + t[2, 2] * a2 - turned * o2 - trace * a2
        # −a · Σ w d × r: the cross product is made of differences of Q's elements off the diagonal.
        gradient[j] = -(
            a0 * (t[1, 2] - t[2, 1] - o1 * e[2] + o2 * e[1])
            + a1 * (t[2, 0] - t[0, 2] - o2 * e[0] + o0 * e[2])
            + a2 * (t[0, 1] - t[1, 0] - o0 * e[1] + o1 * e[0])
        )
        # Only coordinates between j and the pelvis move the same markers; others give zeros.
        i = j
        while i >= ROOT_DOFS:
            u = SEGMENT_OF_COORDINATE[i]
            b0, b1, b2 = axes[i, 0], axes[i, 1], axes[i, 2]
            x0 = origin[u, 0] - origin[0, 0]
            x1 = origin[u, 1] - origin[0, 1]
            x2 = origin[u, 2] - origin[0, 2]
            # b · Σ w (p − x) × (a × d) = b · (n − x × f), for the axis b through x.
            normal[j, i] = (
                b0 * (n0 - x1 * f2 + x2 * f1)
                + b1 * (n1 - x2 * f0 + x0 * f2)
                + b2 * (n2 - x0 * f1 + x1 * f0)
            )
            curvature[j, i] = b0 * c0 + b1 * c1 + b2 * c2
            i = PARENT_COORDINATE[i]
        normal[j, 0], normal[j, 1], normal[j, 2] = n0, n1, n2
        normal[j, 3], normal[j, 4], normal[j, 5] = f0, f1, f2
        curvature[j, 0], curvature[j, 1], curvature[j, 2] = c0, c1, c2
    return cost


@njit
def _root_derivatives(
    weight_sum: float,
    first: Array,
    second: Array,
    force: Array,
    torque: Array,
    work: MarkerWorkspace,
) -> None:
    """The pelvis' part of `evaluate`: rotations exp(δ) about its origin, then translations."""
    normal, curvature, gradient = work.normal, work.curvature, work.gradient
    spread = second[0, 0] + second[1, 1] + second[2, 2]
    trace = torque[0, 0] + torque[1, 1] + torque[2, 2]
    # The markers' inertia about the origin, Σ w (|p|² 1 − p pᵀ). The second derivative of exp(δ)
    # leaves the symmetric part of Σ w p rᵀ less its trace.
    for i in range(3):
        for j in range(i + 1):
            normal[i, j] = -second[i, j]
            curvature[i, j] = 0.5 * (torque[i, j] + torque[j, i])
            normal[3 + i, 3 + j] = 0.0
        normal[i, i] += spread
        curvature[i, i] -= trace
        normal[3 + i, 3 + i] = weight_sum
        normal[3 + i, i] = 0.0
        gradient[3 + i] = -force[i]
    # e_j × Σwp for the turn about axis j
    normal[3, 1], normal[3, 2] = first[2], -first[1]
    normal[4, 0], normal[4, 2] = -first[2], first[0]
    normal[5, 0], normal[5, 1] = first[1], -first[0]
    gradient[0] = -(torque[1, 2] - torque[2, 1])
    gradient[1] = -(torque[2, 0] - torque[0, 2])
    gradient[2] = -(torque[0, 1] - torque[1, 0])


@njit
def independent_coordinates(normal: Array, frozen: Flags, smallest: float, found: Flags) -> None:
    """Coordinates that the markers show, beyond what those nearer to the pelvis explain: `found`
    (31,) out.

    A column of J counts if it is independent of those before. From JᵀJ, `normal` (31, 31) m² as
    `evaluate` leaves it, Cholesky's pivots are the squared parts of a column that the earlier
    columns do not explain; it counts from the pivot `smallest` (m²) on. `frozen` (31,) coordinates
    are held, and left out.
    """
    n = len(found)
    factor = np.zeros((n, n))
    # Elements off the branches are zero, but `evaluate` does not write them.
    on_branch = np.zeros((n, n), dtype=np.bool_)
    for j in range(n):
        i = j
        while i >= 0:
            on_branch[j, i] = True
            i = PARENT_COORDINATE[i]
    for j in range(n):
        found[j] = False
        if frozen[j]:
            continue
        for i in range(j):
            # A dependent column has no row in the factor.
            if not found[i]:
                continue
            total = normal[j, i] if on_branch[j, i] else 0.0
            for k in range(i):
                total -= factor[j, k] * factor[i, k]
            factor[j, i] = total / factor[i, i]
        pivot = normal[j, j]
        for k in range(j):
            pivot -= factor[j, k] ** 2
        if pivot >= smallest:
            found[j] = True
            factor[j, j] = np.sqrt(pivot)
