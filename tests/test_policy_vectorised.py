"""Environments in worker processes are the same as environments here."""

import multiprocessing as mp
import os
import signal
from pathlib import Path

import numpy as np
import pytest
from simulation_fixtures import changed
from stable_baselines3.common.vec_env import VecNormalize

from gaitval.policy.environment import WalkingEnvironment
from gaitval.policy.vectorised import WalkingVecEnv

COUNT = 5
SHARED_MEMORY = Path("/dev/shm")


@pytest.fixture(scope="module")
def short(task):
    """Episodes of 0.3 s, so that some end with their time and some with a fall."""
    return changed(task, environment={"episode_seconds": 0.3, "push_probability": 0.5})


@pytest.fixture(scope="module")
def vectorised(short):
    environments = WalkingVecEnv(short, count=COUNT, workers=2)  # three and two each
    yield environments
    environments.close()


def test_it_equals_single_environments_one_by_one(short, vectorised):
    """Observations, rewards, ends and infos, bit for bit, over several episodes of each."""
    singles = [WalkingEnvironment(short) for _ in range(COUNT)]
    for single in singles:
        single.difficulty = 0.5
    vectorised.set_difficulty(0.5)
    assert vectorised.seed(40) == [40, 41, 42, 43, 44]
    seen = vectorised.reset()
    expected = [single.reset(seed=40 + i)[0] for i, single in enumerate(singles)]
    np.testing.assert_array_equal(seen, expected)

    random = np.random.default_rng(0)
    lengths, returns, falls, timeouts = np.zeros(COUNT), np.zeros(COUNT), 0, 0
    for _ in range(60):
        # Environment 0 is thrown about until it falls.
        scale = np.where(np.arange(COUNT) == 0, 4.0, 0.3)[:, None]
        actions = (scale * random.standard_normal((COUNT, 25))).astype(np.float32)
        seen, rewards, ended, infos = vectorised.step(actions)
        terms = vectorised.terms.copy()
        for i, single in enumerate(singles):
            observation, reward, fell, over, info = single.step(actions[i])
            lengths[i] += 1
            returns[i] += np.float32(reward)
            assert rewards[i] == np.float32(reward)
            np.testing.assert_array_equal(terms[i], info["reward_terms"])
            assert ended[i] == (fell or over)
            if ended[i]:
                np.testing.assert_array_equal(infos[i]["terminal_observation"], observation)
                assert infos[i]["TimeLimit.truncated"] == (not fell)
                assert infos[i]["episode"]["l"] == lengths[i]
                assert infos[i]["episode"]["r"] == pytest.approx(returns[i], rel=1e-6)
                assert infos[i]["cycles"] == info["cycles"]
                lengths[i] = returns[i] = 0
                falls += fell
                timeouts += not fell
                observation, _ = single.reset()
            else:
                assert infos[i] == {}
            np.testing.assert_array_equal(seen[i], observation)
    assert falls > 0
    assert timeouts > 0


def test_what_it_returns_is_not_overwritten(vectorised):
    seen = vectorised.reset()
    kept = seen.copy()
    observations, rewards, _, _ = vectorised.step(np.zeros((COUNT, 25), dtype=np.float32))
    np.testing.assert_array_equal(seen, kept)
    kept_observations, kept_rewards = observations.copy(), rewards.copy()
    vectorised.step(np.ones((COUNT, 25), dtype=np.float32))
    np.testing.assert_array_equal(observations, kept_observations)
    np.testing.assert_array_equal(rewards, kept_rewards)


def test_stable_baselines_can_normalise_it(vectorised):
    normalised = VecNormalize(vectorised)
    observation = normalised.reset()
    assert observation.shape == (COUNT, 124)
    for _ in range(3):
        observation, *_ = normalised.step(np.zeros((COUNT, 25), dtype=np.float32))
    assert np.isfinite(observation).all()


def test_closing_frees_the_shared_memory_and_ends_the_workers(short):
    environments = WalkingVecEnv(short, count=1, workers=1)
    name, processes = environments._memory.name, list(environments._processes)
    assert (SHARED_MEMORY / name).exists()
    assert all(process.is_alive() for process in processes)
    environments.close()
    assert not (SHARED_MEMORY / name).exists()
    assert not any(process.is_alive() for process in processes)
    assert [process.exitcode for process in processes] == [0]


def test_an_error_in_a_worker_reaches_the_trainer(short):
    environments = WalkingVecEnv(short, count=1, workers=1)
    try:
        environments.set_difficulty("hard")
        with pytest.raises(RuntimeError, match=r"worker process .*(?s:.*)environment\.py"):
            environments.reset()
    finally:
        environments.close()
    assert not set(mp.active_children()) & set(environments._processes)


def test_a_killed_worker_is_reported_and_cleaned_up(short):
    environments = WalkingVecEnv(short, count=2, workers=2)
    name = environments._memory.name
    try:
        environments.reset()
        os.kill(environments._processes[1].pid, signal.SIGKILL)
        environments._processes[1].join(5)
        with pytest.raises(RuntimeError, match="killed, perhaps because"):
            environments.step(np.zeros((2, 25), dtype=np.float32))
    finally:
        environments.close()
    assert not (SHARED_MEMORY / name).exists()
