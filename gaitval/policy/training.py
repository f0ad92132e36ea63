"""Proximal policy optimisation of the walking policy (stable-baselines3)."""

import csv
import io
import json
import time
from collections import deque
from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
import torch
from numpy.typing import NDArray
from safetensors import SafetensorError, safe_open
from safetensors.torch import save_file
from stable_baselines3 import PPO
from stable_baselines3.common.callbacks import BaseCallback
from stable_baselines3.common.logger import configure
from stable_baselines3.common.running_mean_std import RunningMeanStd
from stable_baselines3.common.vec_env import VecNormalize

from gaitval.artefacts import replacing, versions, write_text
from gaitval.configuration import Training
from gaitval.errors import PolicyError
from gaitval.policy.environment import PARAMETERS_OBSERVED, REWARD_TERMS
from gaitval.policy.storage import OBSERVATION_CLIP, Policy
from gaitval.policy.vectorised import WalkingVecEnv
from gaitval.scaling.parameters import parameter_bounds
from gaitval.scaling.urdf import model_hash
from gaitval.simulation.walker import WalkingTask

Progress = Callable[[dict[str, float]], None]

LOG_COLUMNS = (
    "samples",
    "wall_seconds",
    "episode_length",
    "episode_reward",
    "cycles",
    "learning_rate",
    "log_std",
    "approx_kl",
    "difficulty",
    *REWARD_TERMS,
)
_CHECKPOINT = "checkpoint.safetensors"


def _difficulty(training: Training, samples: int, total: int, warm: bool) -> float:
    """Share of the randomisation at this point of a training: 0, then a ramp, then 1."""
    if warm:
        return 1.0
    start, end = training.difficulty_ramp
    return float(np.clip((samples / total - start) / max(end - start, 1e-9), 0.0, 1.0))


def _log_std(training: Training, samples: int, total: int, warm: bool) -> float:
    """Logarithm of the actions' standard deviation at this point of a training."""
    if warm:
        return training.final_log_std
    hold = training.exploration_hold
    part = float(np.clip((samples / total - hold) / max(1.0 - hold, 1e-9), 0.0, 1.0))
    return training.initial_log_std + part * (training.final_log_std - training.initial_log_std)


@dataclass
class _Log:
    """What a training has to tell so far.

    Attributes
    ----------
    rows : of `training.csv`, one an update.
    episodes : length, return and gait cycles of the last episodes.
    """

    rows: list[dict[str, Any]] = field(default_factory=list)
    episodes: deque[tuple[int, float, float]] = field(default_factory=lambda: deque(maxlen=100))

    @property
    def wall_seconds(self) -> float:
        return float(self.rows[-1]["wall_seconds"]) if self.rows else 0.0


def _write_rows(path: Path, rows: list[dict[str, Any]]) -> None:
    text = io.StringIO()
    writer = csv.DictWriter(text, LOG_COLUMNS, lineterminator="\n")
    writer.writeheader()
    writer.writerows(rows)
    write_text(path, text.getvalue())


def _read_rows(path: Path, samples: int) -> list[dict[str, Any]]:
    """Rows of a training log up to a checkpoint."""
    with path.open(newline="") as file:
        return [row for row in csv.DictReader(file) if int(row["samples"]) <= samples]


class _Statistics(RunningMeanStd):
    """Running mean and variance of observations, but for mu: its scale is known from its bounds.

    A running variance would be almost zero while mu is nominal at the beginning of a training,
    and throw the policy off when the randomisation of mu begins.
    """

    def __init__(self, size: int, mean: NDArray[np.float64], variance: NDArray[np.float64]) -> None:
        super().__init__(shape=(size,))
        self._known = mean, variance
        self.mean[PARAMETERS_OBSERVED], self.var[PARAMETERS_OBSERVED] = self._known

    def update_from_moments(self, *moments: Any, **named: Any) -> None:
        """Take in a batch."""
        super().update_from_moments(*moments, **named)
        self.mean[PARAMETERS_OBSERVED], self.var[PARAMETERS_OBSERVED] = self._known


