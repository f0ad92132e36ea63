"""Figures of joint power and of the centre of mass, as SVG text; style as in `figures`."""

import numpy as np

from gaitval.coordinates import SIDES
from gaitval.metrics.joint_power import BURSTS, JOINTS, burst_places
from gaitval.metrics.results import Metrics
from gaitval.metrics.typed import array
from gaitval.metrics.whole_body import AXES
from gaitval.reporting.drawing import new_figure, svg
from gaitval.reporting.figures import (
    COLOURS,
    PERCENT,
    STYLES,
    WALK_WIDTH,
    draw_record,
    legend,
)
from gaitval.reporting.links import link

_TITLES = {"hip_flexion": "Hip", "knee_angle": "Knee", "ankle_angle": "Ankle"}
_PATHS = {"forward": "Forward", "left": "To the left", "up": "Up"}


def joint_power(metrics: Metrics) -> str:
    """Sagittal power of hip, knee and ankle in `metrics`, simulated and recorded, one row per side;
    the names of the bursts are at the recorded peaks.
    """
    recorded = metrics.record.joint_power
    walked = metrics.walk.joint_power
    with new_figure(3.2) as figure:
        grid = figure.subplots(2, 3, sharex=True, sharey="col")
        for row, side in enumerate(SIDES):
            places = burst_places(
                {joint: array(recorded.power[f"{joint}_{side[0]}"]) for joint in JOINTS}
            )
            for column, (axes, joint) in enumerate(zip(grid[row], JOINTS, strict=True)):
                link(axes, "cycle", side, column)
                axes.set_xlim(0, 100)
                name = f"{joint}_{side[0]}"
                power = array(recorded.power[name])
                axes.axhline(0.0, color="#b0b0b0", linewidth=0.4, zorder=0)
                draw_record(axes, power, label="record")
                if walked is not None:
                    axes.plot(
                        PERCENT,
                        array(walked.power[name]),
                        color=COLOURS[side],
                        linestyle=STYLES[side],
                        linewidth=WALK_WIDTH,
                        zorder=3,
                        label=f"simulated, {side}",
                    )
                for burst, at in places.items():
                    each = BURSTS[burst]
                    if each.joint == joint and at is not None:
                        place = (0, 5 if each.sign > 0 else -5)
                        near = slice(max(0, at - 4), at + 5)
                        # beyond both curves, so that the name is on neither
                        both = [power, power if walked is None else array(walked.power[name])]
                        top = each.sign * max((each.sign * curve[near]).max() for curve in both)
                        axes.annotate(
                            burst,
                            (at, top),
                            xytext=place,
                            textcoords="offset points",
                            ha="center",
                            va="bottom" if each.sign > 0 else "top",
                            fontsize=7.5,
                            color="#404040",
                        )
                axes.margins(y=0.25)
                if row == 0:
                    axes.set_title(f"{_TITLES[joint]} power, W/kg")
                else:
                    axes.set_xlabel("% of gait cycle")
            grid[row][0].set_ylabel(side)
        legend(figure, *grid[:, 0])
        return svg(figure, "power")


def centre_of_mass(metrics: Metrics) -> str:
    """Path of the centre of mass in `metrics` without steady travel, simulated and recorded, mm."""
    recorded = 1e3 * np.array(metrics.record.centre_of_mass)
    walked = metrics.walk.centre_of_mass
    with new_figure(2.3) as figure:
        for axes, axis, column in zip(figure.subplots(1, 3), AXES, range(3), strict=True):
            link(axes, "cycle", "right", column)
            axes.set_xlim(0, 100)
            axes.axhline(0.0, color="#b0b0b0", linewidth=0.4, zorder=0)
            draw_record(axes, recorded[:, column], label="record")
            if walked is not None:
                path = 1e3 * np.array(walked)[:, column]
                axes.plot(
                    PERCENT, path, color=COLOURS["right"], linewidth=WALK_WIDTH, zorder=3,
                    label="simulated",
                )  # fmt: skip
            axes.set_title(f"{_PATHS[axis]}, mm")
            axes.set_xlabel("% of right gait cycle")
        legend(figure, axes)
        return svg(figure, "com")
