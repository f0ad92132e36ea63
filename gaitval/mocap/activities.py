"""Who does not walk on level ground is refused before anything else is doubted.

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
    # Degrees. Floors and treadmills that are called level, and cameras, are off by less than
    # half; ramps for walking are less steep than stairs, which have 20 to 40.
    "steepest": 4.0,
    # m/s. A foot on the ground, or on a belt relative to it, moves more slowly.
    "rests": 0.12,
    # A foot rests for longer in every stance of a walk.
    "shortest_rest_s": 0.15,
}
"""What decides in this module: each in the unit and for the reason that is said before it."""

FEET: Final = ("Heel", "MT1", "MT2", "MT5", "Toe")


def resting_feet(recording: Recording, landmarks: Mapping[str, str]) -> Array:
    """Place, m, and velocity, m/s, (n, 2, 3) of the middle of a foot each time that it rests on the
    ground or on a belt, in order of time.
    """
    found: list[tuple[int, Array]] = []
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
                during = slice(begin, end)
                place = np.median(middle[during], axis=0), np.median(velocity[during], axis=0)
                found.append((int(begin), np.stack(place)))
    found.sort(key=lambda each: each[0])
    return np.array([each for _, each in found]).reshape(-1, 2, 3)


def check_level(recording: Recording, landmarks: Mapping[str, str]) -> None:
    """Refuse stairs, boxes and slopes, by where the feet rest."""
    feet = resting_feet(recording, landmarks)
    if len(feet) < 3:
        return
    places, velocities = feet[:, 0], feet[:, 1]
    heights = places[:, 2]
    way = np.linalg.norm(places[-1, :2] - places[0, :2])
    slope = 0.0
    if way > 1.0:
        along = (places[:, :2] - places[0, :2]) @ (places[-1, :2] - places[0, :2]) / way
        slope = float(np.degrees(np.arctan(np.polyfit(along, heights, 1)[0])))
    else:
        level = np.linalg.norm(velocities[:, :2], axis=1)
        moved = level > 3 * LIMITS["rests"]
        if moved.sum() >= 3:
            # A belt takes the foot backwards, so it sinks on the way up.
            slope = float(np.degrees(np.arctan(np.median(-velocities[moved, 2] / level[moved]))))
    apart = float(np.diff(np.sort(heights)).max())
    if abs(slope) > LIMITS["steepest"] or apart > LIMITS["apart_m"]:
        raise RecordError(
            f"{recording.source}: the ground under the feet is not level: its slope is "
            f"{slope:+.0f}°, and the feet rest at heights that are up to {apart:.2f} m apart: a "
            "slope, stairs or a box. Only walking on level ground can be analysed; give such a "
            "trial, or a part of this one on the level with --trial-time. If the floor was level, "
            "the laboratory's axes are tilted: calibrate the cameras to the floor."
        )
