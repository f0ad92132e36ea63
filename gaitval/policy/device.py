"""The device that a training runs on, where its settings do not say the processor."""

import time

import numpy as np
import torch
from stable_baselines3.common.logger import configure

from gaitval.configuration import Configuration
from gaitval.errors import ConfigurationError
from gaitval.policy.learner import Learner
from gaitval.policy.reward import REWARD_TERMS
from gaitval.policy.rollout_buffer import RolloutBuffer
from gaitval.policy.senses import observation_size


def update_seconds(configuration: Configuration, device: str) -> float:
    """Duration of one update, s, with made-up data.

    Parameters
    ----------
    configuration : of the training; its sizes and epochs count.
    device : `cpu` or `cuda`.
    """
    learner = Learner(configuration, device=device)
    learner.ppo.set_logger(configure(None, []))
    learner.begin(0)
    noise = learner.noise()
    shape = noise.shape[:2]
    random = np.random.default_rng(0)
    size = observation_size(configuration.environment)
    never = np.zeros(shape, dtype=bool)
    experience = RolloutBuffer(
        observations=random.standard_normal((shape[0] + 1, shape[1], size), dtype=np.float32),
        actions=noise,
        rewards=random.random(shape, dtype=np.float32),
        fell=never,
        ended=never,
        final_observations=np.zeros((*shape, size), dtype=np.float32),
        cycles=np.zeros(shape, dtype=np.float32),
        terms=np.zeros((*shape, len(REWARD_TERMS)), dtype=np.float32),
    )
    seconds = np.inf
    for _ in range(2):  # the first also loads what the device needs
        began = time.perf_counter()
        learner.learn(experience, learning_rate=0.0)
        learner.actor()
        seconds = time.perf_counter() - began
    return seconds


def choose_device(configuration: Configuration) -> str:
    """The device that a training runs on; with `auto`, whichever updates faster here.

    Parameters
    ----------
    configuration : its `training.device` is `cpu`, `cuda` or `auto`.

    Returns
    -------
    `cpu` or `cuda`.

    Raises
    ------
    ConfigurationError : `cuda` is set, but there is none.
    """
    wanted = configuration.training.device
    if wanted == "cpu" or (wanted == "auto" and not torch.cuda.is_available()):
        return "cpu"
    if not torch.cuda.is_available():
        raise ConfigurationError(
            "training.device: it is cuda, but PyTorch finds no CUDA device here. Set it to auto "
            "or cpu, or install a build of PyTorch for the device's driver."
        )
    if wanted == "cuda":
        return "cuda"
    return min(("cpu", "cuda"), key=lambda device: update_seconds(configuration, device))
