"""`gaitval perturb`: what it says first, and its whole path once."""

import io
from pathlib import Path

import pytest
from html_page import only_html
from typer.testing import CliRunner

from gaitval import cli
from gaitval._internal.io.artefacts import read_json
from gaitval.apps.balance.results import PerturbResult
from gaitval.cli.terminal import display


def result(**changes: object) -> PerturbResult:
    given = {"steady_fell": False, "pushes": [], "grounds": [], "quantities": []} | changes
    return PerturbResult.model_construct(**given)


def test_who_falls_undisturbed_is_not_compared():
    (message,) = result(steady_fell=True).answers()
    assert "without any disturbance" in message


@pytest.mark.slow  # a reference motion and forty walks
def test_pushes_and_grounds_of_a_stored_walker(tmp_path: Path, monkeypatch: pytest.MonkeyPatch):
    monkeypatch.setattr("gaitval.apps.balance.study.PHASES", 2)
    only_html(monkeypatch)
    told = io.StringIO()
    monkeypatch.setattr(display, "messages", display.Terminal(file=told, width=200))
    out = tmp_path / "perturbed"
    arguments = ["perturb", "5", "--pushes", "--slip", "0.5:0.02", "--out", str(out)]
    done = CliRunner().invoke(cli.app, arguments)
    assert done.exit_code == 0, done.output + told.getvalue()
    found = PerturbResult.model_validate(read_json(out / "perturb.json"))
    assert len(found.pushes) == 2 * 2 * 2 + 2 * 2
    assert done.output.startswith(found.answers()[0])
    page = (out / "perturb.html").read_text(encoding="utf-8")
    assert found.answers()[0] in page
    assert (out / "figures" / "placement.csv").is_file()
    assert "pushes" in told.getvalue()  # what comes next is said
