"""Proximal policy optimisation from whole rollouts: stable-baselines3's PPO with less waiting.

Network, advantages, schedules and files are stable-baselines3's. There are two differences. A
rollout comes whole from `policy/rollout_buffer.py`, so observations, values and probabilities are
computed for all of it at once. And on the processor the minibatches are learned in compiled code,
`policy/policy_update.py`: the same losses, gradients and steps as stable-baselines3's and torch's,
to rounding. Actor and critic share no weights, so they are learned in two threads, unless the
training has only one worker: then it has one processor too.

It is long because a learner is one class for stable-baselines3.
"""

import math
import warnings
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import ThreadPoolExecutor
from contextlib import contextmanager
from typing import Any

import gymnasium
import numpy as np
import torch
from numpy.typing import NDArray
from stable_baselines3 import PPO
from stable_baselines3.common.policies import ActorCriticPolicy
from stable_baselines3.common.running_mean_std import RunningMeanStd
from threadpoolctl import ThreadpoolController  # type: ignore[import-untyped]

from gaitval.configuration import Configuration
from gaitval.model.parameters import parameter_bounds
from gaitval.policy.environment import action_size
from gaitval.policy.observation import OBSERVATION_CLIP, PARAMETERS_OBSERVED
from gaitval.policy.policy_update import (
    Network,
    actor_gradients,
    adam_step,
    critic_gradients,
    layers_of,
    outputs,
    square_norm,
)
from gaitval.policy.rollout_buffer import RolloutBuffer
from gaitval.policy.senses import observation_size

_REWARD_CLIP = 10.0
"""Normalised rewards are clipped at this, as in stable-baselines3's VecNormalize."""


def _network(hidden: torch.nn.Sequential, last: torch.nn.Module) -> list[torch.Tensor]:
    """Weights and biases, in the order of `policy_update.Network`."""
    layers = [layer for layer in (*hidden, last) if isinstance(layer, torch.nn.Linear)]
    return [parameter for layer in layers for parameter in (layer.weight, layer.bias)]


def _arrays(tensors: Sequence[torch.Tensor]) -> Network:
    """The tensors' own memory."""
    # No copy: the compiled update writes into torch's parameters and optimiser, so that saving,
    # loading and acting need no transfer.
    return Network(*(tensor.detach().numpy() for tensor in tensors))


class _Side:
    """Actor or critic in the compiled update."""

    def __init__(self, parameters: list[torch.Tensor], optimiser: Any, rows: int) -> None:
        self.network = _arrays(parameters)
        self.gradients = Network(*(np.empty_like(each) for each in self.network))
        self.layers = layers_of(self.network, rows)
        self.states = [_adam_state(optimiser, each) for each in parameters]
        self.means = _arrays([state["exp_avg"] for state in self.states])
        self.squares = _arrays([state["exp_avg_sq"] for state in self.states])

    def rows(self, count: int) -> None:
        """Make room for a minibatch of so many rows."""
        if len(self.layers.inputs) != count:
            self.layers = layers_of(self.network, count)

    def step(self, group: dict[str, Any], shrink: float) -> None:
        """A step of Adam along the gradients, shrunk."""
        for state in self.states:
            # torch counts steps per parameter, and a checkpoint contains the count.
            state["step"] += 1.0
        step = int(self.states[0]["step"])
        layers = zip(self.network, self.gradients, self.means, self.squares, strict=True)
        for arrays in layers:
            adam_step(*arrays, shrink, group["lr"], group["betas"], group["eps"], step)


def _adam_state(optimiser: Any, parameter: torch.Tensor) -> dict[str, Any]:
    """What torch's optimiser keeps of a parameter; if there is nothing yet, as torch itself
    starts.
    """
    state: dict[str, Any] = optimiser.state[parameter]
    if not state:
        state["step"] = torch.tensor(0.0)
        state["exp_avg"] = torch.zeros_like(parameter)
        state["exp_avg_sq"] = torch.zeros_like(parameter)
    return state


