"""A cohort whose workers and scheduler are killed ends complete, with equal results."""

import json
from types import SimpleNamespace

import pytest
import quick_study
from killed_cohort import killed, quick, results

from gaitval.study.stage import Observer

NAMES = [f"study{number}_sleep0_8" for number in range(5)]


def alone(name, folder):
    """The summary of a study that nothing happens to."""
    folder.mkdir(parents=True)
    return quick_study.work(SimpleNamespace(name=name), folder, 1, Observer())


@pytest.mark.slow
def test_killed_at_random_and_resumed(tmp_path):
    folder = tmp_path / "killed"
    found = killed(quick(folder, "2", NAMES), folder, kills=2, seed=1, pause=0.5, limit=400.0)
    assert found["returned"] == 0, found["told"]
    assert found["kills"] == 2
    assert found["halfway"] is not None, "the scheduler was never killed"
    assert found["left"] == 0, "processes of studies outlived the cohort"
    assert found["told"].split("\n")[-2].split() == ["finished"] * len(NAMES)
    made = {name: json.loads(text) for name, text in results(folder).items()}
    assert made == {name: alone(name, tmp_path / "alone" / name) for name in NAMES}
