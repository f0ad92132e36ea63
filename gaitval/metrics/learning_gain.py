"""What a training gave: the trained policy beside the one that it started from.

Both walk where nothing was learned from: without noise, with the body as scaled, from the start
phases of the validation; and they are pushed halfway between the phases at which the validation
pushes, so that neither is chosen by the test that it is held against later. The walks are those of
the compiled engine, eight side by side.
"""

import math
from collections.abc import Sequence
from dataclasses import asdict, dataclass
from itertools import chain
from typing import Any, Final

import numpy as np

from gaitval.arrays import Array
from gaitval.metrics.epsilon import Walked, Walks, mean_of, walked
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

RULE: Final = (
    "The trained policy is handed on if, on walks that were not used for learning, it falls in no "
    "more of them, survives no fewer pushes and is no further from the record (epsilon) than the "
    "policy that its training started from; otherwise that one is."
)

DIRECTIONS: Final = 24
"""Of the pushes, all around: four phases make 96 of them, so that one is a hundredth."""


@dataclass(frozen=True)
class Standing:
    """How a policy walks where it did not learn.

    Attributes
    ----------
    walks, falls : walks without a push, one from each start phase, and those that ended in a fall.
    pushes, survived : pushes, and those that were survived.
    epsilon : mean over the walks; None if one of them has no complete gait cycle.
    scatter : standard deviation of epsilon over the walks.
    """

    walks: int
    falls: int
    pushes: int
    survived: int
    epsilon: float | None
    scatter: float | None

    def not_worse_than(self, other: "Standing") -> bool:
        """Whether it is worse in nothing."""
        nearer = (self.epsilon or math.inf) <= (other.epsilon or math.inf)
        return self.falls <= other.falls and self.survived >= other.survived and nearer


@dataclass(frozen=True)
class LearningGain:
    """The policy at the start and at the end of a training.

    Attributes
    ----------
    samples : environment steps of the training.
    start : None for a training from nothing.
    """

    samples: int
    start: Standing | None
    trained: Standing

    @property
    def trained_is_handed_on(self) -> bool:
        """By `RULE`; what was learned from nothing always is."""
        return self.start is None or self.trained.not_worse_than(self.start)

    def as_dict(self) -> dict[str, Any]:
        """To be written as JSON, with the rule and what follows from it."""
        handed_on = "trained" if self.trained_is_handed_on else "start"
        return {**asdict(self), "rule": RULE, "handed_on": handed_on}

    def in_words(self) -> str:
        """A sentence for the user."""
        trained, start = self.trained, self.start
        if start is None:
            return f"Learning from nothing: {_in_words(trained)}."
        kept = "handed on" if self.trained_is_handed_on else "the start is handed on"
        return (
            f"What {self.samples:,} samples gave: {_in_words(start)} before, {_in_words(trained)} "
            f"after; {kept}."
        )


def _in_words(standing: Standing) -> str:
    epsilon = "no whole cycle" if standing.epsilon is None else f"epsilon {standing.epsilon:.4f}"
    falls = f", {standing.falls} of {standing.walks} walks fell" if standing.falls else ""
    return f"{epsilon}, {standing.survived} of {standing.pushes} pushes survived{falls}"


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
