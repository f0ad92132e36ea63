"""The device that a training runs on, where its settings do not say the processor."""

import torch

from gaitval.configuration import Configuration
from gaitval.errors import ConfigurationError


def choose_device(configuration: Configuration) -> str:
    """`cpu` or `cuda`, the device that a training runs on by `training.device`; with `auto` it is
    `cuda` where there is one. Raises ConfigurationError if `cuda` is set, but there is none.
    """
    wanted, there = configuration.training.device, torch.cuda.is_available()
    if wanted == "cuda" and not there:
        raise ConfigurationError(
            "training.device: it is cuda, but PyTorch finds no CUDA device here. Set it to auto "
            "or cpu, or install a build of PyTorch for the device's driver."
        )
    return "cuda" if there and wanted != "cpu" else "cpu"
