"""The command's own words; what it starts is tested beside."""

import pytest
from typer.testing import CliRunner

from gaitval.cli import app


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ((), "give one of SUBJECT"),
        (("5", "--replay", "log.jsonl"), "give one of SUBJECT"),
        (("5", "--check"), "with --replay"),
        (("--replay", "missing.jsonl"), "missing.jsonl"),
        (("11",), "no such subject"),
    ],
)
def test_what_cannot_be_started_is_refused(arguments, message, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    found = CliRunner().invoke(app, ["live", *arguments])
    assert found.exit_code == 2
    assert message in found.output
    assert not list(tmp_path.iterdir())


def test_help_says_what_it_is_not_for():
    found = CliRunner().invoke(app, ["live", "--help"])
    assert found.exit_code == 0
    assert "never for verdicts" in " ".join(found.output.split())
