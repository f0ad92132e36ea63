"""Stored policies: the same actions after saving, the same network as stable-baselines3's."""

import json
import pickle

import gymnasium
import numpy as np
import pytest
import torch
from safetensors.numpy import load_file, save_file
from simulation_fixtures import changed, random_policy
from stable_baselines3.common.policies import ActorCriticPolicy
from stable_baselines3.common.running_mean_std import RunningMeanStd
from stable_baselines3.common.vec_env import DummyVecEnv, VecNormalize

from gaitval.configuration import EnvironmentSettings
from gaitval.errors import PolicyError
from gaitval.model.urdf import model_hash
from gaitval.policy.environment import WalkingEnvironment
from gaitval.policy.observation import OBSERVATION_CLIP, OBSERVATION_SIZES
from gaitval.policy.storage import (
    NETWORK,
    NORMALISATION,
    Policy,
    load_policy,
    load_start,
    save_policy,
)


@pytest.fixture(scope="module")
def policy(task):
    return random_policy(task, scale=0.5)


@pytest.fixture
def folder(policy, tmp_path):
    save_policy(policy, tmp_path)
    return tmp_path


def observations(count=200, size=126):
    return np.random.default_rng(1).normal(0.0, 2.0, (count, size)).astype(np.float32)


# ---- Saving and loading. ----


@pytest.mark.parametrize("name", [*NETWORK, *NORMALISATION])
def test_its_key_is_another_where_one_number_that_it_acts_by_is(policy, name):
    """What was found for a key is not found again: action biases, and walks up to a push."""
    tensor = policy.tensors[name].copy()
    tensor.flat[-1] += np.float32(0.01)
    other = Policy({**policy.tensors, name: tensor}, policy.about)
    assert other.key != policy.key
    same = Policy(dict(policy.tensors), {"subject": "somebody"})
    assert same.key == policy.key


def test_a_stored_policy_acts_the_same_bit_for_bit(policy, folder):
    loaded = load_policy(folder)
    seen = observations()
    np.testing.assert_array_equal(loaded.act(seen), policy.act(seen))
    for observation in seen[:5]:
        np.testing.assert_array_equal(loaded.act(observation), policy.act(observation))
    assert set(loaded.tensors) == set(policy.tensors)
    for name, value in policy.tensors.items():
        np.testing.assert_array_equal(loaded.tensors[name], value)
        assert loaded.tensors[name].dtype == value.dtype
    assert loaded.about == policy.about


def test_files_are_open_formats_and_reproducible(policy, folder, tmp_path):
    tensors = load_file(folder / "policy.safetensors")
    assert set(NETWORK) | set(NORMALISATION) <= set(tensors)
    about = json.loads((folder / "policy.json").read_text())
    assert about["subject"] == "S05"
    save_policy(policy, tmp_path / "again")
    for name in ("policy.safetensors", "policy.json"):
        assert (tmp_path / "again" / name).read_bytes() == (folder / name).read_bytes()
    assert {path.name for path in folder.iterdir()} == {
        "policy.safetensors",
        "policy.json",
        "again",
    }


# ---- The network. ----


def test_actions_are_those_of_stable_baselines3():
    """A policy of stable-baselines3 and the normalisation of its VecNormalize, and ours of the
    same numbers; single precision sums in another order leave 1e-6."""
    torch.manual_seed(0)
    size = 126
    network = ActorCriticPolicy(
        gymnasium.spaces.Box(-np.inf, np.inf, (size,), np.float32),
        gymnasium.spaces.Box(-4.0, 4.0, (26,), np.float32),
        lambda _: 1e-3,
        net_arch={"pi": [32, 32], "vf": [32, 32]},
        activation_fn=torch.nn.Tanh,
        ortho_init=False,
    )
    statistics = RunningMeanStd(shape=(size,))
    statistics.update(np.random.default_rng(0).normal(0.5, 3.0, (500, size)))
    space = gymnasium.spaces.Box(-np.inf, np.inf, (size,), np.float32)

    class Still(gymnasium.Env):
        observation_space = space
        action_space = network.action_space

    normalise = VecNormalize(
        DummyVecEnv([Still]), training=False, clip_obs=OBSERVATION_CLIP, epsilon=1e-8
    )
    normalise.obs_rms = statistics
    tensors = {name: value.numpy() for name, value in network.state_dict().items()}
    ours = Policy(
        {
            **tensors,
            "observation_mean": statistics.mean,
            "observation_variance": statistics.var,
        },
        {},
    )
    seen = observations()
    seen[0] = 1e4  # beyond the clip
    expected, _ = network.predict(normalise.normalize_obs(seen), deterministic=True)
    np.testing.assert_allclose(ours.act(seen), expected, atol=2e-6)
    assert np.abs(expected).max() > 0.1
    assert ours.act(seen).dtype == np.float32


