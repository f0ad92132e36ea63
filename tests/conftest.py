"""Fixtures that every test may use."""

import os
from pathlib import Path

import pytest
from simulation_fixtures import DartPeer, task_of_subject

from gaitval.simulation.walker import WalkingTask


@pytest.fixture(scope="session")
def gait_data() -> Path:
    """Folder of the raw data (`wbds/`, `normative/`, …), which is not part of the project.

    `GAITVAL_DATA` names it; the default is `../shared/data` beside the repository. Without it a
    test is skipped, except in CI, which must have it.
    """
    repository = Path(__file__).resolve().parents[1]
    default = repository.parent / "shared" / "data"
    folder = Path(os.environ.get("GAITVAL_DATA", default))
    if not folder.is_dir():
        reason = f"no raw data at {folder}: set GAITVAL_DATA to the folder that holds wbds/"
        if os.environ.get("CI") == "true":
            pytest.fail(reason)
        pytest.skip(reason)
    return folder


@pytest.fixture(scope="session")
def task() -> WalkingTask:
    """The walking task of subject 5 with the default configuration."""
    return task_of_subject("S05")


@pytest.fixture(scope="session")
def peer(task: WalkingTask, tmp_path_factory: pytest.TempPathFactory) -> DartPeer:
    """DART's own reading of the task's URDF."""
    return DartPeer(task.model, tmp_path_factory.mktemp("peer"))
