"""Figures of joint power and of the centre of mass, as SVG text; style as in `figures`."""

import numpy as np

from gaitval.metrics.results import Metrics
from gaitval.metrics.whole_body import AXES
from gaitval.reporting.drawing import new_figure, svg
from gaitval.reporting.figures import COLOURS, PERCENT, WALK_WIDTH, draw_record, legend
from gaitval.reporting.links import link

_PATHS = {"forward": "Forward", "left": "To the left", "up": "Up"}


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
        legend(figure, axes)
        return svg(figure, "com")
