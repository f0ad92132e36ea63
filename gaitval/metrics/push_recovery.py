"""Recovery from pushes: the largest one survived by phase and direction.

A push is a constant horizontal force on the pelvis for a short time, while the walker walks. It is
survived if the walker does not fall within `cycles` recorded gait cycles of its start. A walker has
fallen when its pelvis is too far from its reference in height or rotation
(`environment.height_tolerance`, `rotation_tolerance`); displacement alone, however far, is not a
fall. The force acts during whole actions, as in training: 50 ms are applied as 30 ms of the full
force and 30 ms of two thirds of it, so force times time is exact.

Survival need not be monotonic in the force: a walker may fall at 400 N and survive 500 N, which
happens to help its next step. So the largest push survived is the largest tested F up to which
*every* tested push was survived. It is found by increasing the force, never by bisection: first in
steps of `step` up to the first fall, then from the last push survived in steps of `resolution`.

All pushes are walked in the compiled engine, eight walks side by side: a walker that is done takes
the next push, so that none waits for the others (`survive_in_turn`). Those that are shown, eight
of those that must be survived, are walked in DART, too: a second-engine check, and a push that is
survived in one engine only counts as a fall. Both engines solve the same equations, DART in nine
times the time. A walker at the edge of falling may fall in one engine and not in the other.
"""

import heapq
import math
from collections.abc import Callable, Generator, Sequence
from contextlib import suppress
from dataclasses import dataclass, replace
from itertools import chain
from typing import Any, Final
from weakref import WeakKeyDictionary

import numpy as np
from numpy.typing import NDArray

from gaitval._internal.numba.lanes import WIDTH
from gaitval.arrays import Array
from gaitval.configuration import PushSettings
from gaitval.metrics.results import PushRecovery, PushTrace
from gaitval.policy.environment import WalkingEnvironment
from gaitval.policy.rollouts import RolloutPool, record_rollout
from gaitval.policy.storage import Policy
from gaitval.policy.walking_group import WalkingGroup
from gaitval.walk.simulation.rollout import Rollout
from gaitval.walk.simulation.walker import WalkingTask


@dataclass(frozen=True)
class Push:
    """A push: phase of the right gait cycle at which it begins, direction rad from straight
    ahead (left positive), force N.
    """

    phase: float
    direction: float
    force: float


REPLAYED: Final = 4.0
"""Gait cycles after a push that is replayed: the walker has recovered by then, or fallen."""


@dataclass(frozen=True)
class Trace:
    """Velocity of the centre of mass around a push.

    Attributes
    ----------
    cycles : (T,) gait cycles since the beginning of the push.
    velocity : (T, 3) m/s, world: forward, left, up.
    fell : the rollout ended in a fall.
    """

    push: Push
    cycles: Array
    velocity: Array
    fell: bool

    def stored(self) -> PushTrace:
        """As a file has it."""
        return PushTrace(
            phase=self.push.phase,
            direction=_degrees(self.push.direction),
            force=self.push.force,
            fell=self.fell,
            cycles=[float(f"{value:.5g}") for value in self.cycles],
            velocity=[[float(f"{value:.5g}") for value in row] for row in self.velocity],
        )


def _degrees(direction: float) -> float:
    return round(math.degrees(direction), 6)


def evenly_spaced(count: int) -> tuple[float, ...]:
    """`count` directions around the circle, rad in (−π, π]: ahead first, then to the left."""
    turns = [index / count for index in range(count)]
    return tuple(2.0 * math.pi * (turn if turn <= 0.5 else turn - 1.0) for turn in turns)


def growing_forces(
    step: float, resolution: float, ceiling: float
) -> Generator[float, bool | None, float]:
    """The forces, N, that one phase and direction is tested with, each as soon as it is told
    whether the last one was survived; returns the largest up to which all were. `step`,
    `resolution` and `ceiling` are N; `ceiling` is tested itself if `step` divides it.
    """
    reached, limit, increment = 0.0, ceiling, step
    # a thousandth of a newton below the limit counts as the limit: steps add up inexactly
    while reached + increment <= limit + 1e-3:
        if (yield reached + increment):
            reached += increment
        else:  # on in fine steps, up to just below the push that it fell from
            limit, increment = reached + increment - resolution, resolution
    return reached


