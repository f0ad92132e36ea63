"""`gaitval/Walker-v0`: Gymnasium's own checker, and what is drawn at a reset."""

import json
import shutil
import subprocess
import sys
import warnings
from pathlib import Path

import gymnasium
import numpy as np
import pytest
from gymnasium.utils.env_checker import check_env

import gaitval.apps.export.environment
from gaitval.apps.export.environment import NAME, WalkerEnvironment
from gaitval.apps.export.formats import write_training
from gaitval.apps.export.walked import ExportedWalk
from gaitval.errors import SubjectError


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
    """But for its advice on actions, which are not -1 to 1, and observations without bounds."""
    made = gymnasium.make(BY_NAME, walker="5")
    with warnings.catch_warnings(record=True) as message:
        warnings.simplefilter("always")
        check_env(made.unwrapped)
    advice = ("symmetric and normalized", "infinity")
    assert all(any(each in str(one.message) for each in advice) for one in message)


@pytest.mark.slow  # stable-baselines3 loads torch
def test_stable_baselines_checker_finds_nothing() -> None:
    from stable_baselines3.common.env_checker import check_env as check

    with warnings.catch_warnings(record=True) as message:
        warnings.simplefilter("always")
        check(gymnasium.make(BY_NAME, walker="5").unwrapped)
    assert all("action" in str(each.message) for each in message)


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