def test_one_observation_gives_the_row_of_the_batch(policy):
    seen = observations(20)
    batch = policy.act(seen)
    assert batch.shape == (20, 26)
    for observation, row in zip(seen, batch, strict=True):
        single = policy.act(observation)
        assert single.shape == (26,)
        np.testing.assert_allclose(single, row, atol=1e-6)


@pytest.mark.parametrize("observation", list(OBSERVATION_SIZES))
def test_policies_fit_what_the_environment_observes(task, observation):
    chosen = changed(task, environment={"observation": observation})
    policy = random_policy(chosen, scale=0.1)
    environment = WalkingEnvironment(chosen)
    seen, _ = environment.reset(seed=0)
    assert environment.action_space.contains(policy.act(seen))


# ---- What is refused. ----


def test_no_policy(tmp_path):
    with pytest.raises(PolicyError, match=r"there is no policy here.*gaitval stage train"):
        load_policy(tmp_path)


def test_another_model(folder):
    with pytest.raises(PolicyError, match=r"trained for S05 .*but the model here is 0123"):
        load_policy(folder, model_hash="0123456789abcdef")


def test_another_observation(folder):
    with pytest.raises(PolicyError, match=r"environment\.observation = 'extended'.*'paper'"):
        load_policy(folder, environment=EnvironmentSettings(observation="paper"))


@pytest.mark.parametrize(
    ("names", "kept", "message"),
    [
        ((NETWORK[0], *NORMALISATION), np.s_[..., :-1], "observes 125 numbers, but .* has 126"),
        (NETWORK[4:], np.s_[:-2], "chooses 24 numbers, but a walker here takes 26"),
    ],
)
def test_a_walker_that_sees_or_does_something_else(policy, tmp_path, names, kept, message):
    """As of an earlier version: a walk would fail at the first product, without saying why."""
    other = {name: np.ascontiguousarray(policy.tensors[name][kept]) for name in names}
    save_policy(Policy({**policy.tensors, **other}, policy.about), tmp_path)
    with pytest.raises(PolicyError, match=message):
        load_policy(tmp_path, environment=EnvironmentSettings())


def test_other_actions(folder):
    """Walked with another action scale or without the mirror it would be silently wrong."""
    with pytest.raises(PolicyError, match=r"environment\.action_scale = 0\.2.*0\.3"):
        load_policy(folder, environment=EnvironmentSettings(action_scale=0.3))
    with pytest.raises(PolicyError, match=r"environment\.mirror = True.*False"):
        load_policy(folder, environment=EnvironmentSettings(mirror=False))


def test_a_training_starts_from_its_own_policy_or_a_general_one(task, policy, folder, tmp_path):
    own = model_hash(task.model)
    assert load_start(folder, EnvironmentSettings(), model_hash=own).about == policy.about
    for other in (None, "0123456789abcdef"):
        with pytest.raises(PolicyError, match=r"trained for S05 only .*Start from a general"):
            load_start(folder, EnvironmentSettings(), model_hash=other)
    about = {k: v for k, v in policy.about.items() if k not in ("subject", "model_hash")}
    save_policy(Policy(policy.tensors, {**about, "general": True}), tmp_path / "general")
    for other in (None, own, "0123456789abcdef"):
        assert load_start(tmp_path / "general", EnvironmentSettings(), model_hash=other).about[
            "general"
        ]
    with pytest.raises(PolicyError, match=r"environment\.observation = 'extended'.*'paper'"):
        load_start(tmp_path / "general", EnvironmentSettings(observation="paper"))
    with pytest.raises(PolicyError, match="a general policy, which was trained on several people"):
        load_policy(tmp_path / "general", model_hash=own)


