"""Identification of the body parameters mu from a record (the paper's section III-B, restated).

CMA-ES (Hansen 2016) with the paper's population of 8 looks for the mode of the posterior
(`body_fit`) until its distribution is narrower than a fraction of the prior, and Gauss-Newton steps
of the whole fit find the last digits and the covariance. Parameters that the record does not
determine stay at their prior mean (`verdicts`); the others take the values that are most likely
with those held there.
"""

import warnings
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Final

import numpy as np

from gaitval.arrays import Array, Flags
from gaitval.artefacts import read_json, value_hash, write_json
from gaitval.configuration import Configuration, IdentificationSettings, NoiseSettings
from gaitval.gait.record import GaitRecord
from gaitval.identification.body_fit import BodyFit, BodyPosterior, Profile, profiles
from gaitval.identification.verdicts import (
    Judged,
    correlation,
    judged,
    judged_combinations,
    verdict_of,
)
from gaitval.metrics.results import ExtendedResult, FoundParameters, Generation, ParameterSum
from gaitval.metrics.typed import number
from gaitval.model.body import BodyModel
from gaitval.model.parameters import PARAMETERS, parameter_bounds
from gaitval.policy.processes import kept_workers, side_by_side
from gaitval.reference.dynamic_fit import Solution

Evaluate = Callable[[Sequence[Array]], list[float]]
"""Values to be made small, of several points (n,)."""
Begun = tuple[BodyFit, Solution]
"""The fit to a record, and its solution with the body as scaled."""