class _Watch(BaseCallback):
    """Sets difficulty and exploration before each rollout; logs and tells of each update."""

    def __init__(
        self,
        environments: WalkingVecEnv,
        training: Training,
        total: int,
        warm: bool,
        log: "_Log",
        on_progress: Progress | None,
    ) -> None:
        super().__init__()
        self.environments = environments
        self.training = training
        self.total = total
        self.warm = warm
        self.log = log
        self.on_progress = on_progress
        self.began = time.monotonic()
        self.spent = log.wall_seconds
        self.terms = np.zeros(len(REWARD_TERMS))
        self.steps = 0

    def _on_step(self) -> bool:
        self.terms += self.environments.terms.mean(axis=0)
        self.steps += 1
        for info in self.locals["infos"]:
            if "episode" in info:
                episode = info["episode"]["l"], info["episode"]["r"], info["cycles"]
                self.log.episodes.append(episode)
        return True

    def _on_rollout_start(self) -> None:
        if self.steps:  # the update of the rollout before is done
            self._report()
        done = self.model.num_timesteps
        self.difficulty = _difficulty(self.training, done, self.total, self.warm)
        self.environments.set_difficulty(self.difficulty)
        deviation = self.model.policy.get_parameter("log_std")
        deviation.data.fill_(_log_std(self.training, done, self.total, self.warm))

    def _on_training_end(self) -> None:
        self._report()

    def _report(self) -> None:
        lengths, returns, cycles = np.array(self.log.episodes or [(0, 0.0, 0.0)]).T
        values = self.logger.name_to_value
        row = {
            "samples": self.model.num_timesteps,
            "wall_seconds": round(self.spent + time.monotonic() - self.began, 1),
            "episode_length": round(float(lengths.mean()), 2),
            "episode_reward": round(float(returns.mean()), 4),
            "cycles": round(float(cycles.mean()), 3),
            "learning_rate": values.get("train/learning_rate", float("nan")),
            "log_std": float(self.model.policy.state_dict()["log_std"].mean()),
            "approx_kl": values.get("train/approx_kl", float("nan")),
            "difficulty": self.difficulty,
            **{
                name: round(float(value), 5)
                for name, value in zip(REWARD_TERMS, self.terms / self.steps, strict=True)
            },
        }
        for name in ("episode_length", "episode_reward", "cycles", *REWARD_TERMS):
            self.logger.record(f"walk/{name}", row[name])
        self.terms[:] = 0.0
        self.steps = 0
        self.log.rows.append(row)
        if self.on_progress is not None:
            self.on_progress(
                {
                    "samples": row["samples"],
                    "total": self.total,
                    "reward": row["episode_reward"],
                    "cycles": row["cycles"],
                }
            )


def _all_tensors(ppo: PPO, normalise: VecNormalize) -> dict[str, torch.Tensor]:
    """Network, optimiser and normalisation as named tensors."""
    tensors = {name: value.contiguous() for name, value in ppo.policy.state_dict().items()}
    parameters = dict(ppo.policy.named_parameters())
    state = ppo.policy.optimizer.state
    for name, parameter in parameters.items():
        for key, value in state.get(parameter, {}).items():
            tensors[f"optimiser.{name}.{key}"] = torch.as_tensor(value).contiguous()
    observations, returns = normalise.obs_rms, normalise.ret_rms
    assert not isinstance(observations, dict)
    tensors["observation_mean"] = torch.from_numpy(np.array(observations.mean))
    tensors["observation_variance"] = torch.from_numpy(np.array(observations.var))
    tensors["observation_count"] = torch.tensor([observations.count], dtype=torch.float64)
    statistics = [float(returns.mean), float(returns.var), float(returns.count)]
    tensors["return_statistics"] = torch.tensor(statistics, dtype=torch.float64)
    return tensors


