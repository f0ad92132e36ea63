"""Grids of curves as gait laboratories draw them: joints in rows, planes in columns, both sides.

Each panel has the norm of healthy people as a grey band, a wide black line for what was recorded,
a narrow coloured one for the walk with its standard deviation, thin strides behind, and toe-off;
the left side is dashed. The grids of a run, an import and a comparison are drawn here.
"""

from collections.abc import Mapping, Sequence
from typing import Any, Final, Literal, NamedTuple

import numpy as np
from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.lines import Line2D
from matplotlib.patches import Patch

from gaitval._internal.io.text_tables import with_unit
from gaitval.arrays import Array
from gaitval.conventions import convention_of
from gaitval.coordinates import Side
from gaitval.metrics.norms import Norm
from gaitval.quantities import BY_NAME, QUANTITIES
from gaitval.quantities.joint_power import BURSTS
from gaitval.reporting.drawing import (
    WIDTH,
    legend_above,
    link,
    new_figure,
    panels_of_one_size,
    svg,
)
from gaitval.reporting.figure_data import Column, table
from gaitval.reporting.figures import (
    BAND_COLOUR,
    COLOURS,
    NAMES,
    PERCENT,
    RECORD_COLOUR,
    RECORD_WIDTH,
    STYLES,
    WALK_WIDTH,
    band,
)

KINEMATICS: Final = (
    ("angles/pelvis_tilt", "angles/pelvis_list", "angles/pelvis_rotation"),
    ("angles/hip_flexion", "angles/hip_adduction", "angles/hip_rotation"),
    ("angles/knee_angle", "angles/knee_adduction", "angles/knee_rotation"),
    ("angles/ankle_angle", "angles/subtalar_angle", "angles/ankle_rotation"),
    ("angles/foot_pitch", "angles/foot_list", "angles/foot_progression"),
)
KINETICS: Final = (
    ("moments/hip_flexion", "moments/hip_adduction", "power/hip_flexion"),
    ("moments/knee_angle", "moments/knee_adduction", "power/knee_angle"),
    ("moments/ankle_angle", "moments/subtalar_angle", "power/ankle_angle"),
)
"""Rows: joints; columns: sagittal, frontal and transverse plane, and for kinetics the power."""
FURTHER: Final = tuple(
    each
    for each in QUANTITIES
    if each.shown == "curves"
    and each.of_muscles is None
    and not {*each.panels()} <= {name for row in KINETICS for name in row}
)
"""Quantities that have no place in `KINETICS`, nor, as what follows from muscles, in a figure of
their own (`muscle_figures`)."""
_FURTHER_PANELS: Final = [name for each in FURTHER for name in each.panels()]
WITH_QUANTITIES: Final = (
    *KINETICS,
    *(
        (*_FURTHER_PANELS[i : i + 3], *("",) * (3 - len(_FURTHER_PANELS[i : i + 3])))
        for i in range(0, len(_FURTHER_PANELS), 3)
    ),
)
"""`KINETICS`, and below it all other quantities."""
_OF_MUSCLES: Final = [
    name
    for each in QUANTITIES
    if each.of_muscles is not None and each.shown == "curves"
    for name in each.panels()
]
MUSCLES: Final = tuple(tuple(_OF_MUSCLES[i : i + 3]) for i in range(0, len(_OF_MUSCLES), 3))
"""Activations and contact forces, three in a row."""
MOMENTS: Final = (
    (*KINETICS[0][:2], "moments/hip_rotation"),
    (*KINETICS[1][:2], "moments/knee_rotation"),
    (*KINETICS[2][:2], "moments/ankle_rotation"),
)
FORCES: Final = (("forces/forward", "forces/medial", "forces/vertical"),)
SAGITTAL: Final = (
    ("angles/hip_flexion", "angles/knee_angle", "angles/ankle_angle"),
    ("moments/hip_flexion", "moments/knee_angle", "moments/ankle_angle"),
)
"""On the sheet."""

_ANGLES: Final = {
    **NAMES,
    "pelvis_list": "Pelvis obliquity, up",
    "pelvis_rotation": "Pelvis rotation, forward",
    "knee_rotation": "Knee internal rotation",
    "ankle_rotation": "Ankle internal rotation",
    "foot_list": "Foot tilt",
    "foot_progression": "Foot progression, inward",
}
"""All others are called by their names."""

_OPPOSITE: Final = {
    "hip_flexion": "Hip extension",
    "hip_adduction": "Hip abduction",
    "knee_angle": "Knee extension",
    "knee_adduction": "Knee abduction",
    "ankle_angle": "Ankle plantarflexion",
}
"""Moments that clinical reports draw the other way round, and what is positive there."""

