"""The labelled body: every marker of a draft from the front and from the right, with its guess."""

from collections.abc import Callable
from itertools import pairwise
from pathlib import Path
from typing import Final

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from gaitval._internal.io.artefacts import replacing
from gaitval.arrays import Array
from gaitval.scaling.markers.draft import Draft, Guess

BONES: Final = (
    "ASIS Knee Ankle Heel MT5",
    "Heel MT2",
    "ASIS Acromion Elbow Wrist.Radial",
)
"""Places of one side that are joined by lines."""

ACROSS: Final = ("ASIS", "Acromion")
"""Places whose right and left are joined."""

SURE, UNSURE, CONTRADICTED = "#2f5d8a", "#c65d00", "#b00020"


def draw(draft: Draft, path: Path, title: str) -> None:
    """Write the picture, whole or not at all; its kind follows from the ending (.svg, .png, .pdf).
    Raises ArtefactError.
    """
    seen = [guess for guess in draft.guesses if np.isfinite(guess.at).all()]
    figure = Figure(figsize=(16.0, 12.0), layout="constrained")
    front, side = figure.subplots(1, 2)
    _view(front, seen, across=lambda at: -at[1], words="from behind", axis="to the right, m")
    _view(side, seen, across=lambda at: at[0], words="from the right", axis="forward, m")
    figure.suptitle(
        f"{title}\nblue: used; orange: less certain, left to you; red: its name says another place",
        fontsize=11,
        parse_math=False,
    )
    with replacing(path) as temporary:
        figure.savefig(temporary, metadata={"Date": None} if path.suffix == ".svg" else None)


def _view(
    axes: Axes, guesses: list[Guess], *, across: Callable[[Array], float], words: str, axis: str
) -> None:
    places = {guess.site.label: guess.at for guess in guesses if guess.site is not None}
    lines = [(f"R.{place}", f"L.{place}") for place in ACROSS]
    lines += [
        (f"{side}.{one}", f"{side}.{other}")
        for side in "RL"
        for chain in BONES
        for one, other in pairwise(chain.split())
    ]
    for one, other in lines:
        if one in places and other in places:
            ends = [(across(places[each]), places[each][2]) for each in (one, other)]
            axes.plot(*zip(*ends, strict=True), color="#cccccc", linewidth=1.5, zorder=1)
    x = np.array([across(guess.at) for guess in guesses])
    z = np.array([guess.at[2] for guess in guesses])
    colours = [
        CONTRADICTED if guess.named is False else SURE if guess.used else UNSURE
        for guess in guesses
    ]
    axes.scatter(x, z, c=colours, s=18, zorder=2)
    # Labels beside the body, in two columns that keep the order of height.
    middle = float(np.median(x))
    span = max(float(np.ptp(z)), 0.5)
    for right in (False, True):
        column = sorted(
            (i for i in range(len(guesses)) if (x[i] >= middle) == right), key=lambda i: z[i]
        )
        heights = _spread([z[i] for i in column], span / 45)
        edge = (x.max() + 0.12 * span) if right else (x.min() - 0.12 * span)
        for i, height in zip(column, heights, strict=True):
            guess = guesses[i]
            place = "?" if guess.site is None else guess.site.label
            axes.annotate(
                f"{guess.name}: {place} {guess.certainty:.0%}",
                (x[i], z[i]),
                (edge, height),
                color=colours[i],
                fontsize=7,
                va="center",
                ha="left" if right else "right",
                arrowprops={
                    "arrowstyle": "-",
                    "color": colours[i],
                    "linewidth": 0.4,
                    "relpos": (0.0 if right else 1.0, 0.5),  # not through the labels beside it
                },
                parse_math=False,
            )
    axes.set_xlim(x.min() - 0.45 * span, x.max() + 0.45 * span)
    axes.set_aspect("equal")
    axes.set_title(words, fontsize=9)
    axes.set_xlabel(axis)
    axes.set_ylabel("height, m")


def _spread(heights: list[float], least: float) -> list[float]:
    """Heights in order, moved apart to be at least `least` from each other."""
    found: list[float] = []
    for height in heights:
        found.append(max(height, found[-1] + least) if found else height)
    if found:
        shift = (sum(found) - sum(heights)) / len(found)
        found = [height - shift for height in found]
    return found
