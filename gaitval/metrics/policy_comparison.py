"""Start and result of a training, on walks from which neither learned; and whether there has to be
a training.

Both walk without noise, with the body as scaled, from the start phases of the validation. They are
pushed halfway between the phases at which the validation pushes, so that neither is chosen by the
test that judges it later. The walks are those of the compiled engine, eight side by side.
"""

from collections.abc import Sequence
from itertools import chain
from typing import Final

import numpy as np

from gaitval.arrays import Array
from gaitval.metrics.epsilon import ScoredWalk, Walks, mean_of, walked
from gaitval.metrics.learning_gain import LearningGain, Standing
from gaitval.metrics.push_recovery import (
    Push,
    evenly_spaced,
    is_required,
    survive_together,
    trials,
    without_drift,
)
from gaitval.metrics.tolerances import push_limit
from gaitval.metrics.typed import array
from gaitval.policy.rollouts import RolloutPool, in_groups
from gaitval.policy.storage import Policy
from gaitval.walk.simulation.walker import WalkingTask

DIRECTIONS: Final = 24
"""Of the pushes, all around: four phases make 96 of them, so that one is a hundredth."""


def between(phases: Sequence[float]) -> tuple[float, ...]:
    """Phases halfway between neighbours in `phases`, around the gait cycle."""
    ordered = np.sort(np.asarray(phases, dtype=float))
    # the first phase again, a cycle later, closes the circle
    halves = ordered + 0.5 * np.diff(np.append(ordered, ordered[0] + 1.0))
    return tuple(float(each) for each in np.sort(halves % 1.0))


def standing_of(tasks: Sequence[WalkingTask], policy: Policy, mu: Array) -> Standing:
    """How `policy` with the body `mu` (14,) walks and survives pushes on `tasks`, which it learned
    with one configuration. The number of workers makes no difference.
    """
    configuration = tasks[0].configuration
    phases = configuration.validation.start_phases
    settings = configuration.pushes.of_mass(tasks[0].model.mass)
    pushes = [
        Push(phase, direction, settings.force)
        for phase in between(settings.phases)
        for direction in evenly_spaced(DIRECTIONS)
    ]
    went: list[ScoredWalk] = []
    survived: list[bool] = []
    # one pool for all tasks, since starting workers takes seconds
    with RolloutPool(tasks[0], workers=configuration.training.workers) as pool:
        for task in tasks:
            walks = [Walks(policy, mu, group) for group in in_groups(phases)]
            went += chain.from_iterable(pool.with_task(task).each_together(walked, walks))
            tried = in_groups(trials(task, policy, mu, pushes))
            pushed = pool.with_task(without_drift(task))
            survived += chain.from_iterable(pushed.each_together(survive_together, tried))
    errors = [each.epsilon for each in went]
    mean = mean_of(errors)
    totals = array([each.total for each in errors if each])
    # by task, phase and direction
    stood = np.array(survived).reshape(len(tasks), len(settings.phases), DIRECTIONS)
    ahead = [is_required(each) for each in pushes[:DIRECTIONS]]
    return Standing(
        walks=len(went),
        falls=sum(each.fell for each in went),
        pushes=len(survived),
        survived=sum(survived),
        weakest_phase=float(100.0 * stood[..., ahead].mean(axis=-1).min()),
        epsilon=None if mean is None else mean.total,
        scatter=None if mean is None else float(np.std(totals)),
        error=mean,
    )


def learning_gain(
    tasks: Sequence[WalkingTask],
    before: Standing | None,
    trained: Policy,
    mu: Array,
    *,
    samples: int,
) -> LearningGain:
    """Compare the start of a training of `samples` environment steps, which walked as `before`
    says (None for a training from nothing), and the policy `trained` of it, on walks of its `tasks`
    with the body `mu` (14,). The tasks have one configuration. Of 0 samples, none was needed.
    """
    if before is not None and samples == 0:
        return LearningGain.none_needed(before, push_limit())
    return LearningGain.of(samples, before, standing_of(tasks, trained, mu))


def handed_on(gain: LearningGain, start: Policy | None, trained: Policy) -> Policy:
    """The policy that `RULE` hands on, by `gain`: `trained`, or the tensors of `start` with the
    description of the training's body and 0 samples, since nothing was learned for it.
    """
    if gain.trained_is_handed_on or start is None:
        return trained
    return Policy(start.tensors, {**trained.about, "samples": 0})
