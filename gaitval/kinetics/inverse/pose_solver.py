"""Newton's method for the pose that best fits a frame's markers, and for all frames of a trial.

It uses the exact second derivative, and the sparsity due to branches through Featherstone's LᵀL
factorisation (Featherstone 2008, Rigid Body Dynamics Algorithms, section 6.5).
"""

import numpy as np

from gaitval._internal.numba.compiled import njit
from gaitval.arrays import Array, Flags, Index
from gaitval.kinetics.inverse.marked_body import MarkerTrial
from gaitval.kinetics.inverse.marker_derivatives import PARENT_COORDINATE, MarkerWorkspace, evaluate
from gaitval.model.tree import ROOT_DOFS

HEADINGS = 8
"""Number of initial headings for a frame without a good previous frame."""

_LONGEST_STEP = 0.5  # rad or m in one iteration
_NEWTON_TOLERANCE = 1e-6  # rad or m: an undamped Newton step this long leaves about its square
_DAMPED_TOLERANCE = 1e-9  # rad or m: for steps that converge linearly
_SMALLEST_PIVOT = 1e-6  # of the diagonal; below, the matrix counts as not positive definite
_MOST_ITERATIONS = 100
_SUDDEN_ERROR = 0.005  # m, weighted RMS that does not yet count as a jump


@njit
def _newton_step(work: MarkerWorkspace, damping: float, second_order: bool) -> bool:
    """Solve (H + damping · diag) step = −gradient for the coordinates that are not fixed, into
    `work.step`.

    Featherstone's LᵀL factorisation, along the branches only. False if H is not positive
    definite.
    """
    matrix, step = work.matrix, work.step
    n = len(step)
    for j in range(n):
        i = j
        while i >= 0:
            # The Hessian is JᵀWJ − Σ w r ∂²p/∂q²: minus, because r is measured less model.
            if work.fixed[j] or work.fixed[i]:
                matrix[j, i] = 0.0
            elif second_order:
                matrix[j, i] = work.normal[j, i] - work.curvature[j, i]
            else:
                matrix[j, i] = work.normal[j, i]
            i = PARENT_COORDINATE[i]
        if work.fixed[j]:
            # The row of a fixed coordinate is 1 · step = 0.
            matrix[j, j] = 1.0
            step[j] = 0.0
        else:
            matrix[j, j] += damping * work.normal[j, j]
            step[j] = -work.gradient[j]
    for k in range(n - 1, -1, -1):
        # From the tips of the branches to the pelvis: in this order the factor has no elements
        # where the matrix has none.
        smallest = 0.0 if work.fixed[k] else _SMALLEST_PIVOT * work.normal[k, k]
        if not matrix[k, k] > smallest:
            return False
        pivot = np.sqrt(matrix[k, k])
        matrix[k, k] = pivot
        i = PARENT_COORDINATE[k]
        while i >= 0:
            matrix[k, i] /= pivot
            i = PARENT_COORDINATE[i]
        i = PARENT_COORDINATE[k]
        while i >= 0:
            j = i
            while j >= 0:
                matrix[i, j] -= matrix[k, i] * matrix[k, j]
                j = PARENT_COORDINATE[j]
            i = PARENT_COORDINATE[i]
    for k in range(n - 1, -1, -1):  # Lᵀ y = −g
        step[k] /= matrix[k, k]
        i = PARENT_COORDINATE[k]
        while i >= 0:
            step[i] -= matrix[k, i] * step[k]
            i = PARENT_COORDINATE[i]
    for k in range(n):  # L x = y
        i = PARENT_COORDINATE[k]
        while i >= 0:
            step[k] -= matrix[k, i] * step[i]
            i = PARENT_COORDINATE[i]
        step[k] /= matrix[k, k]
    return True


