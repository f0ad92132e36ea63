"""Residuals on the pelvis and their derivatives, frame by frame (compiled)."""

from typing import NamedTuple

import numpy as np

from gaitval._internal.numba.compiled import njit
from gaitval.arrays import Array, Flags, Index
from gaitval.coordinates import COORDINATES
from gaitval.kinetics.inverse.motion_rates import root_state
from gaitval.kinetics.inverse.newton_euler import SegmentDynamics, empty_dynamics, newton_euler
from gaitval.model.body import JOINT_COORDINATES, PARENTS, SEGMENTS
from gaitval.model.tree import (
    COORDINATE_COUNT,
    PARENT,
    ROOT_DOFS,
    SEGMENT_COUNT,
    Tree,
    empty_frames,
    forward,
)

MASS_GROUPS = ("pelvis", "thigh", "shank", "foot", "torso", "upper_arm", "forearm")
"""Segments that share one mass factor: both sides together, the toes with the foot."""

GROUP_OF_SEGMENT = np.array(
    [
        MASS_GROUPS.index(name.removesuffix("_r").removesuffix("_l").replace("toes", "foot"))
        for name in SEGMENTS
    ]
)
"""(14,) index into `MASS_GROUPS`."""

TORSO = SEGMENTS.index("torso")
BODY_UNKNOWNS = len(MASS_GROUPS) + 3
"""Logarithms of the mass factors, then the offset of the trunk's centre of mass."""


class _Work(NamedTuple):
    """Arrays that one frame needs: its generalised forces (31,), its state (3, 31)."""

    segments: SegmentDynamics
    generalised: Array
    state: Array


@njit
def _root_residual(tree: Tree, state: Array, wrenches: Array, work: _Work, out: Array) -> None:
    """Residual moment and force (6,) of one frame of a `tree` into `out`. `state` (3, 31) has
    coordinates (with the pelvis' Cardan angles), rates, second rates; `wrenches` (3, 2, 3) force,
    point, free moment; `work` is to work in.
    """
    segments, generalised, q = work
    for i in range(3, COORDINATE_COUNT):
        q[0, i] = state[0, i]
        q[1, i] = state[1, i]
        q[2, i] = state[2, i]
    # Fills the pelvis' rotation, angular velocity and angular acceleration, the first three
    # columns.
    root_state(state[0], state[1], state[2], q[0], q[1], q[2])
    newton_euler(
        tree, q[0], q[1], q[2], wrenches[0], wrenches[1], wrenches[2], segments, generalised
    )
    for i in range(6):
        out[i] = generalised[i]


@njit
def _work_arrays() -> _Work:
    return _Work(empty_dynamics(), np.empty(COORDINATE_COUNT), np.empty((3, COORDINATE_COUNT)))


@njit
def residuals_of_frames(
    tree: Tree,
    states: Array,
    wrenches: Array,
    out: Array,
) -> None:
    """Residuals on the pelvis of a body (`tree`) into `out` (T, 6): moment about the pelvis'
    origin, Nm, and force, N, world axes. `states` (T, 3, 31) has coordinates (with the pelvis'
    Cardan angles), rates, second rates; `wrenches` (T, 3, 2, 3) force N, point m and free moment Nm
    on the right and the left foot.
    """
    work = _work_arrays()
    for t in range(len(states)):
        _root_residual(tree, states[t], wrenches[t], work, out[t])


@njit
def residual_derivatives(
    tree: Tree,
    states: Array,
    wrenches: Array,
    known: Flags,
    by_state: Array,
    by_body: Array,
) -> None:
    """Derivatives of the residuals of `residuals_of_frames` (`tree`, `states`, `wrenches`) in the
    frames that are `known` (T,): added to `by_state` (T, 6, 3, 31), by coordinates, rates, second
    rates, and to `by_body` (T, 6, 10), by the logarithms of the mass factors and the trunk's
    offset.

    The differences with respect to second rates (in which the residuals are linear) and rates (in
    which they are quadratic) are exact up to rounding.
    """
    work = _work_arrays()
    # Only the coordinates' step has to be small; the others are large against rounding.
    steps = (1e-5, 1e-2, 1.0)
    found = np.empty(6)
    # The ground reaction does not depend on the body, so both feet are in the air for `by_body`.
    air = np.full((3, 2, 3), np.nan)
    some_mass, some_inertia = np.empty_like(tree.mass), np.empty_like(tree.inertia)
    centre = tree.centre_of_mass.copy()
    some = Tree(
        tree.joint_position, some_mass, centre, some_inertia,
        tree.sphere_segment, tree.sphere_position, tree.sphere_radius, tree.gravity,
    )  # fmt: skip
    groups = BODY_UNKNOWNS - 3
    for t in range(len(states)):
        if not known[t]:
            continue
        state = states[t].copy()
        # Each loop has only one call, because the compiler copies the whole recursion to each call.
        for case in range(3 * COORDINATE_COUNT * 2):
            # A case is one side of a central difference: the sign changes fastest, then the
            # coordinate.
            order, i, sign = (
                case // (2 * COORDINATE_COUNT),
                case // 2 % COORDINATE_COUNT,
                1.0 - 2.0 * (case % 2),
            )
            value = state[order, i]
            state[order, i] = value + sign * steps[order]
            _root_residual(tree, state, wrenches[t], work, found)
            state[order, i] = value
            for r in range(6):
                by_state[t, r, order, i] += sign * found[r] / (2.0 * steps[order])
        for case in range(groups + 6):
            # The residual is linear in the masses: the contribution of a group is its derivative.
            trunk = case >= groups
            axis, sign = (case - groups) // 2, 1.0 - 2.0 * ((case - groups) % 2)
            for s in range(SEGMENT_COUNT):
                share = 1.0 if trunk or GROUP_OF_SEGMENT[s] == case else 0.0
                some_mass[s] = share * tree.mass[s]
                some_inertia[s] = share * tree.inertia[s]
            if trunk:
                centre[TORSO, axis] += sign * 1e-3
            _root_residual(some, state, air, work, found)
            centre[TORSO] = tree.centre_of_mass[TORSO]
            for r in range(6):
                if trunk:
                    by_body[t, r, groups + axis] += sign * found[r] / 2e-3
                else:
                    by_body[t, r, case] += found[r]


