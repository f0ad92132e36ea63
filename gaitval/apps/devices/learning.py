"""Learned adaptation: the person's policy is trained on with the device.

The learner is that of `policy.training`, the environments wear devices whose masses, stiffness and
torques vary a little, and the body parameters and pushes are drawn as in every training. The aim is
the person's own motion with less effort of their own muscles: the cost of the moments is raised
(`effort`), and the moments need not be those that were recorded.
"""

from collections.abc import Callable, Sequence
from dataclasses import replace
from typing import Final

import numpy as np
import torch
from numpy.typing import NDArray
from stable_baselines3.common.logger import Logger
from threadpoolctl import threadpool_limits  # type: ignore[import-untyped]

from gaitval.apps.devices.walking import DeviceEnvironment, DeviceTask
from gaitval.configuration import Configuration
from gaitval.model.devices.composite import fitted
from gaitval.model.devices.device import Device
from gaitval.policy.environment import action_size
from gaitval.policy.learner import Learner
from gaitval.policy.reward import REWARD_TERMS
from gaitval.policy.rollout_buffer import RolloutBuffer
from gaitval.policy.senses import observation_size
from gaitval.policy.storage import Policy
from gaitval.policy.training import policy_of

EFFORT: Final = 4.0
"""Times the cost of the moments in an ordinary training."""
SPREAD: Final = 0.1
"""Masses, stiffness and torques of the devices in training lie within this of their table."""

HARDEST: Final = 0.4
"""Fraction of the ranges of body parameters and pushes that is reached at the end: to walk with the
device comes first."""

_Progress = Callable[[int, int, float | None], None]
"""Called with the samples so far, all samples, and the mean length of an episode in gait cycles;
None until one has ended.
"""


def varied(device: Device, random: np.random.Generator) -> Device:
    """A device whose masses, spring stiffness and damping differ by a factor within `SPREAD`."""
    mass, stiffness, damping = 1.0 + SPREAD * random.uniform(-1.0, 1.0, 3)
    hinges = []
    for hinge in device.hinges:
        changed: dict[str, object] = {"damping": damping * hinge.damping}
        if hinge.spring is not None:
            spring = {"stiffness": stiffness * hinge.spring.stiffness}
            changed["spring"] = hinge.spring.model_copy(update=spring)
        hinges.append(hinge.model_copy(update=changed))
    parts = [
        part.model_copy(
            update={
                "mass": mass * part.mass,
                "inertia": tuple(mass * each for each in part.inertia),
            }
        )
        for part in device.parts
    ]
    return device.model_copy(update={"hinges": tuple(hinges), "parts": tuple(parts)})


def adaptation_settings(configuration: Configuration, effort: float) -> Configuration:
    """The settings of a training with a device."""
    reward = configuration.reward
    training = configuration.training
    return configuration.model_copy(
        update={
            "reward": reward.model_copy(
                update={"torque": effort * reward.torque, "joint_moments": 0.0}
            ),
            "environment": configuration.environment.model_copy(
                update={"steps_per_action": training.steps_per_action}
            ),
        }
    )


def _environments(task: DeviceTask, seed: int, pace: float | None) -> list[DeviceEnvironment]:
    """The environments of a training: the first has the device of the table."""
    random = np.random.default_rng(seed)
    person = task.person or task.model
    found = []
    for number in range(task.configuration.training.environments):
        devices = task.devices
        if number:
            devices = tuple(varied(each, random) for each in devices)
        with_device = replace(task, model=fitted(person, devices), devices=devices)
        found.append(DeviceEnvironment(with_device, pace=pace))
        found[-1].walker.noise_seed = number
    return found


def _empty(configuration: Configuration) -> RolloutBuffer:
    training, constants = configuration.training, configuration.environment
    steps, count = training.rollout_steps, training.environments
    size = observation_size(constants)
    rows = (steps, count)
    return RolloutBuffer(
        np.zeros((steps + 1, count, size), np.float32),
        np.zeros((*rows, action_size(constants)), np.float32),
        np.zeros(rows, np.float32),
        np.zeros(rows, np.bool_),
        np.zeros(rows, np.bool_),
        np.zeros((*rows, size), np.float32),
        np.zeros(rows, np.float32),
        np.zeros((*rows, len(REWARD_TERMS)), np.float32),
    )


def _walk(
    environments: Sequence[DeviceEnvironment],
    seen: NDArray[np.float32],
    policy: Policy,
    into: RolloutBuffer,
) -> None:
    """A rollout of all environments; `into.actions` has the noise, `seen` is changed in place."""
    for t, actions in enumerate(into.actions):
        into.observations[t] = seen
        actions += policy.act(seen)
        for e, environment in enumerate(environments):
            observation, reward, fell, over, info = environment.step(actions[e])
            into.rewards[t, e], into.fell[t, e], into.ended[t, e] = reward, fell, fell or over
            into.cycles[t, e], into.terms[t, e] = info["cycles"], info["reward_terms"]
            if fell or over:
                into.final_observations[t, e] = observation
                observation, _ = environment.reset()
            seen[e] = observation
    into.observations[-1] = seen


def adapt(
    task: DeviceTask,
    start: Policy,
    *,
    samples: int,
    effort: float = EFFORT,
    seed: int = 0,
    pace: float | None = None,
    on_progress: _Progress | None = None,
) -> Policy:
    """Train a policy on with devices, in this process: `task` is the person with them, `start` what
    the person walks with without. `samples` are actions in all, 10 ms each; `effort` is times the
    cost of the muscles' moments in an ordinary training; `seed` is of the devices that vary, and of
    all else that is random; `pace` is as of a `DeviceEnvironment`. `on_progress` as in `_Progress`.
    """
    configuration = adaptation_settings(task.configuration, effort)
    training = configuration.training
    task = replace(task, configuration=configuration)
    torch.set_num_threads(1)
    with threadpool_limits(1, "blas"):
        learner = Learner(configuration)
        learner.restore({n: torch.from_numpy(np.array(v)) for n, v in start.tensors.items()})
        learner.ppo.num_timesteps = 0
        learner.ppo.set_logger(Logger(None, []))
        learner.begin(seed)
        learner.log_std = training.final_log_std
        environments = _environments(task, seed, pace)
        for environment in environments:
            environment.difficulty = 0.0
        seen = np.array(
            [each.reset(seed=seed + e)[0] for e, each in enumerate(environments)], np.float32
        )
        buffer, done, lengths = _empty(configuration), 0, list[float]()
        while done < samples:
            buffer.actions[:] = learner.noise()
            _walk(environments, seen, Policy(learner.actor(), {}), buffer)
            done += buffer.rewards.size
            part = min(done / samples, 1.0)
            for environment in environments:
                environment.difficulty = HARDEST * part
            first = training.learning_rate
            rate = first + part * (training.final_learning_rate - first)
            ended = learner.learn(buffer, learning_rate=rate)
            lengths = [cycles for *_, cycles in ended] or lengths
            if on_progress is not None:
                on_progress(done, samples, float(np.mean(lengths)) if lengths else None)
    names = ", ".join(device.name for device in task.devices)
    return policy_of(configuration, learner, {**start.about, "devices": names})
