"""What a study's report shows of a person's body. A worker draws it, which needs no page."""

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any, Final

import numpy as np

if TYPE_CHECKING:
    from gaitval.model.body import BodyModel
    from gaitval.identification.shared_errors import Shared

Bar = tuple[str, float, float]
"""Name, mean and SD, in SDs of what was known before."""
_FOUND: Final = "#0072b2"


def bars(found: "Shared", model: "BodyModel") -> list[Bar]:
    """A bar for each parameter of the body, distance between joints, and the legs' difference;
    parameters are those of `page.tables`.
    """
    from gaitval.model.parameters import PARAMETERS
    from gaitval.identification.joints import judged_lengths
    from gaitval.identification.verdicts import judged

    shown = [
        *(each for each in judged(found.posterior) if each.name in PARAMETERS[2:]),
        *judged_lengths(found.posterior, model),
    ]
    legs = found.legs
    mean, sd = legs.estimate
    drawn = [(each.name.replace("_", " "), each.z, each.contraction) for each in shown]
    return [*drawn, ("left leg longer", mean / legs.prior_sd, sd / legs.prior_sd)]


def in_words(found: "Shared", model: "BodyModel", method: str) -> dict[str, Any]:
    """What a study's report says of a body: `said`, the `bars`, and the `method` by which the
    walker's body was found; other parameters are those of `page.tables`.
    """
    from gaitval.reporting.body_words import sentences

    shown = [{"name": name, "mean": mean, "sd": sd} for name, mean, sd in bars(found, model)]
    return {"method": method, "said": sentences(found, model), "bars": shown}


def draw(bars: Sequence[Bar]) -> str:
    """Each of `bars` before and after the record, as SVG."""
    from gaitval.reporting.drawing import new_figure, svg  # a walk is checked without them
    from gaitval.reporting.figures import BAND_COLOUR  # dark on a dark page, where points are light

    names, means, sds = zip(*bars, strict=True)
    places = np.arange(len(bars))[::-1]
    with new_figure(0.24 * len(bars) + 0.6) as figure:
        axes = figure.add_subplot()
        axes.barh(places, 2.0, left=-1.0, color=BAND_COLOUR, height=0.7)
        axes.errorbar(means, places, xerr=sds, fmt="o", color=_FOUND, markersize=4, capsize=2)
        axes.set_yticks(places, names)
        axes.set_xlabel("SDs of what was known before")
        return svg(figure, "body")
