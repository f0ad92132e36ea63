"""Repeats of the walk that is compared: from every start phase, each with another noise.

The noise is that of a training's starts (`environment.initial_noise` on every joint angle), which
the policy has to walk off in the settling cycles. They walk side by side in the compiled engine,
and only what was measured of them is kept.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from itertools import chain
from typing import Any

import numpy as np

from gaitval.arrays import Array
from gaitval.gait.record import GaitRecord
from gaitval.metrics.rollouts import Rollouts, endurance
from gaitval.metrics.tolerances import Measure
from gaitval.metrics.validation import ENDURANCE, measures_of_walk
from gaitval.model.body import BodyModel
from gaitval.policy.rollouts import RolloutPool, in_groups, record_together
from gaitval.policy.storage import Policy
from gaitval.policy.walking_group import WalkingGroup
from gaitval.simulation.walker import WalkingTask

Json = dict[str, Any]


@dataclass(frozen=True)
class Compared:
    """What walks are measured against.

    Attributes
    ----------
    record, recorded : with which they are compared, and its part of `metrics.json`.
    guesses : predictions without a model, as in `metrics.json`.
    model, leg_length : the body before mu; m.
    """

    record: GaitRecord
    recorded: Mapping[str, Any]
    guesses: Sequence[Json]
    model: BodyModel
    leg_length: float


@dataclass(frozen=True)
class _Walks:
    """At most eight: the phase that each starts at, and the seed of its noise."""

    policy: Policy
    mu: Array
    phases: Sequence[float]
    seeds: Sequence[int]
    compared: Compared


def _measured(group: WalkingGroup, walks: _Walks) -> list[Json]:
    configuration = group.environments[0].task.configuration
    validation, of = configuration.validation, walks.compared
    noise = configuration.environment.initial_noise
    rollouts = record_together(
        group,
        walks.policy,
        mu=walks.mu,
        start_phases=walks.phases,
        cycles=validation.settling_cycles + validation.cycles + 2,
        noise=noise,
        seeds=walks.seeds,
    )
    rows = []
    for phase, seed, rollout in zip(walks.phases, walks.seeds, rollouts, strict=True):
        went = endurance(rollout, configuration, engine="compiled")
        measures = measures_of_walk(
            Rollouts(rollout, (went,)),
            of.record,
            dict(of.recorded),
            of.guesses,
            of.model,
            of.leg_length,
            configuration,
        )
        kept = [each for each in measures if each.measure not in ENDURANCE]
        start = {"start_phase": phase, "noise": noise, "seed": seed}
        rows.append({**start, "fell": went.fell, "measures": _by_target(kept)})
    return rows


def _by_target(measures: Sequence[Measure]) -> Json:
    found: Json = {}
    for each in measures:
        found.setdefault(each.measure, {})[each.target] = each.value
    return found


def repeated_walks(task: WalkingTask, policy: Policy, mu: Array, compared: Compared) -> list[Json]:
    """What is measured of a walk from every start phase of the validation, with noise.

    The result does not depend on the number of workers.

    Parameters
    ----------
    mu : (14,) body parameters.

    Returns
    -------
    A row a walk, to be written as JSON: phase, noise (rad) and seed of its start, whether it fell,
    and the values by measure and target.
    """
    configuration = task.configuration
    phases = configuration.validation.start_phases
    drawn = np.random.SeedSequence([configuration.seed, len(phases)]).generate_state(len(phases))
    seeds = [int(seed >> 1) for seed in drawn]
    walks = [
        _Walks(policy, mu, some, theirs, compared)
        for some, theirs in zip(in_groups(phases), in_groups(seeds), strict=True)
    ]
    with RolloutPool(task, workers=configuration.training.workers) as pool:
        return list(chain.from_iterable(pool.each_together(_measured, walks)))
