"""Figures of muscles: activations over textbook timing, and contact forces with bands."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Final

import numpy as np
from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.lines import Line2D
from matplotlib.patches import Patch

from gaitval._internal.io.text_tables import with_unit
from gaitval.arrays import Array
from gaitval.coordinates import SIDES, Side
from gaitval.kinetics.musculature.gait import CONTACTS, GROUPS, USUAL_ON, MuscleGait
from gaitval.reporting.drawing import legend_above, new_figure, panels_of_one_size, svg
from gaitval.reporting.figure_data import Column, table
from gaitval.reporting.figures import COLOURS, PERCENT, STYLES, WALK_WIDTH

ELECTROMYOGRAM: Final = "usual electromyogram (Perry and Burnfield 2010)"


@dataclass(frozen=True)
class DrawnMuscles:
    """What a figure shows: mean (101,) and band (2, 101) or None by name with `_r` or `_l`.

    Attributes
    ----------
    activation : of `GROUPS`.
    contact : of `CONTACTS`, body weights.
    """

    activation: Mapping[str, tuple[Array, Array | None]]
    contact: Mapping[str, tuple[Array, Array | None]]

    @classmethod
    def of(cls, muscles: MuscleGait) -> "DrawnMuscles":
        """The groups and contact forces of `muscles`."""
        activation, contact = {}, {}
        for side, leg in muscles.legs.items():
            for group in GROUPS:
                if np.isfinite(mean := leg.group(group)).all():
                    activation[f"{group}_{side[0]}"] = mean, leg.group_band(group)
            for name, curve in leg.contact.items():
                contact[f"{name}_{side[0]}"] = curve, leg.contact_band.get(name)
        return cls(activation, contact)

    def activations(self) -> str:
        """The figure of activations as SVG."""
        return _grid(self.activation, {n: t for n, (t, _) in GROUPS.items()}, "activations", 3)

    def contacts(self) -> str:
        """The figure of contact forces as SVG."""
        return _grid(self.contact, CONTACTS, "contacts", 3)

    def table(self, name: str) -> str:
        """The curves of the figure "activations" or "contacts" as CSV."""
        if name == "activations":
            return _table(self.activation, "1")
        return _table(self.contact, "BW")

    def tables(self) -> dict[str, str]:
        """The curves of both figures as CSV, by the figure's name."""
        return {name: self.table(name) for name in ("activations", "contacts")}


def _table(curves: Mapping[str, tuple[Array, Array | None]], unit: str) -> str:
    columns: dict[str, Column] = {"percent": PERCENT}
    for name, (mean, band) in curves.items():
        ends = () if band is None else zip(("low", "high"), band, strict=True)
        for what, values in (("mean", mean), *ends):
            columns[with_unit(f"{name}_{what}", unit)] = values
    return table(columns)


def _grid(
    curves: Mapping[str, tuple[Array, Array | None]],
    titles: Mapping[str, str],
    name: str,
    columns: int,
) -> str:
    rows = -(-len(titles) // columns)
    with new_figure(1.45 * rows + 0.35, placed=True) as figure:
        every = panels_of_one_size(figure, rows, columns, above=0.42, between=0.42)
        for number, (key, title) in enumerate(titles.items()):
            axes = every[number // columns, number % columns]
            _draw(axes, key, curves)
            axes.set_title(title, loc="left", pad=3)
            if number % columns == 0:
                axes.set_ylabel("activation" if name == "activations" else "force, BW")
        for axes in every[-1]:
            axes.set_xlabel("% of gait cycle")
        legend_above(figure, _handles(curves, usual=name == "activations"), columns=4)
        return svg(figure, name)


def _draw(axes: Axes, key: str, curves: Mapping[str, tuple[Array, Array | None]]) -> None:
    axes.set_xlim(0, 100)
    highest = 0.0
    for side in SIDES:
        if (found := curves.get(f"{key}_{side[0]}")) is None:
            continue
        mean, band = found
        if band is not None:
            axes.fill_between(PERCENT, *band, color=COLOURS[side], alpha=0.18, linewidth=0)
        axes.plot(
            PERCENT, mean, color=COLOURS[side], linestyle=STYLES[side], linewidth=WALK_WIDTH,
            zorder=3,
        )  # fmt: skip
        highest = max(highest, float(mean.max()), float(band[1].max()) if band is not None else 0.0)
    if not highest:
        axes.text(0.0, 0.9, "not known", transform=axes.transAxes, va="top", color="#5c5c5c")
    axes.set_ylim(0.0, 1.08 * highest or 1.0)
    for first, last in USUAL_ON.get(key, ()):
        axes.plot(
            (first, last), (0.03, 0.03), transform=axes.get_xaxis_transform(), color="#606060",
            linewidth=2.0, solid_capstyle="butt", zorder=1,
        )  # fmt: skip


def _handles(curves: Mapping[str, tuple[Array, Array | None]], *, usual: bool) -> list[Artist]:
    shown: list[Side] = [
        side for side in SIDES if any(name.endswith(f"_{side[0]}") for name in curves)
    ]
    handles: list[Artist] = [
        Line2D([], [], label=s, color=COLOURS[s], linestyle=STYLES[s], linewidth=WALK_WIDTH)
        for s in shown
    ]
    if any(band is not None for _, band in curves.values()):
        handles.append(Patch(label="90 % of the draws", facecolor=COLOURS["right"], alpha=0.3))
    if usual:
        handles.append(Line2D([], [], label=ELECTROMYOGRAM, color="#606060", linewidth=2.0))
    return handles
