"""The figure that researchers of balance know: where the next foot lands after a push, over where
the extrapolated centre of mass has gone.
"""

from collections.abc import Mapping, Sequence
from typing import Any, Final

import numpy as np
from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Patch

from gaitval.arrays import Array
from gaitval.coordinates import Side
from gaitval.metrics.foot_placement import RECOVERED
from gaitval.metrics.results import PlacedFoot
from gaitval.reporting.drawing import legend_above, new_figure, svg
from gaitval.reporting.figures import BAND_COLOUR, COLOURS, RECORD_COLOUR, WALK_WIDTH

CENTIMETRES: Final = 100.0
MARKS: Final[Mapping[Side, str]] = {"right": "o", "left": "^"}
GUESS_COLOUR: Final = "#7a7a7a"
NAME: Final = "foot_placement"
HEIGHT: Final = 2.15
"""Inches."""


def law(
    axes: Axes,
    extrapolated: Array,
    foot: Array,
    pendulum: Array,
    sides: Sequence[Side],
    reach: float | None = None,
) -> None:
    """Draw changes by pushes, (n,) m: of the next `foot` over that of the `extrapolated` centre of
    mass, to `reach` cm, and of the foot by a `pendulum`. On people's line the foot keeps its
    distance; the band is what their ankles correct (Hof et al. 2010).
    """
    x, y, guess = (CENTIMETRES * each for each in (extrapolated, foot, pendulum))
    if reach is None:
        reach = 1.1 * max([1.0, *np.abs(x), *np.abs(y)])
    ends, half = np.array([-reach, reach]), CENTIMETRES * RECOVERED
    axes.fill_between(ends, ends - half, ends + half, color=BAND_COLOUR, linewidth=0)
    axes.plot(ends, ends, color=RECORD_COLOUR, linewidth=WALK_WIDTH)
    axes.axhline(0.0, color=GUESS_COLOUR, linewidth=0.7, linestyle=":")
    axes.plot(x, guess, linestyle="none", marker="x", markersize=3.0, color=GUESS_COLOUR)
    for side, mark in MARKS.items():
        own = np.array([each == side for each in sides], dtype=bool)
        axes.plot(
            x[own], y[own], linestyle="none", marker=mark, markersize=4.0,
            markerfacecolor="none", color=COLOURS[side],
        )  # fmt: skip
    axes.set_xlim(-reach, reach)
    axes.set_ylim(-reach, reach)
    axes.set_aspect("equal")


def handles() -> list[Artist]:
    """What the marks mean."""
    hollow: dict[str, Any] = {"linestyle": "none", "markersize": 4.0, "markerfacecolor": "none"}
    guess: dict[str, Any] = {"linestyle": "none", "marker": "x", "markersize": 3.0}
    return [
        Line2D([], [], label="people (Hof 2010)", color=RECORD_COLOUR, linewidth=WALK_WIDTH),
        Patch(label="±2 cm, by the ankle", facecolor=BAND_COLOUR),
        *(
            Line2D([], [], label=f"{side} foot", marker=mark, color=COLOURS[side], **hollow)
            for side, mark in MARKS.items()
        ),
        Line2D([], [], label="pendulum", color=GUESS_COLOUR, **guess),
        Line2D([], [], label="no reaction", linestyle=":", color=GUESS_COLOUR, linewidth=0.7),
    ]


def answered_pushes(placed: Sequence[PlacedFoot]) -> tuple[Array, list[Side]]:
    """(n, 3) m of the pushes with a step: extrapolated centre of mass, foot, pendulum, NaN where
    that has none; and whose foot it is.
    """
    rows, sides = list[tuple[float, float, float]](), list[Side]()
    for each in placed:
        if each.side is not None and each.foot is not None and each.extrapolated is not None:
            guess = np.nan if each.pendulum is None else each.pendulum
            rows.append((each.extrapolated, each.foot, guess))
            sides.append(each.side)
    return np.array(rows).reshape(-1, 3), sides


def kept_distance(placed: Sequence[PlacedFoot]) -> dict[str, float] | None:
    """Of pushes that were followed by a step: their `count`, the largest `shift` of the foot, and
    `within` what it keeps its distance from the extrapolated centre of mass, cm; None without any.
    """
    rows, sides = answered_pushes(placed)
    if not sides:
        return None
    return {
        "count": len(sides),
        "shift": CENTIMETRES * float(np.abs(rows[:, 1]).max()),
        "within": CENTIMETRES * float(np.abs(rows[:, 1] - rows[:, 0]).max()),
        "people": CENTIMETRES * RECOVERED,
    }


def foot_placement(people: Mapping[str, Sequence[PlacedFoot]]) -> str:
    """The figure, with a panel of what each of `people` did; a title is drawn if it is not empty.
    The panels have one scale.
    """
    with new_figure(HEIGHT) as figure:
        draw_people(figure, people)
        return svg(figure, NAME)


def draw_people(figure: Figure, people: Mapping[str, Sequence[PlacedFoot]]) -> None:
    """Draw it on an empty `figure`."""
    found = {title: answered_pushes(placed) for title, placed in people.items()}
    largest = [float(np.abs(rows[:, :2]).max(initial=0.0)) for rows, _ in found.values()]
    reach = 1.1 * max(1.0, CENTIMETRES * max(largest))
    panels = figure.subplots(1, len(found), sharey=True, squeeze=False)[0]
    for axes, (title, (rows, sides)) in zip(panels, found.items(), strict=True):
        law(axes, rows[:, 0], rows[:, 1], rows[:, 2], sides, reach)
        axes.set_title(title)
        axes.set_xlabel("extrapolated centre of mass, cm to the left")
    panels[0].set_ylabel("next foot, cm to the left")
    legend_above(figure, handles(), columns=6)
