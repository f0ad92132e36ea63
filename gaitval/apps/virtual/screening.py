"""Which parameters of the body and of the ground a walk is sensitive to, and which of them a record
determines.

Elementary effects (Morris 1991; Campolongo, Cariboni, Saltelli 2007, Environ Model Softw 22:1509):
from a few random bodies, one parameter after the other is moved by one standard deviation of what
is known of it, the same policy walks towards the same reference, and the mean curves are compared.
The mean effect says how much a parameter matters, its spread over the bodies how much that depends
on the others. A parameter can matter to a walk and still not be determined by a record, because a
motion that differs by less than the measuring error explains as much. That is for the posterior to
say.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import Final

import numpy as np

from gaitval.arrays import Array, sample_deviation
from gaitval.gait.cycle_curves import Curves
from gaitval.gait.record import GaitRecord
from gaitval.identification.body_fit import BodyFit
from gaitval.metrics.comparison import curves_of
from gaitval.metrics.cycles import find_cycles
from gaitval.model.extended import EXTENDED, extended_body
from gaitval.model.parameters import PARAMETERS, nominal_parameters
from gaitval.model.parameters import UNITS as PARAMETER_UNITS
from gaitval.policy.environment import WalkingEnvironment
from gaitval.policy.rollouts import record_rollout
from gaitval.policy.storage import Policy
from gaitval.simulation.walker import WalkingTask

NAMES: Final = (*PARAMETERS, *(each.name for each in EXTENDED))
UNITS: Final = {**PARAMETER_UNITS, **{each.name: each.unit for each in EXTENDED}}
"""Of the parameters; "1" of a factor, a coefficient or a logarithm."""
KINDS: Final = {"angles": 180.0 / np.pi, "moments": 1.0, "forces": 100.0}
"""Factor from each kind's curves to degrees, Nm/kg and % of body weight."""

_CYCLES: Final = 4
_SPREAD: Final = 0.5
"""SD of the random bodies from which parameters are moved, in prior SDs."""


@dataclass(frozen=True)
class Screened:
    """Sensitivity of a walk to one parameter.

    Attributes
    ----------
    name : one of `NAMES`.
    prior_sd : the step, in the parameter's unit.
    effects : (n, 3) RMS change of angles (degrees), moments (Nm/kg) and forces (% of body weight)
        by one step from each of the bodies that could walk before and after it.
    contraction : posterior SD / prior SD, if all parameters are looked for together.
    """

    name: str
    prior_sd: float
    effects: Array
    contraction: float

    @property
    def mean(self) -> Array:
        """(3,) mean effect."""
        return np.asarray(self.effects.mean(axis=0)) if len(self.effects) else np.full(3, np.nan)

    @property
    def spread(self) -> Array:
        """(3,) standard deviation of the effects (n - 1); NaN of fewer than two."""
        found = sample_deviation(self.effects)
        return np.full(3, np.nan) if found is None else found

    @property
    def unit(self) -> str:
        """Of the step."""
        return UNITS[self.name]


def effects_of(
    task: WalkingTask,
    policy: Policy,
    prior_sd: Array,
    *,
    trajectories: int = 6,
    seed: int = 0,
    on_progress: Callable[[int, int], None] | None = None,
) -> list[Array]:
    """Elementary effects of every one of `NAMES`, (n, 3) each, as in `Screened`.

    Parameters
    ----------
    task : body, reference and constants.
    policy : that walks all bodies.
    prior_sd : (19,) standard deviations, in the order of `NAMES`.
    trajectories : bodies from which every parameter is moved once.
    seed : of the bodies and of the order in which parameters are moved.
    on_progress : called with the walks done, and all of them.
    """
    random = np.random.default_rng(seed)
    found: list[list[Array]] = [[] for _ in NAMES]
    total, done = trajectories * (len(NAMES) + 1), 0
    for _ in range(trajectories):
        place = _SPREAD * random.standard_normal(len(NAMES))
        # Damping and friction stay positive.
        place[:2] = np.maximum(place[:2], -1.0)
        before = _walked(task, policy, prior_sd * place)
        done += 1
        # Morris's trajectory: each body differs from the one before in one parameter, so 19 effects
        # take 20 walks, not 38.
        for index in random.permutation(len(NAMES)):
            place[index] += 1.0
            after = _walked(task, policy, prior_sd * place)
            done += 1
            if before is not None and after is not None:
                found[index].append(_change(before, after))
            before = after
            if on_progress is not None:
                on_progress(done, total)
    return [np.array(each).reshape(-1, len(KINDS)) for each in found]


