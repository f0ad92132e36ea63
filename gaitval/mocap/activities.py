"""Stairs, boxes, running and jumping are refused before anything else is doubted.

Axes: the project's (z up), m.
"""

from collections.abc import Mapping
from typing import Final

import numpy as np

from gaitval.arrays import Array, runs
from gaitval.errors import RecordError
from gaitval.mocap.recording import Recording

LIMITS: Final[Mapping[str, float]] = {
    # m. Feet that rest at heights further apart are on a box or on steps, which rise by 0.1 m and
    # more each.
    "apart_m": 0.16,
    # m/s. A foot on the ground, or on a belt relative to it, moves more slowly.
    "rests": 0.12,
    # A foot rests for longer in every stance of a walk.
    "shortest_rest_s": 0.15,
    # Share of the time in which both feet are raised: a jump of 0.1 m in 10 s.
    "jumps": 0.02,
    # m. The lowest marker of the feet of walkers, also of children who turn, is within 0.034
    # m of where it is lowest in a stride; runners and jumpers raise it by 0.1 to 0.46 m.
    "off_ground_m": 0.06,
    # s, more than a stride, in which one of the feet is on the ground.
    "while_s": 1.4,
}
"""What decides in this module: each in the unit and for the reason that is said before it."""

FEET: Final = ("Heel", "MT1", "MT2", "MT5", "Toe")


def resting_heights(recording: Recording, landmarks: Mapping[str, str]) -> Array:
    """Height (n,) m of the middle of a foot each time that it rests on the ground or on a belt."""
    found: list[float] = []
    for side in "RL":
        names = [landmarks.get(f"{side}.{each}") for each in FEET]
        paths = [recording.marker(str(name)) for name in names if name in recording.names]
        if not paths:
            continue
        middle = np.mean(paths, axis=0)
        velocity = np.gradient(middle, 1.0 / recording.marker_rate, axis=0)
        known = np.isfinite(velocity).all(axis=1)
        if known.sum() < 2:
            continue
        # In stance all of the foot moves as the ground does, so each marker moves alike.
        each = np.stack([np.gradient(path, 1.0 / recording.marker_rate, axis=0) for path in paths])
        apart = np.linalg.norm(each - each.mean(axis=0), axis=2).max(axis=0)
        level = np.linalg.norm(velocity[:, :2], axis=1)
        still = known & (apart < LIMITS["rests"]) & (np.abs(velocity[:, 2]) < 3 * LIMITS["rests"])
        still &= level < np.nanpercentile(level, 60.0)
        for begin, end in zip(*runs(still), strict=True):
            if end - begin >= LIMITS["shortest_rest_s"] * recording.marker_rate:
                found.append(float(np.median(middle[begin:end, 2])))
    return np.array(found)


def check_level(recording: Recording, landmarks: Mapping[str, str]) -> None:
    """Refuse stairs and boxes, by where the feet rest; slopes are said by a finding."""
    heights = resting_heights(recording, landmarks)
    if len(heights) < 3:
        return
    apart = float(np.diff(np.sort(heights)).max())
    if apart > LIMITS["apart_m"]:
        raise RecordError(
            f"{recording.source}: the feet rest on two levels that are {apart:.2f} m apart: stairs "
            "or a box. Only walking on level ground can be analysed; give such a trial, or a part "
            "of this one on the level with --trial-time."
        )


def check_on_ground(recording: Recording, landmarks: Mapping[str, str]) -> None:
    """Refuse who leaves the ground with both feet, at any speed; not where a heel or all of a
    forefoot has no marker, which does not show it.
    """
    low = []
    for side in "RL":
        names = [landmarks.get(f"{side}.{each}") for each in FEET]
        if names[0] not in recording.names or not {*names[1:]} & {*recording.names}:
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
            "of the time: the person runs, hops or jumps. Only walking can be analysed; give a "
            "walking trial, or the part of this one in which the person walks with --trial-time."
        )
