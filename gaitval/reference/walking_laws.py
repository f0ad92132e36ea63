"""The laws of motion and contact at one instant of a walk (compiled).

The motion decides everything: where the contact spheres are and how fast they move gives the
ground's forces by the law that the simulation uses, and with them Newton's equations give what the
joints must exert. The terms of an instant depend only on the coordinates and their first two rates
at that instant, so the derivatives are computed separately for each instant, by central
differences.
"""

import os
from concurrent.futures import ThreadPoolExecutor
from typing import NamedTuple

import numpy as np

from gaitval.arrays import Array
from gaitval.compiled import njit, njit_unlocked
from gaitval.coordinates import COORDINATES
from gaitval.inverse.motion_rates import root_state
from gaitval.inverse.newton_euler import SegmentDynamics, empty_dynamics, newton_euler
from gaitval.model.body import SEGMENTS
from gaitval.model.contact import ContactWorkspace, contact_forces, contact_workspace
from gaitval.model.contact_law import ContactLaw
from gaitval.model.tree import Tree, rotation_vector

_DOFS = len(COORDINATES)

TRUNK = slice(31, 34)
"""The trunk's rotation vector among the numbers of an instant, after its generalised forces."""

FOOT = 34
"""First of the seven numbers of each foot: force N (3), moment Nm about the world origin (3), and
height of the lowest point of the sole m."""

FOOT_NUMBERS = 7
OUTPUTS = FOOT + 2 * FOOT_NUMBERS
INPUTS = 3 * _DOFS

_STEPS = np.repeat([1e-6, 1e-5, 1e-3], _DOFS)
"""Steps of the central differences: rad, rad/s, rad/s² (m likewise)."""

_TORSO = SEGMENTS.index("torso")

_NO_LAG = np.zeros(2)
"""The plain contact law, which the simulation's approaches as its step becomes smaller."""


class _Work(NamedTuple):
    """Arrays that one instant needs."""

    segments: SegmentDynamics
    contact: ContactWorkspace
    state: Array
    generalised: Array
    ground: Array
    feet: Array
    memory: Array
    nowhere: Array


@njit
def _work(spheres: int) -> _Work:
    return _Work(
        empty_dynamics(),
        contact_workspace(spheres),
        np.empty((3, _DOFS)),
        np.empty(_DOFS),
        np.empty(_DOFS),
        np.empty((2, 6)),
        np.zeros((spheres, 3)),
        np.full((2, 3), np.nan),
    )


@njit
def _instant(tree: Tree, law: ContactLaw, lag: Array, x: Array, work: _Work, out: Array) -> None:
    """The terms of the laws at one instant.

    Parameters
    ----------
    x : (93,) coordinates (31) with the pelvis' Cardan angles first, their rates, their second
        rates.
    out : (48,) generalised forces (31) that must act in addition to the ground's; rotation vector
        of the trunk; the numbers of both feet, see `FOOT`.
    """
    q, qd, qdd = work.state[0], work.state[1], work.state[2]
    root_state(x[0:3], x[31:34], x[62:65], q[:3], qd[:3], qdd[:3])
    for i in range(3, 31):
        q[i], qd[i], qdd[i] = x[i], x[31 + i], x[62 + i]
    newton_euler(
        tree.joint_position,
        tree.mass,
        tree.centre_of_mass,
        tree.inertia,
        q,
        qd,
        qdd,
        work.nowhere,
        work.nowhere,
        work.nowhere,
        work.segments,
        work.generalised,
    )
    frames = work.segments.frames
    work.ground[:] = 0.0
    contact_forces(tree, law, frames, lag, work.memory, work.ground, work.feet, work.contact)
    for i in range(31):
        out[i] = work.generalised[i] - work.ground[i]
    out[TRUNK] = rotation_vector(frames.rotation[_TORSO])
    spheres = tree.sphere_segment.shape[0] // 2
    for side in range(2):
        first = FOOT + FOOT_NUMBERS * side
        for i in range(6):
            out[first + i] = work.feet[side, i]
        lowest = np.inf
        for n in range(side * spheres, (side + 1) * spheres):
            s = tree.sphere_segment[n]
            p = tree.sphere_position[n]
            height = frames.origin[s, 2] - tree.sphere_radius[n]
            for i in range(3):
                height += frames.rotation[s, 2, i] * p[i]
            lowest = min(lowest, height)
        out[first + 6] = lowest


@njit_unlocked
def _instants(
    tree: Tree,
    law: ContactLaw,
    lag: Array,
    inputs: Array,
    steps: Array,
    out: Array,
    slope: Array,
) -> None:
    """`_instant` of every row of `inputs` (T, 93) into `out` (T, 48), and its derivatives into
    `slope` (T, 48, 93) unless that is empty.
    """
    work = _work(tree.sphere_segment.shape[0])
    x = np.empty(inputs.shape[1])
    above, below = np.empty(out.shape[1]), np.empty(out.shape[1])
    for t in range(inputs.shape[0]):
        x[:] = inputs[t]
        _instant(tree, law, lag, x, work, out[t])
        if slope.shape[0] == 0:
            continue
        for k in range(inputs.shape[1]):
            x[k] = inputs[t, k] + steps[k]
            _instant(tree, law, lag, x, work, above)
            x[k] = inputs[t, k] - steps[k]
            _instant(tree, law, lag, x, work, below)
            x[k] = inputs[t, k]
            for j in range(out.shape[1]):
                slope[t, j, k] = (above[j] - below[j]) / (2.0 * steps[k])


def walking_laws(tree: Tree, law: ContactLaw, inputs: Array, slope: Array | None = None) -> Array:
    """The terms of the laws at every instant of a walk.

    Parameters
    ----------
    inputs : (T, 93) coordinates, rates and second rates, as for `_instant`.
    slope : (T, 48, 93) out, derivatives of the result by the inputs; not computed if left out.

    Returns
    -------
    (T, 48) generalised forces, `TRUNK`, and seven numbers for each foot from `FOOT` on.
    """
    found, inputs = np.zeros((len(inputs), OUTPUTS)), np.ascontiguousarray(inputs)
    if slope is None:
        _instants(tree, law, _NO_LAG, inputs, _STEPS, found, np.zeros((0, 0, 0)))
        return found
    # The slopes take two hundred times as long as the terms. Instants do not depend on each other.
    parts = np.array_split(np.arange(len(inputs)), _threads())
    with ThreadPoolExecutor(len(parts)) as threads:
        working = [
            threads.submit(
                _instants, tree, law, _NO_LAG, inputs[part], _STEPS, found[part], slope[part]
            )
            for part in [slice(rows[0], rows[-1] + 1) for rows in parts]
        ]
        for each in working:
            each.result()
    return found


def _threads() -> int:
    """As many as linear algebra may use."""
    return max(1, min(int(os.environ.get("OMP_NUM_THREADS") or os.cpu_count() or 1), 8))