_STATE: Final = "identification_state.json"


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
    state_file: Path | None = None,
    key: str = "",
    on_generation: Callable[[int, float], None] | None = None,
) -> Searched:
    """CMA-ES (Hansen 2016) for the minimum of `evaluate`, in units of the prior's SD, from zero.

    It has converged when its distribution is narrower than `settings.tolerance` in every direction
    of the parameters. Every generation's values are kept in `state_file`; an interrupted search
    replays them into a new CMA-ES with the same seed and continues, with the same result as if it
    had not been interrupted.

    Parameters
    ----------
    evaluate : values of several points (n,) at once.
    size : n.
    settings : population, initial step, tolerance and the largest number of generations.
    seed : of the random numbers.
    state_file : keeps the values; None keeps none.
    key : identifies the search; a state file with another key is ignored.
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
    told: list[list[float]] = []
    if state_file is not None and state_file.exists():
        state = read_json(state_file)
        if state.get("key") == key:
            told = state["values"]
    history: list[Generation] = []
    so_far: list[list[float]] = []
    converged = False
    while not converged and len(history) < settings.generations:
        # Also in a replay: `ask` draws the random numbers that the next generations depend on.
        points = strategy.ask()
        generation = len(history)
        rounded = [np.round(point, _DIGITS) for point in points]
        values = told[generation] if generation < len(told) else evaluate(rounded)
        strategy.tell(points, values)
        so_far.append([float(each) for each in values])
        if state_file is not None:
            write_json(state_file, {"key": key, "values": so_far})
        best, sigma = float(min(values)), float(np.round(strategy.sigma, _DIGITS))
        history.append(Generation(generation=generation + 1, best=number(best), sigma=sigma))
        if on_generation is not None:
            on_generation(generation + 1, best)
        converged = bool(strategy.result.stds.max() < settings.tolerance)
    # The mean of the final distribution, which is least affected by single candidates.
    found = np.round(strategy.result.xfavorite, _DIGITS)
    return Searched(found, converged, tuple(history))


def _noise(configuration: Configuration, kinetics_told: bool) -> NoiseSettings:
    if kinetics_told:
        return configuration.noise
    from gaitval.prediction.population import noise_of_expected

    return noise_of_expected(configuration.noise)


def begin(
    record: GaitRecord,
    model: BodyModel,
    prior_sd: Array,
    configuration: Configuration,
    kinetics_told: bool,
) -> Begun:
    """The fit to a record, solved in full with the body as scaled; arguments as in `identify`."""
    fit = BodyFit(
        record, model, configuration.contact, _noise(configuration, kinetics_told),
        prior_sd=prior_sd, extended=configuration.identification.parameters == "extended",
    )  # fmt: skip
    return fit, fit.solve(fixed=fit.prior_mean)


def _search_near(
    fit: BodyFit,
    held: Solution,
    settings: IdentificationSettings,
    seed: int,
    state_file: Path,
    key: str,
    on_generation: Callable[[int, float], None] | None,
) -> Searched:
    """`search` for the mode of the posterior of `fit`, near its solution `held`."""
    profile = Profile(fit, held)
    return search(
        lambda points: profile([fit.mu_at(each) for each in points]),
        int(BodyFit.looked_for().sum()),
        settings=settings,
        seed=seed,
        state_file=state_file,
        key=key,
        on_generation=on_generation,
    )


def identify(
    record: GaitRecord,
    model: BodyModel,
    prior_sd: Array,
    configuration: Configuration,
    folder: Path,
    *,
    kinetics_told: bool = True,
    begun: Callable[[], Begun] | None = None,
    on_progress: Callable[[dict[str, float]], None] | None = None,
) -> FoundParameters:
    """Find what a record says about the body. An interrupted identification resumes.

    Parameters
    ----------
    record : with moments and forces.
    model : the body as scaled.
    prior_sd : (14,) of mu about the body as scaled, see `prior.prior_sd`.
    configuration : settings of identification, noise, contact and bounds; the seed.
    folder : receives the state of the search while it runs.
    kinetics_told : whether the record's moments and forces are the person's own.
    begun : gives what `begin` found of these, if that was started before.
    on_progress : called after each generation with generation, total and value.
    """
    settings = configuration.identification
    noise = _noise(configuration, kinetics_told)
    # The search moves mu near the solution with the body as scaled, which costs hundredths of a
    # second per candidate.
    fit, held = begun() if begun else begin(record, model, prior_sd, configuration, kinetics_told)
    state_file = Path(folder) / _STATE
    key = value_hash(
        {
            "settings": settings.model_dump(mode="json"),
            "noise": noise.model_dump(mode="json"),
            "prior": list(map(float, prior_sd)),
            "deviance": held.cost,
        }
    )

    def progress(generation: int, best: float) -> None:
        if on_progress is not None:
            on_progress({"generation": generation, "total": settings.generations, "value": best})

    # In a worker, if some are kept: cma and a training that runs meanwhile both draw from NumPy's
    # common random numbers. Nothing is reported from there.
    near = partial(_search_near, fit, held, settings, configuration.seed, state_file, key)
    (searched,) = side_by_side(near, [progress if kept_workers() is None else None])
    best = fit.mu_at(searched.best)
    # From the scaled body and from what CMA-ES found: two starts, because contact makes local
    # minima.
    mode = fit.mode(held, fit.near(held, best))
    state_file.unlink(missing_ok=True)
    return found(fit, mode, searched, best, held.cost, model, configuration)


def found(
    fit: BodyFit,
    mode: Solution,
    searched: Searched,
    best: Array,
    deviance: float,
    model: BodyModel,
    configuration: Configuration,
) -> FoundParameters:
    """The verdicts on a posterior, and the body to walk with.

    Parameters
    ----------
    fit : of the record.
    mode : its most likely solution.
    searched : what CMA-ES found.
    best : (14,) the same as parameters.
    deviance : minus twice the log posterior at the prior's mean, up to a constant.
    model : the body as scaled.
    configuration : its bounds of the parameters are used.
    """
    posterior = fit.posterior(mode)
    lower, upper = parameter_bounds(configuration.randomisation)
    verdicts = judged(posterior, (lower, upper))
    kept = walked_with(posterior, verdicts)
    return FoundParameters(
        names=list(PARAMETERS),
        nominal=posterior.prior_mean.tolist(),
        identified=np.clip(kept, lower, upper).tolist(),
        prior_standard_deviation=posterior.prior_sd.tolist(),
        posterior_mean=posterior.mean.tolist(),
        standard_deviation=posterior.sd.tolist(),
        lower=lower.tolist(),
        upper=upper.tolist(),
        on_bound=[each.verdict == "at its bound" for each in verdicts],
        verdicts=[each.verdict for each in verdicts],
        profiles=np.asarray(profiles(fit, mode)).tolist(),
        correlation=correlation(posterior).tolist(),
        combinations=[_combination(each) for each in judged_combinations(posterior, model)],
        extended=_extended(fit, posterior),
        plates=posterior.plates.tolist(),
        deviance_nominal=number(deviance),
        deviance_identified=number(-2.0 * posterior.log_posterior),
        converged=searched.converged,
        search_distance=number(np.max(np.abs(best - posterior.mean) / posterior.sd)),
        history=list(searched.history),
    )


def _extended(fit: BodyFit, posterior: BodyPosterior) -> list[ExtendedResult]:
    found = zip(fit.extended, posterior.extended_mean, posterior.extended_sd, strict=True)
    return [
        ExtendedResult(
            name=each.name,
            unit=each.unit,
            prior_standard_deviation=each.prior_sd,
            mean=float(mean),
            standard_deviation=float(sd),
            verdict=verdict_of(float(sd) / each.prior_sd),
        )
        for each, mean, sd in found
    ]


def _combination(each: Judged) -> ParameterSum:
    return ParameterSum(
        name=each.name,
        prior_standard_deviation=each.prior_sd,
        mean=each.mean,
        standard_deviation=each.sd,
        verdict=each.verdict,
    )


def walked_with(posterior: BodyPosterior, verdicts: Sequence[Judged]) -> Array:
    """Parameters to walk with: what is not identified stays at its prior mean, the rest is where it
    is most likely then.

    Parameters
    ----------
    posterior : of all parameters together.
    verdicts : on each, in the order of `PARAMETERS`.

    Returns
    -------
    (14,) mu.
    """
    used = np.array([each.verdict != "not identified" for each in verdicts])
    return conditional_mean(posterior, used)


def conditional_mean(posterior: BodyPosterior, used: Flags) -> Array:
    """Posterior mean if some parameters are at their prior mean.

    Parameters
    ----------
    posterior : of all parameters together.
    used : (14,) which parameters are free; all others are held.

    Returns
    -------
    (14,) mu.
    """
    precision = np.linalg.inv(posterior.covariance)
    rest = ~used
    mean = posterior.prior_mean.copy()
    away = posterior.prior_mean[rest] - posterior.mean[rest]
    if used.any():
        # Conditional mean of a Gaussian with precision P: m_u - P_uu⁻¹ P_ur (x_r - m_r).
        inner = precision[np.ix_(used, used)]
        shift = np.linalg.solve(inner, precision[np.ix_(used, rest)] @ away)
        mean[used] = posterior.mean[used] - shift
    return mean
