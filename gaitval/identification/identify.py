"""Identification of the body parameters mu from a record (the paper's section III-B, restated).

CMA-ES (Hansen 2016) with the paper's population of 8 looks for the mode of the posterior
(`body_fit`) until its distribution is narrower than a fraction of the prior, and Gauss-Newton steps
of the whole fit find the last digits and the covariance. What the record does not determine stays
at its prior mean (`verdicts`); what it does is where it is most likely with the rest there.
"""

import warnings
from collections.abc import Callable, Sequence
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any, Final

import cma
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
from gaitval.model.body import BodyModel
from gaitval.model.extended import EXTENDED
from gaitval.model.parameters import PARAMETERS, nominal_parameters, parameter_bounds
from gaitval.reference.dynamic_fit import Solution

Evaluate = Callable[[Sequence[Array]], list[float]]
"""Values to be made small, of several points (n,)."""

_STATE: Final = "identification_state.json"


@dataclass(frozen=True)
class Identification:
    """Result of one identification; arrays (14,) in the order of `PARAMETERS`.

    Attributes
    ----------
    nominal : the prior's mean, the body as scaled.
    identified : μ*: posterior mean of what is at least weakly identified, within the bounds; the
        prior's of everything else.
    standard_deviation : of the posterior with all parameters free; `prior_standard_deviation`.
    posterior_mean : of the same posterior.
    on_bound : whether the posterior's mean is outside the bounds.
    verdicts : see `verdicts.Verdict`.
    profiles : (14, 4), see `body_fit.profiles`; empty if nothing was looked for.
    correlation : (14, 14) of the posterior.
    combinations : name, prior SD, mean, SD and verdict of sums of parameters, such as the leg.
    extended : name, unit, prior SD, mean, SD and verdict of `model.extended`, if looked for.
    plates : m, by how much the centre of pressure of the right and left plate is further forward
        than the record has it.
    deviance_nominal, deviance_identified : minus twice the log posterior, up to the same constant.
    converged : whether CMA-ES ended by itself; `search_distance`: between its result and the mode,
        in posterior SDs, the largest of all parameters.
    history : generation, best value, sigma of every generation.
    """

    names: tuple[str, ...]
    nominal: tuple[float, ...]
    identified: tuple[float, ...]
    prior_standard_deviation: tuple[float, ...]
    posterior_mean: tuple[float, ...]
    standard_deviation: tuple[float, ...]
    lower: tuple[float, ...]
    upper: tuple[float, ...]
    on_bound: tuple[bool, ...]
    verdicts: tuple[str, ...]
    profiles: tuple[tuple[float, ...], ...]
    correlation: tuple[tuple[float, ...], ...]
    combinations: tuple[dict[str, Any], ...]
    extended: tuple[dict[str, Any], ...]
    plates: tuple[float, ...]
    deviance_nominal: float | None
    deviance_identified: float | None
    converged: bool
    search_distance: float | None
    history: tuple[dict[str, float], ...]

    def as_dict(self) -> dict[str, Any]:
        """For `identification.json`."""
        return asdict(self)


@dataclass(frozen=True)
class Searched:
    """What CMA-ES found: best point (n,), whether it ended by itself, and its generations."""

    best: Array
    converged: bool
    history: tuple[dict[str, float], ...]


