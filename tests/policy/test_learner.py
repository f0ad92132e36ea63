"""What the learner makes of a rollout is what stable-baselines3 makes of it."""

import numpy as np
import pytest
import torch
from stable_baselines3 import PPO
from stable_baselines3.common.callbacks import CallbackList
from stable_baselines3.common.logger import Logger
from stable_baselines3.common.vec_env import VecEnv, VecNormalize

from gaitval.configuration import Configuration
from gaitval.errors import ConfigurationError
from gaitval.model.parameters import nominal_parameters, parameter_bounds
from gaitval.policy import learner as module
from gaitval.policy.device import choose_device
from gaitval.policy.learner import Learner
from gaitval.policy.observation import OBSERVATION_CLIP, OBSERVATION_SIZES, PARAMETERS_OBSERVED
from gaitval.policy.policy_update import _tanh
from gaitval.policy.rollout_buffer import RolloutBuffer
from gaitval.policy.storage import Policy

STEPS, COUNT, SIZE = 24, 4, OBSERVATION_SIZES["extended"]


def configuration(**training):
    small = {
        "environments": COUNT,
        "rollout_steps": STEPS,
        "batch_size": 32,
        "epochs": 3,
        "hidden_units": 16,
        "learning_rate": 2e-3,
        "target_kl": 1e3,
    }
    return Configuration.model_validate({"training": small | training})


def learner(**training):
    made = Learner(configuration(**training))
    made.ppo.set_logger(Logger(None, []))
    made.begin(1)
    return made


def experience(made, seed):
    """Made up, but for the actions, which are the policy's with noise. Episodes of environment 0
    end by falls and those of environment 1 by their length. One observation and one reward, at the
    end of an episode, are so large that they are clipped: the reward in a second rollout alone, or
    it would be no rarity."""
    random = np.random.default_rng(seed)
    observations = random.normal(0.3, 2.0, (STEPS + 1, COUNT, SIZE)).astype(np.float32)
    observations[9, 1] *= 100.0
    rewards = random.uniform(0.0, 1.0, (STEPS, COUNT)).astype(np.float32)
    rewards[20, 0] += 1000.0 * seed
    policy = Policy(made.actor(), {})
    actions = policy.act(observations[:-1].reshape(-1, SIZE)).reshape(STEPS, COUNT, 26)
    fell, ended = (np.zeros((STEPS, COUNT), dtype=bool) for _ in range(2))
    fell[[3, 20], 0] = True
    ended[[3, 20], 0] = ended[[7, STEPS - 1], 1] = True
    return RolloutBuffer(
        observations=observations,
        actions=(actions + made.noise()).astype(np.float32),
        rewards=rewards,
        fell=fell,
        ended=ended,
        final_observations=random.normal(size=(STEPS, COUNT, SIZE)).astype(np.float32),
        cycles=np.cumsum(np.full((STEPS, COUNT), 0.03, dtype=np.float32), axis=0),
        terms=np.zeros((STEPS, COUNT, 8), dtype=np.float32),
    )


class Replay(VecEnv):
    """An experience as stable-baselines3's environments would have given it."""

    def __init__(self, ppo, experience):
        super().__init__(COUNT, ppo.observation_space, ppo.action_space)
        self.experience, self.t = experience, 0

    def reset(self):
        return self.experience.observations[0]

    def step_async(self, actions):
        limit = self.action_space.high[0]
        expected = np.clip(self.experience.actions[self.t], -limit, limit)
        np.testing.assert_array_equal(actions, expected)

    def step_wait(self):
        e, t = self.experience, self.t
        infos = [
            {
                "terminal_observation": e.final_observations[t, i],
                "TimeLimit.truncated": not e.fell[t, i],
            }
            if e.ended[t, i]
            else {}
            for i in range(COUNT)
        ]
        self.t += 1
        return e.observations[t + 1], e.rewards[t].copy(), e.ended[t].copy(), infos

    def get_attr(self, attr_name, indices=None):
        return [None] * COUNT

    close = set_attr = env_method = env_is_wrapped = None


def equal_buffers(ours, theirs):
    for name in ("observations", "actions", "episode_starts"):
        np.testing.assert_array_equal(getattr(ours, name), getattr(theirs, name), err_msg=name)
    for name in ("values", "log_probs", "rewards", "advantages", "returns"):
        # In single precision, for another number of rows at once.
        np.testing.assert_allclose(
            getattr(ours, name), getattr(theirs, name), rtol=1e-4, atol=2e-5, err_msg=name
        )


