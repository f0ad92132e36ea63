"""`gaitval markers`: writes a set and its picture, says what it left, and how to go on."""

from pathlib import Path

import pytest
from typer.testing import CliRunner

from gaitval.errors import GaitvalError
from gaitval.mocap import reading
from gaitval.mocap.recording import Recording
from gaitval_markers.command import markers


@pytest.fixture(autouse=True)
def _drawn(stander: Recording, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(reading, "read_recording", lambda path, plates=True: stander)


def test_a_set_a_picture_and_the_command_that_goes_on(tmp_path: Path) -> None:
    out = tmp_path / "mine.toml"
    done = CliRunner().invoke(
        markers.app, ["walk.c3d", "--standing", "stand.c3d", "--out", str(out)]
    )
    assert done.exit_code == 0, done.output
    words = " ".join(done.output.split())
    assert f"gaitval import --static stand.c3d --trial walk.c3d --marker-set {out}" in words
    assert "RKNE" in out.read_text(encoding="utf-8")
    picture = out.with_suffix(".svg").read_text(encoding="utf-8")
    assert picture.count("<svg") == 1
    # Never over a file that may have been corrected by hand.
    again = CliRunner().invoke(markers.app, ["walk.c3d", "--out", str(out)])
    assert isinstance(again.exception, GaitvalError)
    assert "may have been corrected by hand" in str(again.exception)


def test_another_ending_is_refused(tmp_path: Path) -> None:
    done = CliRunner().invoke(markers.app, ["walk.c3d", "--out", str(tmp_path / "set.txt")])
    assert isinstance(done.exception, GaitvalError)
    assert done.exception.exit_code == 2
    assert not list(tmp_path.iterdir())