Which = Literal["record", "walk"]
"""How a curve is drawn: black and wide, or narrow in the colour of its side."""


class DrawnCurve(NamedTuple):
    """A curve of a side: mean, SD and strides (n, 101), where there are any."""

    side: Side | None
    mean: Array
    sd: Array | None = None
    strides: Array | None = None
    which: Which = "walk"


class Panel(NamedTuple):
    """What a panel shows of one quantity, by its `name`, "kind/curve".

    Attributes
    ----------
    norm : of healthy people, if there is one.
    toe_off : % of the cycle, by side.
    regions : first and last % where curves differ by a test, by side.
    bursts : their names and place in the cycle, %.
    error : RMSE of the right and the left side, written above the panel.
    opposite : whether it is drawn the other way round, as its title says.
    """

    name: str
    curves: tuple[DrawnCurve, ...] = ()
    norm: Norm | None = None
    toe_off: Mapping[Side, float] = {}
    regions: Mapping[Side, Sequence[tuple[float, float]]] = {}
    bursts: Mapping[str, float] = {}
    error: str = ""
    opposite: bool = False

    @property
    def kind(self) -> str:
        """Of the curve: angles, moments, forces or a name of `QUANTITIES`; empty for an empty
        place.
        """
        return self.name.partition("/")[0]


def in_convention(panels: Sequence[Sequence[Panel]], name: str) -> list[list[Panel]]:
    """The `panels` with their angles, degrees, counted by the convention of this `name`."""
    convention = convention_of(name)

    def moved(panel: Panel) -> Panel:
        offset = float(np.degrees(convention.offset(panel.name.partition("/")[2])))
        if panel.kind != "angles" or not offset:
            return panel
        return panel._replace(
            curves=tuple(
                each._replace(
                    mean=each.mean + offset,
                    strides=None if each.strides is None else each.strides + offset,
                )
                for each in panel.curves
            ),
            norm=panel.norm and panel.norm._replace(mean=panel.norm.mean + offset),
        )

    return [[moved(each) for each in row] for row in panels]


def clinical(panels: Sequence[Sequence[Panel]]) -> list[list[Panel]]:
    """The `panels` with the moments of extensors, plantarflexors and abductors positive."""

    def turned(panel: Panel) -> Panel:
        kind, _, curve = panel.name.partition("/")
        if kind != "moments" or curve not in _OPPOSITE:
            return panel
        return panel._replace(
            curves=tuple(
                each._replace(
                    mean=-each.mean, strides=None if each.strides is None else -each.strides
                )
                for each in panel.curves
            ),
            norm=panel.norm and panel.norm._replace(mean=-panel.norm.mean),
            opposite=True,
        )

    return [[turned(each) for each in row] for row in panels]


def panel_name(kind: str, curve: str, extensor_positive: bool = False) -> str:
    """The name of a `curve` of a `kind` at the head of a column or a row: what is positive."""
    opposite = _OPPOSITE.get(curve) if extensor_positive and kind == "moments" else None
    return opposite or NAMES.get(curve, curve.replace("_", " ").capitalize())


def curve_name(kind: str, curve: str, extensor_positive: bool = False) -> str:
    """The same within a sentence."""
    name = panel_name(kind, curve, extensor_positive)
    words = {"moments": " moment", "forces": " force"}.get(kind, "")
    return f"{name[0].lower()}{name[1:]}{words}"


def title(name: str, opposite: bool = False) -> str:
    """The title of the panel of a quantity `name`, "kind/curve", drawn the `opposite` way round or
    not; its unit is beside the axis.
    """
    kind, _, curve = name.partition("/")
    if opposite:
        return _OPPOSITE[curve]
    if kind == "forces":
        return f"{NAMES[curve]} force"
    if kind in BY_NAME:
        return BY_NAME[kind].curves[curve]
    return _ANGLES.get(curve, curve.replace("_", " ").capitalize())


SPREAD: Final = "± SD of the cycles"
"""What the band about a curve is, unless a page has another."""

UNITS: Final = {
    "angles": "angle, °",
    "moments": "moment, Nm/kg",
    "forces": "force, % BW",
    **{each.name: each.axis_label for each in QUANTITIES},
}

TABLE_UNITS: Final[dict[str, str]] = {
    **{"angles": "deg", "moments": "Nm/kg", "forces": "% BW"},
    **{each.name: each.unit for each in QUANTITIES},
}
"""Units of the curves in the tables behind the figures."""

_LEGEND_LINE: Final = 0.17  # inches, of the 8 points of its letters and the space between


