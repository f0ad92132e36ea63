"""Many walking environments in a few processes, one message a step.

A gait step costs about half a millisecond, so a message per environment would cost as much as
the physics. Each worker process steps its share of the environments; actions, observations and
results lie in shared memory.
"""

import contextlib
import multiprocessing as mp
import os
import traceback
from collections.abc import Sequence
from multiprocessing.connection import Connection
from multiprocessing.shared_memory import SharedMemory
from typing import Any

import numpy as np
from numpy.typing import NDArray
from stable_baselines3.common.vec_env import VecEnv
from stable_baselines3.common.vec_env.base_vec_env import VecEnvObs, VecEnvStepReturn

from gaitval.policy.environment import OBSERVATION_SIZES, REWARD_TERMS, WalkingEnvironment
from gaitval.simulation.walker import WalkingTask

Layout = dict[str, tuple[tuple[int, ...], str]]


def _layout(count: int, observation_size: int) -> Layout:
    return {
        "action": ((count, 25), "f4"),
        "observation": ((count, observation_size), "f4"),
        "final_observation": ((count, observation_size), "f4"),
        "reward": ((count,), "f4"),
        "fell": ((count,), "i1"),
        "ended": ((count,), "i1"),
        "cycles": ((count,), "f8"),
        "terms": ((count, len(REWARD_TERMS)), "f8"),
    }


def _size(layout: Layout) -> int:
    return sum(int(np.prod(shape)) * 8 for shape, _ in layout.values())


def _views(memory: SharedMemory, layout: Layout) -> dict[str, NDArray[Any]]:
    views, offset = {}, 0
    for name, (shape, kind) in layout.items():
        views[name] = np.ndarray(shape, kind, buffer=memory.buf, offset=offset)
        offset += int(np.prod(shape)) * 8
    return views


def _work(
    task: WalkingTask,
    share: range,
    layout: Layout,
    memory_name: str,
    pipe: Connection,
) -> None:
    """Body of a worker process; obeys ("seed", s), ("reset",), ("step",), ("difficulty", d).

    Answers None, or the traceback of what went wrong.
    """
    memory = SharedMemory(memory_name)
    views = _views(memory, layout)
    try:
        environments = {i: WalkingEnvironment(task) for i in share}
        seeds: dict[int, int | None] = dict.fromkeys(share)
        pipe.send(None)
        while True:
            message, value = pipe.recv()
            if message == "step":
                for i, environment in environments.items():
                    observation, reward, fell, over, info = environment.step(views["action"][i])
                    views["reward"][i] = reward
                    views["fell"][i] = fell
                    views["ended"][i] = fell or over
                    views["cycles"][i] = info["cycles"]
                    views["terms"][i] = info["reward_terms"]
                    if fell or over:
                        views["final_observation"][i] = observation
                        observation, _ = environment.reset()
                    views["observation"][i] = observation
            elif message == "reset":
                for i, environment in environments.items():
                    views["observation"][i], _ = environment.reset(seed=seeds[i])
                    seeds[i] = None
            elif message == "seed":
                seeds = {i: value + i for i in share}
            elif message == "difficulty":
                for environment in environments.values():
                    environment.difficulty = value
            pipe.send(None)
    except (EOFError, BrokenPipeError, KeyboardInterrupt):
        pass  # the trainer has closed its end or was interrupted, which it reports itself
    except Exception:
        pipe.send(traceback.format_exc())
    finally:
        del views
        memory.close()


