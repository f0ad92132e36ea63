"""The laws of motion and contact at one instant of a walk (compiled).

The motion decides everything: where the contact spheres are and how fast they move gives the
ground's forces by the law that the simulation uses, and with them Newton's equations give what the
joints must exert. The terms of an instant depend only on the coordinates and their first two rates
at that instant, so the derivatives are computed separately for each instant, by central
differences, with eight instants in the lanes of a vector.
"""

import os
from concurrent.futures import ThreadPoolExecutor
from typing import NamedTuple

import numpy as np

from gaitval._internal.numba.compiled import njit_borrowing, njit_unlocked
from gaitval._internal.numba.lanes import WIDTH, in_lanes, where, with_lanes
from gaitval.arrays import Array
from gaitval.coordinates import COORDINATES
from gaitval.kinetics.inverse.motion_rates import root_state
from gaitval.kinetics.inverse.newton_euler import (
    SegmentDynamics,
    empty_dynamics,
    inertial_wrenches,
    joint_wrenches,
)
from gaitval.model.body import SEGMENTS
from gaitval.model.tree import COORDINATE_COUNT, Tree, enter_rotation_vector
from gaitval.walk.contact.forces import ContactWorkspace, contact_forces, contact_workspace
from gaitval.walk.contact.law import ContactLaw

TRUNK = slice(COORDINATE_COUNT, COORDINATE_COUNT + 3)
"""The trunk's rotation vector among the numbers of an instant, after its generalised forces."""

POWER = slice(TRUNK.stop, TRUNK.stop + 2)
"""W, power of the right and the left ankle in the sagittal plane, after them."""

FOOT = POWER.stop
"""First of the eight numbers of each foot: force N (3), moment Nm about the world origin (3),
height of the lowest point of the sole m, and twist N m²/s: the sum of d x v over its spheres, each
weighted with the normal force on it, where d is its place from the centre of pressure and v its
slip. While friction grows with slip, the free moment is -μ / vt times the twist. Beyond vt friction
grows no more: a foot that turns faster has more twist, but no larger free moment."""

FOOT_NUMBERS = 8
OUTPUTS = FOOT + 2 * FOOT_NUMBERS
INPUTS = 3 * COORDINATE_COUNT
RATES, SECOND_RATES = COORDINATE_COUNT, 2 * COORDINATE_COUNT
"""First of the coordinates' rates and second rates among the numbers that go in."""

_STEPS = np.repeat([1e-6, 1e-5, 1e-3], COORDINATE_COUNT)
"""Steps of the central differences: rad, rad/s, rad/s² (m likewise)."""

_POWER = POWER.start
_TORSO = SEGMENTS.index("torso")
_ANKLES = np.array([COORDINATES.index(f"ankle_angle_{side}") for side in "rl"])

_LIGHT = 20.0
"""N, vertical force below which a foot's centre of pressure fades to the origin: the twist of what
carries nothing is that about the origin, which is nothing, too."""

_NO_LAG = np.zeros(2)
"""The plain contact law, which the simulation's approaches as its step becomes smaller."""


class _Work(NamedTuple):
    """Arrays that one instant needs."""

    segments: SegmentDynamics
    contact: ContactWorkspace
    inputs: Array
    state: Array
    generalised: Array
    ground: Array
    feet: Array
    memory: Array
    middle: Array
    above: Array
    below: Array


def _work(spheres: int) -> _Work:
    """For eight instants."""
    q = COORDINATE_COUNT
    sizes = INPUTS, (3, q), q, q, (2, 6), (spheres, 3), *[OUTPUTS] * 3
    one = _Work(empty_dynamics(), contact_workspace(spheres), *(np.empty(each) for each in sizes))
    work: _Work = with_lanes(one)
    return work


@njit_borrowing
def _twist(tree: Tree, work: _Work, start: int, stop: int) -> float:
    """N m²/s, the twist of the foot whose spheres are those from `start` to before `stop`, see
    `FOOT`.
    """
    frames, contact = work.segments.frames, work.contact
    none = 0.0 * frames.origin[0, 0]
    load, x, y, u, v, turned = none, none, none, none, none, none
    for n in range(start, stop):
        s = tree.sphere_segment[n]
        r, w, o = contact.place[n], frames.angular[s], frames.linear[s]
        f = contact.force[n, 2]
        p0, p1 = frames.origin[s, 0] + r[0], frames.origin[s, 1] + r[1]
        v0 = o[0] + w[1] * r[2] - w[2] * r[1]
        v1 = o[1] + w[2] * r[0] - w[0] * r[2]
        load += f
        x += f * p0
        y += f * p1
        u += f * v0
        v += f * v1
        turned += f * (p0 * v1 - p1 * v0)
    # About the world's origin first, then about the centre of pressure, (x, y) / load.
    twist: float = turned - (x * v - y * u) * load / (load * load + _LIGHT * _LIGHT)
    return twist


