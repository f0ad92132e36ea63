"""Identification of the body parameters mu with CMA-ES (Hansen 2016; the paper's section III-B).

The deterministic policy walks from fixed start phases with the same initial states for every
candidate (common random numbers), so that candidates differ only in mu. The objective is the mean
reward of a planned step, minus a prior that pulls each parameter towards its nominal value; its
width is the anthropometric spread given by the bounds.
"""

import warnings
from collections.abc import Callable
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

import cma
import numpy as np

from gaitval.arrays import Array
from gaitval.artefacts import read_json, value_hash, write_json
from gaitval.configuration import IdentificationSettings
from gaitval.model.parameters import PARAMETERS, nominal_parameters, parameter_bounds
from gaitval.policy.environment import WalkingEnvironment
from gaitval.policy.rollouts import RolloutPool, Score, score_rollout
from gaitval.policy.storage import Policy
from gaitval.simulation.walker import WalkingTask

Evaluate = Callable[[list[Array]], list[float]]

_STATE = "identification_state.json"


@dataclass(frozen=True)
class Identification:
    """Result of one identification; arrays (14,) in the order of `PARAMETERS`.

    Attributes
    ----------
    identified : μ*.
    standard_deviation : spread of the final search distribution, in the parameters' units.
    on_bound : whether a parameter ended within 1 % of its range from a bound.
    reward_nominal, reward_identified : mean reward of a step, without the prior.
    history : generation, best objective, sigma of every generation.
    """

    names: tuple[str, ...]
    nominal: tuple[float, ...]
    identified: tuple[float, ...]
    standard_deviation: tuple[float, ...]
    lower: tuple[float, ...]
    upper: tuple[float, ...]
    on_bound: tuple[bool, ...]
    reward_nominal: float
    reward_identified: float
    history: tuple[dict[str, float], ...]

    def as_dict(self) -> dict[str, Any]:
        """For `identification.json`."""
        return asdict(self)


@dataclass(frozen=True)
class _Candidate:
    policy: Policy
    mu: Array
    start_phase: float
    seconds: float


def _score(environment: WalkingEnvironment, item: _Candidate) -> Score:
    return score_rollout(
        environment,
        item.policy,
        mu=item.mu,
        start_phase=item.start_phase,
        seconds=item.seconds,
    )


def mean_rewards(
    pool: RolloutPool, policy: Policy, settings: IdentificationSettings, candidates: list[Array]
) -> list[float]:
    """Mean reward of a step over the start phases, for each candidate mu (14,)."""
    walks = [
        _Candidate(policy, mu, phase, settings.seconds)
        for mu in candidates
        for phase in settings.start_phases
    ]
    scores = pool.map(_score, walks)
    rewards = np.array([score.reward for score in scores])
    return [float(r) for r in rewards.reshape(len(candidates), -1).mean(axis=1)]