@contextmanager
def _beside(threads: int) -> Iterator[Callable[..., Callable[[], Any]]]:
    """A function that calls another with its arguments, in a thread of its own if there may be two,
    and gives one that waits for the result.
    """
    if threads > 1:
        # One more thread is enough: the caller works too. The compiled functions release Python's
        # lock (`njit_unlocked`), otherwise the two would take turns.
        with ThreadPoolExecutor(1) as pool:
            yield lambda function, *arguments: pool.submit(function, *arguments).result
        return

    def now(function: Callable[..., Any], *arguments: object) -> Callable[[], Any]:
        result = function(*arguments)
        return lambda: result

    yield now


class WalkingPPO(PPO):
    """PPO whose update on the processor is compiled: stable-baselines3's to rounding (tested).

    Attributes
    ----------
    threads : of an update, one or two; they make no difference to what is learned.
    """

    policy: ActorCriticPolicy
    threads: int = 2

    def judged(
        self, observations: torch.Tensor, actions: torch.Tensor
    ) -> tuple[torch.Tensor, torch.Tensor]:
        """Values (N,) of observations (N, size), and log probabilities (M,) of the actions (M, A)
        that were taken after the first M of them.
        """
        policy, count = self.policy, len(actions)
        if self.device.type != "cpu":
            with torch.no_grad():
                # The compiled functions work in the processor's memory only.
                _, log_prob, _ = policy.evaluate_actions(observations[:count], actions)
                return policy.predict_values(observations).flatten(), log_prob
        extractor, seen = policy.mlp_extractor, observations.numpy()
        actor, critic = (
            _arrays(_network(extractor.policy_net, policy.action_net)),
            _arrays(_network(extractor.value_net, policy.value_net)),
        )
        means = np.empty(actions.shape, actor.last.dtype)
        values = np.empty((len(seen), 1), critic.last.dtype)
        with _beside(self.threads) as submit:
            judged = submit(outputs, critic, seen, layers_of(critic, self.batch_size), values)
            outputs(actor, seen[:count], layers_of(actor, self.batch_size), means)
            judged()
        # Once per rollout, so this need not be compiled.
        distribution = torch.distributions.Normal(
            torch.from_numpy(means), policy.get_parameter("log_std").detach().exp()
        )
        log_prob = distribution.log_prob(actions).sum(dim=1)  # type: ignore[no-untyped-call]
        return torch.from_numpy(values).flatten(), log_prob

    def train(self) -> None:
        """Update the network from the rollout buffer."""
        if self.device.type != "cpu":
            super().train()
            return
        policy, optimiser = self.policy, self.policy.optimizer
        policy.set_training_mode(True)
        self._update_learning_rate(optimiser)
        extractor, buffer = policy.mlp_extractor, self.rollout_buffer
        actor, critic = (
            _Side(_network(hidden, last), optimiser, self.batch_size)
            for hidden, last in (
                (extractor.policy_net, policy.action_net),
                (extractor.value_net, policy.value_net),
            )
        )
        clip_range = float(self.clip_range(self._current_progress_remaining))  # type: ignore[operator]
        log_std = policy.get_parameter("log_std").detach().numpy()
        names = "observations", "actions", "advantages", "log_probs", "returns"
        observations, actions, advantages, log_probabilities, returns = (
            np.ascontiguousarray(buffer.swap_and_flatten(getattr(buffer, name))) for name in names
        )
        advantages, log_probabilities, returns = (
            array.ravel() for array in (advantages, log_probabilities, returns)
        )
        actor_losses, critic_losses, divergences = [], [], []
        go_on = True
        with _beside(self.threads) as submit:
            for _ in range(self.n_epochs):
                # NumPy's global generator and the same call as in stable-baselines3's
                # `RolloutBuffer.get`, so that both learn the same minibatches from the same seed.
                order = np.random.permutation(len(observations))  # noqa: NPY002 (as it does)
                for first in range(0, len(order), self.batch_size):
                    rows = order[first : first + self.batch_size]
                    actor.rows(len(rows))
                    critic.rows(len(rows))
                    # Started first, so that the critic is learned in the other thread while the
                    # actor is learned here.
                    learned = submit(
                        critic_gradients, critic.network, observations, returns,
                        float(self.vf_coef), rows, critic.layers, critic.gradients,
                    )  # fmt: skip
                    loss, divergence = actor_gradients(
                        actor.network, observations, actions, advantages, log_probabilities,
                        log_std, clip_range, rows, actor.layers, actor.gradients,
                    )  # fmt: skip
                    critic_losses.append(learned())
                    actor_losses.append(loss)
                    divergences.append(divergence)
                    # As stable-baselines3: an update that has moved the policy too far ends before
                    # the step, not after.
                    go_on = self.target_kl is None or divergence <= 1.5 * self.target_kl
                    if not go_on:
                        break
                    # `torch.nn.utils.clip_grad_norm_` over all parameters: actor and critic share
                    # one norm.
                    norm = math.sqrt(square_norm(actor.gradients) + square_norm(critic.gradients))
                    shrink = min(1.0, self.max_grad_norm / (norm + 1e-6))
                    actor.step(optimiser.param_groups[0], shrink)
                    critic.step(optimiser.param_groups[0], shrink)
                if not go_on:
                    break
        self.logger.record("train/policy_gradient_loss", float(np.mean(actor_losses)))
        self.logger.record("train/value_loss", float(np.mean(critic_losses)))
        self.logger.record("train/approx_kl", float(np.mean(divergences)))


