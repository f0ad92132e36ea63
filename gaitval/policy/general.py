"""Train one policy for several people, from which the training of each can start."""

from collections.abc import Sequence
from pathlib import Path

from gaitval.errors import ConfigurationError
from gaitval.policy.storage import Policy
from gaitval.policy.training import Progress, policy_of, run_training
from gaitval.simulation.walker import WalkingTask


def train_general(
    tasks: Sequence[WalkingTask],
    folder: Path,
    *,
    samples: int,
    start: Policy | None = None,
    on_progress: Progress | None = None,
) -> Policy:
    """Train one policy on the bodies of several people, for trainings of each to start from.

    Observations are relative to the reference, so they mean the same for everybody. The
    environments are assigned to the tasks in turn. Otherwise as `train`.

    Parameters
    ----------
    tasks : one per person, all with the same configuration.
    folder, samples, start, on_progress : as `train` takes them.

    Raises
    ------
    ConfigurationError : the tasks' configurations differ, or there are fewer environments than
        tasks.
    PolicyError : `start` has other observations than these tasks.
    """
    configuration = tasks[0].configuration
    if any(task.configuration != configuration for task in tasks):
        raise ConfigurationError(
            "A general policy is trained with one configuration, but the tasks' configurations "
            "differ. Use the same one for all."
        )
    if configuration.training.environments < len(tasks):
        raise ConfigurationError(
            f"training.environments: {configuration.training.environments} environments are fewer "
            f"than the {len(tasks)} tasks of a general policy. Set it to a multiple of "
            f"{len(tasks)}."
        )
    learner = run_training(tasks, Path(folder), samples, start, on_progress)
    return policy_of(configuration, learner, {"general": True})
