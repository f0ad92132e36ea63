"""Figures of the report of an import, in the style of `gaitval.reporting.figures`.

No text from outside (names of markers or files) is drawn here: it belongs on the page, where it is
escaped.
"""

from collections.abc import Mapping
from itertools import pairwise
from typing import Final

import numpy as np
from matplotlib.axes import Axes
from matplotlib.lines import Line2D
from matplotlib.patches import Patch

from gaitval.arrays import Array
from gaitval.coordinates import SIDES, Side
from gaitval.reporting.drawing import new_figure, svg
from gaitval.reporting.figures import COLOURS, NAMES, PERCENT, RECORD_COLOUR, RECORD_SHADE, STYLES

MeanAndDeviation = tuple[Array, Array]

COLUMNS: Final = 3
_PANEL_HEIGHT: Final = 1.75
"""Inches."""
_SUFFIX: Final[Mapping[str, Side]] = {"_r": "right", "_l": "left"}
_BINS: Final = 500
"""Columns of a drawn time series, about two per printed dot of 0.3 mm."""
_LIMIT_STYLE: Final = {"color": "#a8200d", "linewidth": 0.7, "linestyle": (0, (4, 2))}


def side_of(name: str) -> tuple[str, Side | None]:
    """Curve and side of a `name`: ("knee_angle", "right") of "knee_angle_r"."""
    side = _SUFFIX.get(name[-2:])
    return (name, None) if side is None else (name[:-2], side)


def curve_names(curves: Mapping[str, MeanAndDeviation]) -> list[str]:
    """Names of `curves` without their sides, in their order, each once."""
    return list(dict.fromkeys(side_of(name)[0] for name in curves))


def cycle_curves(
    curves: Mapping[str, MeanAndDeviation],
    stance_fraction: Mapping[Side, float],
    *,
    label: str,
    figure_name: str,
    factor: float = 1.0,
    bands: Mapping[str, tuple[Array, Array]] | None = None,
) -> str:
    """Mean ± SD over the gait cycle as SVG `figure_name`: a panel per curve, with both sides.

    Parameters
    ----------
    curves : mean (101,) and standard deviation (101,), NaN where not measured, by name with "_r"
        or "_l"; a name without a side is drawn in black.
    stance_fraction : toe-off of each side as a fraction of its gait cycle; NaN if not known.
    label : quantity and unit of the drawn values, which are those of `curves` times `factor`.
    bands : mean - SD and mean + SD (101,) of typically developing children, by name as `curves`;
        drawn in grey, once for both sides.
    """
    bands = bands or {}
    names = curve_names(curves)
    # the quotient rounded up
    rows = max(1, -(-len(names) // COLUMNS))
    with new_figure(_PANEL_HEIGHT * rows + 0.55) as figure:
        panels = figure.subplots(rows, COLUMNS, squeeze=False).ravel()
        for axes, name in zip(panels, names, strict=False):
            _panel(axes, curves, name, stance_fraction, factor)
            band = bands.get(f"{name}_r", bands.get(f"{name}_l"))
            if band is not None:
                low, high = (factor * np.asarray(edge, dtype=float) for edge in band)
                axes.fill_between(PERCENT, low, high, color=RECORD_SHADE, linewidth=0, zorder=0)
        for axes in panels[len(names) :]:
            axes.set_visible(False)
        for index, axes in enumerate(panels[: len(names)]):
            if index % COLUMNS == 0:
                axes.set_ylabel(label)
            if index + COLUMNS >= len(names):
                axes.set_xlabel("% of gait cycle")
        handles: list[Line2D | Patch] = [
            Line2D([], [], color=COLOURS[side], linestyle=STYLES[side], label=side)
            for side in SIDES
        ]
        handles.append(Patch(facecolor="#9a9a9a", alpha=0.35, label="± SD"))
        handles.append(
            Line2D([], [], color="#707070", linewidth=0.6, linestyle=(0, (2, 2)), label="toe-off")
        )
        if bands:
            handles.append(
                Patch(facecolor=RECORD_SHADE, label="typically developing children ± SD")
            )
        figure.legend(handles=handles, loc="outside upper center", ncols=len(handles))
        return svg(figure, figure_name)


def _panel(
    axes: Axes,
    curves: Mapping[str, MeanAndDeviation],
    name: str,
    stance_fraction: Mapping[Side, float],
    factor: float,
) -> None:
    axes.set_title(NAMES.get(name, name.replace("_", " ").capitalize()), parse_math=False)
    axes.set_xlim(0, 100)
    axes.axhline(0.0, color="#b0b0b0", linewidth=0.4, zorder=0)
    drawn = False
    for key, (mean, deviation) in curves.items():
        curve, side = side_of(key)
        if curve != name:
            continue
        colour = RECORD_COLOUR if side is None else COLOURS[side]
        middle = factor * np.asarray(mean, dtype=float)
        spread = factor * np.asarray(deviation, dtype=float)
        if not np.isfinite(middle).any():
            continue
        drawn = True
        axes.fill_between(
            PERCENT, middle - spread, middle + spread, color=colour, alpha=0.22, linewidth=0
        )
        axes.plot(PERCENT, middle, color=colour, linestyle="-" if side is None else STYLES[side])
        if side is not None and np.isfinite(stance_fraction.get(side, np.nan)):
            axes.axvline(
                100 * stance_fraction[side],
                color=colour,
                linewidth=0.6,
                linestyle=(0, (2, 2)),
                zorder=0,
            )
    axes.margins(y=0.1)
    if not drawn:
        axes.set_yticks([])
        axes.text(0.5, 0.5, "not measured", transform=axes.transAxes, ha="center", color="#5c5c5c")


def residuals(
    time: Array,
    force: Array,
    moment: Array,
    *,
    force_limit: float,
    moment_limit: float,
    figure_name: str,
) -> str:
    """Residual force and moment at the pelvis over the trial, with limits, as SVG `figure_name`.

    Parameters
    ----------
    time : (T,) s.
    force, moment : (T, 3) N and Nm, axes forward, left, up; NaN where not measured.
    force_limit, moment_limit : limits of the largest magnitude, N and Nm; NaN draws none.
    """
    with new_figure(3.5) as figure:
        panels = figure.subplots(2, 3, sharex=True, sharey="row")
        rows = ((force, force_limit, "force, N"), (moment, moment_limit, "moment, Nm"))
        titles = (
            ("Forward", "To the left", "Up"),
            ("About forward", "About left", "About up"),
        )
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
