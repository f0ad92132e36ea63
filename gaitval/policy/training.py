"""Train a walking policy: schedules, checkpoints, log."""

import json
import time
from collections import deque
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
import torch
from safetensors import SafetensorError, safe_open
from safetensors.torch import save_file
from stable_baselines3.common.logger import configure
from threadpoolctl import threadpool_limits  # type: ignore[import-untyped]

from gaitval._internal.io import file_gate
from gaitval._internal.io.artefacts import replacing
from gaitval.configuration import Configuration, TrainingSettings
from gaitval.errors import ArtefactError, PolicyError
from gaitval.model.body import BodyModel
from gaitval.policy.learner import Learner
from gaitval.policy.reward import REWARD_TERMS
from gaitval.policy.rollout_buffer import RolloutBuffer, WalkingWorkers
from gaitval.policy.storage import Policy, description, of_body
from gaitval.policy.training_log import write_log
from gaitval.walk.simulation.walker import WalkingTask

TrainingProgress = Callable[[dict[str, float]], None]

_CHECKPOINT = "checkpoint.safetensors"


def _learning_rate(training: TrainingSettings, samples: int, total: int, warm: bool) -> float:
    first = training.learning_rate * (training.warm_learning_rate_factor if warm else 1.0)
    last = training.final_learning_rate
    return first + min(samples / total, 1.0) * (last - first)


def _difficulty(training: TrainingSettings, samples: int, total: int, warm: bool) -> float:
    """Fraction of the randomisation at this point of a training: 0, then a ramp, then 1."""
    if warm:
        return 1.0
    start, end = training.difficulty_ramp
    return float(np.clip((samples / total - start) / max(end - start, 1e-9), 0.0, 1.0))


def _tolerance_share(training: TrainingSettings, difficulty: float) -> float:
    """Fraction of the fall tolerances at which episodes end at this point of a training."""
    first, last = training.tolerance_shares
    return first + difficulty * (last - first)


def _log_std(training: TrainingSettings, samples: int, total: int, warm: bool) -> float:
    """Logarithm of the actions' standard deviation at this point of a training."""
    if warm:
        return training.final_log_std
    hold = training.exploration_hold
    part = float(np.clip((samples / total - hold) / max(1.0 - hold, 1e-9), 0.0, 1.0))
    return training.initial_log_std + part * (training.final_log_std - training.initial_log_std)


@dataclass
class _Log:
    """What a training has logged so far.

    Attributes
    ----------
    rows : of `training.csv`, one per update.
    episodes : length, return and gait cycles of the last episodes.
    """

    rows: list[dict[str, Any]] = field(default_factory=list)
    episodes: deque[tuple[int, float, float]] = field(default_factory=lambda: deque(maxlen=100))

    @property
    def wall_seconds(self) -> float:
        return float(self.rows[-1]["wall_seconds"]) if self.rows else 0.0


@dataclass(frozen=True)
class _Checkpoint:
    samples: int
    device: str
    log: _Log
    tensors: dict[str, torch.Tensor]


def _write_checkpoint(folder: Path, checkpoint: _Checkpoint, total: int) -> None:
    """The checkpoint is one file, so a kill leaves the old one or the new one. The log is written
    before it; its rows after a checkpoint do not count.
    """
    write_log(folder / "training.csv", checkpoint.log.rows)
    state = {
        "samples": checkpoint.samples,
        "device": checkpoint.device,
        "total": total,
        "episodes": list(checkpoint.log.episodes),
    }
    with replacing(folder / _CHECKPOINT) as temporary:
        save_file(checkpoint.tensors, temporary, {"state": json.dumps(state)})


def _read_checkpoint(folder: Path, total: int) -> _Checkpoint | None:
    """The checkpoint of a training of `total` samples; None if there is none to resume from."""
    try:
        path = file_gate.passed(
            folder / _CHECKPOINT, ArtefactError, largest=file_gate.SIZES.unpacked
        )
        with safe_open(path, "pt") as file:
            state = json.loads(file.metadata()["state"])
            # The schedules run over the whole of a training, so a checkpoint of another length is
            # of another training.
            if state["total"] != total:
                return None
            tensors = {name: file.get_tensor(name) for name in file.keys()}  # noqa: SIM118
        log = _Log(read_log(folder / "training.csv", state["samples"]))
        log.episodes.extend(tuple(episode) for episode in state["episodes"])
    except (ArtefactError, SafetensorError, KeyError, RecursionError, TypeError, ValueError):
        return None
    return _Checkpoint(state["samples"], state["device"], log, tensors)


