"""What an import cannot write is refused before its work."""

from pathlib import Path

import pytest
from typer.testing import CliRunner

import gaitval.session.importing.importing
from gaitval.cli import app


@pytest.fixture
def worked(monkeypatch: pytest.MonkeyPatch) -> list[object]:
    """The sessions that were begun to be worked out."""
    begun: list[object] = []
    monkeypatch.setattr(
        gaitval.session.importing.importing, "work_out", lambda *all_, **_: begun.append(all_)
    )
    return begun


def refused(*arguments: str) -> str:
    person = ("--mass", "60", "--height", "1.7", "--sex", "F")
    done = CliRunner().invoke(app, ["import", *person, *arguments])
    assert done.exit_code == 2, done.output
    return " ".join(done.output.split())


@pytest.mark.parametrize("letter", ["\x1b", "\a", "\x9b", "\u202e", "\udcfc"])
def test_a_name_of_a_file_that_no_page_can_show(
    tmp_path: Path, worked: list[object], letter: str
) -> None:
    path = tmp_path / f"wa{letter}lk.trc"
    path.touch()
    message = refused("--trial", str(path), "--out", str(tmp_path / "out"))
    assert "letter 3 is" in message
    assert "Take it out." in message
    assert not worked
    assert not (tmp_path / "out").exists()


@pytest.mark.parametrize("key", ["person", "laboratory", "citation", "licence"])
def test_a_text_that_no_page_can_show(tmp_path: Path, worked: list[object], key: str) -> None:
    path, session = tmp_path / "walk.trc", tmp_path / "session.toml"
    path.touch()
    about = 'name = "P01"\nsex = "F"\nmass = 60\nheight = 1.7\ntrials = ["walk.trc"]'
    session.write_text(f'[[people]]\n{about}\n{key} = "a\\u001bb"\n', encoding="utf-8")
    done = CliRunner().invoke(app, ["import", str(session), "--out", str(tmp_path / "out")])
    assert done.exit_code == 2, done.output
    assert "the files or options say" in " ".join(done.output.split())
    assert not worked
