"""Figures of the report, as SVG text.

The right side is dark blue, the left one orange and dashed, the record
a wider black line beneath them: lightness and dashes distinguish them for colour-blind readers and
in grey print. A band is always a standard deviation; a curve without one is drawn as a line.
"""

from collections.abc import Mapping
from typing import Any, Final

import numpy as np
from matplotlib.axes import Axes

from gaitval.arrays import Array
from gaitval.coordinates import Side
from gaitval.gait.cycle_curves import FORCES
from gaitval.metrics.results import PushRecovery
from gaitval.metrics.verdicts import CURVE_NAMES
from gaitval.reporting.drawing import new_figure, svg

COLOURS: Final[Mapping[Side, str]] = {"right": "#00558f", "left": "#d96b0a"}
STYLES: Final[Mapping[Side, Any]] = {"right": "-", "left": (0, (6, 1.5))}
RECORD_COLOUR: Final = "#1a1a1a"
RECORD_SHADE: Final = "#d4d4d4"
BAND_COLOUR: Final = "#d9d9d9"
"""Of a band between healthy people; dark on a dark page."""
RECORD_WIDTH: Final = 2.0
WALK_WIDTH: Final = 1.1
"""Points. The walk lies on the record and is narrower, so that both are seen where they agree."""

NAMES: Final[Mapping[str, str]] = {
    **{name: f"{title[0].upper()}{title[1:]}" for name, title in CURVE_NAMES.items()},
    **{name: CURVE_NAMES[name].removesuffix(" force").capitalize() for name in FORCES},
}
"""What a positive value of a curve means; obliquity: own side up, rotation: own side forward."""

PERCENT = np.arange(101)


def band(axes: Axes, mean: Array, sd: Array, **look: Any) -> None:
    """Draw a `mean` curve ± `sd` (101,) over `PERCENT` into `axes`, as they `look`, by every
    second sample: curves have nothing above 10 Hz, and half of the points of a page's figures were
    those of bands.
    """
    low, high = (mean - sd)[::2], (mean + sd)[::2]
    axes.fill_between(PERCENT[::2], low, high, linewidth=0, **look)


def stability_regions(pushes: PushRecovery) -> str:
    """Largest of the `pushes` survived by direction, a panel per phase; straight ahead is up."""
    outermost = max(max(max(row) for row in pushes.largest), pushes.force)
    # three rings at multiples of 100 N, the last one at or beyond every push
    rings = np.linspace(0.0, 300.0 * np.ceil(outermost / 300.0), 4)[1:]
    with new_figure(1.9) as figure:
        panels = figure.subplots(1, len(pushes.phases), squeeze=False)
        for axes, phase, largest, survived in zip(
            panels[0], pushes.phases, pushes.largest, pushes.survived, strict=True
        ):
            _rings(axes, rings)
            force = np.append(largest, largest[0])
            outline = _directed(np.append(pushes.directions, pushes.directions[0]), force)
            axes.fill(*outline, color=_PUSH_COLOUR, alpha=0.22, linewidth=0)
            axes.plot(*outline, color=_PUSH_COLOUR, linewidth=1.1)
            half = _directed(np.linspace(-90.0, 90.0, 91), np.full(91, pushes.force))
            axes.plot(*half, color="#404040", linewidth=0.7, linestyle="--")
            fell = [
                direction
                for direction, stood in zip(pushes.criterion_directions, survived, strict=True)
                if not stood
            ]
            axes.plot(
                *_directed(np.array(fell), np.full(len(fell), pushes.force)), linestyle="none",
                marker="x", color=_FALL_COLOUR, markersize=5.0, markeredgewidth=1.3, zorder=5,
            )  # fmt: skip
            axes.set_title(f"{100 * phase:g} % of the right cycle")
        # below: a number beside its ring would lie on somebody's outline
        figure.supxlabel(f"rings every {rings[0]:.0f} N", fontsize=7.5, color="#606060")
        return svg(figure, "stability")


def _directed(degrees: Array, newtons: Array) -> tuple[Array, Array]:
    """Places of pushes in these directions, `degrees` from straight ahead (up) to the left."""
    angle = np.deg2rad(degrees)
    return -newtons * np.sin(angle), newtons * np.cos(angle)


def _rings(axes: Axes, rings: Array) -> None:
    """Circles of these radii, the four directions through them, and their words."""
    last = float(rings[-1])
    round_angle = np.linspace(0.0, 360.0, 73)
    for ring in rings:
        outermost = ring == last
        axes.plot(
            *_directed(round_angle, np.full(len(round_angle), ring)),
            color="#000000" if outermost else "#d9d9d9", linewidth=0.4, zorder=0,
        )  # fmt: skip
    for ends in (((-last, last), (0.0, 0.0)), ((0.0, 0.0), (-last, last))):
        axes.plot(*ends, color="#d9d9d9", linewidth=0.4, zorder=0)
    beside = 1.06 * last
    for word, x, y, ha, va in (
        ("ahead", 0.0, beside, "center", "bottom"),
        ("back", 0.0, -beside, "center", "top"),
        # beside the circle and not across it, however long the word is in another language
        ("left", -beside, 0.0, "right", "center"),
        ("right", beside, 0.0, "left", "center"),
    ):
        axes.text(x, y, word, ha=ha, va=va, fontsize=7.5)
    axes.set_xlim(-1.5 * last, 1.5 * last)
    axes.set_ylim(-1.25 * last, 1.25 * last)
    axes.set_aspect("equal")
    axes.axis("off")


_PUSH_COLOUR: Final = "#00558f"
_FALL_COLOUR: Final = "#a8200d"
