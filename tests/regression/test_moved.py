"""What the first line of a check counts, and that one of which nothing can be judged is no pass."""

import io
import re
from dataclasses import replace
from pathlib import Path

import pytest

from gaitval.apps.regression.regression import MeasureOutcome, Row
from gaitval.cli.moved import judge_moved
from gaitval.cli.terminal import display
from gaitval.errors import ToleranceError


def row(change: MeasureOutcome, baseline: float | None = 4.0, current: float | None = 3.0) -> Row:
    return Row("angle_rmse", "knee_angle_r", "deg", baseline, current, 0.5, change, "recorded")


@pytest.fixture
def message(monkeypatch: pytest.MonkeyPatch) -> io.StringIO:
    text = io.StringIO()
    monkeypatch.setattr(display, "output", display.Terminal(file=text, width=200))
    return text


def test_what_improved_is_not_counted_as_within_its_margin(message: io.StringIO) -> None:
    judge_moved([row("kept"), row("improved"), row("kept")], Path("S05"))
    assert "moved by more than their margin" in message.getvalue()
    assert "Figures: 2 of 3 measures within their margins of S05, 1 improved (table below)" in (
        message.getvalue()
    )


def test_each_row_says_which_way_it_moved(message: io.StringIO) -> None:
    with pytest.raises(ToleranceError):
        judge_moved(
            [row("kept"), replace(row("lost"), measure="a"), replace(row("improved"), measure="b")],
            Path("S05"),
        )
    cells = [re.findall(r"[^│┃]+", line) for line in message.getvalue().splitlines()]
    rows = {each[0].strip(): [cell.strip() for cell in each[1:]] for each in cells if len(each) > 6}
    assert {name: rows[name][-1] for name in "ab"} == {"a": "lost", "b": "improved"}
    head = rows["measure"]
    assert (rows["a"][head.index("baseline")], rows["a"][head.index("now")]) == ("4", "3")


def test_a_loss_is_counted_of_all(message: io.StringIO) -> None:
    with pytest.raises(ToleranceError, match="1 of 3 measures are worse than in S05"):
        judge_moved([row("kept"), row("improved"), row("lost")], Path("S05"))
    answer, *rest = message.getvalue().splitlines()
    assert "1 of 3 measures are worse than in S05" in answer
    assert any("lost" in line for line in rest)


def test_a_baseline_without_figures_is_not_judged(message: io.StringIO) -> None:
    for rows in ([row("kept", None, None), row("improved", None, 2.0)], []):
        with pytest.raises(ToleranceError, match="not judged"):
            judge_moved(rows, Path("S05"))
    assert all("not judged" in line for line in message.getvalue().split("Figures: ")[1:])


def test_what_the_baseline_lacks_is_not_counted_as_kept(message: io.StringIO) -> None:
    judge_moved([row("kept"), row("improved", None, 2.0)], Path("S05"))
    assert "1 of 1 measures within their margins" in message.getvalue()
    assert "1 not judged" in message.getvalue()


def test_a_kind_that_decides_and_has_no_figure_is_no_pass() -> None:
    """All that is compared is kept, but of the moments nothing is."""
    new = row("improved", None, 0.1)
    with pytest.raises(ToleranceError, match=r"not judged.*moment_skill"):
        judge_moved([row("kept"), replace(new, measure="moment_skill")], Path("S05"))
    judge_moved([row("kept"), replace(new, measure="learning_gain")], Path("S05"))
