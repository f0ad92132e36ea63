"""What a killed process has left half written goes; what another still writes stays."""

import os
import subprocess
import sys
import time
from pathlib import Path

from gaitval._internal.io.artefacts import replacing, scratch, write_text
from gaitval._internal.io.partial_files import own_folder, remove_partial

KILLED_WHILE_WRITING = """
import os, sys
from pathlib import Path
from gaitval._internal.io.artefacts import replacing, scratch

folder = Path(sys.argv[1])
with replacing(folder / "report.pdf") as temporary, scratch(folder) as own:
    temporary.write_text("half")
    (own / "font").write_text("whole")
    os._exit(9)
"""


def test_what_a_kill_leaves_is_removed_and_nothing_else(tmp_path: Path) -> None:
    folder = tmp_path / "rounds" / "1"
    folder.mkdir(parents=True)
    (folder / "report.pdf").write_text("old")
    (folder / ".hidden").write_text("theirs")
    subprocess.run([sys.executable, "-c", KILLED_WHILE_WRITING, str(folder)], check=False)
    assert len(list(folder.iterdir())) == 4
    remove_partial(tmp_path)
    assert sorted(path.name for path in folder.iterdir()) == [".hidden", "report.pdf"]


def test_what_a_kill_leaves_is_removed_when_the_same_is_written_again(tmp_path: Path) -> None:
    subprocess.run([sys.executable, "-c", KILLED_WHILE_WRITING, str(tmp_path)], check=False)
    left = list(tmp_path.iterdir())
    assert len(left) == 2
    for path in left:
        os.utime(path, (1e9, 1e9))
    with replacing(tmp_path / "other.pdf") as temporary:  # nor that of a longer name
        temporary.write_text("whole")
    assert {*left} <= {*tmp_path.iterdir()}
    with replacing(tmp_path / "report.pdf") as temporary, scratch(tmp_path):
        temporary.write_text("whole")
    assert sorted(path.name for path in tmp_path.iterdir()) == ["other.pdf", "report.pdf"]


def test_what_another_is_still_writing_is_not_removed(tmp_path: Path) -> None:
    with replacing(tmp_path / "a.txt") as first, scratch(tmp_path) as own:
        for path in (first, own):
            os.utime(path, (1e9, 1e9))
        write_text(tmp_path / "a.txt", "second")
        with scratch(tmp_path):
            assert own.is_dir()
        first.write_text("first")
    assert [path.name for path in tmp_path.iterdir()] == ["a.txt"]
    assert (tmp_path / "a.txt").read_text() == "first"


NAME = "gaitval-test-"


def left(tmp_path, name):
    """A folder that a process has left a minute ago."""
    folder = tmp_path / name
    folder.mkdir()
    (folder / "key.pem").write_text("x")
    os.utime(folder, (time.time() - 60.0,) * 2)
    return folder


def test_an_own_folder_goes_when_the_block_ends(tmp_path):
    with own_folder(tmp_path, NAME) as folder:
        (Path(folder) / "key.pem").write_text("x")
        assert Path(folder).stat().st_mode & 0o077 == 0, "keys are for their owner alone"
    assert list(tmp_path.iterdir()) == []


def test_own_folders_that_were_left_go_and_those_in_use_stay(tmp_path):
    abandoned, others = left(tmp_path, f"{NAME}abcdefgh"), left(tmp_path, "somebody-else")
    link = tmp_path / f"{NAME}ijklmnop"
    link.symlink_to(others)
    with own_folder(tmp_path, NAME) as first:
        os.utime(first, (time.time() - 60.0,) * 2)
        with own_folder(tmp_path, NAME) as second:
            assert Path(first).is_dir()
            assert Path(second).is_dir()
    assert not abandoned.exists()
    assert (others / "key.pem").exists(), "a link is not followed"
