"""What a figure shows, taken from what is drawn and not from what draws it."""

from collections.abc import Callable
from pathlib import Path
from typing import Any, TextIO

import numpy as np
import pytest
from matplotlib.axes import Axes
from matplotlib.colors import same_color, to_hex
from matplotlib.figure import Figure


def figures_of(draw: Callable[[], object]) -> list[Figure]:
    """The figures that `draw` saves, in their order."""
    seen = []
    saved = Figure.savefig

    def save(figure: Figure, target: TextIO | Path | str, **options: object) -> None:
        seen.append(figure)
        saved(figure, target, **options)

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(Figure, "savefig", save)
        draw()
    return seen


def figure_of(draw: Callable[[], object]) -> Figure:
    """The one figure that `draw` saves."""
    (figure,) = figures_of(draw)
    return figure


def lines(axes: Axes, colour: str | None = None, width: float | None = None) -> list[np.ndarray]:
    """x and y (n, 2) of the lines of more than two points, of one colour and width."""
    return [
        np.column_stack([each.get_xdata(), each.get_ydata()]).astype(float)
        for each in axes.lines
        if len(each.get_xdata()) > 2
        and (colour is None or same_color(each.get_color(), colour))
        and width in (None, each.get_linewidth())
    ]


def bands(axes: Axes, colour: str | None = None, *, across: bool = False) -> list[np.ndarray]:
    """x, low and high (n, 3) of the filled bands of one colour; `across`: y, left and right."""
    found = []
    for each in axes.collections:
        if not hasattr(each, "get_paths") or not each.get_paths():
            continue
        if colour is not None and to_hex(each.get_facecolor()[0]) != to_hex(colour):
            continue
        points = each.get_paths()[0].vertices[:, :: -1 if across else 1]
        if len(points) > 10:
            places = np.unique(points[:, 0])
            ends = [points[points[:, 0] == at, 1] for at in places]
            found.append(
                np.array([(at, e.min(), e.max()) for at, e in zip(places, ends, strict=True)])
            )
    return found


def forward(axes: Axes) -> bool:
    """Whether the axes grow to the right and upwards, over a whole cycle or stance."""
    (left, right), (low, high) = axes.get_xlim(), axes.get_ylim()
    return (left, right) == (0.0, 100.0) and low < high


def legend(holder: Axes | Figure) -> dict[str, Any]:
    """What a legend calls each line or patch."""
    found = holder.legends[0] if isinstance(holder, Figure) else holder.get_legend()
    texts = (each.get_text() for each in found.get_texts())
    return dict(zip(texts, found.legend_handles, strict=True))
