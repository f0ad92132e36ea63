"""Figures of the report, as SVG text.

The right side is dark blue, the left one orange and dashed, the record
a wider black line beneath them: lightness and dashes distinguish them for colour-blind readers and
in grey print. A band is always a standard deviation; a curve without one is drawn as a line.
"""

from collections.abc import Mapping, Sequence
from itertools import cycle
from typing import Any, Final

import numpy as np
from matplotlib.axes import Axes
from scipy.spatial import ConvexHull

from gaitval.arrays import Array
from gaitval.coordinates import SIDES, Side
from gaitval.gait.cycle_curves import FORCES
from gaitval.metrics.curve_results import MeanCurve
from gaitval.metrics.results import FootContact, Metrics, PushRecovery, PushTrace
from gaitval.metrics.typed import array
from gaitval.metrics.verdicts import CURVE_NAMES
from gaitval.metrics.whole_body import AXES
from gaitval.reporting.drawing import keys_of, legend_above, link, new_figure, svg

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
    **{name: name.capitalize() for name in FORCES},
}
"""What a positive value of a curve means; obliquity: own side up, rotation: own side forward."""

PERCENT = np.arange(101)


def draw_record(axes: Axes, curve: Any, *, label: str | None = None) -> None:
    """Draw a recorded `curve` over `PERCENT` in `axes`, beneath the walk's, with a `label`."""
    axes.plot(
        PERCENT, curve, color=RECORD_COLOUR, linewidth=RECORD_WIDTH, zorder=2, label=label
    )  # fmt: skip


def learning(training: Mapping[str, Array]) -> str:
    """Episode length, cycles and reward over training samples, the columns of `training`."""
    with new_figure(2.0) as figure:
        panels = figure.subplots(1, 3, sharex=True)
        million = training["samples"] / 1e6
        for axes, column, title in zip(
            panels,
            ("episode_length", "cycles", "episode_reward"),
            ("Episode length, actions", "Gait cycles per episode", "Episode reward"),
            strict=True,
        ):
            axes.plot(million, training[column], color="#404040", linewidth=1.0)
            axes.set_title(title)
            axes.set_xlabel("samples, millions")
            axes.set_ylim(bottom=min(0.0, float(np.nanmin(training[column]))))
        return svg(figure, "learning")


_PATHS: Final = {"forward": "Forward", "left": "To the left", "up": "Up"}


def centre_of_mass(metrics: Metrics) -> str:
    """Path of the centre of mass in `metrics` without steady travel, simulated and recorded, mm."""
    known = "record" if metrics.is_recorded_at_all else "prediction"
    recorded = 1e3 * np.array(metrics.record.centre_of_mass)
    walked = metrics.walk.centre_of_mass
    with new_figure(2.3) as figure:
        for axes, axis, column in zip(figure.subplots(1, 3), AXES, range(3), strict=True):
            link(axes, "cycle", "right", column)
            axes.set_xlim(0, 100)
            axes.axhline(0.0, color="#b0b0b0", linewidth=0.4, zorder=0)
            draw_record(axes, recorded[:, column], label=known)
            if walked is not None:
                path = 1e3 * np.array(walked)[:, column]
                axes.plot(
                    PERCENT, path, color=COLOURS["right"], linewidth=WALK_WIDTH, zorder=3,
                    label="simulated",
                )  # fmt: skip
            axes.set_title(f"{_PATHS[axis]}, mm")
            axes.set_xlabel("% of right gait cycle")
        keys = keys_of(axes)
        legend_above(figure, keys, columns=len(keys))
        return svg(figure, "com")


_MARKED = (10, 50, 90)
"""% of stance at which the path of the centre of pressure is marked."""


def pressure_path(metrics: Metrics) -> str:
    """Centre of pressure in `metrics` under both feet, from above, and along them over stance."""
    contact = metrics.walk.foot_contact
    with new_figure(2.8) as figure:
        left, right, progress = figure.subplots(1, 3, width_ratios=(1, 1, 2.6))
        for side in SIDES:
            axes = right if side == "right" else left
            _footprint(axes, contact.of(side), side)
            axes.set_title(f"{side} foot")
            path = contact.of(side).path.along
            if path.mean is not None:
                _with_band(progress, path, side, side)
        link(progress, "stance", "both", 0)
        progress.set_xlim(0, 100)
        progress.set_ylim(0, 100)
        progress.set_xlabel("% of stance")
        progress.set_ylabel("% of foot length from the heel")
        keys = keys_of(progress)
        legend_above(figure, keys, columns=len(keys))
        return svg(figure, "pressure")


def band(axes: Axes, mean: Array, sd: Array, **look: Any) -> None:
    """Draw a `mean` curve ± `sd` (101,) over `PERCENT` into `axes`, as they `look`, by every
    second sample: curves have nothing above 10 Hz, and half of the points of a page's figures were
    those of bands.
    """
    low, high = (mean - sd)[::2], (mean + sd)[::2]
    axes.fill_between(PERCENT[::2], low, high, linewidth=0, **look)


def _with_band(axes: Axes, curve: MeanCurve, side: Side, label: str) -> None:
    """A mean curve with its standard deviation, over `PERCENT`."""
    mean, colour = array(curve.mean or []), COLOURS[side]
    axes.plot(
        PERCENT, mean, color=colour, linestyle=STYLES[side], linewidth=WALK_WIDTH, label=label,
        zorder=4,
    )  # fmt: skip
    if curve.sd is not None:
        band(axes, mean, array(curve.sd), color=colour, alpha=0.22, zorder=3)


