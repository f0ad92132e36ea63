"""The search of a correction: which change of the reference brings the walk nearest to it, and
whether the change that was found does harm.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from gaitval.arrays import Array
from gaitval.learning_control.walked import Walked

_PROBE = 0.75
"""Change of an unknown by which its effect is measured, in prior SDs: the effect is then several
times the scatter of mean curves between walks."""
_STEPS = 6
"""Largest number of steps with the same slopes, which cost ten times as many walks as a step."""
_SMALLEST_GAIN = 0.02
"""Relative decrease of the objective at which the steps end."""
_DAMPINGS = (0.0, 1.0, 10.0, 100.0, 1000.0)
"""Damping of a step, in units of the prior's weight. All of them are tried: a walk does not respond
linearly, so no rule gives the best one beforehand."""
_LENGTHS = (1.0, 0.5, 0.25)
"""Fractions of each step that are tried."""

Walk = Callable[[Sequence[Array]], Sequence[Walked | None]]
"""Walks at each of several points, (n,) in units of the prior's SD; None for one that fell."""


@dataclass(frozen=True)
class Optimum:
    """What a search found: the best point (n,), the error before and after each step, and the
    effective number of free unknowns (`effective_number`).
    """

    point: Array
    errors: tuple[float, ...]
    effective_number: float


def search(
    walk: Walk,
    unknowns: int,
    *,
    rounds: int,
    allowed: Callable[[Array], bool],
    on_round: Callable[[int, float], None] | None = None,
) -> Optimum:
    """Minimise the deviations' sum of squares plus the prior's, starting from zero.

    Parameters
    ----------
    walk : walks at several points at once.
    unknowns : n.
    rounds : how often the slopes are measured.
    allowed : whether a point may be tried.
    on_round : called with the finished round and the error.
    """
    point = np.zeros(unknowns)

    def probing() -> list[Array]:
        return [point + _PROBE * each for each in np.eye(unknowns)]

    # In one call, so that all of these walks share the workers.
    found, *probes = walk([point, *(probing() if rounds else [])])
    if found is None:
        return Optimum(point, (), 0.0)
    errors, free = [found.error()], 0.0
    for number in range(rounds):
        if number > 0:
            probes = list(walk(probing()))
        # A walk that falls gives no slope. With a slope of zero the unknown is left where it is.
        answers = [
            0.0 * found.deviations
            if each is None
            else (each.deviations - found.deviations) / _PROBE
            for each in probes
        ]
        # (m, n): a column for each unknown, in prior SDs.
        slopes = np.column_stack(answers)
        free = effective_number(slopes)
        for _ in range(_STEPS):
            steps = [each for each in _steps(slopes, found, point) if allowed(point + each)]
            walked = [
                (_objective(each, point + step), index, step, each)
                for index, (step, each) in enumerate(
                    zip(steps, walk([point + step for step in steps]), strict=True)
                )
                if each is not None
            ]
            least = _objective(found, point)
            # By objective, then by index: of equal steps the first is taken, and arrays are never
            # compared.
            best = min(walked, default=None, key=lambda each: each[:2])
            if best is None or best[0] >= least:
                break
            _, _, step, after = best
            change = after.deviations - found.deviations
            # Broyden's update: the smallest change of the slopes with which they would have
            # predicted what this step did. It saves measuring them again, n walks.
            slopes = slopes + np.outer(change - slopes @ step, step) / float(step @ step)
            point, found = point + step, after
            errors.append(found.error())
            if best[0] > (1.0 - _SMALLEST_GAIN) * least:
                break
        if on_round is not None:
            on_round(number + 1, errors[-1])
    return Optimum(point, tuple(errors), free)


def _objective(found: Walked, point: Array) -> float:
    return float(found.deviations @ found.deviations + point @ point)


def effective_number(slopes: Array) -> float:
    """Numbers that a linear answer leaves free under a prior of SD 1 of each, 0 to n: the trace of
    the matrix from the deviations to the fitted ones (Hastie, Tibshirani, Friedman 2009, 3.50).
    `slopes` (m, n) are derivatives of the deviations by the unknowns in prior SDs.
    """
    # Σ d² / (d² + 1) over the singular values d: a direction that the walk determines better than
    # the prior counts almost 1, one that it does not almost 0.
    squares = np.linalg.svd(slopes, compute_uv=False) ** 2
    return float(np.sum(squares / (squares + 1.0)))


def _steps(slopes: Array, found: Walked, point: Array) -> list[Array]:
    """Gauss-Newton steps with each of `_DAMPINGS` and `_LENGTHS`, from the longest on."""
    # Gradient of half the objective: slopesᵀ deviations + point, the second from the prior, whose
    # weight of 1 is also the 1.0 on the diagonal.
    normal, right = slopes.T @ slopes, slopes.T @ found.deviations + point
    steps = [
        np.asarray(-np.linalg.solve(normal + (1.0 + damping) * np.eye(len(point)), right), float)
        for damping in _DAMPINGS
    ]
    return [length * step for step in steps for length in _LENGTHS]


def harm(
    before: Walked | None,
    after: Walked | None,
    before_other: Walked | None,
    after_other: Walked | None,
) -> str | None:
    """Why a correction is not to be used; None if it may be. `before` and `after` are walks without
    and with it from the phase that the search used, None if one fell; `before_other` and
    `after_other` are the same from another start phase.
    """
    if before is None or after is None or before_other is None or after_other is None:
        return "a walk from another start phase fell"
    if after_other.error() >= before_other.error():
        return "a walk from another start phase gets no better"
    # A difference smaller than between the cycles of one walk is no harm.
    scatter = max(before.scatter, before_other.scatter)
    worse = max(
        after.left_out() - before.left_out(), after_other.left_out() - before_other.left_out()
    )
    if worse > scatter:
        return (
            f"the pelvis's angles, which are not fitted, get {worse:.2f} degrees worse; cycles "
            f"differ by {scatter:.2f}"
        )
    return None
