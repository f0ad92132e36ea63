"""`gaitval export`: what it refuses, in words and with exit code 2; what it writes."""

from pathlib import Path

import pytest
from typer.testing import CliRunner

from gaitval.apps.export import walked as walked_module
from gaitval.apps.export.mujoco_folder import FILES
from gaitval.apps.export.walked import ExportedWalk
from gaitval.cli.export import export
from gaitval.cli.terminal.app import GaitvalError


@pytest.fixture(autouse=True)
def _one_reference(walked: ExportedWalk, monkeypatch: pytest.MonkeyPatch) -> None:
    of = ExportedWalk.of
    monkeypatch.setattr(
        walked_module.ExportedWalk, "of", lambda who: walked if who == "5" else of(who)
    )


def refused(*arguments: str) -> str:
    """The words of a refusal; the command line prints them and exits with its code."""
    done = CliRunner().invoke(export.app, arguments)
    assert isinstance(done.exception, GaitvalError), done.output
    assert done.exception.exit_code == 2
    return str(done.exception)


def test_a_format_that_is_none_is_refused_with_those_that_are(tmp_path: Path) -> None:
    words = refused("5", "--to", "fbx", "--out", str(tmp_path))
    assert "--to fbx" in words
    assert "Give one of mujoco, urdf, gymnasium, opensim, c3d" in words
    assert not list(tmp_path.iterdir())


def test_a_file_in_the_place_of_the_folder_is_refused(tmp_path: Path) -> None:
    (tmp_path / "out").write_text("mine")
    words = refused("5", "--to", "mujoco", "--out", str(tmp_path / "out"))
    assert "is a file" in words
    assert (tmp_path / "out").read_text() == "mine"


def test_it_says_what_it_wrote(tmp_path: Path) -> None:
    done = CliRunner().invoke(
        export.app, ["5", "--to", "mujoco", "--out", str(tmp_path / "walker")]
    )
    assert done.exit_code == 0, done.output
    assert {path.name for path in (tmp_path / "walker").iterdir()} == set(FILES)
    for name in FILES:
        assert name in done.output
