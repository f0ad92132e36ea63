"""The picture of a person's body in a study's report, and what was stored for it."""

from collections.abc import Sequence
from typing import Final

import numpy as np

from gaitval.identification.body_report import Bar

_FOUND: Final = "#0072b2"


def draw(bars: Sequence[Bar]) -> str:
    """Each of `bars` before and after the record, as SVG."""
    from gaitval.reporting.drawing import new_figure, svg  # a walk is checked without them
    from gaitval.reporting.figures import BAND_COLOUR  # dark on a dark page, where points are light

    names, means, sds = zip(*bars, strict=True)
    places = np.arange(len(bars))[::-1]
    with new_figure(0.24 * len(bars) + 0.6) as figure:
        axes = figure.subplots()
        for at, mean, sd in zip(places, means, sds, strict=True):
            edges = [at - 0.35, at - 0.35, at + 0.35, at + 0.35]
            axes.fill([-1.0, 1.0, 1.0, -1.0], edges, color=BAND_COLOUR, linewidth=0)
            ends = [mean - sd, mean + sd]
            axes.plot(ends, [at, at], color=_FOUND, marker="|", markersize=4.0, linewidth=1.2)
        axes.plot(means, places, color=_FOUND, linestyle="none", marker="o", markersize=4.0)
        axes.set_yticks(places, names)
        axes.set_xlabel("SDs of what was known before")
        return svg(figure, "body")
