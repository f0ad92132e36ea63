"""`gaitval device`: its folder is asked for before the minutes of work, and is of one process."""

from types import SimpleNamespace

import pytest
from typer.testing import CliRunner

from gaitval._internal.io.folder_lock import locked
from gaitval.apps.devices import study
from gaitval.cli import app


def test_a_folder_that_cannot_be_had_is_refused_before_anybody_walks(tmp_path, monkeypatch):
    monkeypatch.setattr(study, "wearer", lambda *_: SimpleNamespace(name="S05", own=()))
    monkeypatch.setattr(study, "outcomes", lambda *_, **__: pytest.fail("they walked"))
    wanted = ["device", "5", "backpack", "--out"]
    with locked(tmp_path / "other"):
        found = CliRunner().invoke(app, [*wanted, str(tmp_path / "other")])
    assert found.exit_code == 2
    assert "another gaitval" in " ".join(found.output.split())
    (tmp_path / "file").write_text("")
    found = CliRunner().invoke(app, [*wanted, str(tmp_path / "file")])
    assert found.exit_code == 2
    assert isinstance(found.exception, SystemExit)
