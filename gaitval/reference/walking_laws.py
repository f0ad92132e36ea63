"""The laws of motion and contact at one instant of a walk (compiled).

The terms of an instant depend only on the coordinates, their first two rates and the forces at that
instant, so the derivatives are computed separately for each instant, by central differences.
"""

from typing import NamedTuple

import numpy as np

from gaitval.arrays import Array
from gaitval.compiled import njit
from gaitval.coordinates import COORDINATES
from gaitval.inverse.motion_rates import root_state
from gaitval.inverse.newton_euler import SegmentDynamics, empty_dynamics, newton_euler
from gaitval.model.body import SEGMENTS
from gaitval.model.tree import Tree, rotation_vector

_SOLE_DEPTH = 0.004
"""m: a sphere this much higher than the lowest one counts 1/e as much as part of the sole on the
ground."""

_LOWEST_DEPTH = 0.002
"""m, likewise, of the smooth minimum that is the height of the sole."""

TRUNK = slice(31, 34)
"""The trunk's rotation vector among the numbers of an instant, after its generalised forces."""

FOOT = 34
"""First of the six numbers of each foot: sliding (2), pivoting, height, pressure (2)."""

OUTPUTS = FOOT + 12
FORCES = 3 * 31
"""First of the twelve numbers of the forces, after coordinates, rates and second rates."""

INPUTS = FORCES + 12

_STEPS = np.concatenate(
    [np.full(31, 1e-5), np.full(31, 1e-4), np.full(31, 1e-3), np.tile([1, 1, 1, 1e-4, 1e-4, 1], 2)]
)
"""Steps of the central differences: rad, rad/s, rad/s² (m likewise), N, m, Nm."""

_TORSO = SEGMENTS.index("torso")
_FEET = np.array([SEGMENTS.index("foot_r"), SEGMENTS.index("foot_l")])
_TOES = np.array([SEGMENTS.index("toes_r"), SEGMENTS.index("toes_l")])
_TOE_DOFS = np.array([COORDINATES.index("mtp_angle_r"), COORDINATES.index("mtp_angle_l")])


class _Work(NamedTuple):
    """Arrays that one instant needs."""

    segments: SegmentDynamics
    generalised: Array
    state: Array
    force: Array
    point: Array
    free_moment: Array


def _work() -> _Work:
    dofs = len(COORDINATES)
    return _Work(
        empty_dynamics(),
        np.empty(dofs),
        np.empty((3, dofs)),
        np.empty((2, 3)),
        np.zeros((2, 3)),
        np.zeros((2, 3)),
    )


@njit
def _instant(tree: Tree, x: Array, work: _Work, out: Array) -> None:
    """The terms of the laws at one instant.

    Parameters
    ----------
    x : (105,) coordinates (31) with the pelvis' Cardan angles first, their rates, their second
        rates; then of the right and the left foot force (3) N, centre of pressure (2) m and
        free moment Nm.
    out : (46,) generalised forces (31) that must act in addition to the ground's; rotation vector
        of the trunk; then for each foot the velocity of its sole on the ground (2) m/s, angular
        velocity about the vertical rad/s, height of its lowest point m, and centre of pressure
        minus the middle of the sole on the ground (2) m.
    """
    q, qd, qdd = work.state[0], work.state[1], work.state[2]
    root_state(x[0:3], x[31:34], x[62:65], q[:3], qd[:3], qdd[:3])
    for i in range(3, 31):
        q[i], qd[i], qdd[i] = x[i], x[31 + i], x[62 + i]
    for side in range(2):
        first = FORCES + 6 * side
        for i in range(3):
            work.force[side, i] = x[first + i]
        work.point[side, 0], work.point[side, 1] = x[first + 3], x[first + 4]
        work.free_moment[side, 2] = x[first + 5]
    newton_euler(
        tree.joint_position,
        tree.mass,
        tree.centre_of_mass,
        tree.inertia,
        q,
        qd,
        qdd,
        work.force,
        work.point,
        work.free_moment,
        work.segments,
        work.generalised,
    )
    for i in range(31):
        out[i] = work.generalised[i]
    out[TRUNK] = rotation_vector(work.segments.frames.rotation[_TORSO])
    for side in range(2):
        _sole(tree, side, work, out)


