"""Newton's method on the dual of the sharing problem (`sharing`), frame by frame, compiled."""

import numpy as np

from gaitval._internal.numba.compiled import njit
from gaitval.arrays import Array, Flags

_STEPS, _HALVINGS = 100, 30
_ENOUGH = 1e-6
"""Of the largest moment: what the equations may be wrong by if the steps end."""


@njit
def _activation(pull: float, weight: float, exponent: float) -> float:
    """Where Σ w aᵖ rises as fast as `pull`, without limits."""
    if pull <= 0.0:
        return 0.0
    free = pull / (exponent * weight)
    if exponent == 2.0:
        return free
    if exponent == 3.0:
        return float(np.sqrt(free))
    return float(free ** (1.0 / (exponent - 1.0)))


@njit
def _power(activation: float, exponent: float) -> float:
    if exponent == 2.0:
        return activation * activation
    if exponent == 3.0:
        return activation * activation * activation
    return float(activation**exponent)


@njit
def share_frames(
    rows: Array,
    wanted: Array,
    softness: Array,
    weights: Array,
    exponent: float,
    lowest: float,
    favour: Array,
    fall: float,
    rise: float,
    precision: float,
    multipliers: Array,
    activations: Array,
    solved: Flags,
) -> None:
    """Solve N frames: `rows` (N, r, m), `wanted` (N, r), `softness` 1/ρ (N, r), `weights` (N, m),
    `favour` (N, m). From frame to frame an activation loses at most the share `fall` of itself, and
    gains at most `rise` of what is left to 1; 1 each for no such limit.
    `multipliers` (N, r) in: where to start, out: of the rows; `activations` (N, m) and `solved`
    (N,) out.
    """
    frames, count, muscles = rows.shape
    low, high = np.empty(muscles), np.empty(muscles)
    pull, slope = np.empty(muscles), np.empty(muscles)
    gradient, step = np.empty(count), np.empty(count)
    hessian, trial = np.empty((count, count)), np.empty(count)
    for n in range(frames):
        a, x = activations[n], multipliers[n]
        for i in range(muscles):
            low[i], high[i] = lowest, 1.0
            if n > 0:
                before = activations[n - 1, i]
                low[i] = max(lowest, before * (1.0 - fall))
                high[i] = max(min(1.0, before + (1.0 - before) * rise), low[i])
        scale = 1.0
        for j in range(count):
            scale = max(scale, 1.0 + abs(wanted[n, j]))
        for _ in range(_STEPS):
            value = 0.0
            for i in range(muscles):
                pull[i] = favour[n, i]
            for j in range(count):
                for i in range(muscles):
                    pull[i] += rows[n, j, i] * x[j]
            for i in range(muscles):
                free = _activation(pull[i], weights[n, i], exponent)
                a[i] = min(max(free, low[i]), high[i])
                slope[i] = 0.0
                if low[i] < free < high[i]:
                    slope[i] = free / (pull[i] * (exponent - 1.0))
                value += pull[i] * a[i] - weights[n, i] * _power(a[i], exponent)
            largest = 0.0
            for j in range(count):
                total = softness[n, j] * x[j] - wanted[n, j]
                value += (0.5 * softness[n, j] * x[j] - wanted[n, j]) * x[j]
                for i in range(muscles):
                    total += rows[n, j, i] * a[i]
                gradient[j] = total
                largest = max(largest, abs(total))
            solved[n] = largest < _ENOUGH * scale
            if largest < precision * scale:
                break
            for j in range(count):
                for k in range(j + 1):
                    total = 0.0
                    for i in range(muscles):
                        total += rows[n, j, i] * slope[i] * rows[n, k, i]
                    hessian[j, k] = total
                hessian[j, j] += softness[n, j]
            # Cholesky, in place, and both triangles solved: the softness keeps it definite.
            for j in range(count):
                for k in range(j + 1):
                    total = hessian[j, k]
                    for i in range(k):
                        total -= hessian[j, i] * hessian[k, i]
                    if j == k:
                        hessian[j, j] = np.sqrt(max(total, 1e-300))
                    else:
                        hessian[j, k] = total / hessian[k, k]
            for j in range(count):
                total = -gradient[j]
                for i in range(j):
                    total -= hessian[j, i] * step[i]
                step[j] = total / hessian[j, j]
            for back in range(count):
                j = count - 1 - back
                total = step[j]
                for i in range(j + 1, count):
                    total -= hessian[i, j] * step[i]
                step[j] = total / hessian[j, j]
            falls = 0.0
            for j in range(count):
                falls += gradient[j] * step[j]
            length = 1.0
            for _ in range(_HALVINGS):
                reached = 0.0
                for j in range(count):
                    trial[j] = x[j] + length * step[j]
                    reached += (0.5 * softness[n, j] * trial[j] - wanted[n, j]) * trial[j]
                for i in range(muscles):
                    total = favour[n, i]
                    for j in range(count):
                        total += rows[n, j, i] * trial[j]
                    free = _activation(total, weights[n, i], exponent)
                    free = min(max(free, low[i]), high[i])
                    reached += total * free - weights[n, i] * _power(free, exponent)
                if reached <= value + 1e-4 * length * falls + 1e-13 * (1.0 + abs(value)):
                    break
                length *= 0.5
            for j in range(count):
                x[j] += length * step[j]
