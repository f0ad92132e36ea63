"""Whether a push is survived, not by one walk but by several that begin almost alike.

At the edge of falling a walk is decided by its last digits: the same push from a start that differs
by micrometres may end otherwise. So a push is an ensemble of `STARTS` walks whose joints differ by
10 µrad at the start, some 10 µm at the feet, and whose pushes begin some milliseconds earlier or
later. It is survived if at least `ENOUGH` of them are; and the largest push is that up to which
*all* of them are, of every tested one.
"""

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, replace
from itertools import chain
from typing import Final

import numpy as np

from gaitval.arrays import Array
from gaitval.metrics.push_recovery import (
    Push,
    PushTrial,
    Survived,
    largest_pushes,
    survive_together,
    trials,
    without_drift,
)
from gaitval.policy.rollouts import RolloutPool, in_groups
from gaitval.policy.storage import Policy
from gaitval.simulation.walker import WalkingTask

STARTS: Final = 5
"""Walks of an ensemble."""
ENOUGH: Final = STARTS - 1
"""Of them, that survive a push that counts as survived."""
OTHERS: Final = 2 * STARTS
"""Starts with which it is checked that the largest push was no luck."""
NOISE: Final = 1e-5
"""rad, standard deviation of the joint angles at their starts."""
APART: Final = 0.002
"""s from the beginning of one walk's push to the next one's."""


@dataclass(frozen=True)
class Ensemble:
    """What became of one push.

    Attributes
    ----------
    stood : (STARTS,) by start, whether it was survived.
    """

    push: Push
    stood: tuple[bool, ...]

    @property
    def survived(self) -> bool:
        """Whether the push counts as survived."""
        return sum(self.stood) >= ENOUGH

    @property
    def all_survived(self) -> bool:
        """Whether every start survived it."""
        return all(self.stood)

    @property
    def torn(self) -> bool:
        """Whether the starts disagree: a single walk would have been a matter of luck."""
        return len(set(self.stood)) > 1


def starts_of(
    trial: PushTrial, stride_time: float, *, count: int = STARTS, first: int = 0
) -> list[PushTrial]:
    """The ensemble of a `trial`, of a walker with this `stride_time` (s): `count` starts, seeds
    from `first` on, whose pushes begin within the same time.
    """
    middle, apart = (count - 1) / 2, APART * (STARTS - 1) / max(count - 1, 1)
    return [
        replace(
            trial,
            push=replace(
                trial.push, phase=trial.push.phase + (number - middle) * apart / stride_time
            ),
            noise=NOISE,
            seed=first + number,
        )
        for number in range(count)
    ]


class Ensembles:
    """Pushes tried as ensembles.

    Parameters
    ----------
    pool : of `without_drift` tasks.
    task, policy, mu : who is pushed.
    """

    def __init__(self, pool: RolloutPool, task: WalkingTask, policy: Policy, mu: Array) -> None:
        self._pool, self._task, self._policy, self._mu = pool, task, policy, mu
        self.known: dict[Push, Ensemble] = {}

    def of(self, pushes: Sequence[Push]) -> list[Ensemble]:
        """The ensemble of each of `pushes`; each is tried once."""
        new = [push for push in dict.fromkeys(pushes) if push not in self.known]
        self.known |= {each.push: each for each in self._walked(new, STARTS, 0)}
        return [self.known[push] for push in pushes]

    def from_others(self, pushes: Sequence[Push]) -> list[Ensemble]:
        """`pushes` from `OTHERS` starts that no ensemble contains: whether what was found for these
        was luck.
        """
        return self._walked(pushes, OTHERS, STARTS)

    def _walked(self, pushes: Sequence[Push], count: int, first: int) -> list[Ensemble]:
        stride = self._task.reference.stride_time
        tried = trials(self._task, self._policy, self._mu, pushes)
        starts = [starts_of(each, stride, count=count, first=first) for each in tried]
        # By start: eight walks of one start are one walk until they are pushed.
        by_start = list(zip(*starts, strict=True))
        groups = list(chain.from_iterable(in_groups(each) for each in by_start))
        flat = list(chain.from_iterable(self._pool.each_together(survive_together, groups)))
        stood = np.reshape(np.array(flat, dtype=bool), (len(by_start), len(pushes)))
        return [
            Ensemble(push, tuple(each)) for push, each in zip(pushes, stood.T.tolist(), strict=True)
        ]

    def survived(self, pushes: Sequence[Push]) -> list[bool]:
        """Whether each is survived by all its starts: what the largest push counts."""
        return [each.all_survived for each in self.of(pushes)]


@dataclass(frozen=True)
class RobustPushes:
    """Pushes of one walker, as ensembles.

    Attributes
    ----------
    phases, directions : of the right gait cycle; rad, left positive.
    largest : (P, D) N, up to which all starts survive every tested push.
    tried : all pushes that were tried.
    again : the largest pushes from other starts than those that they were found with.
    """

    phases: tuple[float, ...]
    directions: tuple[float, ...]
    largest: Array
    tried: tuple[Ensemble, ...]
    again: tuple[Ensemble, ...]

    @property
    def flipped(self) -> tuple[int, int]:
        """Of walks with the largest pushes from other starts: those that fell, and all."""
        stood = [each for one in self.again for each in one.stood]
        return len(stood) - sum(stood), len(stood)


def robust_pushes(
    task: WalkingTask,
    policy: Policy,
    mu: Array,
    *,
    directions: Sequence[float],
    required: Iterable[Push] = (),
    on_progress: Callable[[int], None] | None = None,
) -> RobustPushes:
    """Push the walker of `task` and `policy`, with the body `mu` (14,), in `directions` (rad) at
    the phases of the configuration, with growing force; and with the `required` pushes.
    `on_progress` gets the number of finished phases and directions.
    """
    settings = task.configuration.pushes.of_mass(task.model.mass)
    with RolloutPool(without_drift(task), workers=task.configuration.training.workers) as pool:
        ensembles = Ensembles(pool, task, policy, mu)
        stands: Survived = ensembles.survived
        ensembles.of(list(required))
        largest = largest_pushes(stands, settings, directions, on_progress)
        edges = [
            Push(phase, direction, float(force))
            for phase, row in zip(settings.phases, largest, strict=True)
            for direction, force in zip(directions, row, strict=True)
            if force > 0.0
        ]
        again = tuple(ensembles.from_others(edges))
    tried = tuple(ensembles.known.values())
    return RobustPushes(settings.phases, tuple(directions), largest, tried, again)