def test_the_buffer_is_that_of_stable_baselines3(monkeypatch):
    """Two rollouts, replayed through VecNormalize and PPO.collect_rollouts with the statistics
    that the learner had; the statistics after them, against VecNormalize's own."""
    ours, theirs = learner(), learner()
    counting = None
    for seed in range(2):
        happened = experience(ours, seed)
        seen = ours._observations.copy()
        ours._fill_buffer(happened)

        replay = Replay(theirs.ppo, happened)
        still = VecNormalize(replay, training=False, clip_obs=OBSERVATION_CLIP, epsilon=1e-8)
        still.obs_rms, still.ret_rms = seen, ours._returns
        actions = iter(torch.from_numpy(happened.actions))

        def forward(observations, actions=actions, policy=theirs.ppo.policy):
            action = next(actions)
            values, log_prob, _ = policy.evaluate_actions(observations, action)
            return action, values, log_prob

        monkeypatch.setattr(theirs.ppo.policy, "forward", forward)
        theirs.ppo._last_obs = still.reset()
        if seed == 0:
            theirs.ppo._last_episode_starts = np.ones(COUNT, dtype=bool)
        theirs.ppo.ep_info_buffer = theirs.ppo.ep_success_buffer = []
        callback = CallbackList([])
        callback.init_callback(theirs.ppo)
        theirs.ppo.collect_rollouts(still, callback, theirs.ppo.rollout_buffer, STEPS)
        equal_buffers(ours.ppo.rollout_buffer, theirs.ppo.rollout_buffer)

        if counting is None:
            counting = VecNormalize(replay, gamma=ours.ppo.gamma)
        counting.venv, replay.t = replay, 0
        for action in happened.actions:
            counting.step(action)
        ours._count_observations(happened)
        for name in ("mean", "var", "count"):
            ret, expected = getattr(ours._returns, name), getattr(counting.ret_rms, name)
            np.testing.assert_allclose(ret, expected, rtol=1e-9)
            obs, expected = getattr(ours._observations, name), getattr(counting.obs_rms, name)
            if name != "count":
                obs, expected = (np.delete(x, PARAMETERS_OBSERVED) for x in (obs, expected))
            np.testing.assert_allclose(
                obs, expected, rtol=1e-5, atol=1e-6
            )  # single precision of the batch


def test_the_hyperbolic_tangent_of_single_precision():
    requested = np.linspace(-12.0, 12.0, 200_001).astype(np.float32)
    wanted = np.tanh(requested.astype(float))
    found = requested.copy()
    _tanh(found)
    unit = np.spacing(np.abs(wanted).astype(np.float32))
    assert (np.abs(found - wanted) / unit).max() < 6.0
    double = requested.astype(float)
    _tanh(double)
    np.testing.assert_allclose(double, wanted, rtol=0, atol=1e-15)


def in_double(made):
    """Network and buffer in double precision, where two computations of one thing agree far
    better than two different things."""
    policy, buffer = made.ppo.policy.double(), made.ppo.rollout_buffer
    policy.extract_features = lambda observations, *_: observations  # its own are single
    for name in ("observations", "advantages", "returns", "log_probs"):
        setattr(buffer, name, getattr(buffer, name).astype(float))


def updated(target_kl, *, double):
    """Our learner and stable-baselines3's PPO after three updates from the same rollouts; the
    weights at the start; divergences."""
    ours, theirs = learner(target_kl=target_kl), learner(target_kl=target_kl)
    start = {name: value.clone() for name, value in ours.tensors().items()}
    divergences = []
    for seed in range(3):
        happened = experience(ours, seed)
        for each, train in ((ours, type(ours.ppo).train), (theirs, PPO.train)):
            each.ppo.policy.float()
            each.begin(seed)
            each._fill_buffer(happened)
            before = each.ppo.policy.state_dict()["action_net.weight"].clone()
            if double:
                in_double(each)
            train(each.ppo)
            assert not torch.equal(before, each.ppo.policy.state_dict()["action_net.weight"])
            logged = each.ppo.logger.name_to_value
            divergences.append([logged[f"train/{name}"] for name in LOGGED])
    return ours.tensors(), theirs.tensors(), start, np.array(divergences).reshape(3, 2, -1)


LOGGED = ("approx_kl", "policy_gradient_loss", "value_loss")


@pytest.mark.parametrize("target_kl", [1e3, 0.01])
@pytest.mark.slow  # single precision is tested always
def test_the_update_is_that_of_stable_baselines3(target_kl):
    """Every tensor and the optimiser's state, after three updates in double precision; with the
    smaller limit on the divergence the epochs end early."""
    ours, expected, _, logged = updated(target_kl, double=True)
    assert any(name.endswith("exp_avg_sq") for name in expected)
    assert set(ours) == set(expected)
    for name, value in ours.items():
        np.testing.assert_allclose(value, expected[name], rtol=1e-6, atol=1e-8, err_msg=name)
    steps = ours["optimiser.action_net.bias.step"].item()
    assert (steps == 3 * 3 * 3) == (target_kl == 1e3)
    assert logged[:, 0, 0].max() > 0.0
    losses = logged[:, :, 1:]  # its divergence is of the last epoch
    np.testing.assert_allclose(losses[:, 0], losses[:, 1], rtol=1e-5, atol=1e-7)


def test_the_update_is_that_of_stable_baselines3_in_single_precision():
    """Rounding changes the way that the weights have gone by a small part of its length."""
    ours, expected, start, _ = updated(1e3, double=False)
    for name, value in ours.items():
        if name.endswith((".weight", ".bias")) and not name.startswith("optimiser"):
            way = (expected[name] - start[name]).norm()
            assert way > 0.0
            assert (value - expected[name]).norm() < 1e-3 * way, name


