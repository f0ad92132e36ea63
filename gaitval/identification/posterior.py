"""The posterior with errors that are new in every joint and harmonic: `identification.method =
posterior`, the paper's section III-B restated.

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
from scipy.linalg import cho_factor, cho_solve

from gaitval.arrays import Array, Flags
from gaitval.artefacts import read_json, value_hash, write_json
from gaitval.configuration import Configuration, IdentificationSettings
from gaitval.gait.record import GaitRecord
from gaitval.identification.begin import begin, noise_of
from gaitval.identification.body_fit import BODY, NUISANCES, BodyFit, BodyPosterior
from gaitval.identification.combinations import correlation, judged_combinations, parameter_sum
from gaitval.identification.verdicts import Judged, judged, verdict_of
from gaitval.metrics.results import ExtendedResult, FoundParameters, Generation
from gaitval.metrics.typed import number
from gaitval.model.body import BodyModel
from gaitval.model.parameters import PARAMETERS, parameter_bounds
from gaitval.one_thread import one_thread
from gaitval.policy.processes import kept_workers, side_by_side
from gaitval.reference.dynamic_fit import (
    Solution,
    linear_terms,
    linearised,
    normal_equations,
    weighted_laws,
)

Evaluate = Callable[[Sequence[Array]], list[float]]
"""Values to be made small, of several points (n,)."""
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
    evaluated: list[list[float]] = []
    if state_file is not None and state_file.exists():
        state = read_json(state_file)
        if state.get("key") == key:
            evaluated = state["values"]
    history: list[Generation] = []
    so_far: list[list[float]] = []
    converged = False
    while not converged and len(history) < settings.generations:
        # Also in a replay: `ask` draws the random numbers that the next generations depend on.
        points = strategy.ask()
        generation = len(history)
        rounded = [np.round(point, _DIGITS) for point in points]
        values = evaluated[generation] if generation < len(evaluated) else evaluate(rounded)
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


def _search_near(
    fit: BodyFit,
    fixed_body: Solution,
    settings: IdentificationSettings,
    seed: int,
    state_file: Path,
    key: str,
    on_generation: Callable[[int, float], None] | None,
) -> Searched:
    """`search` for the mode of the posterior of `fit`, near its solution `fixed_body`."""
    profile = Profile(fit, fixed_body)
    return search(
        lambda points: profile([fit.mu_at(each) for each in points]),
        int(BodyFit.looked_for().sum()),
        settings=settings,
        seed=seed,
        state_file=state_file,
        key=key,
        on_generation=on_generation,
    )


_CHORDS: Final = 12
_CHORD_GAIN: Final = 0.02
"""Most chord steps, and the decrease of the sum of squares at which they end."""


class _Equations:
    """The linear equations of a fit at a solution, solved for any right side."""

    def __init__(self, fit: BodyFit, solution: Solution) -> None:
        at = fit.problem, solution.change, solution.common
        laws = linearised(*at, 1.0)
        # Transposed once, because every chord step multiplies by it.
        self.slope = np.ascontiguousarray(laws.slope.transpose(0, 2, 1))
        self.lever = laws.lever
        matrix, _ = normal_equations(*at, laws)
        self._factor = cho_factor(matrix, overwrite_a=True, check_finite=False)
        self.unknowns = len(matrix)

    def solved(self, right: Array) -> Array:
        """The unknowns (U, …) for the right sides `right` (U, …)."""
        return np.asarray(cho_solve(self._factor, right, check_finite=False))


class Profile:
    """The fit for any held numbers, with the motion and the laboratory's errors at their best:
    `held` are the elements of `Solution.common` that are held, mu if left out.

    Near a solution all of them answer almost linearly, so the equations of `fit` at its `solution`
    are used for every mu (chord steps), which takes hundredths of a second instead of seconds.
    """

    def __init__(
        self,
        fit: BodyFit,
        solution: Solution,
        fixed_body: Sequence[int] = range(BODY, NUISANCES),
        *,
        equations: _Equations | None = None,
    ) -> None:
        self._fit, self._problem, self._near = fit, fit.problem, solution
        self._equations = equations or _Equations(fit, solution)
        self._size = solution.change.size
        self._fixed = np.array(fixed_body)
        places = self._size + self._fixed
        unit = np.zeros((self._equations.unknowns, len(places)))
        unit[places, np.arange(len(places))] = 1.0
        columns = self._equations.solved(unit)
        # How all unknowns follow when a held one moves by 1 and the rest is at its best: with C the
        # inverse of the normal equations, C[:, held] C[held, held]⁻¹, the conditional mean of a
        # Gaussian.
        self._answer = np.linalg.solve(columns[places].T, columns.T).T

    def __call__(self, mus: Sequence[Array]) -> list[float]:
        """Sums of squares at several `mus` (14,): -2 times the log posterior, up to a constant."""
        mean, sd = self._fit.prior_mean, self._fit.prior_sd
        return [each.cost for each in self.at([(mu - mean) / sd for mu in mus])]

    @one_thread()
    def at(self, zs: Sequence[Array]) -> list[Solution]:
        """What is most likely with the held numbers at each of `zs`, in prior SDs from the mean;
        with the covariance of the solution.
        """
        fixed_body, size = self._fixed, self._size
        place = np.concatenate([self._near.change.ravel(), self._near.common])
        unknowns = np.repeat(place[:, None], len(zs), axis=1)
        step = self._answer @ (np.stack(zs, axis=1) - unknowns[size + fixed_body])
        best = [self._near._replace(cost=np.inf)] * len(zs)
        # Points whose sum of squares no longer decreases drop out; the others share each solution
        # of the equations.
        moving = np.arange(len(zs))
        for _ in range(_CHORDS):
            unknowns[:, moving] += step
            gradients, gained = [], []
            for each in moving:
                found, gradient = self._found(unknowns[:, each])
                gained.append(found.cost < best[each].cost - _CHORD_GAIN)
                gradients.append(gradient)
                if found.cost < best[each].cost:
                    best[each] = found
            moving = moving[gained]
            if not len(moving):
                break
            right = np.stack(gradients, axis=1)[:, gained]
            # A Newton step with the old matrix, then moved back along `_answer` so that the held
            # numbers stay exactly where they are.
            right[size + fixed_body] = 0.0
            step = -self._equations.solved(right)
            step -= self._answer @ step[size + fixed_body]
        return best

    def _found(self, unknowns: Array) -> tuple[Solution, Array]:
        """The solution with these unknowns (U,), and the gradient (U,) of half its sum of squares,
        with the slopes of the equations.
        """
        problem, near = self._problem, self._near
        change, common = unknowns[: self._size].reshape(near.change.shape), unknowns[self._size :]
        residual, _ = weighted_laws(problem, change, common, 1.0)
        linear = linear_terms(problem, change)
        prior = problem.prior * common
        cost = float(np.sum(residual**2) + np.sum(linear**2) + np.sum(prior**2))
        # Jacobianᵀ · residual, by the chain rule: first by coordinates and rates at each instant,
        # then by the harmonics whose values these are.
        by_input = np.matmul(self._equations.slope, residual[:, :, None])
        by_rate = by_input.reshape(len(residual), 3, -1)
        motion = np.einsum("krn,kr->kn", problem.penalty, linear, optimize=True)
        for order, series in enumerate(problem.series):
            motion += by_rate[:, order].T @ series
        of_common = np.einsum("toi,to->i", self._equations.lever, residual, optimize=True)
        gradient = np.concatenate([motion.ravel(), of_common + problem.prior * prior])
        return near._replace(change=change.copy(), common=common.copy(), cost=cost), gradient


PROFILE_STEPS: Final = (-2.0, -1.0, 1.0, 2.0)
"""Posterior SDs from the mode at which a parameter's profile is taken."""