@njit
def turned(vector: Array, turn: Array, out: Array) -> None:
    """A rotation followed by another one, through quaternions: rotation vectors `vector` (3,) rad
    of the first and `turn` (3,) rad of the second, in world axes; `out` (3,), at most π long, of
    exp(turn) exp(vector).
    """
    a = np.sqrt(vector[0] ** 2 + vector[1] ** 2 + vector[2] ** 2)
    b = np.sqrt(turn[0] ** 2 + turn[1] ** 2 + turn[2] ** 2)
    # sin(a/2) / a, whose limit is ½.
    fa = np.sin(0.5 * a) / a if a > 1e-9 else 0.5
    fb = np.sin(0.5 * b) / b if b > 1e-9 else 0.5
    w, x, y, z = np.cos(0.5 * a), fa * vector[0], fa * vector[1], fa * vector[2]
    c, d, e, f = np.cos(0.5 * b), fb * turn[0], fb * turn[1], fb * turn[2]
    qw = c * w - d * x - e * y - f * z
    qx = c * x + d * w + e * z - f * y
    qy = c * y - d * z + e * w + f * x
    qz = c * z + d * y - e * x + f * w
    # q and −q are the same rotation; with w ≥ 0 the vector is at most π long.
    if qw < 0.0:
        qw, qx, qy, qz = -qw, -qx, -qy, -qz
    sine = np.sqrt(qx * qx + qy * qy + qz * qz)
    factor = 2.0 * np.arctan2(sine, qw) / sine if sine > 1e-9 else 2.0
    out[0], out[1], out[2] = factor * qx, factor * qy, factor * qz


@njit
def moved(q: Array, step: Array, low: Array, high: Array, out: Array) -> None:
    """The pose `q` (31,) after a `step` (31,) rad and m, within the bounds `low` and `high` (31,)
    of the coordinates, into `out` (31,). The pelvis is rotated by the rotation vector step[:3] in
    world axes, which has no bounds; the rest is added.
    """
    turned(q[:3], step[:3], out[:3])
    for i in range(3, len(q)):
        out[i] = min(max(q[i] + step[i], low[i]), high[i])


@njit
def solve_frame(
    problem: MarkerTrial,
    frame: int,
    q: Array,
    free: Flags,
    low: Array,
    high: Array,
    work: MarkerWorkspace,
) -> int:
    """Find the best pose of one frame from q, in place.

    Bounds by Bertsekas' projected Newton method (1982, SIAM J Control Optim 20:221-246): a
    coordinate at a bound that would cross it stays there. If the exact Hessian is not positive
    definite the Gauss-Newton one is used, with Marquardt's damping if that step does not lower the
    cost.

    Parameters
    ----------
    problem, frame, work : as for `evaluate`.
    q : (31,) start, and then the result.
    free : (31,) coordinates to be found; the others stay.
    low, high : (31,) bounds.

    Returns
    -------
    Number of iterations, negative if they were not enough.
    """
    n = len(q)
    damping = 0.0
    cost = evaluate(problem, frame, q, work)
    work.cost[0] = cost
    for iteration in range(1, _MOST_ITERATIONS + 1):
        for j in range(n):
            work.fixed[j] = (
                not free[j]
                or (q[j] <= low[j] and work.gradient[j] > 0.0)
                or (q[j] >= high[j] and work.gradient[j] < 0.0)
            )
        # Damping that a failed step has raised belongs to the Gauss-Newton matrix only.
        exact = damping == 0.0
        if exact:
            exact = _newton_step(work, 0.0, True)
        while not exact and not _newton_step(work, damping, False):
            damping = max(1e-6, 10.0 * damping)
            if damping > 1e12:
                return -iteration
        longest = 0.0
        for j in range(n):
            longest = max(longest, abs(work.step[j]))
        if longest > _LONGEST_STEP:
            for j in range(n):
                work.step[j] *= _LONGEST_STEP / longest
        moved(q, work.step, low, high, work.trial)
        # A Newton step cut short by a bound is not a full Newton step.
        inside = True
        for j in range(3, n):
            if free[j] and work.trial[j] != q[j] + work.step[j]:
                inside = False
        if longest < (_NEWTON_TOLERANCE if exact and inside else _DAMPED_TOLERANCE):
            q[:] = work.trial
            return iteration
        # A trial step that is no better leaves the derivatives of another pose behind.
        new = evaluate(problem, frame, work.trial, work)
        if new <= cost * (1.0 + 1e-13):
            q[:] = work.trial
            cost = new
            work.cost[0] = cost
            damping = 0.0 if damping < 1e-6 else 0.1 * damping
        else:
            if damping > 1e12:
                return -iteration
            damping = max(1e-4, 10.0 * damping)
            evaluate(problem, frame, q, work)
    return -_MOST_ITERATIONS


