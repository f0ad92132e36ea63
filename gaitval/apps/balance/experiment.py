"""The walks of which balance is judged: pushed and undisturbed, on ground as usual or not."""

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Final

import numpy as np

from gaitval._internal.numba.lanes import WIDTH
from gaitval.apps.balance.disturb import (
    Disturbance,
    DisturbedEnvironment,
    Planned,
    Slip,
    Trip,
)
from gaitval.arrays import Array
from gaitval.coordinates import SIDES, Side, opposite
from gaitval.errors import ArtefactError
from gaitval.metrics.balance_walk import BalanceWalk, Footstep, walked
from gaitval.metrics.push_recovery import Push, without_drift
from gaitval.model.body import BodyModel
from gaitval.model.parameters import apply_parameters
from gaitval.model.tree import segment_frames, tree_arrays
from gaitval.policy.rollouts import in_groups, record_rollout, record_together
from gaitval.policy.storage import Policy
from gaitval.policy.walking_group import WalkingGroup
from gaitval.walk.simulation.rollout import Rollout
from gaitval.walk.simulation.walker import WalkingTask

AFTER: Final = 5.0
"""Gait cycles that a disturbed walk is followed: the paper's figure of velocity shows five."""
STARTS: Final = 5
"""Walks on one ground, which begin almost alike: at the edge of falling the last digits decide."""
NOISE: Final = 1e-5
"""rad, standard deviation of the joint angles at their starts."""


@dataclass(frozen=True)
class TestedWalker:
    """A policy with a body and what it walks.

    Attributes
    ----------
    task : displacement ends no walk of it.
    """

    task: WalkingTask
    policy: Policy
    mu: Array

    @classmethod
    def of(cls, task: WalkingTask, policy: Policy, mu: Array) -> "TestedWalker":
        """`task` as it comes from a stored policy."""
        return cls(without_drift(task), policy, mu)

    @cached_property
    def model(self) -> BodyModel:
        """The body that walks."""
        return apply_parameters(self.task.model, self.mu)

    @cached_property
    def together(self) -> WalkingGroup:
        """Eight of them."""
        return WalkingGroup([self.task] * WIDTH)

    @cached_property
    def settling(self) -> int:
        """Gait cycles before a disturbance."""
        return self.task.configuration.validation.settling_cycles

    @property
    def threshold(self) -> float:
        """N, above which a foot is on the ground."""
        return self.task.configuration.contact.event_threshold

    def seen(self, rollout: Rollout) -> BalanceWalk:
        """What balance is judged by in a `rollout`."""
        return walked(rollout, self.model, threshold=self.threshold)


def pushed(walker: TestedWalker, pushes: Sequence[Push]) -> Iterator[BalanceWalk]:
    """Walks with `pushes`; one of force 0 is undisturbed."""
    for some in in_groups(pushes):
        for rollout in record_together(
            walker.together,
            walker.policy,
            mu=walker.mu,
            start_phases=[0.0] * len(some),
            cycles=walker.settling + 1.0 + AFTER,
            pushes=[
                (walker.settling + push.phase, push.force, push.direction) if push.force else None
                for push in some
            ],
        ):
            yield walker.seen(rollout)


def sideways_pushes(forces: Sequence[float], phases: int) -> list[Push]:
    """Pushes to the left and right of these `forces`, N, at so many `phases` of the cycle."""
    return [
        Push(phase / phases, direction, force)
        for force in forces
        for direction in (0.5 * math.pi, -0.5 * math.pi)
        for phase in range(phases)
    ]


def lengthways_pushes(forces: Sequence[float], phases: int) -> list[Push]:
    """Pushes forward and backward."""
    return [
        Push(phase / phases, direction, force)
        for force in forces
        for direction in (0.0, math.pi)
        for phase in range(phases)
    ]


@dataclass(frozen=True)
class GroundWalk:
    """A walk on disturbed ground.

    Attributes
    ----------
    fell : whether it ended in a fall.
    slid : m, of a slip.
    """

    fell: bool
    slid: float