def walking_ppo(configuration: Configuration, device: str) -> WalkingPPO:
    """PPO with the network, training, environment's settings and seed of a `configuration`, without
    environments of its own, on a `device`: `cpu` or `cuda`.
    """
    training = configuration.training
    layers = [training.hidden_units, training.hidden_units]
    ppo = WalkingPPO(
        "MlpPolicy",
        None,  # type: ignore[arg-type]
        learning_rate=training.learning_rate,
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
            "optimizer_kwargs": {"eps": 1e-5, "fused": True},
        },
        seed=configuration.seed,
        device=device,
        _init_setup_model=False,
    )
    constants = configuration.environment
    size, limit = observation_size(constants), constants.action_limit
    # stable-baselines3 takes these from its environment; without one they are set before
    # `_setup_model` builds the network.
    ppo.observation_space = gymnasium.spaces.Box(-np.inf, np.inf, (size,), np.float32)
    ppo.action_space = gymnasium.spaces.Box(-limit, limit, (action_size(constants),), np.float32)
    ppo.n_envs = training.environments
    ppo.threads = min(training.workers, 2)
    with warnings.catch_warnings():
        # stable-baselines3 warns of a small network on a graphics card; which is faster was
        # measured (`choose_device`).
        warnings.filterwarnings("ignore", message=".*primarily intended to run on the CPU")
        ppo._setup_model()
    ppo.policy.get_parameter("log_std").requires_grad_(False)  # follows a schedule of the training
    return ppo


