"""Rollouts of a deterministic policy, without pushes unless asked for, recorded or only scored."""

import multiprocessing as mp
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass
from typing import Any, TypeVar

import numpy as np
from numpy.typing import NDArray

from gaitval.arrays import Array
from gaitval.lanes import WIDTH
from gaitval.model.tree import centres_of_mass
from gaitval.policy.environment import WalkingEnvironment
from gaitval.policy.parent import end_with_parent
from gaitval.policy.storage import Policy
from gaitval.policy.walking_group import WalkingGroup
from gaitval.simulation.rollout import Rollout
from gaitval.simulation.walker import Engine, Trajectory, WalkingTask

Item = TypeVar("Item")
Result = TypeVar("Result")


@dataclass(frozen=True)
class Score:
    """Score of a rollout.

    Attributes
    ----------
    reward : mean reward of a planned step; steps after a fall count as zero.
    cycles : gait cycles walked.
    fell : the rollout ended early.
    """

    reward: float
    cycles: float
    fell: bool


def score_rollout(
    environment: WalkingEnvironment,
    policy: Policy,
    *,
    mu: Array,
    start_phase: float,
    seconds: float,
    push: tuple[float, float, float] | None = None,
) -> Score:
    """Simulate `seconds` of walking without keeping the trajectory.

    Parameters
    ----------
    mu : (14,) body parameters.
    push : see `WalkingEnvironment`.
    """
    options = {"phase": start_phase, "mu": mu, "push": push, "noise": 0.0}
    environment.centre(policy.act, mu, key=policy.key)
    observation, _ = environment.reset(seed=0, options=options)
    planned = round(seconds / environment.walker.action_seconds)
    total, fell, info = 0.0, False, {"cycles": 0.0}
    for _ in range(planned):
        observation, reward, fell, _, info = environment.step(policy.act(observation))
        if fell:
            break
        total += reward
    return Score(total / planned, float(info["cycles"]), fell)


def fell_together(
    group: WalkingGroup,
    policy: Policy,
    *,
    mu: Array,
    starts: Sequence[dict[str, Any]],
    seconds: Sequence[float],
) -> NDArray[np.bool_]:
    """Whether each of at most eight walks, which are simulated side by side, ends in a fall.

    Parameters
    ----------
    mu : (14,) body parameters of all.
    starts : options of `WalkingEnvironment.reset` of each.
    seconds : how long each one is followed.

    Returns
    -------
    (walks,). The policy's actions are rounded otherwise than those of a single walker.
    """
    first = group.environments[0]
    first.centre(policy.act, mu, key=policy.key)
    count = len(starts)
    options = [
        {"mu": mu, "noise": 0.0, **starts[min(e, count - 1)]}
        for e in range(len(group.environments))
    ]
    seen = np.array([group.reset(e, seed=0, options=each) for e, each in enumerate(options)])
    left = np.zeros(len(options), dtype=int)
    left[:count] = [round(each / first.walker.action_seconds) for each in seconds]
    fell = np.zeros(len(options), dtype=bool)
    while left.any():
        actions = policy.act(seen) - first.habit_at(group.phases)
        _, fallen, _ = group.step(actions.astype(np.float32), seen)
        fell |= fallen & (left > 0)
        left = np.where(fallen, 0, np.maximum(left - 1, 0))
        for e in np.flatnonzero(fallen).tolist():  # it would roll on for ever
            seen[e] = group.reset(e, seed=0, options=options[e])
    return fell[:count]


def _centre_of_pressure(feet: Array) -> Array:
    """(T, 2, 3) m on the ground from forces and moments (T, 2, 6); NaN without load."""
    vertical = feet[..., 2]
    loaded = np.where(vertical > 1.0, vertical, np.nan)
    return np.stack([-feet[..., 4] / loaded, feet[..., 3] / loaded, 0.0 * loaded], axis=-1)