def grid(
    panels: Sequence[Sequence[Panel]],
    *,
    height: float,
    figure_name: str,
    words: tuple[str, str] = ("record", "walk"),
    norm: str = "",
    spread: str = SPREAD,
    linked: bool = True,
    width: float = WIDTH,
    extensor_positive: bool = False,
) -> str:
    """Rows of `panels` as SVG `figure_name`, each row `height` and the whole `width` inches: record
    and walk are called by `words`, the band of healthy people by `norm`, or by whose it is, that of
    a curve by `spread`. `linked` panels show the moment of the replay. Moments are drawn as they
    are counted, or as clinical reports draw them (`extensor_positive`).
    """
    panels = [[_seen(each) for each in row] for row in panels]
    panels = clinical(panels) if extensor_positive else panels
    shown = [panel for row in panels for panel in row]
    handles = _handles(shown, words, norm, spread)
    lines = 2 if width >= WIDTH else -(-len(handles) // 2)
    legend = _LEGEND_LINE * lines
    units = any(_begins(row, i) for row in panels for i in range(1, len(row)))
    between = 0.55 if units else 0.42
    with new_figure(height * len(panels) + 0.11 + legend, width=width, placed=True) as figure:
        every = panels_of_one_size(
            figure, len(panels), len(panels[0]), above=0.22 + legend, between=between
        )
        for number, (row, axes_of_row) in enumerate(zip(panels, every, strict=True)):
            for column, (panel, axes) in enumerate(zip(row, axes_of_row, strict=True)):
                if linked and panel.curves:
                    link(axes, "cycle", "both", number * len(row) + column)
                _draw(axes, panel)
                if _begins(row, column):
                    axes.set_ylabel(UNITS[panel.kind])
        for axes in every[-1]:
            axes.set_xlabel("% of gait cycle")
        legend_above(figure, handles, columns=-(-len(handles) // lines), size=8.0)
        return svg(figure, figure_name)


SEEN: Final = 0.015
"""Of the height of a panel: what is nearer to its curve is hidden by the line."""


def _seen(panel: Panel) -> Panel:
    """The `panel` without the bands and strides that its lines would hide."""
    means = [each.mean for each in panel.curves]
    least = SEEN * float(np.nanmax(means) - np.nanmin(means)) if means else 0.0

    def seen(distance: Array) -> bool:
        return bool(np.nanmax(np.abs(distance), initial=0.0) > least)

    return panel._replace(
        curves=tuple(
            each._replace(
                sd=each.sd if each.sd is not None and seen(each.sd) else None,
                strides=each.strides
                if each.strides is not None and seen(each.strides - each.mean)
                else None,
            )
            for each in panel.curves
        )
    )


def _begins(row: Sequence[Panel], column: int) -> bool:
    """Whether a panel is the first of its kind in its row, which says the unit."""
    kind = row[column].kind
    return bool(kind) and (column == 0 or kind != row[column - 1].kind)


def grid_table(panels: Sequence[Sequence[Panel]], beside: str = "record") -> str:
    """The curves of a grid of `panels` as CSV: what the walk is `beside` ("record" or "predicted"),
    mean and SD of each side, and the norm.
    """
    shown = [panel for row in panels for panel in row if panel.name]
    kinds = {panel.kind for panel in shown}
    columns: dict[str, Column] = {"percent": PERCENT}
    for panel in shown:
        # moments and powers of a joint have the same name
        name = panel.name.replace("/", "_") if len(kinds) > 1 else panel.name.partition("/")[2]
        unit = TABLE_UNITS[panel.kind]
        for curve in panel.curves:
            key = name if curve.side is None else f"{name}_{curve.side[0]}"
            which = "mean" if curve.which == "walk" else beside
            columns[with_unit(f"{key}_{which}", unit)] = curve.mean
            columns[with_unit(f"{key}_sd", unit)] = curve.sd
        if panel.norm is not None:
            columns[with_unit(f"{name}_norm_mean", unit)] = panel.norm.mean
            columns[with_unit(f"{name}_norm_sd", unit)] = panel.norm.sd
    return table(columns)


def _handles(
    panels: Sequence[Panel], words: tuple[str, str], norm: str, spread: str = SPREAD
) -> list[Artist]:
    """What the legend has: only what some panel shows."""
    drawn = {(each.which, each.side) for panel in panels for each in panel.curves}
    handles: list[Artist] = []
    for which, label in zip(("record", "walk"), words, strict=True):
        for side in (*COLOURS, None):
            if (which, side) in drawn:
                look = _look("walk" if which == "walk" else "record", side)
                handles.append(Line2D([], [], label=f"{label}, {side}" if side else label, **look))
    if any(each.sd is not None for panel in panels for each in panel.curves):
        handles.append(Patch(label=spread, facecolor=COLOURS["right"], alpha=0.3))
    if any(each.strides is not None for panel in panels for each in panel.curves):
        handles.append(Line2D([], [], label="single strides", color="#9a9a9a", linewidth=0.5))
    if bands := [panel.norm for panel in panels if panel.norm is not None]:
        handles.append(Patch(label=norm or _healthy(bands), facecolor=BAND_COLOUR))
    if any(found for panel in panels for found in panel.regions.values()):
        label = f"{words[1]} differs from {words[0]}"
        handles.append(Line2D([], [], label=label, color="#606060", linewidth=2.0))
    if any(panel.toe_off for panel in panels):
        dotted: Any = {"color": "#707070", "linewidth": 0.7, "linestyle": (0, (1, 1.5))}
        handles.append(Line2D([], [], label="toe-off", **dotted))
    return handles


def _healthy(bands: Sequence[Norm]) -> str:
    """Whose bands they are."""
    people = sorted({norm.people for norm in bands})
    if not people[0]:
        return "typically developing children, free speed, ± SD"
    count = "–".join(str(each) for each in dict.fromkeys((people[0], people[-1])))
    if any(norm.beyond for norm in bands):
        return f"{count} healthy adults at this speed or their nearest to it, ± SD"
    return f"{count} healthy adults at this speed, ± SD"


def _look(which: Which, side: Side | None) -> dict[str, Any]:
    """Colour, dashes and width of a curve."""
    walked = which == "walk"
    return {
        "color": COLOURS[side] if walked and side else RECORD_COLOUR,
        "linestyle": STYLES[side] if side else "-",
        "linewidth": WALK_WIDTH if walked else RECORD_WIDTH,
    }


def _draw(axes: Axes, panel: Panel) -> None:
    axes.set_xlim(0, 100)
    if not panel.curves:
        axes.axis("off")
    if not panel.name:
        return
    axes.set_title(title(panel.name, panel.opposite), loc="left", pad=3)
    if not panel.curves:
        axes.text(0.0, 0.9, "not measured", transform=axes.transAxes, va="top", color="#5c5c5c")
        return
    axes.axhline(0.0, color="#b0b0b0", linewidth=0.4, zorder=0)
    if panel.norm is not None:
        mean, sd, *_ = panel.norm
        band(axes, mean, sd, color=BAND_COLOUR, zorder=0)
    for side, percent in panel.toe_off.items():
        colour = COLOURS[side]
        axes.axvline(percent, color=colour, linewidth=0.7, linestyle=(0, (1, 1.5)), zorder=1)
    for curve in panel.curves:
        _curve(axes, curve)
    for place, (side, regions) in zip((0.02, 0.06), panel.regions.items(), strict=False):
        for first, last in regions:
            axes.plot(
                (first, last or 0.5), (place, place), transform=axes.get_xaxis_transform(),
                color=COLOURS[side], linewidth=2.0, solid_capstyle="butt",
            )  # fmt: skip
    _bursts(axes, panel)
    axes.margins(y=0.22 if panel.bursts else 0.14)
    if panel.error:
        axes.text(
            1.0, 1.0, panel.error, transform=axes.transAxes, ha="right", va="bottom", fontsize=7.5,
            color="#404040",
        )  # fmt: skip


def _curve(axes: Axes, curve: DrawnCurve) -> None:
    look = _look(curve.which, curve.side)
    colour = look["color"]
    if curve.strides is not None and len(curve.strides):
        # one line with gaps, of every third point: a path each would make the page three times
        # as long
        values = np.pad(curve.strides[:, ::3], ((0, 0), (0, 1)), constant_values=np.nan).ravel()
        percent = np.tile(np.append(PERCENT[::3], np.nan), len(curve.strides))
        axes.plot(percent, values, color=colour, linewidth=0.35, alpha=0.45, zorder=2)
    if curve.sd is not None:
        band(axes, curve.mean, curve.sd, color=colour, alpha=0.22, zorder=2)
    axes.plot(PERCENT, curve.mean, **look, zorder=4 if curve.which == "walk" else 3)


def _bursts(axes: Axes, panel: Panel) -> None:
    """Names of the bursts of power, beyond all curves."""
    for burst, at in panel.bursts.items():
        sign = BURSTS[burst].sign
        near = slice(max(0, int(at) - 4), int(at) + 5)
        top = sign * max((sign * curve.mean[near]).max() for curve in panel.curves)
        axes.annotate(
            burst, (at, top), xytext=(0, 4 * sign), textcoords="offset points", ha="center",
            va="bottom" if sign > 0 else "top", fontsize=7.5, color="#404040",
        )  # fmt: skip