@njit_borrowing
def _instant(tree: Tree, law: ContactLaw, lag: Array, work: _Work, out: Array) -> None:
    """The terms of the laws at one instant, or in lanes at eight. The `inputs` (93,) of `work` are
    the coordinates (31) with the pelvis' Cardan angles first, their rates, their second rates; into
    `out` (52,) go the generalised forces (31) that must act in addition to the ground's; the
    rotation vector of the trunk; the ankles' power; the numbers of both feet, see `FOOT`.
    """
    x, q, qd, qdd = work.inputs, work.state[0], work.state[1], work.state[2]
    root_state(
        x[0:3], x[RATES : RATES + 3], x[SECOND_RATES : SECOND_RATES + 3], q[:3], qd[:3], qdd[:3]
    )
    for i in range(3, COORDINATE_COUNT):
        q[i], qd[i], qdd[i] = x[i], x[RATES + i], x[SECOND_RATES + i]
    inertial_wrenches(tree, q, qd, qdd, work.segments)
    joint_wrenches(work.segments, work.generalised)
    frames = work.segments.frames
    for i in range(COORDINATE_COUNT):
        work.ground[i] = 0.0
    contact_forces(tree, law, frames, lag, work.memory, work.ground, work.feet, work.contact)
    for i in range(COORDINATE_COUNT):
        # Of the pelvis (0 to 5) this is a residual force that nothing exerts; of a joint its net
        # moment.
        out[i] = work.generalised[i] - work.ground[i]
    enter_rotation_vector(frames.rotation[_TORSO], out[COORDINATE_COUNT : COORDINATE_COUNT + 3])
    spheres = tree.sphere_segment.shape[0] // 2
    for side in range(2):
        ankle = _ANKLES[side]
        out[_POWER + side] = out[ankle] * qd[ankle]
        first = FOOT + FOOT_NUMBERS * side
        for i in range(6):
            out[first + i] = work.feet[side, i]
        out[first + 7] = _twist(tree, work, side * spheres, (side + 1) * spheres)
        # The lowest point, with `where`, because in lanes each of the eight has its own.
        out[first + 6] = np.inf
        for n in range(side * spheres, (side + 1) * spheres):
            s = tree.sphere_segment[n]
            p = tree.sphere_position[n]
            height = frames.origin[s, 2] - tree.sphere_radius[n]
            for i in range(3):
                height += frames.rotation[s, 2, i] * p[i]
            out[first + 6] = where(height < out[first + 6], height, out[first + 6])


@njit_unlocked
def _instants(
    tree: Tree,
    law: ContactLaw,
    lag: Array,
    inputs: Array,
    steps: Array,
    out: Array,
    slope: Array,
    work: _Work,
) -> None:
    """`_instant` of every row of `inputs` (T, 93) into `out` (T, 52), and its derivatives into
    `slope` (T, 52, 93) unless that is empty. What is left of the last eight is its last row again.
    """
    # `work` and `lanes` are the same memory: numbers are written and read through `work`, computed
    # through `lanes`.
    lanes, instants = in_lanes(work), inputs.shape[0]
    for first in range(0, instants, WIDTH):
        for e in range(WIDTH):
            row = min(first + e, instants - 1)
            for k in range(inputs.shape[1]):
                work.inputs[k, e] = inputs[row, k]
        _instant(tree, law, lag, lanes, lanes.middle)
        count = min(WIDTH, instants - first)
        for e in range(count):
            for j in range(out.shape[1]):
                out[first + e, j] = work.middle[j, e]
        for k in range(slope.shape[2]):
            # One input at a time, and restored exactly afterwards: subtracting the step again would
            # round.
            x = lanes.inputs[k]
            lanes.inputs[k] = x + steps[k]
            _instant(tree, law, lag, lanes, lanes.above)
            lanes.inputs[k] = x - steps[k]
            _instant(tree, law, lag, lanes, lanes.below)
            lanes.inputs[k] = x
            for e in range(count):
                for j in range(out.shape[1]):
                    difference = work.above[j, e] - work.below[j, e]
                    slope[first + e, j, k] = difference / (2.0 * steps[k])


def walking_laws(tree: Tree, law: ContactLaw, inputs: Array, slope: Array | None = None) -> Array:
    """The terms of the laws at every instant of a walk.

    Parameters
    ----------
    tree : the body.
    law : the contact law.
    inputs : (T, 93) coordinates, rates and second rates, as for `_instant`.
    slope : (T, 52, 93) out, derivatives of the result by the inputs; not computed if left out.

    Returns
    -------
    (T, 52) generalised forces, `TRUNK`, `POWER`, and eight numbers for each foot from `FOOT` on: Nm
        and N, rad, W, N, Nm, m and N m²/s.
    """
    found, inputs = np.zeros((len(inputs), OUTPUTS)), np.ascontiguousarray(inputs)
    spheres = len(tree.sphere_segment)

    def instants(part: slice) -> None:
        wanted = np.zeros((0, 0, 0)) if slope is None else slope[part]
        _instants(tree, law, _NO_LAG, inputs[part], _STEPS, found[part], wanted, _work(spheres))

    if slope is None:
        instants(slice(None))
        return found
    # The slopes take two hundred times as long as the terms. Instants do not depend on each other.
    eights = np.array_split(np.arange(0, len(inputs), WIDTH), _threads())
    # Cut at multiples of eight, so that the lanes are full; each thread has its own arrays to work
    # in, and writes other rows of the result.
    parts = [slice(rows[0], rows[-1] + WIDTH) for rows in eights if len(rows)]
    with ThreadPoolExecutor(len(parts)) as threads:
        list(threads.map(instants, parts))
    return found


def _threads() -> int:
    """As many as linear algebra may use."""
    return max(1, min(int(os.environ.get("OMP_NUM_THREADS") or os.cpu_count() or 1), 8))