def record_rollout(
    environment: WalkingEnvironment,
    policy: Policy,
    *,
    mu: Array,
    start_phase: float,
    cycles: float,
    push: tuple[float, float, float] | None = None,
) -> Rollout:
    """Simulate a rollout of the deterministic policy and keep everything.

    Parameters
    ----------
    mu : (14,) body parameters.
    start_phase : phase of the right gait cycle at the start.
    cycles : planned length in gait cycles.
    push : see `WalkingEnvironment`; none by default.
    """
    walker = environment.walker
    options = {"phase": start_phase, "mu": mu, "push": push, "noise": 0.0}
    environment.centre(policy.act, mu, key=policy.key)
    observation, _ = environment.reset(seed=0, options=options)
    constants = environment.constants
    longest = cycles * environment.task.reference.stride_time / constants.slowest_pace
    actions = int(np.ceil(longest / walker.action_seconds))
    recording = Trajectory(actions * walker.steps_per_action)
    fell = False
    for _ in range(actions):
        observation, _, fell, _, _ = environment.step(policy.act(observation), recording)
        if fell or walker.phase >= start_phase + cycles:
            break
    rows = slice(0, recording.rows)
    positions, tree = recording.positions[rows], walker.tree
    return Rollout(
        time=walker.physics_step * np.arange(1.0, recording.rows + 1.0),
        phase=recording.phase[rows],
        positions=positions,
        velocities=recording.velocities[rows],
        moments=recording.moments[rows],
        ground_reaction=recording.feet[rows, :, :3],
        centre_of_pressure=_centre_of_pressure(recording.feet[rows]),
        centre_of_mass=centres_of_mass(
            tree.joint_position, tree.mass, tree.centre_of_mass, positions
        ),
        root_force=recording.root_force[rows],
        mu=np.asarray(mu, dtype=float),
        start_phase=np.array([start_phase]),
        fell=np.array([float(fell)]),
    )


def roll_out(
    task: WalkingTask,
    policy: Policy,
    *,
    mu: Array,
    start_phase: float,
    cycles: float,
    push: tuple[float, float, float] | None = None,
    engine: Engine = "dart",
) -> Rollout:
    """`record_rollout` in a new environment, with the engine that is used for results."""
    return record_rollout(
        WalkingEnvironment(task, engine=engine),
        policy,
        mu=mu,
        start_phase=start_phase,
        cycles=cycles,
        push=push,
    )


class _Environments:
    """A task's environments, one an engine, and a group of them: they are slow to build."""

    def __init__(self, task: WalkingTask) -> None:
        self._task = task
        self._built: dict[Engine, WalkingEnvironment] = {}
        self._group: WalkingGroup | None = None

    def group(self) -> WalkingGroup:
        if self._group is None:
            self._group = WalkingGroup([self._task] * WIDTH)
        return self._group

    def of(self, engine: Engine) -> WalkingEnvironment:
        if engine not in self._built:
            self._built[engine] = WalkingEnvironment(self._task, engine=engine)
        return self._built[engine]


_environments: _Environments | None = None


def _begin(task: WalkingTask) -> None:
    global _environments  # of a worker process
    end_with_parent()
    _environments = _Environments(task)


def _call(arguments: tuple[Callable[[WalkingEnvironment, Any], Any], Engine, Any]) -> Any:
    function, engine, item = arguments
    assert _environments is not None
    return function(_environments.of(engine), item)


def _call_together(arguments: tuple[Callable[[WalkingGroup, Any], Any], Any]) -> Any:
    function, item = arguments
    assert _environments is not None
    return function(_environments.group(), item)


class RolloutPool:
    """Worker processes with their own environments; use as a context manager.

    One worker is this process itself: to start another takes seconds.

    Parameters
    ----------
    engine : physics engine of the environments, where a call does not name one.
    """

    def __init__(self, task: WalkingTask, *, workers: int, engine: Engine = "compiled") -> None:
        self._engine = engine
        self._alone = _Environments(task) if workers == 1 else None
        self._executor = None if workers == 1 else _workers(task, workers)

    def __enter__(self) -> "RolloutPool":
        return self

    def __exit__(self, *_: object) -> None:
        if self._executor is not None:
            self._executor.shutdown(cancel_futures=True)

    def map(
        self, function: Callable[[WalkingEnvironment, Item], Result], items: Sequence[Item]
    ) -> list[Result]:
        """`function(environment, item)` of every item, in order; must be a module's function."""
        return list(self.each(function, items))

    def each(
        self,
        function: Callable[[WalkingEnvironment, Item], Result],
        items: Sequence[Item],
        *,
        engine: Engine | None = None,
    ) -> Iterator[Result]:
        """As `map`, each result as soon as it and those before it are there. Worker processes begin
        at once, and finish what earlier calls gave them first.

        Parameters
        ----------
        engine : another one than the pool's.
        """
        engine = engine or self._engine
        if self._executor is not None:
            return self._executor.map(_call, [(function, engine, item) for item in items])
        alone = self._alone
        assert alone is not None
        return (function(alone.of(engine), item) for item in items)

    def each_together(
        self, function: Callable[[WalkingGroup, Item], Result], items: Sequence[Item]
    ) -> Iterator[Result]:
        """As `each`, with eight environments that act at the same time."""
        if self._executor is not None:
            return self._executor.map(_call_together, [(function, item) for item in items])
        alone = self._alone
        assert alone is not None
        return (function(alone.group(), item) for item in items)


def _workers(task: WalkingTask, count: int) -> ProcessPoolExecutor:
    return ProcessPoolExecutor(
        count,
        mp_context=mp.get_context("spawn"),
        initializer=_begin,
        initargs=(task,),
    )
