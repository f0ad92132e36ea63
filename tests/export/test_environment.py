"""`gaitval/Walker-v0`: Gymnasium's own checker, and what is drawn at a reset."""

import json
import shutil
import subprocess
import sys
import warnings
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace

import gymnasium
import numpy as np
import pytest
from gymnasium.utils.env_checker import check_env, data_equivalence
from gymnasium.vector import AutoresetMode

import gaitval.apps.export.environment
from gaitval.apps.export.environment import NAME, WalkerEnvironment, WalkerVector
from gaitval.apps.export.formats import write_training
from gaitval.apps.export.observation_bounds import observation_bounds
from gaitval.apps.export.walked import ExportedWalk
from gaitval.errors import SubjectError
from gaitval.policy.environment import WalkingEnvironment
from gaitval.policy.observation import OBSERVATION_SIZES, OBSERVED


@pytest.fixture(autouse=True)
def _one_reference(walked: ExportedWalk, monkeypatch: pytest.MonkeyPatch) -> None:
    """The reference takes seconds; subject 5's is there already."""
    of = gaitval.apps.export.environment._walked
    monkeypatch.setattr(
        gaitval.apps.export.environment, "_walked", lambda who: walked if who == "5" else of(who)
    )


BY_NAME = f"gaitval.apps.export.environment:{NAME}"


@pytest.mark.slow
def test_gymnasiums_checker_finds_nothing() -> None:
    """But for its advice on actions, which are to be -1 to 1 for it, and are not."""
    made = gymnasium.make(BY_NAME, walker="5")
    with warnings.catch_warnings(record=True) as message:
        warnings.simplefilter("always")
        check_env(made.unwrapped)
    assert all("symmetric and normalized" in str(each.message) for each in message)


@pytest.mark.slow  # stable-baselines3 loads torch
def test_stable_baselines_checker_finds_nothing() -> None:
    from stable_baselines3.common.env_checker import check_env as check

    with warnings.catch_warnings(record=True) as message:
        warnings.simplefilter("always")
        check(gymnasium.make(BY_NAME, walker="5").unwrapped)
    assert all("action" in str(each.message) for each in message)


@pytest.mark.slow
@pytest.mark.parametrize("kind", ["extended", "paper"])
def test_observations_stay_in_their_bounds_by_themselves(
    walked: ExportedWalk, monkeypatch: pytest.MonkeyPatch, kind: str
) -> None:
    """A thousand random steps with pushes and other bodies, falls among them, are clipped nowhere;
    and no bound is so far that it says nothing.
    """
    if kind == "paper":
        monkeypatch.setattr(
            gaitval.apps.export.environment, "_walked", lambda _: _observing(walked, kind)
        )
    environment = WalkerEnvironment("5", pushes=True, vary_body=True)
    space = environment.observation_space
    assert isinstance(space, gymnasium.spaces.Box)
    assert space.is_bounded()
    rng = np.random.default_rng(0)
    seen, falls = [environment.reset(seed=0)[0]], 0
    for _ in range(1000):
        action = rng.uniform(-4, 4, environment.action_space.shape).astype(np.float32)
        observation, _, fell, over, _ = environment.step(action)
        seen += [observation, super(WalkerEnvironment, environment).told()]
        if fell or over:
            falls += fell
            seen.append(environment.reset()[0])
    assert falls > 5
    every = np.array(seen)
    assert np.all((every >= space.low) & (every <= space.high))
    reached = np.abs(every).max(axis=0)
    assert np.all(reached[reached > 0.0] > 0.001 * space.high[reached > 0.0])


def _observing(walked: ExportedWalk, kind: str) -> SimpleNamespace:
    """A walker whose task has the observation `kind`."""
    task = walked.stored.corrected_task
    settings = task.configuration
    other = settings.model_copy(
        update={"environment": settings.environment.model_copy(update={"observation": kind})}
    )
    return SimpleNamespace(
        stored=SimpleNamespace(corrected_task=replace(task, configuration=other)), mu=walked.mu
    )


def test_observations_beyond_a_bound_are_clipped() -> None:
    environment = WalkerEnvironment("5")
    high = environment.observation_space.high
    environment.reset(seed=0, options={"phase": 0.0})  # where nothing is mirrored
    environment.episode.observation[:] = 1e6
    assert np.array_equal(environment.told(), high)


def test_past_actions_are_bounded_as_actions_are(walked: ExportedWalk) -> None:
    late = walked.stored.corrected_task.with_environment(action_memory=0.1)
    environment = WalkingEnvironment(late)
    low, high = observation_bounds(environment, walked.mu)
    assert low.shape == high.shape == environment.observation_space.shape
    assert set(high[126:]) == {environment.constants.action_limit} == set(-low[126:])