@dataclass(frozen=True)
class PushTrial:
    """A rollout from phase 0 that is pushed after its settling cycles and followed for `cycles`.

    Attributes
    ----------
    noise : rad, standard deviation of the joint angles at the start.
    seed : of them.
    """

    policy: Policy
    mu: Array
    push: Push
    settling_cycles: int
    cycles: float
    noise: float = 0.0
    seed: int = 0

    def settings(self) -> dict[str, Any]:
        """The settings that the rollout starts with."""
        push = self.start()["push"]
        return {
            "mu": self.mu, "start_phase": 0.0, "push": push, "noise": self.noise, "seed": self.seed
        }  # fmt: skip

    def start(self) -> dict[str, Any]:
        """Where it starts, as options of `WalkingEnvironment.reset`."""
        push = self.push
        return {
            "phase": 0.0,
            "noise": self.noise,
            "push": (self.begins, push.force, push.direction),
        }

    @property
    def begins(self) -> float:
        """Phase of the rollout at which the push begins."""
        return self.settling_cycles + self.push.phase

    def planned_cycles(self) -> float:
        """Length of the rollout."""
        return self.begins + self.cycles


_walked: Final[WeakKeyDictionary[WalkingGroup, dict[Any, Any]]] = WeakKeyDictionary()
"""Of groups, by policy, body and start, and then by the phase at which a walk was to be pushed: how
many actions it had taken, and what the next one began with."""

Tests = Generator[PushTrial, bool | None, object]
"""Pushes one after another, each asked for when it is told whether the last one was survived."""


class _Pushed:
    """The eight walkers of a `group` that was made `without_drift`, each with a push of its own.
    Policy, body and start of all are those of the trial `first`.

    Until its push every walk is the same. Where it came to is kept, and the next ones begin there,
    bit for bit as if each had walked from its start.
    """

    def __init__(self, group: WalkingGroup, first: PushTrial) -> None:
        self._group, self._policy = group, first.policy
        group.centre(first.policy.act, first.mu, key=first.policy.key)
        rows, one = group._arrays, group.environments[0]
        self._seen = np.zeros((WIDTH, *one.episode.observation.shape), dtype=np.float32)
        # all that an action begins with, beside what a reset sets
        self._moving: list[NDArray[Any]] = [
            *rows.walkers, *rows.episodes, rows.phase, self._seen,
        ]  # fmt: skip
        begun = first.policy.key, first.mu.tobytes(), first.noise, first.seed
        # what was seen before is not kept
        kept = _walked.setdefault(group, {}).setdefault(begun, {})
        self._kept: dict[float, tuple[int, list[Any]]] | None = (
            kept if one.senses.immediate else None
        )
        self._actions_per_cycle = one.task.reference.stride_time / one.walker.action_seconds
        self._trials, self._actions, self._looking = [first] * WIDTH, 0, False
        # by walker, in actions of the group: when its walk began, and when it has its length
        self._began, self._ends = np.zeros(WIDTH, dtype=int), np.zeros(WIDTH, dtype=int)

    def begin(self, e: int, trial: PushTrial) -> None:
        """Walker `e` is to walk `trial`."""
        self._trials[e], self._began[e] = trial, self._actions
        options = {"mu": trial.mu, **trial.start()}
        self._seen[e] = self._group.reset(e, seed=trial.seed, options=options)
        # who was not pushed before this one's phase was not before a later one's either
        before = [each for each in self._kept or () if each <= trial.begins]
        if before:
            assert self._kept is not None
            done, values = self._kept[max(before)]
            self._began[e] -= done
            for array, value in zip(self._moving, values, strict=True):
                array[e] = value
            self._group.environments[e].walker.phase = float(self._group.phases[e])
        self._looking = self._kept is not None and any(
            each.begins not in self._kept for each in self._trials
        )
        length = round(trial.planned_cycles() * self._actions_per_cycle)
        self._ends[e] = self._began[e] + length

    def rest(self, e: int, *, fell: bool = False) -> None:
        """Walker `e` has nothing more to do: it walks on, from its start again if it fell, or it
        would be simulated lying on the ground.
        """
        if fell:
            self.begin(e, self._trials[e])
        self._ends[e] = np.iinfo(int).max

    def until_one_ends(self) -> tuple[NDArray[np.bool_], NDArray[np.bool_]]:
        """Actions of all, until some fell or were followed long enough: these, and who fell."""
        last = int(self._ends.min())
        while True:
            if self._looking:
                self._keep()
            _, fallen = self._group.step(self._policy.act(self._seen), self._seen)
            self._actions += 1
            if self._actions >= last or np.count_nonzero(fallen):
                fell = fallen & (self._actions <= self._ends)
                return fallen | (self._actions >= self._ends), fell

    def _keep(self) -> None:
        """Remember where those are who are about to be pushed at a phase that is not known yet."""
        assert self._kept is not None
        for e, phase in enumerate(self._group.phases.tolist()):
            begins = self._trials[e].begins
            if begins <= phase and begins not in self._kept:
                done = self._actions - int(self._began[e])
                self._kept[begins] = done, [each[e].copy() for each in self._moving]
        self._looking = any(each.begins not in self._kept for each in self._trials)