def read_log(path: Path, samples: int) -> list[dict[str, Any]]:
    """Rows of the log at `path` up to a checkpoint after this many `samples`; all values
    are text. Raises ArtefactError if it is missing or damaged.
    """
    # Rows after the checkpoint are of updates that a killed training had not stored; they will be
    # made again.
    rows = file_gate.csv_rows(path, ArtefactError)
    try:
        return [row for _, row in rows if int(row["samples"]) <= samples]
    except (KeyError, TypeError, ValueError) as error:
        raise ArtefactError(
            f"{path}: not the log of a training ({error}). Delete it and train again."
        ) from None


def _row(
    learner: Learner, log: _Log, experience: RolloutBuffer, difficulty: float, wall_seconds: float
) -> dict[str, Any]:
    """Row of `training.csv` for an update."""
    # Before the first episode has ended there is nothing to average: a row of zeros.
    lengths, returns, cycles = np.array(log.episodes or [(0, 0.0, 0.0)]).T
    logged = learner.ppo.logger.name_to_value
    terms = experience.terms.mean(axis=(0, 1), dtype=float)
    return {
        "samples": learner.ppo.num_timesteps,
        "wall_seconds": round(wall_seconds, 1),
        "episode_length": round(float(lengths.mean()), 2),
        "episode_reward": round(float(returns.mean()), 4),
        "cycles": round(float(cycles.mean()), 3),
        "learning_rate": logged["train/learning_rate"],
        "log_std": learner.log_std,
        "approx_kl": logged["train/approx_kl"],
        "difficulty": difficulty,
        **{name: round(float(term), 5) for name, term in zip(REWARD_TERMS, terms, strict=True)},
    }


def _learner(
    configuration: Configuration, checkpoint: _Checkpoint | None, start: Policy | None
) -> Learner:
    """The learner as it was at the checkpoint and on its device, or with the numbers of `start`, or
    new.
    """
    if checkpoint is not None:
        learner = Learner(configuration, device=checkpoint.device)
        tensors = checkpoint.tensors
    else:
        learner = Learner(configuration, device=_device(configuration))
        if start is None:
            return learner
        tensors = {name: torch.from_numpy(np.array(v)) for name, v in start.tensors.items()}
    try:
        learner.restore(tensors)
    except (KeyError, RuntimeError) as error:
        origin = "The policy to start from" if checkpoint is None else "The checkpoint"
        raise PolicyError(
            f"{origin} does not fit this task ({error}). It was trained with another observation "
            "or network size. Set them to the same values, or start from scratch (--scratch, or "
            "another --out)."
        ) from None
    learner.ppo.num_timesteps = 0 if checkpoint is None else checkpoint.samples
    return learner


def train(
    task: WalkingTask,
    folder: Path,
    *,
    samples: int,
    also: Sequence[WalkingTask] = (),
    start: Policy | None = None,
    subject: str = "",
    scaled: BodyModel | None = None,
    on_progress: TrainingProgress | None = None,
) -> Policy:
    """Train a policy, or resume an interrupted training from its checkpoint in `folder`.

    At a checkpoint all episodes and random numbers restart, seeded by the configuration's seed and
    the samples so far. So a training that was interrupted at any moment and resumed gives bit for
    bit the same policy, and the same `training.csv` except for the times, as one that was not. The
    number of workers makes no difference either.

    The checkpoint stays when training is done, so a caller that is killed before it has stored the
    policy loses nothing; empty `folder` to train again.

    Parameters
    ----------
    task : body, reference and constants.
    folder : receives `training.csv`, TensorBoard logs and checkpoints.
    samples : environment steps in all.
    also : tasks of the same body, at other speeds, that the policy learns too.
    start : policy whose weights are used (a warm start: full randomisation and a smaller learning
        rate from the start), for the same body or general.
    subject : identifier of the person, stored with the policy.
    scaled : body as scaled, which the policy is said to be for; the task's if not given. Legs that
        were found to differ are the task's alone.
    on_progress : called after each update with samples, total, reward and cycles.

    Raises
    ------
    PolicyError : `start` has other observations than this task.
    ConfigurationError : the configured device does not exist.
    """
    learner = run_training([task, *also], Path(folder), samples, start, on_progress)
    return policy_of(task.configuration, learner, of_body(scaled or task.model, subject))


