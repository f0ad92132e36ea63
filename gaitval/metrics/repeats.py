"""Repeats of the compared walk: from every start phase, each with its own noise.

The noise is that of training starts (`environment.initial_noise` on every joint angle). The policy
has the settling cycles to recover from it. The walks run side by side in the compiled engine, and
only their measures are kept.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import chain

import numpy as np

from gaitval.arrays import Array
from gaitval.metrics.comparator import Comparator
from gaitval.metrics.results import Repeat
from gaitval.metrics.rollouts import Rollouts, compared_cycles, endurance
from gaitval.metrics.validation import measures_of_walk
from gaitval.metrics.verdict_rows import ENDURANCE
from gaitval.policy.rollouts import RolloutPool, in_groups, record_together
from gaitval.policy.storage import Policy
from gaitval.policy.walking_group import WalkingGroup
from gaitval.walk.simulation.walker import WalkingTask


@dataclass(frozen=True)
class _Walks:
    """At most eight: the phase that each starts at, and the seed of its noise."""

    policy: Policy
    mu: Array
    phases: Sequence[float]
    seeds: Sequence[int]
    compared: Comparator


def _measured(group: WalkingGroup, walks: _Walks) -> list[Repeat]:
    configuration = group.environments[0].task.configuration
    noise = configuration.environment.initial_noise
    rollouts = record_together(
        group,
        walks.policy,
        mu=walks.mu,
        start_phases=walks.phases,
        cycles=compared_cycles(configuration),
        noise=noise,
        seeds=walks.seeds,
    )
    repeats = []
    for phase, seed, rollout in zip(walks.phases, walks.seeds, rollouts, strict=True):
        went = endurance(rollout, configuration, engine="compiled")
        measures = measures_of_walk(Rollouts(rollout, (went,)), walks.compared, configuration)
        found: dict[str, dict[str, float | None]] = {}
        for each in measures:
            if each.measure not in ENDURANCE:
                found.setdefault(each.measure, {})[each.target] = each.value
        repeats.append(
            Repeat(start_phase=phase, noise=noise, seed=seed, fell=went.fell, measures=found)
        )
    return repeats


def repeated_walks(
    task: WalkingTask, policy: Policy, mu: Array, compared: Comparator
) -> list[Repeat]:
    """Measures of the walks of `policy` on `task` with the body `mu` (14,), against `compared`: one
    walk with noise from every start phase of the validation, the same for any number of workers.
    """
    configuration = task.configuration
    phases = configuration.validation.start_phases
    # a seed for each phase, so the noise does not depend on which worker walks it, or when
    drawn = np.random.SeedSequence([configuration.seed, len(phases)]).generate_state(len(phases))
    # one bit less, so that a seed fits a signed integer
    seeds = [int(seed >> 1) for seed in drawn]
    walks = [
        _Walks(policy, mu, some, theirs, compared)
        for some, theirs in zip(in_groups(phases), in_groups(seeds), strict=True)
    ]
    with RolloutPool(task, workers=configuration.training.workers) as pool:
        return list(chain.from_iterable(pool.each_together(_measured, walks)))