def survive_in_turn(
    group: WalkingGroup, tests: Sequence[Tests], spare: Sequence[Tests] = ()
) -> None:
    """Walk the pushes that `tests` ask for, eight at a time, all of one policy, body and start, by
    a `group` made `without_drift`. A walker that fell, or was followed long enough, takes the next
    push, of the test that had the fewest; those of `spare` wait until no other does.
    """
    every = [*tests, *spare]
    waiting = [(n >= len(tests), 0, n) for n in range(len(every))]
    asked: dict[int, PushTrial] = {}

    def following() -> tuple[int, PushTrial] | None:
        while waiting:
            *_, n = heapq.heappop(waiting)
            trial = asked.pop(n, None) or next(every[n], None)
            if trial is not None:
                return n, trial
        return None

    if (first := following()) is None:
        return
    walkers, counts = _Pushed(group, first[1]), [0] * len(every)
    of: list[int | None] = [None] * WIDTH
    for e in range(WIDTH):
        found = first if e == 0 else following()
        of[e], trial = found or (None, first[1])
        walkers.begin(e, trial)
        if found is None:
            walkers.rest(e)
    while any(n is not None for n in of):
        ended, fell = walkers.until_one_ends()
        for e in np.flatnonzero(ended).tolist():
            if (n := of[e]) is not None:
                counts[n] += 1
                with suppress(StopIteration):  # it knows enough
                    asked[n] = every[n].send(not fell[e])
                    heapq.heappush(waiting, (n >= len(tests), counts[n], n))
            if found := following():
                of[e], trial = found
                walkers.begin(e, trial)
            else:
                of[e] = None
                walkers.rest(e, fell=bool(fell[e]))


def survive_together(group: WalkingGroup, tried: Sequence[PushTrial]) -> list[bool]:
    """Whether the walker survives each of the pushes `tried`; `group` and what they have in common
    as for `survive_in_turn`.
    """
    survived = [False] * len(tried)

    def test(n: int) -> Generator[PushTrial, bool | None, None]:
        survived[n] = bool((yield tried[n]))

    survive_in_turn(group, [test(n) for n in range(len(tried))])
    return survived


@dataclass(frozen=True)
class _AtPhase:
    """All pushes at one phase: what `trial` (of any push) says of the walker, and the `settings`
    for its mass.
    """

    trial: PushTrial
    phase: float
    settings: PushSettings


def _survived_at(group: WalkingGroup, at: _AtPhase) -> tuple[list[float], list[bool]]:
    """The largest push survived, N, in each of the directions, and whether each of the required
    ones is.
    """
    settings = at.settings
    directions, required = evenly_spaced(settings.directions), required_directions(settings)
    largest = [0.0] * len(directions)
    known: dict[tuple[float, float], bool] = {}

    def test(direction: float, force: float) -> Generator[PushTrial, bool | None, bool]:
        # Some are both required and on the way to the largest, with directions that differ in their
        # last digit.
        key = round(direction, 12), force
        if key not in known:
            pushed = replace(at.trial, push=Push(at.phase, direction, force))
            known[key] = bool((yield pushed))
        return known[key]

    def search(n: int) -> Generator[PushTrial, bool | None, None]:
        forces = growing_forces(settings.step, settings.resolution, settings.largest)
        survived = None
        while True:
            try:
                force = forces.send(survived)
            except StopIteration as end:
                largest[n] = end.value
                return
            survived = yield from test(directions[n], force)

    survive_in_turn(
        group,
        [search(n) for n in range(len(directions))],
        [test(direction, settings.force) for direction in required],
    )
    return largest, [known[round(each, 12), settings.force] for each in required]


def trace_of(environment: WalkingEnvironment, trial: PushTrial) -> Trace:
    """Velocity of the centre of mass in `trial` from a cycle before the push, in an `environment`
    that is `without_drift`.
    """
    rollout = record_rollout(
        environment, trial.policy, cycles=trial.planned_cycles(), **trial.settings()
    )
    # the phase counts whole cycles since the start, so this is 0 when the push begins
    since = rollout.phase - (trial.settling_cycles + trial.push.phase)
    # a row for each action is enough to draw, and keeps the file small
    every = environment.walker.steps_per_action
    velocity = np.gradient(rollout.centre_of_mass, rollout.time, axis=0)
    shown = np.flatnonzero(since >= -1.0)[::every]
    return Trace(trial.push, since[shown], velocity[shown], bool(rollout.fell[0]))


def trials(task: WalkingTask, policy: Policy, mu: Array, pushes: Sequence[Push]) -> list[PushTrial]:
    """The rollouts that test `pushes` on `policy` with body parameters `mu` (14,) on `task`."""
    settling = task.configuration.validation.settling_cycles
    cycles = task.configuration.pushes.cycles
    return [PushTrial(policy, mu, push, settling, cycles) for push in pushes]


