"""Axes that draw their ticks together, and curves of few points, paint what matplotlib's do."""

from itertools import pairwise

import numpy as np
import pytest
from matplotlib.figure import Figure
from test_light_figures import drawn

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
    light, plain = pair
    for kind in ("text", "ML"):
        ours, theirs = (
            sorted(
                (*np.round(points, 2).ravel(), words)
                for letters, points, _, _, words in of if letters == kind
            )
            for of in (light, plain)
        )  # fmt: skip
        assert len(ours) == len(theirs) > 20
        for one, other in zip(ours, theirs, strict=True):
            assert one[-1] == other[-1]
            np.testing.assert_allclose(one[:-1], other[:-1], atol=0.02)


def test_curves_and_bands_have_fewer_points_and_lie_on_the_same_line(pair) -> None:
    curves = [[points for letters, points, *_ in of if len(letters) > 20] for of in pair]
    assert len(curves[0]) == len(curves[1]) == 8
    assert sum(map(len, curves[0])) < 0.7 * sum(map(len, curves[1]))
    for light, plain in zip(*curves, strict=True):
        steps = np.linspace(0.0, 1.0, 50)[:, None]
        dense = np.concatenate([a + steps * (b - a) for a, b in pairwise(light)])
        far = np.min(np.linalg.norm(plain[:, None] - dense[None], axis=-1), axis=1)
        assert far.max() <= 0.25


def test_what_leaves_its_axes_is_cut_and_nothing_else_is(pair) -> None:
    clipped = [bool(clips) for letters, _, _, clips, _ in pair[0] if len(letters) > 20]
    assert 0 < sum(clipped) < len(clipped)