@njit
def _sole(tree: Tree, side: int, work: _Work, out: Array) -> None:
    """What one foot adds to `out` of `_instant`, where `work` has the frames and the forces."""
    rotation, origin, axes, angular, linear = work.segments.frames
    spheres = tree.sphere_segment.shape[0] // 2
    arm = np.empty((spheres, 3))
    height = np.empty(spheres)
    for n in range(spheres):
        s = tree.sphere_segment[side * spheres + n]
        p = tree.sphere_position[side * spheres + n]
        for i in range(3):
            arm[n, i] = (
                rotation[s, i, 0] * p[0] + rotation[s, i, 1] * p[1] + rotation[s, i, 2] * p[2]
            )
        arm[n, 2] -= tree.sphere_radius[side * spheres + n]
        height[n] = origin[s, 2] + arm[n, 2]
    lowest = height.min()
    share = deep = 0.0
    middle = np.zeros(2)
    sliding = np.zeros(2)
    toes = np.zeros(3)
    for n in range(spheres):
        s = tree.sphere_segment[side * spheres + n]
        weight = np.exp(-(height[n] - lowest) / _SOLE_DEPTH)
        share += weight
        deep += np.exp(-(height[n] - lowest) / _LOWEST_DEPTH)
        w, r = angular[s], arm[n]
        sliding[0] += weight * (linear[s, 0] + w[1] * r[2] - w[2] * r[1])
        sliding[1] += weight * (linear[s, 1] + w[2] * r[0] - w[0] * r[2])
        for i in range(2):
            middle[i] += weight * (origin[s, i] + r[i])
        if s == _TOES[side]:
            for i in range(3):
                toes[i] += weight * r[i]
    first = FOOT + 6 * side
    for i in range(2):
        out[first + i] = sliding[i] / share
        out[first + 4 + i] = work.point[side, i] - middle[i] / share
    out[first + 2] = angular[_FEET[side], 2]
    out[first + 3] = lowest - _LOWEST_DEPTH * np.log(deep)
    # `newton_euler` applies the whole force to the foot, but the toes carry their share of it.
    axis, force = axes[_TOE_DOFS[side]], work.force[side]
    moment = np.cross(toes, force) / share
    out[_TOE_DOFS[side]] -= axis[0] * moment[0] + axis[1] * moment[1] + axis[2] * moment[2]


@njit
def _instants(
    tree: Tree, inputs: Array, steps: Array, work: _Work, out: Array, slope: Array
) -> None:
    """`_instant` of every row of `inputs` (T, 105) into `out` (T, 46), and its derivatives into
    `slope` (T, 46, 105) unless that is empty.
    """
    x = np.empty(inputs.shape[1])
    above, below = np.empty(out.shape[1]), np.empty(out.shape[1])
    for t in range(inputs.shape[0]):
        x[:] = inputs[t]
        _instant(tree, x, work, out[t])
        if slope.shape[0] == 0:
            continue
        for k in range(inputs.shape[1]):
            x[k] = inputs[t, k] + steps[k]
            _instant(tree, x, work, above)
            x[k] = inputs[t, k] - steps[k]
            _instant(tree, x, work, below)
            x[k] = inputs[t, k]
            for j in range(out.shape[1]):
                slope[t, j, k] = (above[j] - below[j]) / (2.0 * steps[k])


def walking_laws(tree: Tree, inputs: Array, slope: Array | None = None) -> Array:
    """The terms of the laws at every instant of a walk.

    Parameters
    ----------
    inputs : (T, 105) coordinates, rates, second rates and forces, as for `_instant`.
    slope : (T, 46, 105) out, derivatives of the result by the inputs; not computed if left out.

    Returns
    -------
    (T, 46) generalised forces, `TRUNK`, and six numbers for each foot from `FOOT` on.
    """
    found = np.zeros((len(inputs), OUTPUTS))
    wanted = np.zeros((0, 0, 0)) if slope is None else slope
    _instants(tree, inputs, _STEPS, _work(), found, wanted)
    return found