@pytest.mark.parametrize(("share", "ends"), [(1.6, True), (1.4, False)])
def test_an_update_ends_beyond_one_and_a_half_times_the_limit(monkeypatch, share, ends):
    """Before the step of the minibatch in which the policy has moved too far."""
    made = learner(target_kl=0.01)
    made._fill_buffer(experience(made, 0))
    made.ppo.lr_schedule = lambda _: 1e-3
    monkeypatch.setattr(module, "actor_gradients", lambda *_: (0.0, share * 0.01))
    made.ppo.train()
    state = made.tensors().get("optimiser.action_net.bias.step", torch.tensor(0.0))
    assert state.item() == (0 if ends else 3 * 3)


def test_elsewhere_than_on_the_processor_the_update_is_stable_baselines3s_own(monkeypatch):
    made, called = learner(), []
    monkeypatch.setattr(PPO, "train", lambda ppo: called.append(ppo))
    made._fill_buffer(experience(made, 0))
    made.ppo.lr_schedule = lambda _: 1e-3
    made.ppo.train()
    assert not called
    monkeypatch.setattr(made.ppo, "device", torch.device("cuda"))
    made.ppo.train()
    assert called == [made.ppo]


def test_the_parameters_keep_the_scale_of_their_bounds():
    """mu scaled by its bounds in the extended observation, as it is in the paper's."""
    made = learner()
    happened = experience(made, 0)
    made.learn(happened, learning_rate=1e-3)
    tensors = made.tensors()
    assert torch.all(tensors["observation_mean"][PARAMETERS_OBSERVED] == 0.0)
    assert torch.all(tensors["observation_variance"][PARAMETERS_OBSERVED] == 1.0)
    assert tensors["observation_mean"].abs().min() == 0.0 < tensors["observation_mean"].abs().max()
    values = configuration().model_dump()
    values["environment"]["observation"] = "paper"
    paper = Learner(Configuration.model_validate(values)).tensors()
    middle = paper["observation_mean"][PARAMETERS_OBSERVED].numpy()
    half_range = paper["observation_variance"][PARAMETERS_OBSERVED].sqrt().numpy()
    assert np.all(np.abs(nominal_parameters() - middle) <= half_range + 1e-12)
    lower, upper = parameter_bounds(configuration().randomisation)
    np.testing.assert_allclose(middle - half_range, lower, atol=1e-9)
    np.testing.assert_allclose(middle + half_range, upper, atol=1e-9)


def test_episodes_are_counted_across_rollouts():
    made = learner()
    first, second = experience(made, 0), experience(made, 1)
    episodes = made.learn(first, learning_rate=1e-3)
    assert [length for length, _, _ in episodes] == [4, 8, 17, STEPS - 8]
    assert episodes[0][1] == pytest.approx(first.rewards[:4, 0].sum(), rel=1e-6)
    assert episodes[0][2] == first.cycles[3, 0]
    episodes = made.learn(second, learning_rate=1e-3)
    assert [length for length, _, _ in episodes] == [4 + STEPS - 21, 8, 17, STEPS - 8]
    # the first one began in the rollout before, and the third where the first ended
    both = np.concatenate([first.rewards[21:, 0], second.rewards[:4, 0]]).sum()
    assert episodes[0][1] == pytest.approx(both, rel=1e-6)
    assert episodes[2][1] == pytest.approx(second.rewards[4:21, 0].sum(), rel=1e-6)
    assert made.ppo.num_timesteps == 2 * STEPS * COUNT
    made.begin(0)
    again = made.learn(first, learning_rate=1e-3)
    assert again[0][0] == 4
    assert again[0][1] == pytest.approx(first.rewards[:4, 0].sum(), rel=1e-6)


def test_what_was_restored_learns_the_same():
    made = learner()
    made.learn(experience(made, 0), learning_rate=1e-3)
    other = learner()
    other.restore(made.tensors())
    for each in (made, other):
        each.begin(3)
        each.learn(experience(each, 1), learning_rate=1e-3)
    for name, value in made.tensors().items():
        assert torch.equal(value, other.tensors()[name]), name


# ---- Devices. ----


@pytest.mark.parametrize(
    ("wanted", "there", "expected"),
    [
        ("auto", True, "cuda"),
        ("auto", False, "cpu"),
        ("cpu", True, "cpu"),
        ("cuda", True, "cuda"),
    ],
)
def test_a_device_is_taken_where_it_is_asked_for(monkeypatch, wanted, there, expected):
    monkeypatch.setattr(torch.cuda, "is_available", lambda: there)
    assert choose_device(configuration(device=wanted)) == expected


def test_by_default_a_seed_means_the_same_policy_with_cuda_and_without(monkeypatch):
    monkeypatch.setattr(torch.cuda, "is_available", lambda: True)
    assert choose_device(Configuration()) == "cpu"


def test_a_device_that_is_not_there(monkeypatch):
    monkeypatch.setattr(torch.cuda, "is_available", lambda: False)
    with pytest.raises(ConfigurationError, match=r"training\.device: it is cuda, but"):
        choose_device(configuration(device="cuda"))
