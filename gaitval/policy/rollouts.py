"""Rollouts of a deterministic policy, without pushes unless asked for, recorded or only scored.

Many walks are simulated eight side by side (`record_together`, `travel` for long ones), in the
compiled engine. The policy then acts on eight observations in one matrix product, whose rounding
differs from that of a single observation: a walk of eight agrees with a single walker's to
rounding, and in a long walk rounding errors grow. A walk depends neither on the other seven nor on
their number, because the policy always acts on eight.
"""

import itertools
from collections.abc import Callable, Iterator, Sequence
from contextlib import ExitStack
from copy import copy
from typing import Any, Final, NamedTuple, TypeVar

import numpy as np
from numpy.typing import NDArray
from threadpoolctl import threadpool_limits  # type: ignore[import-untyped]

from gaitval._internal.numba.lanes import WIDTH
from gaitval.arrays import Array
from gaitval.model.tree import centres_of_mass
from gaitval.policy.environment import WalkingEnvironment
from gaitval.policy.processes import kept_workers
from gaitval.policy.storage import Policy
from gaitval.policy.walking_group import WalkingGroup
from gaitval.walk.simulation.rollout import Rollout
from gaitval.walk.simulation.walker import Engine, Steps, Trajectory, Walker, WalkingTask

_Item = TypeVar("_Item")
_Result = TypeVar("_Result")


