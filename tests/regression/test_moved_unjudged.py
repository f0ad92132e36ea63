"""A check of which nothing can be judged is no pass."""

from pathlib import Path

import pytest

from gaitval.apps.regression.moved import judge_moved
from gaitval.apps.regression.regression import Row
from gaitval.errors import ToleranceError


def row(baseline, current, change="kept"):
    return Row("angle_rmse", "knee_angle_r", "deg", baseline, current, 1.0, change, "recorded")


def test_a_baseline_without_figures_is_not_judged(capsys):
    with pytest.raises(ToleranceError, match="not judged"):
        judge_moved([row(None, None), row(None, 2.0, "improved")], Path("S05"))
    with pytest.raises(ToleranceError, match="not judged"):
        judge_moved([], Path("S05"))
    assert all("not judged" in line for line in capsys.readouterr().out.split("Figures: ")[1:])


def test_what_the_baseline_lacks_is_not_counted_as_kept(capsys):
    judge_moved([row(1.0, 1.1), row(None, 2.0, "improved")], Path("S05"))
    message = " ".join(capsys.readouterr().out.split())
    assert "1 of 1 measures within their margins" in message
    assert "1 not judged" in message


def test_a_kind_that_decides_and_has_no_figure_is_no_pass():
    """All that is compared is kept, but of the moments nothing is."""
    moment = Row("moment_rmse", "knee_angle_r", "Nm/kg", None, 0.1, 0.02, "improved", "recorded")
    with pytest.raises(ToleranceError, match=r"not judged.*moment_rmse"):
        judge_moved([row(1.0, 1.0), moment], Path("S05"))
    context = Row("learning_gain", "walk", "1", None, 0.1, 0.02, "improved", "recorded")
    judge_moved([row(1.0, 1.0), context], Path("S05"))
