"""Whether the cycles of all trials together are those of one steady walk."""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import Final

import numpy as np

from gaitval.findings.finding import Finding, Seen
from gaitval.gait.cycles import AverageCurve
from gaitval.gait.record import ANGLE_NAMES

USUAL_DRIFT: Final = {"angle": float(np.radians(5.7)), "moment": 0.57}
"""rad and Nm/kg. Of 208 single strides of 82 people over ground, with and without a gait disorder,
in 99 % all of nine angles end nearer than this to where they began (WBDS, Fukuchi 2018; Shida 2023,
Front Neurosci 17:992585; Hood 2020, Sci Data 7:150); so do the moments of all of 52 single cycles
of 13 people, most of them children."""
ABOUT: Final = ("hip_rotation", "subtalar", "foot_list", "foot_progression", "pelvis_rotation")
"""Angles that a foot changes which is put down a little elsewhere: they may drift by twice as
much."""
LEAST_DRIFT: Final = float(np.radians(4.0))
"""rad. Closing it moves no point by more than 2 degrees, which nobody minds (McGinley 2009)."""


@dataclass(frozen=True)
class MeanGait:
    """The mean curves of an import, rad and Nm/kg by name, and the speed of each trial, m/s."""

    angles: Mapping[str, AverageCurve]
    moments: Mapping[str, AverageCurve]
    speeds: Mapping[str, float]


def usual_drift(name: str, kind: str, strides: int) -> float:
    """By how much (rad, Nm/kg) the mean curve of this `name` and `kind` differs between its ends in
    nearly everybody: single strides are not alike, and their mean drifts less the more there are.
    """
    if kind == "moment":
        return USUAL_DRIFT[kind]
    usual = USUAL_DRIFT[kind] * (2.0 if name.startswith(ABOUT) else 1.0)
    return max(LEAST_DRIFT, usual / float(np.sqrt(strides)))


def _drift(of: MeanGait) -> Iterator[Seen]:
    """How often what is usual the curve drifts that does so most: one stride that is not as the
    others, or one marker, moves several curves.
    """
    found = [
        Seen(abs(gap) / usual_drift(name, kind, len(curve.curves)), name, {"shown": shown})
        for kind, curves in (("angle", of.angles), ("moment", of.moments))
        for name, curve in curves.items()
        if kind == "moment" or name in ANGLE_NAMES
        for gap in [float(curve.mean[-1] - curve.mean[0])]
        for shown in [f"{np.degrees(gap):+.1f}°" if kind == "angle" else f"{gap:+.2f} Nm/kg"]
    ]
    if found:
        yield max(found, key=lambda each: each.value)


def _speeds(of: MeanGait) -> Iterator[Seen]:
    """Times the slowest trial's speed."""
    if of.speeds:
        shown = ", ".join(f"{name} {speed:.2f} m/s" for name, speed in of.speeds.items())
        speeds = of.speeds.values()
        yield Seen(max(speeds) / min(speeds), "walking speed", {"shown": shown})


DRIFT: Final[Finding] = Finding(
    name="drift",
    needs=MeanGait,
    values=_drift,
    limits=1.0,
    unit="1",
    sentence=(
        "from one heel strike to the next it drifts by {shown}, {value:.1f} times what mean curves "
        "of 99 % of people do over as many strides; taken away evenly over the cycle. An uneven "
        "walk does so, and so do markers that moved, gaps, and forces that are late"
    ),
    remedy="Begin with other warnings that name them; else more cycles make it smaller",
)
SPEEDS: Final[Finding] = Finding(
    name="speed of the trials",
    needs=MeanGait,
    values=_speeds,
    limits=1.2,
    unit="times",
    sentence=(
        "the trials were walked at different speeds ({shown}): their mean is a gait that nobody "
        "walked"
    ),
    remedy="Import each speed as a subject of its own",
)