def in_groups(items: Sequence[_Item], at_least: int = 1) -> list[Sequence[_Item]]:
    """`items` in order, in as few groups of at most eight as hold them, but `at_least` so many."""
    # Minus the floor of minus the quotient is the quotient rounded up.
    count = max(-(-len(items) // WIDTH), min(at_least, len(items)))
    ends = [len(items) * number // count for number in range(1, count + 1)]
    return [items[first:end] for first, end in itertools.pairwise([0, *ends])]


def _actions_together(
    group: WalkingGroup, policy: Policy, mu: Array, starts: Sequence[dict[str, Any]]
) -> Iterator[NDArray[np.bool_]]:
    """Walks side by side, without end: after each action, who fell in it (walks,).

    A start may have a `seed` beside the options of `WalkingEnvironment.reset`. A walker that fell
    starts again, or its body would be simulated lying on the ground; so do the surplus walkers of a
    group that is larger than the number of walks, from the last start.
    """
    lanes = len(group.environments)
    if lanes != WIDTH:
        raise ValueError(f"a group of {lanes} would act with other rounding than one of {WIDTH}")
    group.centre(policy.act, mu, key=policy.key)
    options = [
        {"mu": mu, "push": None, "noise": 0.0, "seed": 0, **starts[min(e, len(starts) - 1)]}
        for e in range(lanes)
    ]
    seeds = [each.pop("seed") for each in options]
    seen = np.array([group.reset(e, seed=seeds[e], options=each) for e, each in enumerate(options)])
    while True:
        _, fallen = group.step(policy.act(seen), seen)
        yield fallen[: len(starts)]
        if np.count_nonzero(fallen):
            for e in np.flatnonzero(fallen).tolist():
                seen[e] = group.reset(e, seed=seeds[e], options=options[e])


def _longest(environment: WalkingEnvironment, cycles: float) -> int:
    """Actions that so many gait cycles take at the slowest pace."""
    longest = cycles * environment.task.reference.stride_time / environment.constants.slowest_pace
    return int(np.ceil(longest / environment.walker.action_seconds))


def walks_together(
    group: WalkingGroup, policy: Policy, mu: Array, starts: Sequence[dict[str, Any]], cycles: float
) -> Iterator[tuple[NDArray[np.bool_], NDArray[np.bool_]]]:
    """Walks side by side, in a `group` of eight environments with a `policy` without noise and a
    body `mu` (14,), each from its own of `starts`, options of `WalkingEnvironment.reset`, until it
    has its gait `cycles` or fell: after each action, who still walked in it, and who fell (walks,).
    """
    ends = np.array([start["phase"] for start in starts]) + cycles
    longest = np.array([_longest(each, cycles) for each in group.environments[: len(ends)]])
    phases, soonest = group.phases[: len(ends)], int(longest.min())
    walking, actions = np.ones(len(ends), dtype=bool), 0
    for fallen in _actions_together(group, policy, mu, starts):
        # The action in which a walk ends is still its own.
        yield walking, fallen
        actions += 1
        over = fallen | (phases >= ends)
        if actions < soonest and not np.count_nonzero(over):
            continue  # as nearly always
        walking = walking & ~over & (actions < longest)
        ends[~walking] = np.inf  # which counts once
        if not walking.any():
            break


def record_together(
    group: WalkingGroup,
    policy: Policy,
    *,
    mu: Array,
    start_phases: Sequence[float],
    cycles: float,
    noise: float = 0.0,
    seeds: Sequence[int] | None = None,
    pushes: Sequence[tuple[float, float, float] | None] | None = None,
) -> Iterator[Rollout]:
    """`record_rollout` of at most eight walks, side by side, in a `group` of eight environments,
    which may have different references. They are simulated when the first one is asked for.

    `policy`, without noise, `mu` (14,) and the planned number of gait `cycles` are of all.
    `start_phases` are of each walk; the first one is that of the first environment. `noise` is the
    standard deviation of the joint angles at the start, rad, with `seeds` of each; all 0 if not
    given. `pushes` of each, see `WalkingEnvironment`; none if not given.
    """
    walks = len(start_phases)
    starts = [
        {"phase": phase, "noise": noise, "seed": seed, "push": push}
        for phase, seed, push in zip(
            start_phases, seeds or [0] * walks, pushes or [None] * walks, strict=True
        )
    ]
    actions = max(_longest(each, cycles) for each in group.environments[:walks])
    recording = Trajectory(actions * group.environments[0].walker.steps_per_action, WIDTH)
    rows, fell = np.zeros(walks, dtype=int), np.zeros(walks, dtype=bool)
    for walking, fallen in walks_together(group, policy, mu, starts, cycles):
        recording.append(group.beside.account, group.beside.arrays.root_force)
        rows[walking] = recording.rows
        if np.count_nonzero(fallen):
            fell |= walking & fallen
    for e, start_phase in enumerate(start_phases):
        steps = recording.steps_of(e, int(rows[e]))
        yield rollout_of(steps, group.environments[e].walker, start_phase, bool(fell[e]))


def times_of(walker: Walker, steps: int) -> Array:
    """(T,) s after each of the `steps` physics steps of `walker`."""
    return np.asarray(walker.physics_step * np.arange(1.0, steps + 1.0))


def centre_of_mass_of(steps: Steps, walker: Walker) -> Array:
    """(T, 3) m, centre of mass of the whole body of `walker` in its `steps`."""
    return np.asarray(centres_of_mass(walker.tree, steps.positions), dtype=float)


def _centre_of_pressure(feet: Array) -> tuple[Array, Array]:
    """(T, 2, 3) m on the ground from forces and moments (T, 2, 6), and the free moment (T, 2) Nm;
    NaN and 0 without load.
    """
    vertical = feet[..., 2]
    loaded = np.where(vertical > 1.0, vertical, np.nan)
    # Moment about the origin of a force at (x, y, 0): Mx = y Fz and My = -x Fz; the free moment is
    # about z alone. Below 1 N the quotient is noise.
    x, y = -feet[..., 4] / loaded, feet[..., 3] / loaded
    free = feet[..., 5] - (x * feet[..., 1] - y * feet[..., 0])
    return np.stack([x, y, 0.0 * loaded], axis=-1), np.nan_to_num(free)


def record_rollout(
    environment: WalkingEnvironment,
    policy: Policy,
    *,
    mu: Array,
    start_phase: float,
    cycles: float,
    push: tuple[float, float, float] | None = None,
    noise: float = 0.0,
    seed: int = 0,
) -> Rollout:
    """Simulate a rollout of the deterministic `policy`, a body `mu` (14,), in the engine of
    `environment`, from `start_phase` of the right gait cycle over the planned gait `cycles`, and
    keep everything. `push`: see `WalkingEnvironment`; none by default. `noise` is the standard
    deviation of the joint angles at the start, rad, with its `seed`.
    """
    walker = environment.walker
    options = {"phase": start_phase, "mu": mu, "push": push, "noise": noise}
    environment.centre(policy.act, mu, key=policy.key)
    observation, _ = environment.reset(seed=seed, options=options)
    actions = _longest(environment, cycles)
    recording = Trajectory(actions * walker.steps_per_action)
    fell = False
    for _ in range(actions):
        observation, _, fell, _, _ = environment.step(policy.act(observation), recording)
        if fell or walker.phase >= start_phase + cycles:
            break
    return rollout_of(recording.steps(), walker, start_phase, fell)


def rollout_of(steps: Steps, walker: Walker, start_phase: float, fell: bool) -> Rollout:
    """What was recorded of a walker: the states that a step follows, with what acts in it."""
    centre, free = _centre_of_pressure(steps.feet[1:])
    return Rollout(
        time=times_of(walker, len(steps.phase) - 1),
        phase=steps.phase[:-1],
        positions=steps.positions[:-1],
        velocities=0.5 * (steps.velocities[:-1] + steps.velocities[1:]),
        moments=steps.moments[1:],
        ground_reaction=steps.feet[1:, :, :3],
        centre_of_pressure=centre,
        free_moment=free,
        centre_of_mass=centre_of_mass_of(steps, walker)[:-1],
        root_force=steps.root_force[1:],
        mu=walker.mu,
        start_phase=np.array([start_phase]),
        fell=np.array([float(fell)]),
        hip_centre=walker.task.reference.hip_centre,
    )


class _Environments(dict[Engine | None, Any]):
    """A task's environments, one an engine, and a group of them (None), built when asked for."""

    def __init__(self, task: WalkingTask) -> None:
        self._task = task

    def __missing__(self, engine: Engine | None) -> Any:
        if engine is None:
            self[engine] = WalkingGroup([self._task] * WIDTH)
        else:
            self[engine] = WalkingEnvironment(self._task, engine=engine)
        return self[engine]


_environments: tuple[int, _Environments] | None = None
"""Of a worker process: the number of the pool that it works for, and the environments of its task.
"""
_pools: Final = itertools.count()


class _Given(NamedTuple):
    """The number and the task of a pool, for a worker that may not know them yet."""

    pool: int
    task: WalkingTask

    def environments(self) -> _Environments:
        """In the worker."""
        global _environments
        if _environments is None or _environments[0] != self.pool:
            _environments = self.pool, _Environments(self.task)
        return _environments[1]


def _call(work: tuple[_Given, Callable[[Any, Any], Any], Engine | None, Any]) -> Any:
    given, function, engine, item = work
    # Any worker may take any item, so each item brings its task; a worker builds the task's
    # environments once.
    return function(given.environments()[engine], item)


class RolloutPool:
    """Worker processes with their own environments; use as a context manager.

    One worker is this process itself, whose linear algebra meanwhile has one thread, as that of the
    others: with several, sums round otherwise. Others are started, which takes seconds, unless some
    are kept (`processes.keeping_workers`).

    Parameters
    ----------
    task : of all environments.
    workers : number of processes; with 1 everything runs in this one.
    engine : physics engine of the environments, where a call does not name one.
    """

    def __init__(self, task: WalkingTask, *, workers: int, engine: Engine = "compiled") -> None:
        self.workers = workers
        self._engine = engine
        self._alone = _Environments(task) if workers == 1 else None
        kept = kept_workers() if workers > 1 else None
        self._own = None
        if workers > 1 and kept is None:
            from gaitval.policy.workers import new_workers

            self._own = new_workers(workers)
        self._executor = kept or self._own
        self._given = _Given(next(_pools), task)
        self._limits = ExitStack()

    def __enter__(self) -> "RolloutPool":
        if self._alone is not None:
            self._limits.enter_context(threadpool_limits(1, "blas"))
        return self

    def __exit__(self, *_: object) -> None:
        self._limits.close()
        if self._own is not None:
            self._own.shutdown(cancel_futures=True)

    def with_task(self, task: WalkingTask) -> "RolloutPool":
        """The same processes with another task, while this pool is open."""
        other = copy(self)
        other._alone = None if self._alone is None else _Environments(task)
        # Without processes of its own, the copy cannot end those that it shares.
        other._own, other._given = None, _Given(next(_pools), task)
        return other

    def each(
        self,
        function: Callable[[WalkingEnvironment, _Item], _Result],
        items: Sequence[_Item],
        *,
        engine: Engine | None = None,
    ) -> Iterator[_Result]:
        """`function(environment, item)`, a module's function, of all `items`, in their order, each
        result as soon as it and those before it are there; `engine` is another one than the pool's.
        Worker processes start at once, and finish what earlier calls gave them first.
        """
        return self._results(function, engine or self._engine, items)

    def each_together(
        self, function: Callable[[WalkingGroup, _Item], _Result], items: Sequence[_Item]
    ) -> Iterator[_Result]:
        """As `each`, with eight environments that act at the same time: `function` is of a
        `WalkingGroup` and one of `items`.
        """
        return self._results(function, None, items)

    def _results(
        self,
        function: Callable[[Any, _Item], _Result],
        engine: Engine | None,
        items: Sequence[_Item],
    ) -> Iterator[_Result]:
        if self._executor is not None:
            work = [(self._given, function, engine, item) for item in items]
            return self._executor.map(_call, work)
        alone = self._alone
        assert alone is not None
        # A generator: each walk is simulated when its result is asked for, as with workers the
        # results come one by one.
        return (function(alone[engine], item) for item in items)
