"""Figures of the report of an import, in the style of `gaitval.reporting.figures`.

No text from outside (names of markers or files) is drawn here: it belongs on the page, where it is
escaped.
"""

from collections.abc import Mapping, Sequence
from itertools import pairwise
from typing import Final

import numpy as np
from matplotlib.axes import Axes

from gaitval.arrays import Array
from gaitval.coordinates import SIDES, Side, split_side
from gaitval.metrics.norms import Norm
from gaitval.reporting.drawing import new_figure, svg
from gaitval.reporting.figures import RECORD_COLOUR
from gaitval.reporting.grids import DrawnCurve, Panel

MeanAndDeviation = tuple[Array, Array]

COLUMNS: Final = 3
_BINS: Final = 500
"""Columns of a drawn time series, about two per printed dot of 0.3 mm."""
_LIMIT_STYLE: Final = {"color": "#a8200d", "linewidth": 0.7, "linestyle": (0, (4, 2))}


def curve_rows(
    curves: Mapping[str, MeanAndDeviation],
    stance_fraction: Mapping[Side, float],
    kind: str,
    *,
    layout: Sequence[Sequence[str]] = (),
    factor: float = 1.0,
    norms: Mapping[str, Norm] | None = None,
    strides: Mapping[str, Array] | None = None,
) -> list[list[Panel]]:
    """The rows of a grid of recorded curves: those of `layout` ("kind/curve") that were recorded in
    some panel of their row, then all others of the `kind`, three in a row.

    Parameters
    ----------
    curves : mean (101,) and standard deviation (101,), NaN where not measured, by name with "_r"
        or "_l"; a name without a side is drawn in black.
    stance_fraction : toe-off of each side as a fraction of its gait cycle; NaN if not known.
    factor : of curves and strides, to the unit of the grid.
    norms : by "kind/curve", in the unit of the grid.
    strides : (n, 101) by "kind/curve_r".
    """
    norms, strides = norms or {}, strides or {}
    here = list(dict.fromkeys(split_side(name)[1] for name in curves))
    toe_off = {s: 100.0 * at for s, at in stance_fraction.items() if np.isfinite(at)}
    placed = [row for row in layout if any(each.partition("/")[2] in here for each in row)]
    left = [f"{kind}/{name}" for name in here if not any(f"{kind}/{name}" in r for r in placed)]
    rows = [*placed, *(left[i : i + COLUMNS] for i in range(0, len(left), COLUMNS))]

    def panel(name: str) -> Panel:
        found = []
        for key, (mean, deviation) in curves.items():
            of, curve = split_side(key)
            if f"{kind}/{curve}" == name and np.isfinite(mean).any():
                side = next((each for each in SIDES if each == of), None)
                every = strides.get(f"{kind}/{key}")
                found.append(
                    DrawnCurve(
                        side,
                        factor * np.asarray(mean, dtype=float),
                        factor * np.asarray(deviation, dtype=float),
                        None if every is None else factor * every,
                        "record" if side is None else "walk",
                    )
                )
        return Panel(name, tuple(found), norms.get(name), toe_off)

    return [[panel(name) for name in (*row, *("",) * (COLUMNS - len(row)))] for row in rows]


def residuals(
    time: Array,
    force: Array,
    moment: Array,
    *,
    force_limit: float,
    moment_limit: float,
    figure_name: str,
) -> str:
    """Residual `force` and `moment` (T, 3) N and Nm at the pelvis, axes forward, left, up, NaN
    where not measured, over the `time` (T,) s of the trial, as SVG `figure_name`, with the limits
    of the largest magnitude, `force_limit` and `moment_limit`; NaN draws none.
    """
    with new_figure(2.9) as figure:
        panels = figure.subplots(2, 3, sharex=True, sharey="row")
        rows = ((force, force_limit, "force, N"), (moment, moment_limit, "moment, Nm"))
        titles = (("Forward", "To the left", "Up"), ("About forward", "About left", "About up"))
        for row, (values, limit, label) in enumerate(rows):
            for column in range(3):
                axes = panels[row, column]
                axes.set_title(titles[row][column])
                axes.axhline(0.0, color="#b0b0b0", linewidth=0.4, zorder=0)
                _series(axes, time, values[:, column])
                if np.isfinite(limit):
                    for sign in (-1.0, 1.0):
                        axes.axhline(sign * limit, **_LIMIT_STYLE)
            panels[row, 0].set_ylabel(label)
        for axes in panels[1]:
            axes.set_xlabel("time, s")
        return svg(figure, figure_name)


def _series(axes: Axes, time: Array, values: Array) -> None:
    """A time series; a long one as its range in each column, so that no peak is lost."""
    if len(time) <= 2 * _BINS:
        axes.plot(time, values, color=RECORD_COLOUR, linewidth=0.6)
        return
    edges = np.linspace(0, len(time), _BINS + 1).astype(int)
    spans = [values[begin:end] for begin, end in pairwise(edges)]
    # fmin and fmax ignore NaN if there is a number beside it
    lowest = np.array([np.fmin.reduce(span) for span in spans])
    highest = np.array([np.fmax.reduce(span) for span in spans])
    middle = 0.5 * (time[edges[:-1]] + time[edges[1:] - 1])
    axes.fill_between(
        middle, lowest, highest, color=RECORD_COLOUR, linewidth=0.4, edgecolor=RECORD_COLOUR
    )
