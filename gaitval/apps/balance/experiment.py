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
    StepDown,
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
from gaitval.simulation.rollout import Rollout
from gaitval.simulation.walker import WalkingTask

AFTER: Final = 5.0
"""Gait cycles that a disturbed walk is followed: the paper's figure of velocity shows five."""
NOISE: Final = 0.02
"""rad, of the joints at the start of walks whose small deviations the linear map is made of: that
of a training."""
FIRST: Final = 2
"""Steps of such a walk that are left out, one of each foot: they end where the moved joints swing
the leg, whatever the pelvis does."""


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

    def seen(self, rollout: Rollout, onset: int | None = None) -> BalanceWalk:
        """What balance is judged by in a `rollout` that is disturbed at row `onset`."""
        return walked(rollout, self.model, threshold=self.threshold, onset=onset)


def pushed(
    walker: TestedWalker, pushes: Sequence[Push], seeds: Sequence[int] = ()
) -> Iterator[BalanceWalk]:
    """Walks with `pushes`; one of force 0 is undisturbed. With `seeds`, one a push, each walk
    starts with `NOISE`.
    """
    noise = NOISE if seeds else 0.0
    numbered = list(zip(pushes, seeds or [0] * len(pushes), strict=True))
    for some in in_groups(numbered):
        for rollout in record_together(
            walker.together,
            walker.policy,
            mu=walker.mu,
            start_phases=[0.0] * len(some),
            cycles=walker.settling + 1.0 + AFTER,
            noise=noise,
            seeds=[seed for _, seed in some],
            pushes=[
                (walker.settling + push.phase, push.force, push.direction) if push.force else None
                for push, _ in some
            ],
        ):
            yield walker.seen(rollout)


def steady_walks(walker: TestedWalker, count: int) -> list[BalanceWalk]:
    """So many walks without pushes that begin with `NOISE`, without their first steps."""
    still = [Push(0.0, 0.0, 0.0)] * count
    walks = pushed(walker, still, list(range(count)))
    return [replace(walk, steps=walk.steps[FIRST:]) for walk in walks]


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


def random_pushes(count: int, largest: float, seed: int = 0) -> list[Push]:
    """Pushes in any direction at any phase, of a force uniform up to the `largest`, N."""
    random = np.random.default_rng(seed)
    return [
        Push(float(phase), float(direction), float(force))
        for phase, direction, force in zip(
            random.uniform(0.0, 1.0, count),
            random.uniform(-math.pi, math.pi, count),
            random.uniform(0.0, largest, count),
            strict=True,
        )
    ]


@dataclass(frozen=True)
class DisturbedWalk:
    """A walk on disturbed ground beside the same walk on level ground.

    Attributes
    ----------
    walk, plain : with and without; both know when the disturbance begins.
    step : the step of the plain walk that is disturbed, or follows the disturbed swing.
    slid : m, of a slip.
    ended : s after its beginning, when it was over; NaN if it was not.
    rollout : of `walk`.
    knee, plain_knee : (T,) rad, flexion of the knee of that side.
    """

    ground: Disturbance
    walk: BalanceWalk
    plain: BalanceWalk
    step: Footstep
    slid: float
    ended: float
    rollout: Rollout
    knee: Array
    plain_knee: Array


class OnGround:
    """Walks on disturbed ground, each beside the plain one.

    Parameters
    ----------
    walker : whose they are.
    environment : to walk in; a new one by default.
    """

    def __init__(
        self, walker: TestedWalker, environment: DisturbedEnvironment | None = None
    ) -> None:
        self.walker = walker
        self.environment = environment or DisturbedEnvironment(walker.task)
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
    ) -> DisturbedWalk:
        """A walk on `ground`, from a start with `noise` rad on the joints by `seed`; a slip or a
        trip begins by so many actions `later`.
        """
        level = self._level(noise, seed)
        usual = self.walker.seen(level)
        step = self._step(usual, ground.side)
        planned = self._plan(ground, level, usual, step)
        shift = later * self.environment.walker.action_seconds
        planned = replace(planned, start=planned.start + shift)
        rollout = self._rollout(planned, noise, seed)
        began = self.environment.began
        step_time = float(level.time[1] - level.time[0])
        # A step down is there when the foot would have landed; it is noticed later.
        at = planned.start if np.isnan(began) or isinstance(ground, StepDown) else began
        onset = min(round(at / step_time), len(rollout.time) - 1)
        knee = f"knee_angle_{ground.side[0]}"
        seen = rollout
        if isinstance(ground, Trip):
            seen = _without_wall(rollout, SIDES.index(ground.side), at, self.environment.ended)
        return DisturbedWalk(
            ground,
            self.walker.seen(seen, onset),
            self.walker.seen(level, onset),
            step,
            self.environment.slid,
            self.environment.ended - at,
            rollout,
            _angle(rollout, knee),
            _angle(level, knee),
        )

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


def _without_wall(rollout: Rollout, column: int, began: float, ended: float) -> Rollout:
    """The `rollout` in which the foot is not on the ground while a wall holds it: the wall pushes
    upwards, too, and would count as a step.
    """
    force = rollout.ground_reaction.copy()
    held = rollout.time >= began
    if np.isfinite(ended):
        held &= rollout.time < ended
    force[held, column] = 0.0
    return replace(rollout, ground_reaction=force)


def _angle(rollout: Rollout, name: str) -> Array:
    from gaitval.coordinates import COORDINATES

    return rollout.positions[:, COORDINATES.index(name)]


def _foot_ends(model: BodyModel, positions: Array) -> tuple[Array, Array]:
    """(2,) m, x of the foremost and the rearmost point of the right and the left foot at
    `positions` (31,).
    """
    tree, frame = tree_arrays(model), segment_frames(model, positions[None])[0]
    poses = frame[tree.sphere_segment]
    x = np.einsum("kj,kj->k", poses[:, 0, :3], tree.sphere_position) + poses[:, 0, 3]
    halves = x.reshape(2, -1), tree.sphere_radius.reshape(2, -1)
    return (halves[0] + halves[1]).max(axis=1), (halves[0] - halves[1]).min(axis=1)
