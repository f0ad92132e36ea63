"""Rollouts of many walking environments in a few processes, one message per rollout.

Each worker process runs its share of the environments with the policy that it is sent: an action
needs no message, so the processes never wait for each other within a rollout. The results are in
shared memory. An environment gives the same result in any process.
"""

import contextlib
import ctypes
import math
import traceback
from collections.abc import Sequence
from multiprocessing.connection import Connection
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from gaitval._internal.numba.lanes import WIDTH
from gaitval.configuration import EnvironmentSettings
from gaitval.policy.environment import action_size
from gaitval.policy.reward import REWARD_TERMS
from gaitval.policy.senses import observation_size
from gaitval.policy.storage import Policy
from gaitval.policy.walking_group import WalkingGroup
from gaitval.policy.workers import begin_as_worker, fresh_processes, ready_to_start
from gaitval.walk.simulation.walker import WalkingTask

_Shapes = dict[str, tuple[tuple[int, ...], type]]
_Memory = ctypes.Array[ctypes.c_byte]
"""Shared memory of `multiprocessing`. It has no name in the file system, so that it is gone when
the last process that uses it ends, even if that is killed."""


class RolloutBuffer(NamedTuple):
    """What E environments did in T actions.

    Attributes
    ----------
    observations : (T + 1, E, size) before each action, and after the last one.
    actions : (T, E, A) the policy's actions plus noise.
    rewards : (T, E).
    fell, ended : (T, E) the episode ended in a fall; it ended in a fall or reached its full length.
    final_observations : (T, E, size) last observation of each episode, where it ended.
    cycles : (T, E) gait cycles of the episode so far.
    terms : (T, E, 10) reward terms.
    """

    observations: NDArray[np.float32]
    actions: NDArray[np.float32]
    rewards: NDArray[np.float32]
    fell: NDArray[np.bool_]
    ended: NDArray[np.bool_]
    final_observations: NDArray[np.float32]
    cycles: NDArray[np.float32]
    terms: NDArray[np.float32]


def _shapes(steps: int, count: int, constants: EnvironmentSettings) -> _Shapes:
    """Shapes and types of a `RolloutBuffer`."""
    size = observation_size(constants)
    return {
        "observations": ((steps + 1, count, size), np.float32),
        "actions": ((steps, count, action_size(constants)), np.float32),
        "rewards": ((steps, count), np.float32),
        "fell": ((steps, count), np.bool_),
        "ended": ((steps, count), np.bool_),
        "final_observations": ((steps, count, size), np.float32),
        "cycles": ((steps, count), np.float32),
        "terms": ((steps, count, len(REWARD_TERMS)), np.float32),
    }


def _bytes(shapes: _Shapes) -> int:
    # Four bytes also for a truth value, so that every array starts at a multiple of four.
    return sum(4 * math.prod(shape) for shape, _ in shapes.values())


def _views(memory: _Memory, shapes: _Shapes) -> RolloutBuffer:
    """The arrays in shared memory, four bytes for every number."""
    arrays, offset = {}, 0
    numbers = np.frombuffer(memoryview(memory), np.uint8)
    for name, (shape, kind) in shapes.items():
        arrays[name] = np.ndarray(shape, kind, buffer=numbers, offset=offset)
        offset += 4 * math.prod(shape)
    return RolloutBuffer(**arrays)


def _walk(
    group: WalkingGroup,
    observations: NDArray[np.float32],
    policy: Policy,
    experience: RolloutBuffer,
    first: int,
) -> None:
    """Run a group's environments, from number `first` on, through a rollout; before the call
    `actions` contains the noise. `observations` (environments, size) are those of now, in and out.
    """
    numbers = slice(first, first + len(group.environments))
    padded = np.zeros((WIDTH, observations.shape[1]), dtype=np.float32)
    for t, actions in enumerate(experience.actions[:, numbers]):
        experience.observations[t, numbers] = observations
        # The product's rounding depends on the number of rows, so that is always the same.
        padded[: len(observations)] = observations
        # In place: `actions` is a view of the shared array, which holds the noise before.
        actions += policy.act(padded)[: len(observations)]
        rewards, fell = group.step(actions, observations)
        ended = fell | [environment.counted() for environment in group.environments]
        experience.rewards[t, numbers] = rewards
        experience.fell[t, numbers] = fell
        experience.ended[t, numbers] = ended
        experience.terms[t, numbers] = group.terms
        for e, environment in enumerate(group.environments):
            experience.cycles[t, first + e] = environment.walker.phase - environment.start_phase
        for e in np.flatnonzero(ended).tolist():
            # The reset overwrites the observation, but the learner needs it for the value of an
            # episode that was cut off.
            experience.final_observations[t, first + e] = observations[e]
            observations[e] = group.reset(e)
    experience.observations[-1, numbers] = observations


