"""Environments in worker processes are the same as environments here."""

import multiprocessing as mp

import numpy as np
import pytest
from simulation_fixtures import changed, random_policy

from gaitval.policy.environment import WalkingEnvironment
from gaitval.policy.rollout_buffer import WalkingWorkers

COUNT, STEPS = 11, 30


@pytest.fixture(scope="module")
def short(task):
    """Episodes of 0.3 s, so that some end with their time and some with a fall."""
    return changed(task, environment={"episode_seconds": 0.3, "push_probability": 0.5})


@pytest.fixture(scope="module")
def other(short):
    """The same person in other shoes: an environment of this task does something else."""
    return changed(short, contact={"stiffness": 1e6})


@pytest.fixture(scope="module")
def workers(short, other):
    with WalkingWorkers([short, other], count=COUNT, workers=2, steps=STEPS) as workers:
        yield workers  # a whole group of eight, and one of three


def noise(seed, scale=0.3):
    """Environment 0 is thrown about until it falls."""
    scales = np.where(np.arange(COUNT) == 0, 4.0, scale)[:, None]
    normal = np.random.default_rng(seed).standard_normal((STEPS, COUNT, 26))
    normal[:, 0] = np.abs(normal[:, 0])  # what alternates hardly enters
    return (scales * normal).astype(np.float32)


def test_it_equals_single_environments_one_by_one(short, other, workers):
    """All that happens, bit for bit, over two rollouts with several episodes of each; only the
    policy, a product of matrices, rounds otherwise for eight observations than for one.
    """
    singles = [WalkingEnvironment((short, other)[i % 2]) for i in range(COUNT)]
    policy = random_policy(short, scale=0.1)
    workers.set_curriculum(0.5, 0.4)
    workers.begin(40)
    observations = []
    for i, single in enumerate(singles):
        single.difficulty, single.tolerance_share = 0.5, 0.4
        observations.append(single.reset(seed=40 + i)[0])
    falls, timeouts = 0, 0
    for rollout in range(2):
        experience = workers.walk(dict(policy.tensors), noise(rollout))
        for t, added in enumerate(noise(rollout)):
            for i, single in enumerate(singles):
                np.testing.assert_array_equal(experience.observations[t, i], observations[i])
                action = experience.actions[t, i]
                alone = added[i] + policy.act(observations[i])
                np.testing.assert_allclose(action, alone, rtol=0, atol=1e-5)
                observations[i], reward, fell, over, info = single.step(action)
                assert experience.rewards[t, i] == np.float32(reward)
                assert experience.cycles[t, i] == np.float32(info["cycles"])
                terms = info["reward_terms"].astype(np.float32)
                np.testing.assert_array_equal(experience.terms[t, i], terms)
                assert experience.fell[t, i] == fell
                assert experience.ended[t, i] == (fell or over)
                if fell or over:
                    final = experience.final_observations[t, i]
                    np.testing.assert_array_equal(final, observations[i])
                    falls += fell
                    timeouts += not fell
                    observations[i], _ = single.reset()
        np.testing.assert_array_equal(experience.observations[-1], observations)
    assert falls > 0
    assert timeouts > 0


def test_beginning_again_forgets_what_was(short, workers):
    policy, seen = dict(random_policy(short, scale=0.1).tensors), []
    for _ in range(2):
        workers.begin(7)
        seen.append(workers.walk(policy, noise(0)).observations.copy())
        workers.walk(policy, noise(1))
    np.testing.assert_array_equal(*seen)


def test_closing_ends_the_workers(short):
    with WalkingWorkers([short], count=1, workers=1, steps=1) as workers:
        processes = list(workers._processes)
        assert all(process.is_alive() for process in processes)
    assert not any(process.is_alive() for process in processes)
    assert [process.exitcode for process in processes] == [0]


def test_an_error_in_a_worker_reaches_the_trainer(short):
    with WalkingWorkers([short], count=1, workers=1, steps=1) as workers:
        workers.set_curriculum("hard", 1.0)
        with pytest.raises(RuntimeError, match=r"worker process .*(?s:.*)environment\.py"):
            workers.begin(0)
        processes = workers._processes
    assert not set(mp.active_children()) & set(processes)


@pytest.mark.slow  # starts processes and waits for them
def test_a_killed_worker_is_reported_and_cleaned_up(short):
    policy = dict(random_policy(short, scale=0.1).tensors)
    with WalkingWorkers([short], count=16, workers=2, steps=1) as workers:
        workers.begin(0)
        workers._processes[1].kill()
        workers._processes[1].join(5)
        with pytest.raises(RuntimeError, match="killed, perhaps because"):
            workers.walk(policy, np.zeros((1, 16, 26), dtype=np.float32))
        processes = workers._processes
    assert not set(mp.active_children()) & set(processes)
