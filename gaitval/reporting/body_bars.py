"""The picture of a person's body in a study's report, and what was stored for it."""

from collections.abc import Sequence
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Final

import numpy as np

from gaitval._internal.io.artefacts import read_json
from gaitval.errors import ArtefactError
from gaitval.identification.body_report import Bar

if TYPE_CHECKING:
    from gaitval.reporting.page import Draw

FILE: Final = "body.json"
_FOUND: Final = "#0072b2"
_LONGEST: Final = 1000
"""Characters of the sentences; those of `body_words` have 300."""


def draw(bars: Sequence[Bar]) -> str:
    """Each of `bars` before and after the record, as SVG."""
    from gaitval.reporting.drawing import new_figure, svg  # a walk is checked without them
    from gaitval.reporting.figures import BAND_COLOUR  # dark on a dark page, where points are light

    names, means, sds = zip(*bars, strict=True)
    places = np.arange(len(bars))[::-1]
    with new_figure(0.24 * len(bars) + 0.6) as figure:
        axes = figure.subplots()
        for at, mean, sd in zip(places, means, sds, strict=True):
            edges = [at - 0.35, at - 0.35, at + 0.35, at + 0.35]
            axes.fill([-1.0, 1.0, 1.0, -1.0], edges, color=BAND_COLOUR, linewidth=0)
            ends = [mean - sd, mean + sd]
            axes.plot(ends, [at, at], color=_FOUND, marker="|", markersize=4.0, linewidth=1.2)
        axes.plot(means, places, color=_FOUND, linestyle="none", marker="o", markersize=4.0)
        axes.set_yticks(places, names)
        axes.set_xlabel("SDs of what was known before")
        return svg(figure, "body")


def shown(folder: Path) -> "tuple[dict[str, str], list[Bar], Draw]":
    """Of a run `folder`: what is `said` and the `method` by which the walker's body was found, the
    bars, and what draws them. Raises ArtefactError if the file is damaged.
    """
    path = folder / FILE
    try:
        stored = read_json(path, "Remove it and run `gaitval subject` again")
        texts = {name: str(stored[name])[:_LONGEST] for name in ("said", "method")}
        found: list[Bar] = [
            (str(each["name"])[:_LONGEST], float(each["mean"]), float(each["sd"]))
            for each in stored["bars"]
        ]
    except (OSError, ValueError, KeyError, TypeError) as error:
        raise ArtefactError(
            f"{path}: is not what a study writes ({error}). Remove it and run `gaitval subject` "
            "again."
        ) from error
    return texts, found, partial(draw, found)