_DIGITS: Final = 6
"""Digits of a candidate of the search, in the prior's SD. cma adds with Python's `sum`, which
rounds otherwise from version 3.12 on: without this, what two Pythons find would differ, and a
parameter at the edge of being identified be so in one of them only."""


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
    """CMA-ES for the minimum of `evaluate`, in units of the prior's SD, from zero.

    It has converged when its distribution is narrower than `settings.tolerance` in every direction
    of the parameters. Every generation's values are kept in `state_file`; an interrupted search
    replays them into a new CMA-ES with the same seed and continues, with the same result as if it
    had not been interrupted.

    Parameters
    ----------
    key : identifies the search; a state file with another key is ignored.
    """
    options = {
        "popsize": settings.population,
        "seed": seed + 1,  # cma takes 0 for "from the clock"
        "verbose": -9,
        "maxiter": settings.generations,
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
    history: list[dict[str, float]] = []
    so_far: list[list[float]] = []
    converged = False
    while not converged and len(history) < settings.generations:
        points = strategy.ask()
        generation = len(history)
        rounded = [np.round(point, _DIGITS) for point in points]
        values = told[generation] if generation < len(told) else evaluate(rounded)
        strategy.tell(points, values)
        so_far.append([float(each) for each in values])
        if state_file is not None:
            write_json(state_file, {"key": key, "values": so_far})
        best, sigma = float(min(values)), float(np.round(strategy.sigma, _DIGITS))
        history.append({"generation": generation + 1, "best": best, "sigma": sigma})
        if on_generation is not None:
            on_generation(generation + 1, best)
        converged = bool(strategy.result.stds.max() < settings.tolerance)
    # The mean of the final distribution, which is least affected by single candidates.
    found = np.round(strategy.result.xfavorite, _DIGITS)
    return Searched(found, converged, tuple(history))


def noise_of_expected(noise: NoiseSettings) -> NoiseSettings:
    """The noise of moments and forces that are not this person's, but what people of their speed
    have: half as large again as such a prediction misses by, because it is wrong in its own way at
    every percent of the cycle.
    """
    return noise.model_copy(
        update={
            "moment": 0.15,
            "adduction_moment": 0.2,
            "vertical_force": 0.08,
            "forward_force": 0.02,
            "medial_force": 0.02,
            "independent": 2.0,
        }
    )


def unidentified(configuration: Configuration, prior_sd: Array) -> Identification:
    """Nothing is looked for: the body stays as scaled."""
    mu = nominal_parameters()
    lower, upper = parameter_bounds(configuration.randomisation)
    numbers = tuple(map(float, mu))
    sd = tuple(map(float, prior_sd))
    return Identification(
        names=PARAMETERS,
        nominal=numbers,
        identified=numbers,
        prior_standard_deviation=sd,
        posterior_mean=numbers,
        standard_deviation=sd,
        lower=tuple(map(float, lower)),
        upper=tuple(map(float, upper)),
        on_bound=(False,) * len(mu),
        verdicts=("not identified",) * len(mu),
        profiles=(),
        correlation=tuple(tuple(map(float, row)) for row in np.eye(len(mu))),
        combinations=(),
        extended=(),
        plates=(0.0, 0.0),
        deviance_nominal=None,
        deviance_identified=None,
        converged=False,
        search_distance=None,
        history=(),
    )


def identify(
    record: GaitRecord,
    model: BodyModel,
    prior_sd: Array,
    configuration: Configuration,
    folder: Path,
    *,
    kinetics_told: bool = True,
    on_progress: Callable[[dict[str, float]], None] | None = None,
) -> Identification:
    """Find what a record says about the body. An interrupted identification resumes.

    Parameters
    ----------
    prior_sd : (14,) of mu about the body as scaled, see `prior.prior_sd`.
    folder : receives the state of the search while it runs.
    kinetics_told : whether the record's moments and forces are the person's own.
    on_progress : called after each generation with generation, total and value.
    """
    settings = configuration.identification
    if settings.method == "none":
        return unidentified(configuration, prior_sd)
    noise = configuration.noise if kinetics_told else noise_of_expected(configuration.noise)
    fit = BodyFit(
        record, model, configuration.contact, noise, prior_sd=prior_sd,
        extended=settings.parameters == "extended",
    )  # fmt: skip
    nominal = fit.prior_mean
    held = fit.solve(fixed=nominal)
    profile = Profile(fit, held)
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

    searched = search(
        lambda points: profile([fit.mu_at(each) for each in points]),
        int(BodyFit.looked_for().sum()),
        settings=settings,
        seed=configuration.seed,
        state_file=state_file,
        key=key,
        on_generation=progress,
    )
    best = fit.mu_at(searched.best)
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
) -> Identification:
    """The verdicts on a posterior, and the body to walk with.

    Parameters
    ----------
    best : (14,) what CMA-ES found.
    deviance : at the prior's mean.
    """
    posterior = fit.posterior(mode)
    lower, upper = parameter_bounds(configuration.randomisation)
    verdicts = judged(posterior, (lower, upper))
    kept = walked_with(posterior, verdicts)
    return Identification(
        names=PARAMETERS,
        nominal=tuple(map(float, posterior.prior_mean)),
        identified=tuple(map(float, np.clip(kept, lower, upper))),
        prior_standard_deviation=tuple(map(float, posterior.prior_sd)),
        posterior_mean=tuple(map(float, posterior.mean)),
        standard_deviation=tuple(map(float, posterior.sd)),
        lower=tuple(map(float, lower)),
        upper=tuple(map(float, upper)),
        on_bound=tuple(each.verdict == "at its bound" for each in verdicts),
        verdicts=tuple(each.verdict for each in verdicts),
        profiles=tuple(tuple(map(float, row)) for row in profiles(fit, mode)),
        correlation=tuple(tuple(map(float, row)) for row in correlation(posterior)),
        combinations=tuple(_combination(each) for each in judged_combinations(posterior, model)),
        extended=tuple(_extended(posterior)),
        plates=tuple(map(float, posterior.plates)),
        deviance_nominal=deviance,
        deviance_identified=-2.0 * posterior.log_posterior,
        converged=searched.converged,
        search_distance=float(np.max(np.abs(best - posterior.mean) / posterior.sd)),
        history=searched.history,
    )


def _extended(posterior: BodyPosterior) -> list[dict[str, Any]]:
    found = zip(EXTENDED, posterior.extended_mean, posterior.extended_sd, strict=False)
    return [
        {
            "name": each.name,
            "unit": each.unit,
            "prior_standard_deviation": each.prior_sd,
            "mean": float(mean),
            "standard_deviation": float(sd),
            "verdict": verdict_of(float(sd) / each.prior_sd),
        }
        for each, mean, sd in found  # none if not looked for
    ]


def _combination(each: Judged) -> dict[str, Any]:
    return {
        "name": each.name,
        "prior_standard_deviation": each.prior_sd,
        "mean": each.mean,
        "standard_deviation": each.sd,
        "verdict": each.verdict,
    }


def walked_with(posterior: BodyPosterior, verdicts: Sequence[Judged]) -> Array:
    """Parameters (14,) to walk with: what is not identified stays at its prior mean, the rest is
    where it is most likely then.
    """
    used = np.array([each.verdict != "not identified" for each in verdicts])
    return conditional_mean(posterior, used)


def conditional_mean(posterior: BodyPosterior, used: Flags) -> Array:
    """Posterior mean (14,) if all but the parameters in `used` (14,) are at their prior mean."""
    precision = np.linalg.inv(posterior.covariance)
    rest = ~used
    mean = posterior.prior_mean.copy()
    away = posterior.prior_mean[rest] - posterior.mean[rest]
    if used.any():
        inner = precision[np.ix_(used, used)]
        shift = np.linalg.solve(inner, precision[np.ix_(used, rest)] @ away)
        mean[used] = posterior.mean[used] - shift
    return mean
