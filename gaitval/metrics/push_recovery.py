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

All pushes are walked in the compiled engine, eight walks side by side. Those that are shown, eight
of those that must be survived, are walked in DART, too: a second-engine check, and a push that is
survived in one engine only counts as a fall. Both engines solve the same equations, DART in nine
times the time. A walker at the edge of falling may fall in one engine and not in the other.
"""

import math
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import asdict, dataclass, replace
from functools import partial
from itertools import chain
from typing import Any, Final
from weakref import WeakKeyDictionary

import numpy as np
from numpy.typing import NDArray

from gaitval.arrays import Array
from gaitval.configuration import PushSettings
from gaitval.journal import Journal
from gaitval.lanes import WIDTH
from gaitval.metrics.walk_results import PushRecovery, PushTrace
from gaitval.policy.environment import WalkingEnvironment
from gaitval.policy.rollouts import RolloutPool, in_groups, record_rollout
from gaitval.policy.settled import settled_walks
from gaitval.policy.storage import Policy
from gaitval.policy.walking_group import WalkingGroup
from gaitval.simulation.rollout import Rollout
from gaitval.simulation.walker import WalkingTask


@dataclass(frozen=True)
class Push:
    """A push: phase of the right gait cycle at which it begins, direction rad from straight
    ahead (left positive), force N.
    """

    phase: float
    direction: float
    force: float


Survived = Callable[[Sequence[Push]], Sequence[bool]]


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


def largest_survived(
    survived: Survived,
    phases: Sequence[float],
    directions: Sequence[float],
    *,
    step: float,
    resolution: float,
    ceiling: float,
    on_progress: Callable[[int], None] | None = None,
) -> Array:
    """The largest force (P, D) N, of `phases` and `directions` (rad), up to which every tested push
    is survived; 0 if none is. `survived` returns for each of several pushes whether it is, and may
    test those of one call in parallel. `step`, `resolution` and `ceiling` are N; `ceiling` is
    tested itself if `step` divides it. `on_progress` gets the number of finished cases.
    """
    cases = [(phase, direction) for phase in phases for direction in directions]
    reached, limits = np.zeros(len(cases)), np.full(len(cases), ceiling)
    increments, left = np.full(len(cases), step), list(range(len(cases)))
    # a thousandth of a newton below the limit counts as the limit: steps add up inexactly
    while left := [n for n in left if reached[n] + increments[n] <= limits[n] + 1e-3]:
        stood = survived([Push(*cases[n], float(reached[n] + increments[n])) for n in left])
        for n, survives in zip(left, stood, strict=True):
            if survives:
                reached[n] += increments[n]
            else:  # on in fine steps, up to just below the push that it fell from
                limits[n] = reached[n] + increments[n] - resolution
                increments[n] = resolution
        if on_progress is not None:
            on_progress(len(cases) - len(left))
    if on_progress is not None:
        on_progress(len(cases))
    return reached.reshape(len(phases), len(directions))


def largest_pushes(
    survived: Survived,
    settings: PushSettings,
    directions: Sequence[float],
    on_progress: Callable[[int], None] | None = None,
) -> Array:
    """`largest_survived` as the `settings` of a person say, in `directions`, rad."""
    return largest_survived(
        survived,
        settings.phases,
        directions,
        step=settings.step,
        resolution=settings.resolution,
        ceiling=settings.largest,
        on_progress=on_progress,
    )


def _once(survived: Survived) -> Survived:
    """`survived`, asked once for every push: some are both required and on the way to the largest,
    with directions that differ in their last digit.
    """
    known: dict[Push, bool] = {}

    def remembered(pushes: Sequence[Push]) -> list[bool]:
        wanted = [replace(push, direction=round(push.direction, 12)) for push in pushes]
        new = [at for at, push in enumerate(wanted) if push not in known]
        stood = survived([pushes[at] for at in new])
        known.update(zip((wanted[at] for at in new), stood, strict=True))
        return [known[push] for push in wanted]

    return remembered


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
            "push": (self.settling_cycles + push.phase, push.force, push.direction),
        }

    def planned_cycles(self) -> float:
        """Length of the rollout."""
        return self.settling_cycles + self.push.phase + self.cycles


_walked: Final[WeakKeyDictionary[WalkingGroup, dict[Any, Any]]] = WeakKeyDictionary()
"""Of groups, by policy, body and start, and then by the phase at which the first of eight walks was
to be pushed: how many actions they had taken, and what the next one began with."""


def survive_together(group: WalkingGroup, tried: Sequence[PushTrial]) -> list[bool]:
    """Whether the walker survives each of at most eight pushes `tried`, of one policy, body and
    start, by a `group` made `without_drift`.

    Until the first push all of them are one walk. It is kept, and the next ones begin where it
    came to, bit for bit as if each had walked from its start.
    """
    walker, policy, mu = group.environments[0].walker, tried[0].policy, tried[0].mu
    options = [{"mu": mu, **tried[min(e, len(tried) - 1)].start()} for e in range(WIDTH)]
    start = tried[0].noise, tried[0].seed
    group.centre(policy.act, mu, key=policy.key)
    seen = np.array([group.reset(e, seed=start[1], options=each) for e, each in enumerate(options)])
    rows, first, done = group._arrays, min(each["push"][0] for each in options), 0
    # all that an action begins with, beside what a reset sets
    moving: list[NDArray[Any]] = [*rows.walkers, *rows.episodes, rows.phase, seen]
    kept = _walked.setdefault(group, {}).setdefault((policy.key, mu.tobytes(), *start), {})
    if not group.environments[0].senses.immediate:
        kept = {}  # what was seen before is not kept
    # who was not pushed before this one's phase was not before a later one's either
    if before := [each for each in kept if each <= first]:
        done, values = kept[max(before)]
        for array, value in zip(moving, values, strict=True):
            array[:] = value
        for environment, phase in zip(group.environments, group.phases.tolist(), strict=True):
            environment.walker.phase = phase
    stride = group.environments[0].task.reference.stride_time
    ends = np.array([round(t.planned_cycles() * stride / walker.action_seconds) for t in tried])
    survived, last = np.ones(len(tried), dtype=bool), ends.max()
    while done < last:
        # eight that were not pushed fall together
        if first not in kept and survived.all() and group.phases.max() >= first:
            kept[first] = done, [each.copy() for each in moving]
        _, fallen = group.step(policy.act(seen), seen)
        if fallen.any():
            survived &= ~fallen[: len(tried)] | (done >= ends)
            last = ends.max(where=survived, initial=0)
            for e in np.flatnonzero(
                fallen
            ).tolist():  # or it would be simulated lying on the ground
                seen[e] = group.reset(e, seed=start[1], options=options[e])
        done += 1
    return [bool(each) for each in survived]


def _stand(pool: RolloutPool, tried: Sequence[PushTrial]) -> Iterator[bool]:
    """`survive_together` of any number of trials."""
    return chain.from_iterable(pool.each_together(survive_together, in_groups(tried)))


def trace_of(environment: WalkingEnvironment, trial: PushTrial) -> Trace:
    """Velocity of the centre of mass in `trial` from a cycle before the push, in an `environment`
    that is `without_drift`.
    """
    begun = trial.policy.key, trial.mu.tobytes(), trial.noise, trial.seed
    rollout = record_rollout(
        environment, trial.policy, cycles=trial.planned_cycles(), **trial.settings(),
        settled=settled_walks(environment, *begun),
    )  # fmt: skip
    # the phase counts whole cycles since the start, so this is 0 when the push begins
    since = rollout.phase - (trial.settling_cycles + trial.push.phase)
    # a row for each action is enough to draw, and keeps the file small
    every = environment.walker.steps_per_action
    velocity = np.gradient(rollout.centre_of_mass, rollout.time, axis=0)
    shown = np.flatnonzero(since >= -1.0)[::every]
    return Trace(trial.push, since[shown], velocity[shown], bool(rollout.fell[0]))


def _trace_values(trace: Trace) -> dict[str, Any]:
    """For a `Journal`, with all digits."""
    numbers = {"cycles": trace.cycles.tolist(), "velocity": trace.velocity.tolist()}
    return {"push": asdict(trace.push), **numbers, "fell": trace.fell}


def _trace_from(values: Mapping[str, Any]) -> Trace:
    cycles, velocity = np.array(values["cycles"]), np.array(values["velocity"])
    return Trace(Push(**values["push"]), cycles, velocity.reshape(-1, 3), values["fell"])


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
    journal: Journal | None = None,
    on_progress: Callable[[dict[str, float]], None] | None = None,
) -> tuple[PushRecovery, list[Trace]]:
    """Push the walker of `task` and `policy` as the `pushes` of the configuration say.

    Every rollout starts at phase 0, settles for `validation.settling_cycles` and is pushed in the
    next cycle. Worker processes share the rollouts; the result does not depend on their number.

    Parameters
    ----------
    mu : (14,) body parameters.
    journal : keeps every push; an interrupted call continues from it, to the same result.
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

    journal = journal or Journal()
    workers = configuration.training.workers
    # shown pushes run in the pool's engine; `_stand` asks for the compiled one
    with RolloutPool(without_drift(task), workers=workers, engine="dart") as pool:

        @_once
        def survived(pushes: Sequence[Push]) -> list[bool]:
            return journal.results(
                partial(_stand, pool), trials(task, policy, mu, pushes), write=bool, read=bool
            )

        required = required_pushes(settings)
        stood = survived(required)
        largest = largest_pushes(survived, settings, directions, progress)
        traces = journal.results(
            partial(pool.each, trace_of),
            trials(task, policy, mu, _shown(settings)),
            write=_trace_values,
            read=_trace_from,
        )
    fell = {trace.push for trace in traces if trace.fell}
    stood = [each and push not in fell for push, each in zip(required, stood, strict=True)]
    recovery = PushRecovery(
        seconds=configuration.environment.push_seconds,
        cycles=settings.cycles,
        resolution=settings.resolution,
        ceiling=settings.largest,
        phases=list(settings.phases),
        directions=[_degrees(each) for each in directions],
        largest=largest.tolist(),
        force=settings.force,
        criterion_directions=[_degrees(each) for each in required_directions(settings)],
        survived=np.reshape(stood, (len(settings.phases), -1)).tolist(),
    )
    return recovery, traces