def _restore(ppo: PPO, normalise: VecNormalize, tensors: dict[str, torch.Tensor]) -> None:
    """Put back what `_all_tensors` took, the optimiser's state only where it is there."""
    names = set(ppo.policy.state_dict())
    ppo.policy.load_state_dict({name: tensors[name].float() for name in names})
    optimiser = ppo.policy.optimizer
    for name, parameter in ppo.policy.named_parameters():
        prefix = f"optimiser.{name}."
        found = {k[len(prefix) :]: v.clone() for k, v in tensors.items() if k.startswith(prefix)}
        if found:
            optimiser.state[parameter] = found
    observations, returns = normalise.obs_rms, normalise.ret_rms
    assert not isinstance(observations, dict)
    observations.mean = tensors["observation_mean"].numpy().copy()
    observations.var = tensors["observation_variance"].numpy().copy()
    observations.count = float(tensors["observation_count"][0])
    returns.mean, returns.var, returns.count = (float(v) for v in tensors["return_statistics"])


def _make(
    task: WalkingTask, environments: WalkingVecEnv, total: int, warm: bool
) -> tuple[PPO, VecNormalize]:
    training = task.configuration.training
    normalise = VecNormalize(
        environments, clip_obs=OBSERVATION_CLIP, gamma=training.discount, epsilon=1e-8
    )
    low, high = parameter_bounds(task.configuration.randomisation)
    half_range = np.maximum(0.5 * (high - low), 1e-9)
    extended = task.configuration.environment.observation == "extended"
    normalise.obs_rms = _Statistics(  # type: ignore[assignment]
        environments.observation_space.shape[0],  # type: ignore[index]
        np.zeros(len(low)) if extended else 0.5 * (low + high),
        np.ones(len(low)) if extended else half_range**2,
    )
    first = training.learning_rate * (training.warm_learning_rate_factor if warm else 1.0)

    def learning_rate(_: float) -> float:
        # Of the whole training: stable-baselines3 knows only the part up to the next checkpoint.
        remaining = 1.0 - ppo.num_timesteps / total
        return training.final_learning_rate + remaining * (first - training.final_learning_rate)

    layers = [training.hidden_units, training.hidden_units]
    ppo = PPO(
        "MlpPolicy",
        normalise,
        learning_rate=first,
        n_steps=training.rollout_steps,
        batch_size=training.batch_size,
        n_epochs=training.epochs,
        gamma=training.discount,
        gae_lambda=training.gae_lambda,
        clip_range=training.clip_range,
        target_kl=training.target_kl,
        ent_coef=0.0,
        policy_kwargs={
            "net_arch": {"pi": layers, "vf": layers},
            "activation_fn": torch.nn.Tanh,
            "log_std_init": training.initial_log_std,
        },
        seed=task.configuration.seed,
        device="cpu",
    )
    ppo.lr_schedule = learning_rate
    ppo.policy.get_parameter("log_std").requires_grad_(False)  # follows a schedule, see _log_std
    return ppo, normalise


def _policy(task: WalkingTask, ppo: PPO, normalise: VecNormalize, subject: str) -> Policy:
    tensors = {
        name: value.numpy()
        for name, value in _all_tensors(ppo, normalise).items()
        if not name.startswith("optimiser.")
    }
    configuration = task.configuration
    about = {
        "subject": subject,
        "model_hash": model_hash(task.model),
        "observation": configuration.environment.observation,
        "action_scale": configuration.environment.action_scale,
        "samples": ppo.num_timesteps,
        "seed": configuration.seed,
        "configuration": configuration.model_dump(mode="json"),
        "versions": versions(),
    }
    return Policy(tensors, about)


@dataclass(frozen=True)
class _Checkpoint:
    samples: int
    log: _Log
    tensors: dict[str, torch.Tensor]


def _write_checkpoint(folder: Path, checkpoint: _Checkpoint, total: int) -> None:
    """One file, so that a kill leaves the old checkpoint or the new one; the log before it, of
    which the rows after a checkpoint do not count.
    """
    _write_rows(folder / "training.csv", checkpoint.log.rows)
    state = {
        "samples": checkpoint.samples,
        "total": total,
        "episodes": list(checkpoint.log.episodes),
    }
    with replacing(folder / _CHECKPOINT) as temporary:
        save_file(checkpoint.tensors, temporary, {"state": json.dumps(state)})


