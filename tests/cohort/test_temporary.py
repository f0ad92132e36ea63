"""Temporary folders of a cohort."""

import os
import tempfile
import time
from pathlib import Path

import pytest

from gaitval_cohort.temporary import temporary_folder

NAME = "gaitval-test-"


@pytest.fixture
def place(tmp_path, monkeypatch):
    """The system's folder of temporary files."""
    monkeypatch.setattr(tempfile, "tempdir", str(tmp_path))
    return tmp_path


def left(place, name):
    """A folder that a process has left a minute ago."""
    folder = place / name
    folder.mkdir()
    (folder / "key.pem").write_text("x")
    os.utime(folder, (time.time() - 60.0,) * 2)
    return folder


def test_it_goes_when_the_block_ends(place):
    with temporary_folder(NAME) as folder:
        (Path(folder) / "key.pem").write_text("x")
        assert Path(folder).stat().st_mode & 0o077 == 0, "keys are for their owner alone"
    assert list(place.iterdir()) == []


def test_what_was_left_goes_and_what_is_in_use_stays(place):
    abandoned, others = left(place, f"{NAME}abcdefgh"), left(place, "somebody-else")
    link = place / f"{NAME}ijklmnop"
    link.symlink_to(others)
    with temporary_folder(NAME) as first:
        os.utime(first, (time.time() - 60.0,) * 2)
        with temporary_folder(NAME) as second:
            assert Path(first).is_dir()
            assert Path(second).is_dir()
    assert not abandoned.exists()
    assert (others / "key.pem").exists(), "a link is not followed"