def moved_by() -> Flags:
    """Which coordinates move which segments: (14, 31) True if the coordinate is of the segment's
    joint or of one between it and the pelvis; those of the pelvis move all.
    """
    above = np.zeros((SEGMENT_COUNT, COORDINATE_COUNT), dtype=bool)
    above[:, :ROOT_DOFS] = True
    for s, name in enumerate(SEGMENTS):
        if name in PARENTS:
            above[s] |= above[SEGMENTS.index(PARENTS[name])]
            above[s, [COORDINATES.index(c) for c in JOINT_COORDINATES[name]]] = True
    return above


@njit
def marker_metric(
    joint_position: Array,
    segment: Index,
    place: Array,
    weight: Array,
    above: Flags,
    coordinates: Array,
    out: Array,
) -> None:
    """Σ w Jᵀ J of the markers' positions by the coordinates, added to `out`.

    Parameters
    ----------
    joint_position : of `Tree`.
    segment, place, weight : (M,), (M, 3) m and (M,): segment of each marker, its position on it,
        and its weight.
    above : (14, 31) whether a coordinate moves a segment, of `moved_by`.
    coordinates : (T, 31) with the pelvis' Cardan angles.
    out : (T, 31, 31) added to; columns of J are in m/rad for angles, m/m for the translation.
    """
    frames = empty_frames()
    rotation, origin, axes = frames.rotation, frames.origin, frames.axes
    q, unused, rates = np.empty(COORDINATE_COUNT), np.empty(3), np.zeros(3)
    zero = np.zeros(3)
    jacobian = np.empty((3, COORDINATE_COUNT))
    arm, column = np.empty(3), np.empty(3)
    pivot = np.zeros(
        COORDINATE_COUNT, dtype=np.int64
    )  # segment whose origin a coordinate rotates about
    for s in range(SEGMENT_COUNT):
        for d in range(ROOT_DOFS, COORDINATE_COUNT):
            if above[s, d] and not above[PARENT[s], d]:
                pivot[d] = s
    for t in range(len(coordinates)):
        q[:] = coordinates[t]
        root_state(coordinates[t], zero, zero, q, unused, unused)
        forward(joint_position, q, frames, SEGMENT_COUNT)
        for i in range(3):  # axes of the Cardan angles: angular velocity at unit rates
            rates[i] = 1.0
            root_state(coordinates[t], rates, zero, q, axes[i], unused)
            rates[i] = 0.0
        for m in range(len(segment)):
            s = segment[m]
            point = origin[s] + rotation[s] @ place[m]
            jacobian[:] = 0.0
            for d in range(COORDINATE_COUNT):
                if 3 <= d < ROOT_DOFS:
                    jacobian[d - 3, d] = 1.0
                elif above[s, d]:
                    for i in range(3):
                        # ∂p/∂q = a × (p − o).
                        arm[i] = point[i] - origin[pivot[d], i]
                        column[i] = axes[d, i]
                    jacobian[0, d] = column[1] * arm[2] - column[2] * arm[1]
                    jacobian[1, d] = column[2] * arm[0] - column[0] * arm[2]
                    jacobian[2, d] = column[0] * arm[1] - column[1] * arm[0]
            for i in range(COORDINATE_COUNT):
                for j in range(COORDINATE_COUNT):
                    for k in range(3):
                        out[t, i, j] += weight[m] * jacobian[k, i] * jacobian[k, j]