class WalkingVecEnv(VecEnv):
    """`count` walking environments over `workers` processes, for stable-baselines3.

    `terms` (count, 8) holds the reward terms of the last step and `cycles` (count,) the gait
    cycles walked so far in each episode.
    """

    def __init__(self, task: WalkingTask, *, count: int, workers: int) -> None:
        single = WalkingEnvironment(task)
        super().__init__(count, single.observation_space, single.action_space)
        layout = _layout(count, OBSERVATION_SIZES[task.configuration.environment.observation])
        self._memory = SharedMemory(create=True, size=_size(layout))
        self._views = _views(self._memory, layout)
        context = mp.get_context("spawn")
        self._pipes: list[Connection] = []
        self._processes = []
        os.environ.setdefault("OMP_NUM_THREADS", "1")  # a worker's arrays are tiny
        for share in np.array_split(np.arange(count), min(workers, count)):
            ours, theirs = context.Pipe()
            process = context.Process(
                target=_work,
                args=(
                    task,
                    range(int(share[0]), int(share[-1]) + 1),
                    layout,
                    self._memory.name,
                    theirs,
                ),
                daemon=True,
            )
            process.start()
            theirs.close()
            self._pipes.append(ours)
            self._processes.append(process)
        try:
            self._all_done()
        except BaseException:
            self.close()
            raise
        self._lengths = np.zeros(count, dtype=int)
        self._returns = np.zeros(count)

    def _tell(self, message: str, value: Any = None) -> None:
        for pipe in self._pipes:
            with contextlib.suppress(BrokenPipeError):  # `_all_done` says that the worker ended
                pipe.send((message, value))

    def _all_done(self) -> None:
        for pipe in self._pipes:
            try:
                problem = pipe.recv()
            except (EOFError, ConnectionResetError):
                problem = "it was killed, perhaps because the machine ran out of memory."
            if problem is not None:
                raise RuntimeError(f"A worker process of the walking environments ended: {problem}")

    def set_difficulty(self, difficulty: float) -> None:
        """Set `WalkingEnvironment.difficulty` everywhere."""
        self._tell("difficulty", difficulty)
        self._all_done()

    def seed(self, seed: int | None = None) -> Sequence[int | None]:
        """Seed environment i with seed + i at the next reset."""
        if seed is not None:
            self._tell("seed", seed)
            self._all_done()
        return [None if seed is None else seed + i for i in range(self.num_envs)]

    def reset(self) -> VecEnvObs:
        """Reset all environments; returns (count, size) observations."""
        self._tell("reset")
        self._all_done()
        self._lengths[:] = 0
        self._returns[:] = 0.0
        return self._views["observation"].copy()

    def step_async(self, actions: NDArray[Any]) -> None:
        """Send the actions (count, 25)."""
        self._views["action"][:] = actions
        self._tell("step")

    def step_wait(self) -> VecEnvStepReturn:
        """Observations, rewards, ends and infos of the step that `step_async` began."""
        self._all_done()
        views = self._views
        ended = views["ended"].astype(bool)
        self._lengths += 1
        self._returns += views["reward"]
        infos: list[dict[str, Any]] = [{} for _ in range(self.num_envs)]
        for i in np.flatnonzero(ended):
            infos[i] = {
                "terminal_observation": views["final_observation"][i].copy(),
                "TimeLimit.truncated": not views["fell"][i],
                "episode": {"r": float(self._returns[i]), "l": int(self._lengths[i])},
                "cycles": float(views["cycles"][i]),
            }
        self._lengths[ended] = 0
        self._returns[ended] = 0.0
        return views["observation"].copy(), views["reward"].copy(), ended, infos

    @property
    def terms(self) -> NDArray[np.float64]:
        """Reward terms (count, 8) of the last step."""
        return np.asarray(self._views["terms"])

    def close(self) -> None:
        """End the workers and free the shared memory."""
        for pipe in self._pipes:
            pipe.close()
        for process in self._processes:
            process.join(timeout=5)
            if process.is_alive():
                process.kill()
        del self._views
        self._memory.close()
        self._memory.unlink()

    def get_attr(self, attr_name: str, indices: Any = None) -> list[Any]:
        """Only `render_mode` is known: environments live in other processes."""
        if attr_name == "render_mode":
            return [None] * self.num_envs
        raise AttributeError(attr_name)

    def set_attr(self, attr_name: str, value: Any, indices: Any = None) -> None:
        """Not offered; see `set_difficulty`."""
        raise AttributeError(attr_name)

    def env_method(self, method_name: str, *args: Any, indices: Any = None, **kwargs: Any) -> Any:
        """Not offered: environments live in other processes."""
        raise AttributeError(method_name)

    def env_is_wrapped(self, wrapper_class: Any, indices: Any = None) -> list[bool]:
        """No environment is wrapped."""
        return [False] * self.num_envs
