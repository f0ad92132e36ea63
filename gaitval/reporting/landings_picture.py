"""The picture of when each foot lands and leaves, and of what the plates carry together."""

from pathlib import Path
from typing import Final

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from gaitval.arrays import Flags, runs
from gaitval.artefacts import replacing
from gaitval.checks.landings import METHODS, Landings, disagreements
from gaitval.coordinates import SIDES, Side
from gaitval.mocap.foot_markers import foot_markers

COLOURS: Final = {"plates": "#2f5d8a", "markers": "#3a7d44", "file": "#7a5195"}
APART: Final = "#b00020"
_WORDS: Final = {"heel_strike": "▼", "toe_off": "▲"}


def draw(found: Landings, landmarks: dict[str, str], path: Path, title: str) -> None:
    """Write the picture, whole or not at all; its kind follows from the ending (.svg, .png, .pdf).
    Raises ArtefactError.
    """
    panels = 3 if len(found.time) else 2
    figure = Figure(figsize=(14.0, 2.9 * panels), layout="constrained")
    axes = figure.subplots(panels, 1, sharex=True)
    for side, each in zip(SIDES, axes, strict=False):
        _foot(each, found, landmarks, side)
    if len(found.time):
        _sum(axes[2], found)
    axes[-1].set_xlabel("time, s")
    figure.suptitle(
        f"{title}\n▼ lands, ▲ leaves; red: two methods are more than 40 ms apart, or one has none",
        fontsize=11,
        parse_math=False,
    )
    with replacing(path) as temporary:
        figure.savefig(temporary, metadata={"Date": None} if path.suffix == ".svg" else None)


def _foot(axes: Axes, found: Landings, landmarks: dict[str, str], side: Side) -> None:
    """Heights of heel and forefoot, and the events of each method in a row below them."""
    recording = found.recording
    foot = foot_markers(recording, landmarks)[side]
    time = recording.start + np.arange(len(recording.markers)) / recording.marker_rate
    for values, name, style in ((foot.heel, "heel", "-"), (foot.front, "forefoot", "--")):
        height = 1000.0 * (values[:, 2] - np.nanmin(values[:, 2]))
        axes.plot(time, height, style, color="#777777", linewidth=0.9, label=name)
    there = [method for method in METHODS if method in found.events]
    for row, method in enumerate(there):
        at = -25.0 * (row + 1)
        axes.annotate(
            method, (1.003, at), xycoords=("axes fraction", "data"), color=COLOURS[method],
            fontsize=8, va="center", annotation_clip=False,
        )  # fmt: skip
        for event in found.events[method]:
            if event.side == side:
                axes.text(
                    event.time, at, _WORDS[event.kind], color=COLOURS[method],
                    ha="center", va="center", fontsize=8, clip_on=True,
                )  # fmt: skip
    for each in disagreements(found):
        if each.side == side:
            end = each.time + (0.0 if np.isnan(each.late) else each.late)
            low, high = sorted((each.time, end))
            axes.axvspan(low - 0.01, high + 0.01, color=APART, alpha=0.25, linewidth=0)
    axes.set_ylim(bottom=-25.0 * (len(there) + 1))
    axes.set_title(f"{side} foot", fontsize=9)
    axes.set_ylabel("height, mm")
    axes.legend(loc="upper right", fontsize=7)


def _sum(axes: Axes, found: Landings) -> None:
    """Vertical force of all plates together, and where it is all there is."""
    axes.plot(found.time, found.total[:, 2], color=COLOURS["plates"], linewidth=0.9)
    _band(axes, found, found.complete, "#d9e6f2", "every foot on the ground is on a plate")
    _band(axes, found, found.shared, "#f2d9b3", "both feet on one plate: only their sum is known")
    axes.set_ylim(bottom=min(0.0, float(np.nanmin(found.total[:, 2]))))  # else feet seem to float
    axes.set_title("vertical force of all plates together", fontsize=9)
    axes.set_ylabel("N")
    if axes.get_legend_handles_labels()[1]:  # no plate may carry all, nor both feet
        axes.legend(loc="upper right", fontsize=7)


def _band(axes: Axes, found: Landings, where: Flags, colour: str, words: str) -> None:
    for number, (begin, end) in enumerate(zip(*runs(where), strict=True)):
        axes.axvspan(
            found.time[begin], found.time[end - 1], color=colour, zorder=0, linewidth=0,
            label=words if number == 0 else None,
        )  # fmt: skip
