"""The stored walker of subject 5, which every format is written of."""

from pathlib import Path

import pytest

from gaitval.apps.export.walked import ExportedWalk


@pytest.fixture(scope="session")
def walked() -> ExportedWalk:
    """Its reference takes seconds, once."""
    return ExportedWalk.of("5")


@pytest.fixture(scope="session")
def mujoco_folder(walked: ExportedWalk, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The person for plain MuJoCo."""
    from gaitval.apps.export.mujoco_folder import write_mujoco

    folder = tmp_path_factory.mktemp("exported") / "mujoco"
    write_mujoco(folder, walked)
    return folder