def test_every_part_of_an_observation_has_a_bound(
    walked: ExportedWalk, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setitem(OBSERVED, "new", slice(126, 127))
    monkeypatch.setitem(OBSERVATION_SIZES, "extended", 127)
    with pytest.raises(KeyError, match="new"):
        observation_bounds(WalkingEnvironment(walked.stored.corrected_task), walked.mu)


@pytest.mark.slow
@pytest.mark.parametrize("number", [8, 11])
def test_walkers_side_by_side_do_what_each_does_alone(number: int) -> None:
    """Bit for bit, through falls and new starts, in groups of eight and in one that is not full."""
    options = {"num_envs": number, "walker": "5", "pushes": True, "vary_body": True}
    together = gymnasium.make_vec(BY_NAME, **options)
    assert isinstance(together.unwrapped, WalkerVector)
    alone = gymnasium.make_vec(
        BY_NAME, **options, vectorization_mode="sync",
        vector_kwargs={"autoreset_mode": AutoresetMode.SAME_STEP},
    )  # fmt: skip
    assert together.single_observation_space == alone.single_observation_space
    assert together.observation_space == alone.observation_space
    assert together.action_space == alone.action_space
    first, second = together.reset(seed=3)[0], alone.reset(seed=3)[0]
    np.testing.assert_array_equal(first, second)
    rng, falls = np.random.default_rng(0), 0
    for _ in range(300):
        action = rng.uniform(-1, 1, together.action_space.shape).astype(np.float32)
        *found, info = together.step(action)
        *wanted, told = alone.step(action)
        for each, other in zip(found, wanted, strict=True):
            np.testing.assert_array_equal(each, other)
        assert info.keys() == told.keys()
        assert all(data_equivalence(info[name], told[name], exact=True) for name in told)
        falls += int(found[2].sum())
    assert falls > number


def test_an_episode_of_full_length_starts_again() -> None:
    together = WalkerVector(2, "5")
    together.reset(seed=[4, 5], options={"phase": 0.25})
    assert [each.start_phase for each in together._environments] == [0.25, 0.25]
    together._environments[1]._steps = together._environments[1]._longest - 1
    seen, _, fell, over, info = together.step(np.zeros(together.action_space.shape, np.float32))
    assert not fell.any()
    assert over.tolist() == info["_final_obs"].tolist() == [False, True]
    assert info["_errors"].tolist() == [True, False]
    assert not np.array_equal(seen[1], info["final_obs"][1])
    assert together._environments[1]._steps == 0


def test_the_body_is_the_identified_one_and_nobody_pushes(walked: ExportedWalk) -> None:
    environment = WalkerEnvironment("5")
    for seed in range(20):
        environment.reset(seed=seed)
        np.testing.assert_array_equal(environment.walker.mu, walked.mu)
        assert environment._push is None


def test_pushes_and_other_bodies_are_drawn_if_asked_for(walked: ExportedWalk) -> None:
    environment = WalkerEnvironment("5", pushes=True, vary_body=True)
    pushed = 0
    for seed in range(20):
        environment.reset(seed=seed)
        assert not np.array_equal(environment.walker.mu, walked.mu)
        pushed += environment._push is not None
    assert 10 < pushed < 20  # four of five episodes


def test_options_of_a_reset_go_first(walked: ExportedWalk) -> None:
    environment = WalkerEnvironment("5")
    environment.reset(seed=0, options={"push": (0.7, 100.0, 0.0), "phase": 0.25})
    assert environment._push == (0.7, 100.0, 0.0)
    assert environment.start_phase == 0.25


def test_a_walker_that_is_not_there_is_refused() -> None:
    with pytest.raises(SubjectError, match="nobody"):
        gymnasium.make(NAME, walker="nobody")


@pytest.mark.slow  # stable-baselines3 loads torch; 20 s
def test_the_script_trains_with_plain_stable_baselines3(
    walked: ExportedWalk, tmp_path: Path
) -> None:
    write_training(tmp_path, walked)
    done = subprocess.run(
        [sys.executable, "train.py", "--steps", "20000", "--out", "learned"],
        cwd=tmp_path, capture_output=True, text=True, check=False,
    )  # fmt: skip
    assert done.returncode == 0, done.stderr
    found = json.loads(done.stdout.splitlines()[-1])
    assert found["last"] > found["first"]
    assert {path.name for path in (tmp_path / "learned").iterdir()} == {
        *("policy.zip", "normalisation.pkl")
    }
    shutil.rmtree(tmp_path / "learned")
