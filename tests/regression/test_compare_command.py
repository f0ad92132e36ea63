"""`gaitval compare` of two versions says what is not in both, and what has another record."""

import io
from pathlib import Path
from typing import Any

import pytest
from html_page import only_html
from typer.testing import CliRunner

from gaitval._internal.io.artefacts import read_json, write_json
from gaitval.cli import app
from gaitval.cli.terminal import display

REPORTS = Path(__file__).parents[2] / "reports"
WALK = REPORTS / "S05" / "baseline"


@pytest.fixture
def message(monkeypatch: pytest.MonkeyPatch) -> io.StringIO:
    text = io.StringIO()
    monkeypatch.setattr(display, "messages", display.Terminal(file=text, width=600))
    only_html(monkeypatch)
    return text


def compare(tmp_path: Path, now: list[Path], before: list[Path], *options: str) -> Any:
    earlier = [word for folder in before for word in ("--before", str(folder))]
    words = ["compare", *map(str, now), *earlier, "--out", str(tmp_path / "out"), *options]
    return CliRunner().invoke(app, words)


@pytest.mark.slow
def test_a_person_who_walks_no_more_fails_a_strict_comparison(
    message: io.StringIO, tmp_path: Path
) -> None:
    assert (
        compare(tmp_path, [WALK], [WALK, REPORTS / "S02" / "baseline"], "--strict").exit_code == 1
    )
    assert "no walk now of S02" in message.getvalue()
    assert (tmp_path / "out" / "comparison.html").is_file()


@pytest.mark.slow
def test_another_record_is_said(message: io.StringIO, tmp_path: Path) -> None:
    """Its figures move for that alone."""
    values = read_json(WALK / "metrics.json")
    values["provenance"]["record"] = 64 * "f"
    (tmp_path / "now").mkdir()
    write_json(tmp_path / "now" / "metrics.json", values)
    done = compare(tmp_path, [tmp_path / "now"], [WALK])
    assert done.exit_code == 0, done.output
    assert "compared with another record than before: S05" in done.output