def required_directions(settings: PushSettings) -> tuple[float, ...]:
    """Directions, rad, of the pushes that must be survived by `settings`: evenly from 90° right to
    90° left of straight ahead; a single one is straight ahead.
    """
    count = settings.required_directions
    ends = (-0.5 * math.pi, 0.5 * math.pi) if count > 1 else (0.0, 0.0)
    return tuple(float(each) for each in np.linspace(*ends, count))


def is_required(push: Push) -> bool:
    """Whether a `push` has a direction of those that must be survived: within 90° of ahead."""
    # of evenly spaced directions, the two sideways ones count
    return math.cos(push.direction) > -1e-9


def required_pushes(settings: PushSettings) -> list[Push]:
    """The pushes that must be survived by `settings`, at every phase."""
    return [
        Push(phase, direction, settings.force)
        for phase in settings.phases
        for direction in required_directions(settings)
    ]


def _shown(settings: PushSettings) -> list[Push]:
    """The pushes whose traces are kept: ahead and to the left, at every phase."""
    return [
        Push(phase, direction, settings.force)
        for direction in (0.0, 0.5 * math.pi)
        for phase in settings.phases
    ]


def pushed_walks(task: WalkingTask, policy: Policy, mu: Array) -> list[Rollout]:
    """The first pushes of `_shown` ahead and to the left as they are replayed, by `policy` in
    the `task` with body `mu` (14,): from the start to `REPLAYED` cycles after the push, in the
    compiled engine.
    """
    settings = task.configuration.pushes.of_mass(task.model.mass)
    environment = WalkingEnvironment(without_drift(task))
    some = trials(task, policy, mu, _shown(settings)[:: len(settings.phases)])
    cycles = [each.settling_cycles + each.push.phase + REPLAYED for each in some]
    return [
        record_rollout(environment, policy, cycles=length, **each.settings())
        for each, length in zip(some, cycles, strict=True)
    ]


def without_drift(task: WalkingTask) -> WalkingTask:
    """The `task` in which displacement does not end a rollout, because it is not a fall."""
    return task.with_environment(drift_tolerance=math.inf)


def push_recovery(
    task: WalkingTask,
    policy: Policy,
    mu: Array,
    *,
    on_progress: Callable[[dict[str, float]], None] | None = None,
) -> tuple[PushRecovery, list[Trace]]:
    """Push the walker of `task` and `policy` as the `pushes` of the configuration say.

    Every rollout starts at phase 0, settles for `validation.settling_cycles` and is pushed in the
    next cycle. Worker processes share the rollouts; the result does not depend on their number.

    Parameters
    ----------
    mu : (14,) body parameters.
    on_progress : called with `pushes` (finished phases and directions) and `total`.

    Returns
    -------
    Which pushes the walker survives, and the velocity of the centre of mass from one cycle before a
    push of `pushes.force` to `pushes.cycles` after it, ahead and to the left at each phase.
    """
    configuration = task.configuration
    settings = configuration.pushes.of_mass(task.model.mass)
    directions = evenly_spaced(settings.directions)
    total = len(settings.phases) * len(directions)

    def progress(done: int) -> None:
        if on_progress is not None:
            on_progress({"pushes": done, "total": total})

    workers = configuration.training.workers
    some = trials(task, policy, mu, [Push(0.0, 0.0, 0.0)])[0]
    # shown pushes run in the pool's engine; `each_together` is the compiled one
    with RolloutPool(without_drift(task), workers=workers, engine="dart") as pool:
        at_phases: list[tuple[list[float], list[bool]]] = []
        phases = [_AtPhase(some, phase, settings) for phase in settings.phases]
        for found in pool.each_together(_survived_at, phases):
            at_phases.append(found)
            progress(len(at_phases) * len(directions))
        traces = list(pool.each(trace_of, trials(task, policy, mu, _shown(settings))))
    progress(total)
    fell = {trace.push for trace in traces if trace.fell}
    stood = chain.from_iterable(stood for _, stood in at_phases)
    survived = [
        each and push not in fell
        for push, each in zip(required_pushes(settings), stood, strict=True)
    ]
    recovery = PushRecovery(
        seconds=configuration.environment.push_seconds,
        cycles=settings.cycles,
        resolution=settings.resolution,
        ceiling=settings.largest,
        phases=list(settings.phases),
        directions=[_degrees(each) for each in directions],
        largest=[largest for largest, _ in at_phases],
        force=settings.force,
        criterion_directions=[_degrees(each) for each in required_directions(settings)],
        survived=np.reshape(survived, (len(settings.phases), -1)).tolist(),
    )
    return recovery, traces