def _walked(task: WalkingTask, policy: Policy, away: Array) -> Curves | None:
    """Mean curves of the walk of a body this far from the scaled one; None if it falls."""
    configuration = task.configuration
    model, contact = extended_body(task.model, configuration.contact, away[len(PARAMETERS) :])
    changed = replace(
        task, model=model, configuration=configuration.model_copy(update={"contact": contact})
    )
    rollout = record_rollout(
        WalkingEnvironment(changed),
        policy,
        mu=nominal_parameters() + away[: len(PARAMETERS)],
        start_phase=0.0,
        cycles=configuration.validation.settling_cycles + _CYCLES + 2,
    )
    cycles = find_cycles(rollout, configuration).first(_CYCLES)
    if rollout.fell[0] or min(cycles.count("right"), cycles.count("left")) < _CYCLES:
        return None
    return curves_of(task, rollout, cycles)


def _change(before: Curves, after: Curves) -> Array:
    sizes = []
    for kind, factor in KINDS.items():
        old, new = getattr(before, kind), getattr(after, kind)
        off = [new[name].mean(axis=0) - old[name].mean(axis=0) for name in old]
        sizes.append(factor * np.sqrt(np.mean(np.square(off))))
    return np.array(sizes)


def screened(
    task: WalkingTask,
    policy: Policy,
    record: GaitRecord,
    prior_sd: Array,
    *,
    on_progress: Callable[[int, int], None] | None = None,
) -> list[Screened]:
    """Every parameter of `NAMES`: its effects on a walk, and how well the `record`, with moments
    and forces, determines it. `task` has body, reference and constants; `policy` walks all bodies;
    `prior_sd` (14,) is of mu. `on_progress` is called with the walks done, and all of them.
    """
    configuration = task.configuration
    sd = np.array([*prior_sd, *(each.prior_sd for each in EXTENDED)])
    effects = effects_of(task, policy, sd, seed=configuration.seed, on_progress=on_progress)
    fit = BodyFit(
        record, task.model, configuration.contact, configuration.noise, prior_sd=prior_sd,
        extended=True,
    )  # fmt: skip
    posterior = fit.posterior(fit.mode(fit.solve(fixed=nominal_parameters())))
    after = np.concatenate([posterior.sd, posterior.extended_sd])
    return [
        Screened(name, float(size), each, float(ratio))
        for name, size, each, ratio in zip(NAMES, sd, effects, after / sd, strict=True)
    ]


def table(parameters: Sequence[Screened]) -> list[list[str]]:
    """Header and a row for each of `parameters`: step and its unit, number of pairs of walks, mean
    and SD of its effects, SD after / before. What cannot be computed is "nan".
    """
    units = ("deg", "Nm/kg", "% BW")
    effects = [f"{kind} ({unit}){of}" for kind, unit in zip(KINDS, units, strict=True)
               for of in ("", " SD")]  # fmt: skip
    rows = [["parameter", "step", "unit", "walks", *effects, "SD after / before"]]
    for each in parameters:
        both = np.column_stack([each.mean, each.spread]).ravel()
        numbers = [*both.tolist(), each.contraction]
        rows.append(
            [
                *(each.name, f"{each.prior_sd:.3g}", each.unit, str(len(each.effects))),
                *(f"{number:.3g}" for number in numbers),
            ]
        )
    return rows