def _device(configuration: Configuration) -> str:
    """`cpu` or `cuda`. Raises ConfigurationError if the one that is set does not exist."""
    if configuration.training.device == "cpu":
        return "cpu"
    from gaitval.policy.device import choose_device

    return choose_device(configuration)


def run_training(
    tasks: Sequence[WalkingTask],
    folder: Path,
    samples: int,
    start: Policy | None,
    on_progress: TrainingProgress | None,
) -> Learner:
    """What has learned to walk `samples` of `tasks`; `folder`, `start`, `on_progress` and errors as
    for `train`.
    """
    folder.mkdir(parents=True, exist_ok=True)
    steps = tasks[0].configuration.training.steps_per_action
    tasks = [task.with_environment(steps_per_action=steps) for task in tasks]
    configuration = tasks[0].configuration
    training, warm = configuration.training, start is not None
    torch.set_num_threads(1)  # more threads per operation wait longer than they compute
    checkpoint = _read_checkpoint(folder, samples)
    learner = _learner(configuration, checkpoint, start)
    done = learner.ppo.num_timesteps
    if done >= samples:
        return learner
    log = _Log() if checkpoint is None else checkpoint.log
    logger = configure(str(folder / "tensorboard"), ["tensorboard"])
    learner.ppo.set_logger(logger)
    began = time.monotonic() - log.wall_seconds
    workers = WalkingWorkers(
        tasks, count=training.environments, workers=training.workers, steps=training.rollout_steps
    )
    # Its threads would be woken for each update, and then stand in the workers' way.
    with workers, threadpool_limits(1, "blas"):
        pause = done  # for a checkpoint
        while done < samples:
            difficulty = _difficulty(training, done, samples, warm)
            workers.set_curriculum(difficulty, _tolerance_share(training, difficulty))
            if done >= pause:
                pause = min(done + training.checkpoint_samples, samples)
                # A seed of its own for each checkpoint, well mixed, so that neighbouring seeds of
                # the configuration do not share random numbers; 31 bits, which every generator here
                # accepts.
                derived = np.random.SeedSequence([configuration.seed, done]).generate_state(1)[0]
                workers.begin(int(derived >> 1))
                learner.begin(int(derived >> 1))
            learner.log_std = _log_std(training, done, samples, warm)
            experience = workers.walk(learner.actor(), learner.noise())
            done += experience.rewards.size
            # Of the samples after this rollout, as stable-baselines3 counts; difficulty and noise
            # are of those before it, because the rollout was made with them.
            rate = _learning_rate(training, done, samples, warm)
            log.episodes.extend(learner.learn(experience, learning_rate=rate))
            row = _row(learner, log, experience, difficulty, time.monotonic() - began)
            log.rows.append(row)
            for name in ("episode_length", "episode_reward", "cycles", *REWARD_TERMS):
                logger.record(f"walk/{name}", row[name])
            logger.dump(done)
            if on_progress is not None:
                figures = {"total": samples, "reward": row["episode_reward"]}
                on_progress({"samples": done, "cycles": row["cycles"], **figures})
            if done >= pause:
                found = _Checkpoint(done, str(learner.ppo.device), log, learner.tensors())
                _write_checkpoint(folder, found, samples)
    return learner


def policy_of(configuration: Configuration, learner: Learner, about: dict[str, Any]) -> Policy:
    """The policy of a `learner`, with what there is to say `about` it and its `configuration`."""
    tensors = {
        name: value.numpy()
        for name, value in learner.tensors().items()
        if not name.startswith("optimiser.")
    }
    return Policy(
        tensors,
        description(
            configuration, about, learner.ppo.num_timesteps, device=str(learner.ppo.device)
        ),
    )
