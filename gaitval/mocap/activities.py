"""Running, jumping, stairs and boxes are refused before anything else is doubted.

Axes: the project's (z up), m.
"""

from collections.abc import Mapping
from typing import Final

import numpy as np

from gaitval.errors import RecordError
from gaitval.mocap.recording import Recording

LIMITS: Final[Mapping[str, float]] = {
    # Share of the time in which both feet are raised: a jump of 0.1 m in 10 s.
    "jumps": 0.02,
    # m. The lowest marker of the feet of walkers, also of children who turn, is within 0.034
    # m of where it is lowest in a stride; runners and jumpers raise it by 0.1 to 0.46 m, and a
    # step or a box by 0.1 m and more.
    "off_ground_m": 0.06,
    # s, more than a stride, in which one of the feet is on the ground.
    "while_s": 1.4,
}
"""What decides in this module: each in the unit and for the reason that is said before it."""

FEET: Final = ("Heel", "MT1", "MT2", "MT5", "Toe")


def check_on_ground(recording: Recording, landmarks: Mapping[str, str]) -> None:
    """Refuse who leaves the ground with both feet, at any speed, or climbs; not where a forefoot
    has no marker, which does not show it.
    """
    low = []
    for side in "RL":
        names = [landmarks.get(f"{side}.{each}") for each in FEET]
        if not {*names[1:]} & {*recording.names}:
            return
        heights = [recording.marker(str(each))[:, 2] for each in names if each in recording.names]
        low.append(np.min(heights, axis=0))  # NaN where one is not seen
    lowest = np.min(low, axis=0)
    known = np.asarray(np.isfinite(lowest))
    half = round(0.5 * LIMITS["while_s"] * recording.marker_rate)
    ground = np.where(known, lowest, np.inf)
    padded = np.pad(ground, half, constant_values=np.inf)
    ground = np.lib.stride_tricks.sliding_window_view(padded, 2 * half + 1).min(axis=1)
    off = (lowest[known] - ground[known]) > LIMITS["off_ground_m"]
    if off.sum() > LIMITS["jumps"] * len(lowest):
        raise RecordError(
            f"{recording.source}: both feet are off the ground at once, {100 * off.mean():.0f} % "
            "of the time: the person runs, hops or jumps, or climbs stairs or a box. Only walking "
            "on level ground can be analysed; give such a trial, or the part of this one in which "
            "the person walks on the level with --trial-time."
        )
