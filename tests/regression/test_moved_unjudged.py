"""A check of which nothing can be judged is no pass."""

from pathlib import Path

import pytest

from gaitval.apps.regression.moved import judge_moved
from gaitval.apps.regression.regression import Row
from gaitval.errors import ToleranceError


def row(baseline, current, change="kept"):
    return Row("angle_rmse", "knee_angle_r", "deg", baseline, current, 1.0, change, "recorded")


def test_a_baseline_without_figures_is_not_judged():
    with pytest.raises(ToleranceError, match="not judged"):
        judge_moved([row(None, None), row(None, 2.0, "improved")], Path("S05"))
    with pytest.raises(ToleranceError, match="not judged"):
        judge_moved([], Path("S05"))


def test_what_the_baseline_lacks_is_not_counted_as_kept(capsys):
    judge_moved([row(1.0, 1.1), row(None, 2.0, "improved")], Path("S05"))
    message = " ".join(capsys.readouterr().out.split())
    assert "1 of 1 measures within their margins" in message
    assert "1 not judged" in message