def _footprint(axes: Axes, contact: FootContact, side: Side) -> None:
    """One foot from above, its tip up; the midline is to the left of the right foot."""
    outwards = -1.0 if side == "right" else 1.0
    spheres = 100.0 * np.array(contact.spheres)
    angle = np.linspace(0.0, 2.0 * np.pi, 49)
    rims = []
    for along, across, radius in spheres:
        x = outwards * across + radius * np.cos(angle)
        y = along + radius * np.sin(angle)
        axes.fill(x, y, facecolor="#eeeeee", edgecolor=RECORD_SHADE, linewidth=0.5, zorder=1)
        rims.append(np.column_stack([x, y]))
    points = np.concatenate(rims)
    # the outline of the sole is the hull of its contact spheres
    rim = points[ConvexHull(points).vertices]
    axes.fill(*rim.T, facecolor="none", edgecolor="#808080", linewidth=0.8, zorder=2)
    path = contact.path
    if path.along.mean is None or path.across.mean is None:
        axes.text(0.5, 0.5, "no stance", transform=axes.transAxes, ha="center")
    else:
        along = array(path.along.mean)
        across = outwards * array(path.across.mean)
        if path.across.sd is not None:
            spread = array(path.across.sd)
            axes.fill_betweenx(
                along,
                across - spread,
                across + spread,
                color=COLOURS[side],
                alpha=0.22,
                linewidth=0,
            )
        axes.plot(across, along, color=COLOURS[side], linestyle=STYLES[side], zorder=4)
        for percent in _MARKED:
            axes.plot(
                across[percent], along[percent], linestyle="none", marker="o",
                color=COLOURS[side], markersize=3.5,
            )  # fmt: skip
            axes.annotate(
                f"{percent}",
                (across[percent], along[percent]),
                xytext=(4, 0),
                textcoords="offset points",
                va="center",
                fontsize=7.5,
                color="#404040",
            )
    axes.set_aspect("equal")
    axes.axis("off")


def stability_regions(pushes: PushRecovery) -> str:
    """Largest of the `pushes` survived by direction, a panel per phase; straight ahead is up."""
    outermost = max(max(max(row) for row in pushes.largest), pushes.force)
    # three rings at multiples of 100 N, the last one at or beyond every push
    rings = np.linspace(0.0, 300.0 * np.ceil(outermost / 300.0), 4)[1:]
    with new_figure(2.35) as figure:
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
_PHASE_STYLES: Final = ("-", (0, (5, 1.5)), (0, (1, 1)), (0, (5, 1.5, 1, 1.5)))


_CIVIDIS: Final = (
    (0, 34, 78), (8, 51, 112), (53, 69, 108), (79, 87, 108), (102, 105, 112), (124, 123, 120),
    (148, 142, 119),
)  # fmt: skip
"""The darker six tenths of this map of colours, for every kind of colour vision (Nuñez et al. 2018,
10.1371/journal.pone.0199239), as matplotlib has it."""


def phase_colours(count: int) -> list[str]:
    """`count` colours from dark blue to yellow-grey, for every kind of colour vision; the lightest
    still has a contrast of three to white paper.
    """
    at, known = np.linspace(0.0, len(_CIVIDIS) - 1.0, count), np.array(_CIVIDIS).T
    mixed = [np.interp(at, np.arange(len(_CIVIDIS)), each).round().astype(int) for each in known]
    return [f"#{red:02x}{green:02x}{blue:02x}" for red, green, blue in zip(*mixed, strict=True)]


def push_velocity(traces: Sequence[PushTrace]) -> str:
    """Change of the centre of mass velocity after a push: the forward one after a push ahead, the
    leftward one after a push to the left, relative to the same phase of the cycle before the push.

    `traces` that end in a fall before their push are left out.
    """
    shown = (
        (0.0, 0, "Pushed ahead: change of the forward velocity, m/s"),
        (90.0, 1, "Pushed to the left: change of the leftward velocity, m/s"),
    )
    phases = sorted({trace.phase for trace in traces})
    looks = dict(zip(phases, zip(phase_colours(len(phases)), cycle(_PHASE_STYLES)), strict=True))
    with new_figure(3.0) as figure:
        panels = figure.subplots(2, 1, sharex=True)
        for axes, (direction, component, title) in zip(panels, shown, strict=True):
            axes.axhline(0.0, color="#b0b0b0", linewidth=0.4, zorder=0)
            axes.axvline(0.0, color="#b0b0b0", linewidth=0.4, zorder=0)
            for trace in traces:
                cycles = np.array(trace.cycles)
                before = cycles < 0.0
                if trace.direction != direction or not before.any():  # fell before the push
                    continue
                velocity = np.array(trace.velocity)[:, component]
                # the cycle before the push, continued periodically
                unpushed = np.interp(
                    np.mod(cycles, 1.0) - 1.0, cycles[before], velocity[before], period=1.0
                )
                colour, style = looks[trace.phase]
                label = f"at {100 * trace.phase:g} % of the right cycle"
                change = velocity - unpushed
                axes.plot(cycles, change, color=colour, linestyle=style, linewidth=1.0, label=label)
                if trace.fell:
                    axes.plot(
                        cycles[-1], change[-1], linestyle="none", marker="x", color=_FALL_COLOUR,
                        markersize=6.0,
                    )  # fmt: skip
            axes.set_title(title, loc="left")
            axes.margins(x=0.01)
        panels[-1].set_xlabel("gait cycles since the push")
        keys = keys_of(panels[0])
        legend_above(figure, keys, columns=max(1, len(keys)))
        return svg(figure, "velocity")
