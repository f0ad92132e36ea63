"""Who walks on stairs or boxes is refused before anything else is doubted.

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
