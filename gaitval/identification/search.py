"""The search of `identification.method = rollouts`: CMA-ES (Hansen 2016), population 8 as in the
paper.
"""

import warnings
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np

from gaitval.arrays import Array
from gaitval.configuration import IdentificationSettings
from gaitval.metrics.results import Generation
from gaitval.metrics.typed import number

Evaluate = Callable[[Sequence[Array]], list[float]]
"""Values to be made small, of several points (n,)."""


@dataclass(frozen=True)
class Searched:
    """What CMA-ES found: the best point (n,), whether the search converged by itself, and the
    history of its generations.
    """

    best: Array
    converged: bool
    history: tuple[Generation, ...]


_DIGITS: Final = 6
"""Decimal places of a candidate of the search, in prior SDs. cma adds with Python's `sum`, which
rounds differently from version 3.12 on. Without this rounding two versions of Python would find
different results, and a parameter at the edge of being identified might be so in one of them only.
"""


def search(
    evaluate: Evaluate,
    size: int,
    *,
    settings: IdentificationSettings,
    seed: int,
    on_generation: Callable[[int, float], None] | None = None,
) -> Searched:
    """CMA-ES (Hansen 2016) for the minimum of `evaluate`, in units of the prior's SD, from zero.

    It has converged when its distribution is narrower than `settings.tolerance` in every direction
    of the parameters.

    Parameters
    ----------
    evaluate : values of several points (n,) at once.
    size : n.
    settings : population, initial step, tolerance and the largest number of generations.
    seed : of the random numbers.
    on_generation : called with the number of the generation, from 1, and its best value.
    """
    import cma  # here: it loads pyplot, which the one process that searches has to hold

    options = {
        "popsize": settings.population,
        "seed": seed + 1,  # cma takes 0 for "from the clock"
        "verbose": -9,
        "maxiter": settings.generations,
        # cma's own criteria to end are switched off: `settings.tolerance` decides, below.
        "tolfun": 0.0,
        "tolfunhist": 0.0,
        "tolx": 0.0,
    }
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # cma warns about options it does not use
        strategy = cma.CMAEvolutionStrategy(np.zeros(size), settings.initial_sigma, options)
    history: list[Generation] = []
    converged = False
    while not converged and len(history) < settings.generations:
        points = strategy.ask()
        values = evaluate([np.round(point, _DIGITS) for point in points])
        strategy.tell(points, values)
        best, sigma = float(min(values)), float(np.round(strategy.sigma, _DIGITS))
        generation = len(history) + 1
        history.append(Generation(generation=generation, best=number(best), sigma=sigma))
        if on_generation is not None:
            on_generation(generation, best)
        converged = bool(strategy.result.stds.max() < settings.tolerance)
    # The mean of the final distribution, which is least affected by single candidates.
    found = np.round(strategy.result.xfavorite, _DIGITS)
    return Searched(found, converged, tuple(history))