def _read_checkpoint(folder: Path, total: int) -> _Checkpoint | None:
    """The checkpoint of a training of `total` samples; None where there is none to go on from."""
    try:
        with safe_open(folder / _CHECKPOINT, "pt") as file:
            state = json.loads(file.metadata()["state"])
            if state["total"] != total:
                return None
            tensors = {name: file.get_tensor(name) for name in file.keys()}  # noqa: SIM118
        log = _Log(_read_rows(folder / "training.csv", state["samples"]))
    except (OSError, SafetensorError, KeyError, TypeError, ValueError):
        return None
    log.episodes.extend(tuple(episode) for episode in state["episodes"])
    return _Checkpoint(state["samples"], log, tensors)


def train(
    task: WalkingTask,
    folder: Path,
    *,
    samples: int,
    start: Policy | None = None,
    subject: str = "",
    on_progress: Progress | None = None,
) -> Policy:
    """Train a policy, or go on from the checkpoint in `folder` of a training that was cut off.

    At a checkpoint all environments and random numbers begin anew, seeded by the configuration's
    seed and the samples so far. So a training that was cut off at any moment and goes on gives
    bit for bit the policy, and the `training.csv` but for its times, of one that was not.

    The checkpoint stays when training is done, so a caller that is killed before it has stored
    the policy loses nothing; empty `folder` to train anew.

    Parameters
    ----------
    folder : receives `training.csv`, TensorBoard logs and checkpoints.
    samples : environment steps in all.
    start : policy whose weights are taken over (a warm start: full randomisation and a smaller
        learning rate from the beginning).
    on_progress : called after each update with samples, total, reward and cycles.

    Raises
    ------
    PolicyError : `start` observes something else than this task.
    """
    folder = Path(folder)
    folder.mkdir(parents=True, exist_ok=True)
    training = task.configuration.training
    torch.set_num_threads(1)  # two threads wait for each other longer than they compute
    warm = start is not None
    found = _read_checkpoint(folder, samples)
    tensors: dict[str, torch.Tensor] | None = None
    if found is not None:
        tensors = found.tensors
    elif start is not None:
        tensors = {name: torch.from_numpy(np.array(v)) for name, v in start.tensors.items()}
    environments = WalkingVecEnv(task, count=training.environments, workers=training.workers)
    try:
        ppo, normalise = _make(task, environments, samples, warm)
        if tensors is not None:
            try:
                _restore(ppo, normalise, tensors)
            except (KeyError, RuntimeError) as error:
                origin = "The policy to start from" if found is None else f"{folder}: checkpoint"
                raise PolicyError(
                    f"{origin} does not fit this task ({error}). It was trained "
                    "with another observation or network size; set them alike, or start from "
                    "scratch (--scratch, or another --out)."
                ) from None
        ppo.set_logger(configure(str(folder / "tensorboard"), ["tensorboard"]))
        log = _Log() if found is None else found.log
        watch = _Watch(environments, training, samples, warm, log, on_progress)
        ppo.num_timesteps = 0 if found is None else found.samples
        while ppo.num_timesteps < samples:
            _begin_anew(ppo, environments, task.configuration.seed)
            environments.set_difficulty(_difficulty(training, ppo.num_timesteps, samples, warm))
            part = min(training.checkpoint_samples, samples - ppo.num_timesteps)
            ppo.learn(part, callback=watch, reset_num_timesteps=False)
            checkpoint = _Checkpoint(ppo.num_timesteps, log, _all_tensors(ppo, normalise))
            _write_checkpoint(folder, checkpoint, samples)
        policy = _policy(task, ppo, normalise, subject)
    finally:
        environments.close()
    return policy


def _begin_anew(ppo: PPO, environments: WalkingVecEnv, seed: int) -> None:
    """Seed all random numbers by `seed` and the samples so far, and let episodes begin."""
    derived = np.random.SeedSequence([seed, ppo.num_timesteps]).generate_state(1)[0] >> 1
    ppo.set_random_seed(int(derived))  # also of the environments
    ppo._last_obs = None  # so that `learn` resets the environments
