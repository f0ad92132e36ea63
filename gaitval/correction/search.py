"""The search of a correction: which change of the reference brings the walk nearest to it, and
whether the change that was found does harm.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np

from gaitval.arrays import Array
from gaitval.correction.slopes import Slopes
from gaitval.correction.walked import Walked


@dataclass(frozen=True)
class SearchSettings:
    """How far the search for a correction goes."""

    smallest_gain: float = 0.02
    """Relative decrease of the objective at which the steps end."""
    dampings: tuple[float, float, float, float] = (0.0, 3.0, 30.0, 300.0)
    """Damping of a step, in units of the prior's weight. All of them are tried: a walk does not
    respond linearly, so no rule gives the best one beforehand."""
    lengths: tuple[float, float] = (1.0, 0.5)
    """Fractions of each step that are tried: with the dampings eight walks, which take no longer
    than one."""
    pelvis: float = 0.25
    """Degrees by which the pelvis's angles may get worse, a sixth of the accuracy with which other
    angles are looked for. Corrections of people that are in no table of walks made them worse by at
    most 0.21, and what they looked at better by 7 to 72 % (docs/learning.md)."""


SEARCH: Final = SearchSettings()


WalkFunction = Callable[[Sequence[Array]], Sequence[Walked | None]]
"""Walks at each of several points, (n,) in units of the prior's SD; None for one that fell."""


@dataclass(frozen=True)
class Optimum:
    """The best point (n,), errors before and after each step, and the number of free unknowns."""

    point: Array
    errors: tuple[float, ...]
    effective_number: float


def search(
    walk: WalkFunction,
    slopes: Slopes,
    *,
    steps: int,
    allowed: Callable[[Array], bool],
    on_step: Callable[[int, float], None] | None = None,
) -> Optimum:
    """Minimise the deviations' sum of squares plus the prior's, from zero on in at most so many
    `steps`. `walk` walks at several points at once; `slopes` are what is known of them beforehand,
    to which all walks add; `allowed` says whether a point may be tried; `on_step` gets the number
    of the step and the error.
    """
    point = np.zeros(len(slopes.covariance))
    (found,) = walk([point])
    if found is None:
        return Optimum(point, (), 0.0)
    errors = [found.error()]
    for number in range(1, steps + 1):
        tried = [each for each in _steps(slopes.mean, found, point) if allowed(point + each)]
        walked = [
            (step, each)
            for step, each in zip(tried, walk([point + step for step in tried]), strict=True)
            if each is not None
        ]
        if not walked:
            break
        slopes = slopes.learned(
            np.array([step for step, _ in walked]),
            np.array([each.deviations - found.deviations for _, each in walked]),
        )
        least = _objective(found, point)
        # Of equal steps the first is taken.
        step, best = min(walked, key=lambda each: _objective(each[1], point + each[0]))
        reached = _objective(best, point + step)
        if reached < least:
            point, found = point + step, best
            errors.append(found.error())
        if on_step is not None:
            on_step(number, errors[-1])
        if reached > (1.0 - SEARCH.smallest_gain) * least:
            break
    return Optimum(point, tuple(errors), effective_number(slopes.mean))


def _objective(found: Walked, point: Array) -> float:
    return float(found.deviations @ found.deviations + point @ point)


def effective_number(slopes: Array) -> float:
    """Numbers that a linear answer leaves free under a prior of SD 1 of each, 0 to n: the trace of
    the matrix from the deviations to the fitted ones (Hastie, Tibshirani, Friedman 2009, 3.50).
    `slopes` (m, n) are derivatives of the deviations by the unknowns in prior SDs.
    """
    # Σ d² / (d² + 1) over the singular values d: a direction that the walk determines better than
    # the prior counts almost 1, one that it does not almost 0.
    squares = np.maximum(np.linalg.eigvalsh(slopes.T @ slopes), 0.0)
    return float(np.sum(squares / (squares + 1.0)))


def _steps(slopes: Array, found: Walked, point: Array) -> list[Array]:
    """Gauss-Newton steps with each of `SEARCH.dampings` and `SEARCH.lengths`, from the longest
    on.
    """
    # The prior's weight is 1: the point in the gradient, and the 1.0 on the diagonal.
    normal, right = slopes.T @ slopes, slopes.T @ found.deviations + point
    steps = [
        np.asarray(-np.linalg.solve(normal + (1.0 + damping) * np.eye(len(point)), right), float)
        for damping in SEARCH.dampings
    ]
    return [length * step for step in steps for length in SEARCH.lengths]


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
    worse = max(
        after.left_out() - before.left_out(), after_other.left_out() - before_other.left_out()
    )
    if worse > SEARCH.pelvis:
        return (
            f"the pelvis's angles, which are not fitted, get {worse:.2f} degrees worse; at most "
            f"{SEARCH.pelvis} are allowed"
        )
    return None