def _work(
    tasks: Sequence[WalkingTask], share: range, shapes: _Shapes, memory: _Memory, pipe: Connection
) -> None:
    """Body of a worker process; obeys ("curriculum", two numbers), ("begin", seed), ("walk",
    tensors).

    Answers None when done, or the traceback of an error.
    """
    begin_as_worker()
    experience = _views(memory, shapes)
    try:
        size = experience.observations.shape[2]
        groups = {
            first: WalkingGroup(
                [tasks[i % len(tasks)] for i in range(first, min(first + WIDTH, share.stop))]
            )
            for first in range(share.start, share.stop, WIDTH)
        }
        observations = {
            first: np.zeros((len(group.environments), size), dtype=np.float32)
            for first, group in groups.items()
        }
        pipe.send(None)
        while True:
            message, value = pipe.recv()
            for first, group in groups.items():
                if message == "curriculum":
                    for environment in group.environments:
                        environment.difficulty, environment.tolerance_share = value
                elif message == "begin":
                    for e in range(len(group.environments)):
                        # The seed follows from the environment's number, not from the worker: the
                        # number of workers makes no difference.
                        observations[first][e] = group.reset(e, seed=value + first + e)
                elif message == "walk":
                    _walk(group, observations[first], Policy(value, {}), experience, first)
            pipe.send(None)
    except (EOFError, ConnectionError, KeyboardInterrupt):
        pass  # the trainer closed its end or was interrupted, which it reports itself
    except Exception:
        pipe.send(traceback.format_exc())


class WalkingWorkers:
    """Walking environments over several processes; use as a context manager.

    Environment i uses `tasks[i % len(tasks)]`; the tasks differ only in body and reference.

    Parameters
    ----------
    tasks : of the environments, in turn.
    count : number of environments.
    workers : number of processes, at most one per eight environments.
    steps : actions of a rollout.
    """

    def __init__(
        self, tasks: Sequence[WalkingTask], *, count: int, workers: int, steps: int
    ) -> None:
        shapes = _shapes(steps, count, tasks[0].configuration.environment)
        context = ready_to_start()
        # Without a lock: each worker writes its own environments' columns, and nobody reads before
        # all have answered.
        memory: _Memory = context.RawArray(ctypes.c_byte, _bytes(shapes))
        self._experience = _views(memory, shapes)
        self._pipes: list[Connection] = []
        self._processes = []
        # Whole groups of eight for each worker: a group that is not full computes all eight lanes
        # anyway.
        groups = range(0, count, WIDTH)
        for share in np.array_split(groups, min(workers, len(groups))):
            ours, theirs = context.Pipe()
            mine = range(int(share[0]), min(int(share[-1]) + WIDTH, count))
            arguments = (tasks, mine, shapes, memory, theirs)
            process = context.Process(target=_work, args=arguments, daemon=True)
            with fresh_processes():
                process.start()
            # This process's copy of the worker's end: while it is open, the death of the worker is
            # not noticed.
            theirs.close()
            self._pipes.append(ours)
            self._processes.append(process)
        try:
            self._all_done()
        except BaseException:
            self.close()
            raise

    def __enter__(self) -> "WalkingWorkers":
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def _tell(self, message: str, value: Any) -> None:
        for pipe in self._pipes:
            with contextlib.suppress(BrokenPipeError):  # `_all_done` says that the worker ended
                pipe.send((message, value))
        self._all_done()

    def _all_done(self) -> None:
        for pipe in self._pipes:
            try:
                problem = pipe.recv()
            except (EOFError, ConnectionResetError):
                problem = "it was killed, perhaps because the machine ran out of memory."
            if problem is not None:
                raise RuntimeError(f"A worker process of the walking environments ended: {problem}")

    def set_curriculum(self, difficulty: float, tolerance_share: float) -> None:
        """Set `difficulty` and `tolerance_share` of every `WalkingEnvironment`."""
        self._tell("curriculum", (difficulty, tolerance_share))

    def begin(self, seed: int) -> None:
        """Start an episode in every environment; environment i is seeded with `seed` + i."""
        self._tell("begin", seed)

    def walk(self, tensors: dict[str, NDArray[Any]], noise: NDArray[np.float32]) -> RolloutBuffer:
        """Continue the walks with a policy of these `tensors`, to whose actions `noise` (T, E, A)
        is added. Returns views of shared memory, which the next call overwrites.
        """
        self._experience.actions[:] = noise
        self._tell("walk", tensors)
        return self._experience

    def close(self) -> None:
        """End the workers."""
        for pipe in self._pipes:
            pipe.close()
        for process in self._processes:
            process.join(timeout=20)  # it may be in the middle of a rollout
            if process.is_alive():
                process.kill()
                process.join()
