"""Proximal policy optimisation of the walking policy (stable-baselines3)."""

import csv
import io
import time
from collections import deque
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import torch
from numpy.typing import NDArray
from safetensors.torch import load_file, save_file
from stable_baselines3 import PPO
from stable_baselines3.common.callbacks import BaseCallback
from stable_baselines3.common.logger import configure
from stable_baselines3.common.running_mean_std import RunningMeanStd
from stable_baselines3.common.vec_env import VecNormalize

from gaitval.artefacts import read_json, replacing, versions, write_json, write_text
from gaitval.configuration import Training
from gaitval.errors import ArtefactError, PolicyError
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
_CHECKPOINT_STATE = "checkpoint.json"


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


def _log_rows(path: Path, samples: int) -> list[dict[str, Any]]:
    """Rows of a training log up to a checkpoint."""
    if not path.exists():
        return []
    with path.open(newline="") as file:
        return [row for row in csv.DictReader(file) if int(row["samples"]) <= samples]


def _write_log(path: Path, rows: list[dict[str, Any]]) -> None:
    text = io.StringIO()
    writer = csv.DictWriter(text, LOG_COLUMNS, extrasaction="ignore", lineterminator="\n")
    writer.writeheader()
    writer.writerows(rows)
    write_text(path, text.getvalue())


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
    """Logs, reports progress, sets the difficulty and writes checkpoints after each update."""

    def __init__(
        self,
        environments: WalkingVecEnv,
        folder: Path,
        training: Training,
        total: int,
        warm: bool,
        rows: list[dict[str, Any]],
        on_progress: Progress | None,
    ) -> None:
        super().__init__()
        self.environments = environments
        self.folder = folder
        self.training = training
        self.total = total
        self.warm = warm
        self.rows = rows
        self.on_progress = on_progress
        self.episodes: deque[tuple[int, float, float]] = deque(maxlen=100)
        self.began = time.monotonic()
        self.spent = float(rows[-1]["wall_seconds"]) if rows else 0.0
        self.saved = self.began
        self.terms = np.zeros(len(REWARD_TERMS))
        self.steps = 0

    def _on_step(self) -> bool:
        self.terms += self.environments.terms.mean(axis=0)
        self.steps += 1
        for info in self.locals["infos"]:
            if "episode" in info:
                self.episodes.append((info["episode"]["l"], info["episode"]["r"], info["cycles"]))
        return True

    def _on_rollout_start(self) -> None:
        if self.steps:  # the update of the rollout before is done
            self._report()
        done = self.model.num_timesteps
        self.difficulty = _difficulty(self.training, done, self.total, self.warm)
        self.environments.set_difficulty(self.difficulty)
        deviation = self.model.policy.get_parameter("log_std")
        deviation.data.fill_(_log_std(self.training, done, self.total, self.warm))

    def _report(self) -> None:
        lengths, returns, cycles = np.array(self.episodes or [(0, 0.0, 0.0)]).T
        now = time.monotonic()
        values = self.logger.name_to_value
        row = {
            "samples": self.model.num_timesteps,
            "wall_seconds": round(self.spent + now - self.began, 1),
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
        self.rows.append(row)
        if self.on_progress is not None:
            self.on_progress(
                {
                    "samples": row["samples"],
                    "total": self.total,
                    "reward": row["episode_reward"],
                    "cycles": row["cycles"],
                }
            )
        if now - self.saved > self.training.checkpoint_seconds:
            self.saved = now
            self.checkpoint()

    def _on_training_end(self) -> None:
        self._report()
        self.checkpoint()

    def checkpoint(self) -> None:
        """Write all that training needs to go on, and the log."""
        normalise = self.model.get_vec_normalize_env()
        assert normalise is not None
        assert isinstance(self.model, PPO)
        tensors = _all_tensors(self.model, normalise)
        with replacing(self.folder / _CHECKPOINT) as temporary:
            save_file(tensors, temporary, {"samples": str(self.model.num_timesteps)})
        state = {"samples": self.model.num_timesteps, "total": self.total, "warm": self.warm}
        write_json(self.folder / _CHECKPOINT_STATE, state)
        _write_log(self.folder / "training.csv", self.rows)


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
    task: WalkingTask, environments: WalkingVecEnv, total: int, warm: bool, seed: int
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

    def learning_rate(remaining: float) -> float:
        return training.final_learning_rate + remaining * (first - training.final_learning_rate)

    layers = [training.hidden_units, training.hidden_units]
    ppo = PPO(
        "MlpPolicy",
        normalise,
        learning_rate=learning_rate,
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
        seed=seed,
        device="cpu",
    )
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


def checkpoint_samples(folder: Path, *, total: int) -> int:
    """Samples of an unfinished training in `folder` that `train` would go on from; else 0."""
    if not (Path(folder) / _CHECKPOINT).exists():
        return 0
    try:
        state = read_json(Path(folder) / _CHECKPOINT_STATE)
        return int(state["samples"]) if state["total"] == total else 0
    except (ArtefactError, KeyError, TypeError, ValueError):
        return 0


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
    seed = task.configuration.seed
    torch.set_num_threads(1)  # two threads wait for each other longer than they compute
    warm = start is not None
    resumed = checkpoint_samples(folder, total=samples)
    tensors: dict[str, torch.Tensor] | None = None
    if resumed:
        tensors = load_file(folder / _CHECKPOINT)
    elif start is not None:
        tensors = {name: torch.from_numpy(np.array(v)) for name, v in start.tensors.items()}
    environments = WalkingVecEnv(task, count=training.environments, workers=training.workers)
    try:
        ppo, normalise = _make(task, environments, samples, warm, seed)
        if tensors is not None:
            try:
                _restore(ppo, normalise, tensors)
            except (KeyError, RuntimeError) as error:
                origin = f"The checkpoint in {folder}" if resumed else "The policy to start from"
                raise PolicyError(
                    f"{origin} does not fit this task ({error}). It was trained "
                    "with another observation or network size; set them alike, or start from "
                    "scratch (--scratch, or another --out)."
                ) from None
        ppo.num_timesteps = resumed
        # A resumed training must not repeat the random numbers of its beginning.
        environments.seed(int(np.random.SeedSequence([seed, resumed]).generate_state(1)[0] >> 1))
        ppo.set_logger(configure(str(folder / "tensorboard"), ["tensorboard"]))
        rows = _log_rows(folder / "training.csv", resumed) if resumed else []
        watch = _Watch(environments, folder, training, samples, warm, rows, on_progress)
        remaining = samples - resumed
        if remaining > 0:
            # Of the first episodes, which begin before any callback.
            environments.set_difficulty(_difficulty(training, resumed, samples, warm))
            ppo.learn(remaining, callback=watch, reset_num_timesteps=False)
        policy = _policy(task, ppo, normalise, subject)
    finally:
        environments.close()
    return policy