@njit
def solve_from_all_sides(
    problem: MarkerTrial,
    frame: int,
    start: Array,
    q: Array,
    free: Flags,
    low: Array,
    high: Array,
    work: MarkerWorkspace,
) -> int:
    """As `solve_frame`, but at headings all around, with the joint angles `start` (31,); the best
    resulting pose goes into `q` (31,), from which coordinates that are not `free` are read. Returns
    the number of its iterations, negative if they were not enough.

    The rigid body is fitted to the markers first, then the joints are freed. `problem`, `frame` and
    `work` are as for `evaluate`; `free`, `low` and `high` (31,) as for `solve_frame`.
    """
    weight, measured = problem.weight[frame], problem.measured[frame]
    total = weight.sum()
    best, iterations = np.inf, 0
    for j in range(len(q)):
        work.stiff[j] = free[j] and j < ROOT_DOFS
    for heading in range(HEADINGS):
        for j in range(len(q)):
            work.other[j] = start[j] if free[j] else q[j]
        if free[0]:
            work.other[0], work.other[1] = 0.0, 0.0
            # People stand upright, but may face any way: headings are rotations about z.
            work.other[2] = 2.0 * np.pi * heading / HEADINGS
            for i in range(3):
                work.other[3 + i] = 0.0
                # The pelvis starts at the weighted mean of the markers.
                for m in range(len(weight)):
                    work.other[3 + i] += weight[m] * measured[m, i] / total
        solve_frame(problem, frame, work.other, work.stiff, low, high, work)
        count = solve_frame(problem, frame, work.other, free, low, high, work)
        if work.cost[0] < best:
            best, iterations = work.cost[0], count
            q[:] = work.other
    work.cost[0] = best
    return iterations


@njit
def _led_on(
    q: Array, last: Array, turn: Array, free: Flags, low: Array, high: Array, out: Array
) -> None:
    """out = extrapolation of the motion from the pose `last` to the pose q, for free coordinates:
    the pelvis is rotated by `turn` (3,) once more, the rest moves on by the same amount.
    """
    turned(q[:3], turn, out[:3])
    for i in range(3, len(q)):
        if free[i]:
            out[i] = min(max(2.0 * q[i] - last[i], low[i]), high[i])


@njit
def solve_trial(
    problem: MarkerTrial,
    positions: Array,
    start_pose: Array,
    free: Flags,
    low: Array,
    high: Array,
    start: int,
    direction: int,
    iterations: Index,
    converged: Flags,
    work: MarkerWorkspace,
) -> None:
    """Solve all frames from `start` forwards (direction 1) or backwards (-1), each from the
    extrapolated motion of the last two; `positions[start]` is already solved. If the markers jump,
    this may lead to another minimum: a frame whose error is suddenly large is also solved from all
    sides.

    Parameters
    ----------
    problem, work : as for `evaluate`.
    positions, free : (T, 31) out, but for the frame `start`; and the coordinates to be found.
    start_pose, low, high : (31,) joint angles for `solve_from_all_sides`, and bounds.
    iterations, converged : (T,) out.
    """
    q = positions[start].copy()
    last = q.copy()
    turn = np.zeros(3)
    guess = np.empty_like(q)
    another = np.empty_like(q)
    inverse = np.empty(3)
    good_error = np.inf
    known = 0
    t = start
    while 0 <= t < len(positions):
        guess[:] = q
        if known >= 2 and free[t, :ROOT_DOFS].all():
            _led_on(q, last, turn, free[t], low, high, guess)
        if free[t].any():
            count = solve_frame(problem, t, guess, free[t], low, high, work)
            total = problem.weight[t].sum()
            if count < 0 or work.cost[0] > total * (4.0 * good_error + _SUDDEN_ERROR**2):
                cost = work.cost[0]
                another[:] = guess
                other_count = solve_from_all_sides(
                    problem, t, start_pose, another, free[t], low, high, work
                )
                if work.cost[0] < 0.99 * cost:
                    guess[:] = another
                    count = other_count
                    known = 0
                else:
                    work.cost[0] = cost
            # A good error is forgotten slowly, so that a wrong minimum is soon left again.
            error = work.cost[0] / total
            good_error = min(error, 1.1 * good_error + 1e-6)  # m²
            iterations[t] = abs(count)
            converged[t] = count > 0
            known += 1
        else:
            known = 0
        last[:] = q
        q[:] = guess
        for i in range(3):
            inverse[i] = -last[i]
        # exp(q) exp(−last): the rotation from the last pose to this one.
        turned(inverse, q[:3], turn)
        positions[t] = q
        t += direction
