"""What the benchmarks share with the tests: the raw data."""

import os
from pathlib import Path

import pytest

REPOSITORY = Path(__file__).resolve().parents[1]


@pytest.fixture(scope="session")
def gait_data() -> Path:
    """Folder of the raw data; `GAITVAL_DATA` names it (see tests/conftest.py)."""
    default = REPOSITORY.parent / "shared" / "data"
    folder = Path(os.environ.get("GAITVAL_DATA", default))
    if not folder.is_dir():
        pytest.skip(f"no raw data at {folder}: set GAITVAL_DATA to the folder that contains wbds/")
    return folder