def search(
    evaluate: Evaluate,
    *,
    start: Array,
    nominal: Array,
    lower: Array,
    upper: Array,
    settings: IdentificationSettings,
    seed: int,
    state_file: Path | None = None,
    key: str = "",
    on_generation: Callable[[int, float], None] | None = None,
) -> tuple[Array, Array, list[dict[str, float]]]:
    """CMA-ES for the maximum of `evaluate` minus the prior, within bounds.

    The search runs in units of half the range of each parameter. Every generation's candidates and
    values are kept in `state_file`; an interrupted search replays them into a new CMA-ES with the
    same seed and continues, with the same result as if it had not been interrupted.

    Parameters
    ----------
    evaluate : rewards of a list of candidates (14,).
    start, nominal, lower, upper : (n,).
    key : identifies the search; a state file with another key is ignored.

    Returns
    -------
    best (n,), standard deviation of the final distribution (n,), history.
    """
    half = np.maximum(0.5 * (upper - lower), 1e-12)
    middle = 0.5 * (upper + lower)
    prior_centre = (nominal - middle) / half
    options = {
        "popsize": settings.population,
        "bounds": [-1.0, 1.0],
        "seed": seed + 1,  # cma takes 0 for "from the clock"
        "verbose": -9,
        "maxiter": settings.generations,
        "tolfun": 0.0,
        "tolfunhist": 0.0,
        "tolx": 0.0,
    }
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # cma warns about options it does not use
        strategy = cma.CMAEvolutionStrategy(
            np.clip((start - middle) / half, -1.0, 1.0), settings.initial_sigma, options
        )
    told: list[list[float]] = []
    if state_file is not None and state_file.exists():
        state = read_json(state_file)
        if state.get("key") == key:
            told = state["values"]
    history: list[dict[str, float]] = []
    values_so_far: list[list[float]] = []
    for generation in range(settings.generations):
        unit = strategy.ask()
        if generation < len(told):
            values = told[generation]
        else:
            prior = [settings.prior * float(np.sum((u - prior_centre) ** 2)) for u in unit]
            rewards = evaluate([middle + half * u for u in unit])
            values = [p - r for p, r in zip(prior, rewards, strict=True)]
        strategy.tell(unit, values)
        values_so_far.append([float(v) for v in values])
        if state_file is not None:
            write_json(state_file, {"key": key, "values": values_so_far})
        history.append(
            {
                "generation": generation + 1,
                "best": -float(min(values)),
                "sigma": float(strategy.sigma),
            }
        )
        if on_generation is not None:
            on_generation(generation + 1, -float(min(values)))
    # The mean of the final distribution, which is least affected by noise in single candidates.
    best = middle + half * np.clip(strategy.result.xfavorite, -1.0, 1.0)
    return best, half * strategy.result.stds, history


def identify(
    task: WalkingTask,
    policy: Policy,
    folder: Path,
    *,
    start: Array | None = None,
    on_progress: Callable[[dict[str, float]], None] | None = None,
) -> Identification:
    """Find the mu with which the policy walks most like the record.

    A candidate is accepted only if it is better than the nominal parameters without the prior;
    otherwise the nominal ones are the result. An interrupted identification resumes.

    Parameters
    ----------
    folder : receives the state of the search while it runs.
    start : (14,) mu to start from; the nominal ones when not given.
    on_progress : called after each generation with generation, total and reward.
    """
    configuration = task.configuration
    settings = configuration.identification
    nominal = nominal_parameters()
    lower, upper = parameter_bounds(configuration.randomisation)
    state_file = Path(folder) / _STATE
    key = value_hash(
        {
            "settings": settings.model_dump(mode="json"),
            "randomisation": configuration.randomisation.model_dump(mode="json"),
            "start": None if start is None else list(map(float, start)),
            "policy": {k: v for k, v in policy.about.items() if k != "versions"},
            "numbers": [float(np.sum(np.abs(v))) for v in policy.tensors.values()],
        }
    )

    def progress(generation: int, best: float) -> None:
        if on_progress is not None:
            on_progress({"generation": generation, "total": settings.generations, "reward": best})

    with RolloutPool(task, workers=configuration.training.workers) as pool:

        def evaluate(candidates: list[Array]) -> list[float]:
            return mean_rewards(pool, policy, settings, candidates)

        best, spread, history = search(
            evaluate,
            start=nominal if start is None else start,
            nominal=nominal,
            lower=lower,
            upper=upper,
            settings=settings,
            seed=configuration.seed,
            state_file=state_file,
            key=key,
            on_generation=progress,
        )
        reward_nominal, reward_best = evaluate([nominal, best])
    if reward_best < reward_nominal:
        best, reward_best = nominal, reward_nominal
    state_file.unlink(missing_ok=True)
    margin = 0.01 * (upper - lower)
    on_bound = (best < lower + margin) | (best > upper - margin)
    return Identification(
        names=PARAMETERS,
        nominal=tuple(map(float, nominal)),
        identified=tuple(map(float, best)),
        standard_deviation=tuple(map(float, spread)),
        lower=tuple(map(float, lower)),
        upper=tuple(map(float, upper)),
        on_bound=tuple(map(bool, on_bound)),
        reward_nominal=reward_nominal,
        reward_identified=reward_best,
        history=tuple(history),
    )