def profiles(fit: BodyFit, mode: Solution) -> Array:
    """Profiles (14, 4) of the posterior: how much minus twice its logarithm grows if one parameter
    is held at `PROFILE_STEPS` posterior SDs from the `mode`, the solution of `fit`, and all else is
    at its best. They are 4, 1, 1, 4 if the posterior is Gaussian; 0 of what is not looked for.
    """
    equations = _Equations(fit, mode)
    found = np.zeros((len(PARAMETERS), len(PROFILE_STEPS)))
    for index in np.flatnonzero(fit.looked_for()):
        place = BODY + int(index)
        profile = Profile(fit, mode, [place], equations=equations)
        at, sd = mode.common[place], np.sqrt(mode.covariance[place, place])
        walked = profile.at([np.array([at + step * sd]) for step in PROFILE_STEPS])
        found[index] = np.array([each.cost for each in walked]) - mode.cost
    return found


def identify(
    record: GaitRecord,
    model: BodyModel,
    prior_sd: Array,
    configuration: Configuration,
    folder: Path,
    *,
    kinetics_known: bool = True,
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
    kinetics_known : whether the record's moments and forces are the person's own.
    on_progress : called after each generation with generation, total and value.
    """
    settings = configuration.identification
    noise = noise_of(configuration, kinetics_known)
    # The search moves mu near the solution with the body as scaled, which costs hundredths of a
    # second per candidate.
    fit, fixed_body = begin(record, model, prior_sd, configuration, kinetics_known)
    state_file = Path(folder) / _STATE
    key = value_hash(
        {
            "settings": settings.model_dump(mode="json"),
            "noise": noise.model_dump(mode="json"),
            "prior": list(map(float, prior_sd)),
            "deviance": fixed_body.cost,
        }
    )

    def progress(generation: int, best: float) -> None:
        if on_progress is not None:
            on_progress({"generation": generation, "total": settings.generations, "value": best})

    # In a worker, if some are kept: cma and a training that runs meanwhile both draw from NumPy's
    # common random numbers. Nothing is reported from there.
    search = partial(_search_near, fit, fixed_body, settings, configuration.seed, state_file, key)
    (searched,) = side_by_side(search, [progress if kept_workers() is None else None])
    best = fit.mu_at(searched.best)
    # From the scaled body and from what CMA-ES found: two starts, because contact makes local
    # minima.
    mode = fit.mode(fixed_body, fit.near(fixed_body, best))
    state_file.unlink(missing_ok=True)
    return found(fit, mode, searched, best, fixed_body.cost, model, configuration)


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
        combinations=[parameter_sum(each) for each in judged_combinations(posterior, model)],
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


def walked_with(posterior: BodyPosterior, verdicts: Sequence[Judged]) -> Array:
    """Mu (14,) to walk with: what is not identified, by the `verdicts` in the order of
    `PARAMETERS`, stays at its prior mean; the rest is where it is most likely then, by the
    `posterior` of all parameters together.
    """
    used = np.array([each.verdict != "not identified" for each in verdicts])
    return conditional_mean(posterior, used)


def conditional_mean(posterior: BodyPosterior, used: Flags) -> Array:
    """Mean (14,) of mu by the `posterior` of all parameters together if only those `used` (14,) are
    free, and all others are held at their prior mean.
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
