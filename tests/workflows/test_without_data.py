"""What the suite says where the raw data are missing."""

import os
import subprocess
import sys
from pathlib import Path

import pytest

TESTS = Path(__file__).parents[1]


def run_of(data: Path, *arguments: str) -> subprocess.CompletedProcess[str]:
    """A session of two tests that read the data and of one that reads none, as another CI
    would run it."""
    names = ("scaling/test_same_person.py", "test_build_info.py")
    return subprocess.run(
        [sys.executable, "-m", "pytest", "-p", "no:cacheprovider", "--color=no", *arguments]
        + [str(TESTS / name) for name in names],
        env={**os.environ, "GAITVAL_DATA": str(data), "CI": "true"},
        capture_output=True,
        text=True,
        check=False,
    )


@pytest.mark.parametrize(
    "side_by_side", [(), pytest.param(("-n", "1", "--dist", "loadfile"), marks=pytest.mark.slow)]
)
@pytest.mark.slow  # a session of pytest
def test_tests_that_read_the_data_are_skipped_and_counted(tmp_path, side_by_side):
    done = run_of(tmp_path / "none", *side_by_side)
    assert done.returncode == 0, done.stdout
    counts = done.stdout.splitlines()[-1]
    assert "passed" in counts
    skipped = int(counts.partition(" skipped")[0].split()[-1])
    assert skipped > 0
    message = f"Skipped for want of data: {skipped} (no raw data at {tmp_path / 'none'})"
    assert message in done.stdout
    assert "To run them: GAITVAL_DATA=" in done.stdout


def test_a_session_that_requires_them_does_not_begin(tmp_path):
    done = run_of(tmp_path, "--require-data")  # a folder, but without wbds/
    assert done.returncode == pytest.ExitCode.USAGE_ERROR
    assert f"--require-data: no raw data at {tmp_path}: set GAITVAL_DATA" in done.stderr
    assert "passed" not in done.stdout


@pytest.mark.slow
def test_data_that_lack_a_file_fail(tmp_path):
    (tmp_path / "wbds").mkdir()
    done = run_of(tmp_path, "--require-data")
    assert done.returncode == pytest.ExitCode.TESTS_FAILED, done.stdout
    assert "Skipped for want of data" not in done.stdout
