"""What `gaitval history` prints, and what it does not overwrite."""

import io
from pathlib import Path

import pytest
from html_page import only_html
from typer.testing import CliRunner

from gaitval.apps.regression import history
from gaitval.apps.regression.history import Check, CheckedFigure
from gaitval.cli import app
from gaitval.terminal import display

COMMITS = ("1234e67a", "1235e671")
"""Of the first and of the last checks; the last looks like a number."""


@pytest.fixture
def message(monkeypatch: pytest.MonkeyPatch) -> io.StringIO:
    text = io.StringIO()
    for name in ("output", "messages"):
        monkeypatch.setattr(display, name, display.Terminal(file=text, width=200))
    only_html(monkeypatch)
    return text


@pytest.fixture
def kept(tmp_path: Path) -> Path:
    """Twelve checks of two figures, both of which get worse at the seventh."""
    path = tmp_path / "accuracy.db"
    for number in range(12):
        day = f"2026-11-{number + 1:02d}T10:00:00+00:00"
        value = 1.0 + 0.01 * (number % 2) + (number >= 6)
        for subject, measure, target in (
            ("00120", "angle_rmse", "knee_angle_r"),
            ("", "benchmark", "b.py::test_a[fast]"),
        ):
            figure = CheckedFigure(measure, target, "1", value, None, None, "lower")
            kind = "check" if subject else "benchmark"
            commit = f"{COMMITS[number >= 6]}{number:032d}"
            history.add(path, Check(kind, commit, day, day, "m", subject, (figure,)))
    return path


def test_commits_and_names_are_printed_as_they_are(kept: Path, message: io.StringIO) -> None:
    """And not as 1.235e+674, 120 and markup."""
    assert CliRunner().invoke(app, ["history", str(kept)]).exit_code == 0
    text = message.getvalue()
    assert "Commits at which a figure took a step" in text
    assert f" {COMMITS[1]} " in text
    assert " 00120 " in text
    assert "b.py::test_a[fast]" in text
    assert "e+" not in text


@pytest.mark.parametrize("ending", ["csv", "html", "pdf"])
def test_a_history_is_not_overwritten_by_its_page(
    kept: Path, message: io.StringIO, ending: str
) -> None:
    named = kept.rename(kept.with_suffix(f".{ending}"))
    before = named.read_bytes()
    assert CliRunner().invoke(app, ["history", str(named)]).exit_code == 2
    assert "over the history itself" in message.getvalue()
    assert named.read_bytes() == before
    assert [*named.parent.iterdir()] == [named]
    out = kept.parent / "page"
    assert CliRunner().invoke(app, ["history", str(named), "--out", str(out)]).exit_code == 0
    assert (out / "accuracy.csv").is_file()