class Learner:
    """Network, optimiser and running statistics, and the episodes under way.

    The statistics normalise observations and rewards as stable-baselines3's VecNormalize does, but
    change only between rollouts. Those of mu are fixed by its bounds: a running variance would be
    almost zero while mu is nominal at the start of a training, and would upset the policy when
    the randomisation of mu starts.

    Parameters
    ----------
    configuration : of the training.
    device : `cpu` or `cuda`.

    Attributes
    ----------
    ppo : network and optimiser; `num_timesteps` counts the samples.
    """

    def __init__(self, configuration: Configuration, *, device: str = "cpu") -> None:
        self.ppo = walking_ppo(configuration, device)
        count = self.ppo.n_envs
        size = observation_size(configuration.environment)
        self._observations = RunningMeanStd(shape=(size,))
        self._returns = RunningMeanStd(shape=())
        low, high = parameter_bounds(configuration.randomisation)
        self._known = np.zeros(len(low)), np.ones(len(low))  # extended: mu is scaled already
        if configuration.environment.observation == "paper":
            self._known = 0.5 * (low + high), np.maximum(0.5 * (high - low), 1e-9) ** 2
        self._keep_known()
        self._random = np.random.default_rng(configuration.seed)
        self._libraries = ThreadpoolController()  # to look for them takes 3 ms, so it is done once
        self._starts = np.ones(count, dtype=bool)
        self._discounted = np.zeros(count)
        self._lengths = np.zeros(count, dtype=int)
        self._rewards = np.zeros(count)

    def _keep_known(self) -> None:
        mean, variance = self._known
        self._observations.mean[PARAMETERS_OBSERVED] = mean
        self._observations.var[PARAMETERS_OBSERVED] = variance

    def begin(self, seed: int) -> None:
        """Seed all random numbers with `seed` and start an episode in every environment."""
        self.ppo.set_random_seed(seed)
        self._random = np.random.default_rng(seed)
        # Discounted returns and lengths of unfinished episodes are forgotten as well, so that a
        # training that was resumed here and one that was not continue alike.
        self._starts[:] = True
        for array in (self._discounted, self._lengths, self._rewards):
            array[:] = 0

    def actor(self) -> dict[str, NDArray[Any]]:
        """Tensors of the current policy, as `storage.Policy` takes them."""
        tensors = {
            name: value.cpu().numpy() for name, value in self.ppo.policy.state_dict().items()
        }
        return {
            **tensors,
            "observation_mean": self._observations.mean,
            "observation_variance": self._observations.var,
        }

    def noise(self) -> NDArray[np.float32]:
        """Exploration (T, E, A) of a rollout."""
        deviation = torch.exp(self.ppo.policy.get_parameter("log_std").detach()).cpu().numpy()
        # Drawn for the whole rollout here, not in the workers: the noise does not depend on how
        # many there are.
        shape = self.ppo.n_steps, self.ppo.n_envs, len(deviation)
        normal = self._random.standard_normal(shape, dtype=np.float32)
        return np.asarray(normal * deviation, dtype=np.float32)

    @property
    def log_std(self) -> float:
        """Logarithm of the standard deviation of actions."""
        return float(self.ppo.policy.get_parameter("log_std")[0])

    @log_std.setter
    def log_std(self, value: float) -> None:
        self.ppo.policy.get_parameter("log_std").data.fill_(value)

    def learn(
        self, experience: RolloutBuffer, *, learning_rate: float
    ) -> list[tuple[int, float, float]]:
        """Update from a rollout made with the current `actor` and `noise`.

        Parameters
        ----------
        experience : the rollout.
        learning_rate : of Adam in this update.

        Returns
        -------
        Length, return and gait cycles of the episodes that ended.
        """
        ppo = self.ppo
        with self._libraries.limit(limits=1, user_api="blas"):
            # In this order: the rollout was walked with the statistics before it, so it is
            # normalised with them, and only then do they learn its observations.
            self._fill_buffer(experience)
            self._count_observations(experience)
            ppo.num_timesteps += experience.rewards.size
            ppo.lr_schedule = lambda _: learning_rate
            ppo.train()
        return self._episodes(experience)

    def _count_observations(self, experience: RolloutBuffer) -> None:
        size = experience.observations.shape[-1]
        # From the second row on: the first is the last of the rollout before, which has been
        # counted.
        self._observations.update(experience.observations[1:].reshape(-1, size))
        self._keep_known()

    def _normalised(self, observations: NDArray[np.float32]) -> torch.Tensor:
        """(B, size) from (…, size), as `Policy.act` normalises."""
        flat = observations.reshape(-1, observations.shape[-1])
        normalised = (flat - self._observations.mean) / np.sqrt(self._observations.var + 1e-8)
        clipped = np.clip(normalised, -OBSERVATION_CLIP, OBSERVATION_CLIP).astype(np.float32)
        return torch.from_numpy(clipped).to(self.ppo.device)

    def _normalised_rewards(self, experience: RolloutBuffer) -> NDArray[np.float32]:
        discounted = np.empty(experience.rewards.shape)
        for t, rewards in enumerate(experience.rewards):
            discounted[t] = self._discounted = self._discounted * self.ppo.gamma + rewards
            # VecNormalize scales rewards by the standard deviation of the running discounted
            # return, which restarts with an episode.
            self._discounted = np.where(experience.ended[t], 0.0, self._discounted)
        self._returns.update(discounted.ravel())
        scaled = experience.rewards / np.sqrt(self._returns.var + 1e-8)
        return np.clip(scaled, -_REWARD_CLIP, _REWARD_CLIP).astype(np.float32)

    def _fill_buffer(self, experience: RolloutBuffer) -> None:
        """What stable-baselines3's `collect_rollouts` leaves in the buffer."""
        ppo, buffer = self.ppo, self.ppo.rollout_buffer
        buffer.reset()
        steps, count = experience.rewards.shape
        seen = self._normalised(experience.observations)
        before = seen[: steps * count]
        actions = torch.from_numpy(experience.actions.reshape(len(before), -1).copy()).to(
            ppo.device
        )
        values, log_prob = ppo.judged(seen, actions)
        # The observations after the last action: their values continue the advantages beyond the
        # rollout.
        last = values[steps * count :]
        buffer.observations[:] = before.cpu().numpy().reshape(buffer.observations.shape)
        buffer.actions[:] = experience.actions
        buffer.values[:] = values[: steps * count].cpu().numpy().reshape(steps, count)
        buffer.log_probs[:] = log_prob.cpu().numpy().reshape(steps, count)
        buffer.rewards[:] = self._normalised_rewards(experience)
        # It would have continued, so its value counts.
        cut_off = experience.ended & ~experience.fell
        if cut_off.any():
            with torch.no_grad():
                final = ppo.policy.predict_values(
                    self._normalised(experience.final_observations[cut_off])
                )
            buffer.rewards[cut_off] += ppo.gamma * final.cpu().numpy().ravel()
        buffer.episode_starts[0] = self._starts
        buffer.episode_starts[1:] = experience.ended[:-1]
        self._starts = experience.ended[-1].copy()
        buffer.pos, buffer.full = steps, True
        buffer.compute_returns_and_advantage(last, self._starts)

    def _episodes(self, experience: RolloutBuffer) -> list[tuple[int, float, float]]:
        episodes = []
        for t, ended in enumerate(experience.ended):
            self._lengths += 1
            self._rewards += experience.rewards[t]
            for i in np.flatnonzero(ended):
                cycles = float(experience.cycles[t, i])
                episodes.append((int(self._lengths[i]), float(self._rewards[i]), cycles))
                self._lengths[i] = self._rewards[i] = 0
        return episodes

    def tensors(self) -> dict[str, torch.Tensor]:
        """Network, optimiser and statistics, by name."""
        ppo = self.ppo
        tensors = {name: v.cpu().contiguous() for name, v in ppo.policy.state_dict().items()}
        for name, parameter in ppo.policy.named_parameters():
            for key, value in ppo.policy.optimizer.state.get(parameter, {}).items():
                tensors[f"optimiser.{name}.{key}"] = torch.as_tensor(value).cpu().contiguous()
        seen, returns = self._observations, self._returns
        tensors["observation_mean"] = torch.from_numpy(np.array(seen.mean))
        tensors["observation_variance"] = torch.from_numpy(np.array(seen.var))
        tensors["observation_count"] = torch.tensor([seen.count], dtype=torch.float64)
        statistics = [float(returns.mean), float(returns.var), float(returns.count)]
        tensors["return_statistics"] = torch.tensor(statistics, dtype=torch.float64)
        return tensors

    def restore(self, tensors: dict[str, torch.Tensor]) -> None:
        """Restore what `tensors` gave; the optimiser's state only if present. Raises KeyError or
        RuntimeError if they are of another network.
        """
        policy = self.ppo.policy
        policy.load_state_dict({name: tensors[name].float() for name in policy.state_dict()})
        for name, parameter in policy.named_parameters():
            prefix = f"optimiser.{name}."
            found = {
                key.removeprefix(prefix): value.to(self.ppo.device, copy=True)
                for key, value in tensors.items()
                if key.startswith(prefix)
            }
            if found:
                policy.optimizer.state[parameter] = found
        seen, returns = self._observations, self._returns
        seen.mean = tensors["observation_mean"].numpy().copy()
        seen.var = tensors["observation_variance"].numpy().copy()
        seen.count = float(tensors["observation_count"][0])
        mean, variance, count = tensors["return_statistics"].numpy()
        returns.mean, returns.var, returns.count = mean, variance, float(count)
