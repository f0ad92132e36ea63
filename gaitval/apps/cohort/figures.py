"""Figures of a cohort's report, as SVG text; style as in `figures`."""

from collections.abc import Sequence
from typing import Final

import numpy as np
import pandas as pd
from matplotlib.axes import Axes

from gaitval.number_text import unit_sign
from gaitval.reporting.drawing import new_figure, svg
from gaitval.reporting.figures import RECORD_SHADE

SEX_COLOURS: Final = {"F": "#cc79a7", "M": "#0072b2"}
IDENTIFIED: Final = "identified"
"""Verdict of a parameter that the record determines."""
ROW: Final = 1.9
"""Inches; height of a row of panels."""


def by_speed_age_sex(rows: pd.DataFrame, names: Sequence[str], *, figure_name: str) -> str:
    """Each record's value against speed, age and sex, as the SVG `figure_name`: a row of three
    panels for each of `names`.

    `rows` has columns name, unit, value, speed (m/s), age (years), sex.
    """
    with new_figure(ROW * len(names)) as figure:
        grid = figure.subplots(len(names), 3, sharey="row", squeeze=False)
        for panels, name in zip(grid, names, strict=True):
            chosen = rows[rows["name"] == name]
            _scatter(panels[0], chosen, "speed")
            _scatter(panels[1], chosen, "age")
            _by_sex(panels[2], chosen)
            unit = "" if chosen.empty else unit_sign(str(chosen["unit"].iloc[0]))
            panels[0].set_ylabel(f"{name}, {unit}" if unit else name)
        for axes, label in zip(grid[-1], ("Speed, m/s", "Age, years", "Sex"), strict=True):
            axes.set_xlabel(label)
        return svg(figure, figure_name)


def _scatter(axes: Axes, rows: pd.DataFrame, across: str) -> None:
    for sex, colour in SEX_COLOURS.items():
        some = rows[rows["sex"] == sex]
        axes.plot(some[across], some["value"], "o", color=colour, markersize=3, alpha=0.75)


def _by_sex(axes: Axes, rows: pd.DataFrame) -> None:
    """Box of each sex: quartiles and 1.5 interquartile ranges, with the records beside it."""
    for place, (sex, colour) in enumerate(SEX_COLOURS.items()):
        values = rows.loc[rows["sex"] == sex, "value"].dropna().to_numpy(dtype=float)
        if len(values) > 3:
            axes.boxplot(
                values, positions=[place], widths=0.5, showfliers=False, patch_artist=True,
                boxprops={"facecolor": RECORD_SHADE, "linewidth": 0.5},
                medianprops={"color": "#1a1a1a"},
            )  # fmt: skip
        spread = np.linspace(-0.12, 0.12, max(len(values), 2))[: len(values)]
        axes.plot(place + spread, values, "o", color=colour, markersize=3, alpha=0.75)
    axes.set_xticks(range(len(SEX_COLOURS)), ["women", "men"])
    axes.set_xlim(-0.6, len(SEX_COLOURS) - 0.4)


def parameter_distributions(rows: pd.DataFrame, *, figure_name: str) -> str:
    """Parameters that the records of the studies determine as the SVG `figure_name`, in prior
    standard deviations from the prior's mean. Those of others keep the prior's mean, and a dot
    would say nothing.

    `rows` as `results.tables_of` gives `parameters`; at least one is determined.
    """
    rows = rows[rows["verdict"] == IDENTIFIED]
    names = list(dict.fromkeys(rows["parameter"]))
    with new_figure(0.8 + 0.2 * len(names)) as figure:
        axes = figure.subplots()
        axes.axvspan(-1.0, 1.0, color=RECORD_SHADE, alpha=0.5, linewidth=0)
        for place, name in enumerate(names):
            some = rows[rows["parameter"] == name]
            far = (some["mean"] - some["nominal"]) / some["prior_sd"]
            axes.plot(far, np.full(len(far), place), "o", color="#0072b2", markersize=3, alpha=0.7)
        axes.set_yticks(range(len(names)), [name.replace("_", " ") for name in names])
        axes.invert_yaxis()
        axes.set_xlabel("Posterior mean from the body as scaled, prior standard deviations")
        return svg(figure, figure_name)