@pytest.mark.parametrize("size", [0, 7, 200, -1])
def test_a_truncated_file(folder, size):
    path = folder / "policy.safetensors"
    path.write_bytes(path.read_bytes()[:size])
    with pytest.raises(PolicyError, match=r"policy\.safetensors: cannot be read"):
        load_policy(folder)


def test_a_pickle_that_was_renamed_is_not_opened(folder, tmp_path):
    """Unpickling runs what the file says; this one would leave a file behind."""
    trap = tmp_path / "trap"

    class Trap:
        def __reduce__(self):
            return (open, (str(trap), "w"))

    (folder / "policy.safetensors").write_bytes(pickle.dumps(Trap()))
    with pytest.raises(PolicyError, match="cannot be read as safetensors"):
        load_policy(folder)
    torch.save({"weight": torch.zeros(3)}, folder / "policy.safetensors")
    with pytest.raises(PolicyError, match="cannot be read as safetensors"):
        load_policy(folder)
    assert not trap.exists()


@pytest.mark.parametrize("content", ["", "{", "[]", '{"format": 99}', '"policy"'])
def test_a_damaged_description(folder, content):
    (folder / "policy.json").write_text(content)
    with pytest.raises(PolicyError, match=r"policy\.json"):
        load_policy(folder)


def with_nan(tensor):
    return np.where(np.arange(len(tensor)) == 3, np.nan, tensor)


@pytest.mark.parametrize(
    ("name", "change", "message"),
    [
        ("action_net.bias", with_nan, "not finite"),
        ("action_net.bias", lambda t: t + np.inf, "not finite"),
        ("action_net.weight", None, r"action_net\.weight are missing"),
        ("observation_mean", None, "observation_mean are missing"),
        (NETWORK[0], lambda t: t[0], r"policy_net\.0\.weight has the shape \(126,\)"),
        (NETWORK[1], lambda t: t[:-1], r"policy_net\.0\.bias has the shape .*does not fit"),
        (NETWORK[2], lambda t: t[:, :3], r"policy_net\.2\.weight has the shape"),
        (NETWORK[4], lambda t: t.ravel(), r"action_net\.weight has the shape"),
        (NETWORK[4], lambda t: t[0, :1], r"action_net\.weight has the shape \(1,\)"),
        (NETWORK[5], lambda t: t[:0], r"action_net\.bias has the shape \(0,\)"),
        ("observation_mean", lambda t: t[:5], r"observation_mean has the shape \(5,\)"),
        ("observation_variance", lambda t: -t, "observation_variance is negative"),
        (NETWORK[3], lambda t: t.astype(np.int64), "is of type int64"),
        (NETWORK[3], lambda t: t.astype(bool), "is of type bool"),
    ],
)
def test_tensors_that_do_not_fit_each_other(folder, name, change, message):
    """They would end a training with an internal error, or walk nowhere."""
    tensors = load_file(folder / "policy.safetensors")
    tensor = tensors.pop(name)
    if change is not None:
        tensors[name] = np.ascontiguousarray(change(tensor))
    save_file(tensors, folder / "policy.safetensors")
    with pytest.raises(PolicyError, match=message):
        load_policy(folder)


@pytest.mark.parametrize("content", ['{"environment": []}', "[]", '"all"', "1"])
def test_settings_that_are_no_table(folder, content):
    about = json.loads((folder / "policy.json").read_text())
    about["configuration"] = json.loads(content)
    (folder / "policy.json").write_text(json.dumps(about))
    with pytest.raises(PolicyError, match=r"policy\.json: .*not a table of settings"):
        load_policy(folder, environment=EnvironmentSettings())
