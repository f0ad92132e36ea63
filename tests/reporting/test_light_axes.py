"""Axes that draw their ticks together, and curves of few points, paint what matplotlib's do."""

import numpy as np
import pytest
from matplotlib.figure import Figure
from painted import drawn

from gaitval.reporting import light_axes
from gaitval.reporting.drawing import new_figure, svg
from gaitval.reporting.light_axes import LightFigure
from gaitval.reporting.page import _with_letters

X = np.linspace(0.0, 100.0, 101)


def made() -> str:
    with new_figure(2.5) as figure:
        upper, lower = figure.subplots(2, 2, sharex=True)
        for number, axes in enumerate([*upper, *lower]):
            axes.plot(X, 20.0 * np.sin(X / 15.0 + number) * 10.0**number)
            axes.fill_between(X, X, X + 30.0 * np.cos(X / 20.0), color="#d9d9d9")
            axes.axvline(61.5)
            axes.set_ylabel("moment, Nm/kg")
        lower[0].set_ylim(-5.0, 5.0)  # cuts its curve
        lower[1].set_yticks([0.0, 50.0], ["none", "half"], fontsize=7.0)
        lower[0].tick_params(axis="x", length=0)
        figure.legend(upper[0].lines[:1], ["walk"], loc="outside upper center")
        return _with_letters(svg(figure, "made"))


@pytest.fixture(scope="module")
def pair() -> tuple[list, list]:
    light = drawn(made())
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(LightFigure, "add_subplot", Figure.add_subplot)
        patch.setattr(light_axes, "_thin_out", lambda figure: None)
        return light, drawn(made())


def test_every_text_and_mark_stands_where_matplotlib_puts_it(pair) -> None:
    for kind in ("text", "ML"):
        ours, theirs = (
            [(words, points.ravel()) for letters, points, _, _, words in of if letters == kind]
            for of in pair
        )
        assert len(ours) == len(theirs) > 20
        for words, place in theirs:
            near = [each for each in ours if each[0] == words]
            assert min(np.abs(each[1] - place).max() for each in near) <= 0.1


def test_curves_and_bands_have_fewer_points_and_lie_on_the_same_line(pair) -> None:
    light, plain = (
        [points for letters, points, *_ in of if len(points) > few]
        for of, few in zip(pair, (1, 5), strict=True)  # a curve that is flat keeps three
    )
    assert len(plain) > 5
    assert sum(map(len, light)) < 0.7 * sum(map(len, plain))
    for curve in plain:
        assert min(_away(curve, each) for each in light) <= 0.25


def _away(points: np.ndarray, line: np.ndarray) -> float:
    """The largest distance of `points` from a `line` through its own."""
    along = np.diff(line, axis=0)
    length = np.maximum(np.sum(along**2, axis=1), 1e-12)
    to = points[:, None] - line[None, :-1]
    share = np.clip(np.sum(to * along, axis=-1) / length, 0.0, 1.0)
    return float(np.linalg.norm(to - share[..., None] * along, axis=-1).min(axis=1).max())


def test_what_leaves_its_axes_is_cut_and_nothing_else_is(pair) -> None:
    clipped = [bool(clips) for letters, _, _, clips, _ in pair[0] if len(letters) > 20]
    assert 0 < sum(clipped) < len(clipped)