class OnGround:
    """Walks on disturbed ground, planned by the one on level ground from the same start.

    Parameters
    ----------
    walker : whose they are.
    """

    def __init__(self, walker: TestedWalker) -> None:
        self.walker = walker
        self.environment = DisturbedEnvironment(walker.task)
        self._known: dict[tuple[float, int], Rollout] = {}

    def _level(self, noise: float, seed: int) -> Rollout:
        if (noise, seed) not in self._known:
            self._known[noise, seed] = self._rollout(None, noise, seed)
        return self._known[noise, seed]

    def _rollout(self, planned: Planned | None, noise: float, seed: int) -> Rollout:
        self.environment.planned = planned
        return record_rollout(
            self.environment,
            self.walker.policy,
            mu=self.walker.mu,
            start_phase=0.0,
            cycles=self.walker.settling + 1.0 + AFTER,
            noise=noise,
            seed=seed,
        )

    def walk(
        self, ground: Disturbance, *, noise: float = 0.0, seed: int = 0, later: float = 0.0
    ) -> GroundWalk:
        """A walk on `ground`, from a start with `noise` rad on the joints by `seed`; a slip or a
        trip begins by so many actions `later`.
        """
        level = self._level(noise, seed)
        usual = self.walker.seen(level)
        planned = self._plan(ground, level, usual, self._step(usual, ground.side))
        shift = later * self.environment.walker.action_seconds
        planned = replace(planned, start=planned.start + shift)
        rollout = self._rollout(planned, noise, seed)
        return GroundWalk(bool(rollout.fell[0]), self.environment.slid)

    def starts_survived(self, ground: Disturbance) -> list[bool]:
        """Whether each of `STARTS` starts survives."""
        middle = (STARTS - 1) / 2
        return [
            not self.walk(ground, noise=NOISE, seed=seed, later=seed - middle).fell
            for seed in range(STARTS)
        ]

    def _step(self, plain: BalanceWalk, side: Side) -> Footstep:
        """The first step of a side after the settling cycles."""
        cycle = self.walker.task.reference.stride_time
        later = [
            each
            for each in plain.steps
            if each.side == side and plain.time[each.strike] > self.walker.settling * cycle
        ]
        if not later:
            raise ArtefactError(
                f"on level ground the walker takes no step of its {side} foot after "
                f"{self.walker.settling} gait cycles, so it cannot be disturbed there. Its policy "
                "does not walk this person; train it further, or give another run."
            )
        return later[0]

    def _plan(
        self, ground: Disturbance, level: Rollout, plain: BalanceWalk, step: Footstep
    ) -> Planned:
        time = plain.time
        if isinstance(ground, Trip):
            lift, strike = time[step.lift], time[step.strike]
            return Planned(ground, float(lift + ground.swing * (strike - lift)))
        # An action before the foot is loaded, so that it never stands on the usual ground.
        start = float(time[step.strike] - 2.0 * self.environment.walker.action_seconds)
        if isinstance(ground, Slip):
            return Planned(ground, start)
        return Planned(ground, start, self._edge(level, plain, step))

    def _edge(self, level: Rollout, plain: BalanceWalk, step: Footstep) -> float:
        """m, halfway between the toes of the foot on the ground and the heel of the landing one."""
        ahead, behind = _foot_ends(self.walker.model, level.positions[step.strike])
        other = SIDES.index(opposite(step.side))
        return 0.5 * (float(ahead[other]) + float(behind[step.column]))


def _foot_ends(model: BodyModel, positions: Array) -> tuple[Array, Array]:
    """(2,) m, x of the foremost and the rearmost point of the right and the left foot at
    `positions` (31,).
    """
    tree, frame = tree_arrays(model), segment_frames(model, positions[None])[0]
    poses = frame[tree.sphere_segment]
    x = np.einsum("kj,kj->k", poses[:, 0, :3], tree.sphere_position) + poses[:, 0, 3]
    halves = x.reshape(2, -1), tree.sphere_radius.reshape(2, -1)
    return (halves[0] + halves[1]).max(axis=1), (halves[0] - halves[1]).min(axis=1)
