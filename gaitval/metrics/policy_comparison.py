"""Start and result of a training, walked where nothing was learned from.

Both walk without noise, with the body as scaled, from the start phases of the validation; and they
are pushed halfway between the phases at which the validation pushes, so that neither is chosen by
the test that it is held against later. The walks are those of the compiled engine, eight side by
side.
"""

from collections.abc import Sequence
from itertools import chain
from typing import Final

import numpy as np

from gaitval.arrays import Array
from gaitval.metrics.epsilon import Walked, Walks, mean_of, walked
from gaitval.metrics.learning_gain import LearningGain, Standing
from gaitval.metrics.push_recovery import (
    Push,
    evenly_spaced,
    survive_together,
    trials,
    without_drift,
)
from gaitval.policy.rollouts import RolloutPool, in_groups
from gaitval.policy.storage import Policy
from gaitval.simulation.walker import WalkingTask

DIRECTIONS: Final = 24
"""Of the pushes, all around: four phases make 96 of them, so that one is a hundredth."""


def between(phases: Sequence[float]) -> tuple[float, ...]:
    """Phases halfway between neighbours, around the gait cycle."""
    ordered = np.sort(np.asarray(phases, dtype=float))
    halves = ordered + 0.5 * np.diff(np.append(ordered, ordered[0] + 1.0))
    return tuple(float(each) for each in np.sort(halves % 1.0))


def standing_of(tasks: Sequence[WalkingTask], policy: Policy, mu: Array) -> Standing:
    """How a policy walks and stands pushes; the result does not depend on the number of workers.

    Parameters
    ----------
    tasks : that it learned, with the same configuration.
    mu : (14,) body parameters that it walks with.
    """
    configuration = tasks[0].configuration
    phases, settings = configuration.validation.start_phases, configuration.pushes
    pushes = [
        Push(phase, direction, settings.force)
        for phase in between(settings.phases)
        for direction in evenly_spaced(DIRECTIONS)
    ]
    went: list[Walked] = []
    survived = 0
    with RolloutPool(tasks[0], workers=configuration.training.workers) as pool:
        for task in tasks:
            walks = [Walks(policy, mu, group) for group in in_groups(phases)]
            went += chain.from_iterable(pool.with_task(task).each_together(walked, walks))
            tried = in_groups(trials(task, policy, mu, pushes))
            pushed = pool.with_task(without_drift(task))
            survived += sum(chain.from_iterable(pushed.each_together(survive_together, tried)))
    errors = [each.epsilon for each in went]
    mean = mean_of(errors)
    return Standing(
        walks=len(went),
        falls=sum(each.fell for each in went),
        pushes=len(pushes) * len(tasks),
        survived=survived,
        epsilon=None if mean is None else mean.total,
        scatter=None if mean is None else float(np.std([each.total for each in errors if each])),
    )


def learning_gain(
    tasks: Sequence[WalkingTask],
    start: Policy | None,
    trained: Policy,
    mu: Array,
    *,
    samples: int,
) -> LearningGain:
    """Both policies of a training on walks that were not used for learning.

    Parameters
    ----------
    tasks : that the training was of, with the same configuration.
    start : None for a training from nothing.
    mu : (14,) body parameters that they walk with.
    samples : environment steps of the training.
    """
    before = None if start is None else standing_of(tasks, start, mu)
    return LearningGain(samples, before, standing_of(tasks, trained, mu))


def handed_on(gain: LearningGain, start: Policy | None, trained: Policy) -> Policy:
    """The policy that a training hands on by `RULE`: the start's numbers keep the description of
    the training's body, and say that nothing was learned for it.
    """
    if gain.trained_is_handed_on or start is None:
        return trained
    return Policy(start.tensors, {**trained.about, "samples": 0})
