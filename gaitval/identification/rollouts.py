"""The paper's own identification: the body with which the policy walks most like the record.

Its equation 3: mu* is the body at which rollouts of the policy resemble the record most, looked for
by CMA-ES with a population of 8. Each generation's eight bodies walk at once, in the lanes of the
compiled engine. Likeness is epsilon (`metrics.epsilon`) of a walk's mean curves against the record;
somebody who falls is as unlike as `FALLEN`. There is no prior but the distribution that the search
starts with, and no posterior: the result is a point, which a policy that follows its reference on
any body hardly depends on (docs/how-to/body.md). Damping and friction stay, as elsewhere.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np

from gaitval._internal.numba.lanes import WIDTH
from gaitval.arrays import Array
from gaitval.configuration import Configuration, IdentificationSettings
from gaitval.gait.cycle_curves import recorded_curves
from gaitval.gait.record import GaitRecord
from gaitval.identification.body_fit import BodyFit
from gaitval.identification.search import Searched, search
from gaitval.identification.unidentified import bounded
from gaitval.metrics.comparison import curves_of
from gaitval.metrics.cycles import find_cycles
from gaitval.metrics.epsilon import epsilon
from gaitval.metrics.results import FoundParameters
from gaitval.model.body import BodyModel
from gaitval.model.parameters import apply_parameters, nominal_parameters
from gaitval.policy.rollouts import record_together
from gaitval.policy.storage import Policy
from gaitval.policy.walking_group import WalkingGroup
from gaitval.walk.simulation.walker import WalkingTask

FALLEN: Final = 10.0
"""Epsilon of a walk that ends on the ground or has too few cycles; a walk's is below 1."""
CYCLES: Final = 6
"""Gait cycles that are compared, after those that settle."""


@dataclass(frozen=True)
class ByRollouts:
    """What was found.

    Attributes
    ----------
    mu : (14,) the body whose walk is most like the record.
    epsilon : of its walk. before : of the walk of the scaled body.
    walks : how many were simulated.
    searched : the search.
    """

    mu: Array
    epsilon: float
    before: float
    walks: int
    searched: Searched


class BodyWalks:
    """Epsilon of the walks of several bodies against one `record`: of the `model` as scaled, with a
    `policy` that walks without noise, by the settings of contact, simulation and cycles of the
    `configuration`.
    """

    def __init__(
        self, record: GaitRecord, model: BodyModel, policy: Policy, configuration: Configuration
    ) -> None:
        self._model, self._record = model, record
        self._task = WalkingTask.of(model, record, configuration)
        self._policy, self._configuration = policy, configuration
        self._recorded = recorded_curves(record)
        self.count = 0

    def __call__(self, mus: Sequence[Array]) -> list[float]:
        """Epsilons of the bodies `mus` (14,), eight at once."""
        found: list[float] = []
        for first in range(0, len(mus), WIDTH):
            found += self._together(mus[first : first + WIDTH])
        return found

    def _together(self, mus: Sequence[Array]) -> list[float]:
        # The reference stays that of the scaled body: the policy is the same, and so is its aim.
        tasks = [
            WalkingTask(
                apply_parameters(self._model, mu), self._record, self._task.reference,
                self._configuration,
            )
            for mu in mus
        ]  # fmt: skip
        settling = self._configuration.validation.settling_cycles
        walks = record_together(
            # the last walks in the lanes that are left: groups of other sizes round otherwise
            WalkingGroup([*tasks, *tasks[-1:] * (WIDTH - len(tasks))]), self._policy,
            mu=nominal_parameters(),
            start_phases=[0.0] * len(tasks), cycles=settling + CYCLES + 2,
        )  # fmt: skip
        found = []
        for task, walk in zip(tasks, walks, strict=True):
            self.count += 1
            cycles = find_cycles(walk, self._configuration).first(CYCLES)
            enough = min(len(cycles.starts[side]) for side in ("right", "left")) >= CYCLES
            like = None
            if enough and not walk.fell[0]:
                like = epsilon(curves_of(task, walk, cycles), self._recorded)
            total = None if like is None else like.total
            found.append(FALLEN if total is None else float(total))
        return found


def identified_by_rollouts(
    walks: BodyWalks,
    prior_sd: Array,
    settings: IdentificationSettings,
    *,
    seed: int = 0,
    on_generation: Callable[[int, float], None] | None = None,
) -> ByRollouts:
    """The body with which a policy walks most like a record, by its `walks` against it. `prior_sd`
    (14,) is of mu; the search starts with `initial_sigma` of it. `settings` has population,
    generations and tolerance; `seed` is of the search. `on_generation` is called with the number of
    the generation, from 1, and its best epsilon.
    """
    (before,) = walks([nominal_parameters()])
    shown = BodyFit.looked_for()

    def body(point: Array) -> Array:
        mu = nominal_parameters()
        mu[shown] += np.asarray(prior_sd)[shown] * point
        return mu

    searched = search(
        lambda points: walks([body(each) for each in points]),
        int(shown.sum()),
        settings=settings,
        seed=seed,
        on_generation=on_generation,
    )
    mu = body(searched.best)
    (after,) = walks([mu])
    if after >= before:  # where all bodies fall, the best of them is the one drawn first
        mu, after = nominal_parameters(), before
    return ByRollouts(mu, after, before, walks.count, searched)


def rollouts_identification(
    fit: BodyFit,
    record: GaitRecord,
    model: BodyModel,
    policy: Policy,
    configuration: Configuration,
    on_progress: Callable[[dict[str, float]], None],
) -> FoundParameters:
    """`identification.method=rollouts`: the paper's own, with a `policy` (that of the round), on
    `record` and the body (`model`) as scaled. It has no posterior, so no parameter is identified by
    it; the walker takes its body all the same.

    Of `fit` only the prior is used. The `configuration` has the
    settings of the search and of walking; `on_progress` is called after each generation, with its
    best epsilon.
    """
    most = configuration.identification.generations

    def on_generation(generation: int, best: float) -> None:
        on_progress({"generation": generation, "total": most, "value": best})

    found = identified_by_rollouts(
        BodyWalks(record, model, policy, configuration),
        fit.prior_sd, configuration.identification,
        seed=configuration.seed, on_generation=on_generation,
    )  # fmt: skip
    return bounded(found.mu, fit.prior_sd, configuration).model_copy(
        update={
            "posterior_mean": found.mu.tolist(),
            "converged": found.searched.converged,
            "history": list(found.searched.history),
        }
    )
