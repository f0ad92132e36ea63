"""Metatarsal heads without a marker, by the mean shape of a foot."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Final

import numpy as np

from gaitval.arrays import Array

FOOT_SHAPE = {
    ("MT1", "MT5"): (1.0324, 0.4835, 0.0610),
    ("MT1", "MT2"): (1.0033, 0.1487, 0.0220),
    ("MT5", "MT2"): (0.8528, -0.2548, -0.0323),
}
"""Position of a metatarsal head relative to the heel and another head: along the line from the heel
marker to the other head, medial of it, and above the other head, as fractions of that line's length
in the plane of the floor. Means over the 20 feet of the ten built-in subjects (WBDS); 1 SD of the
length is 3.5, 1.4 and 2.8 %, of the direction 1.5, 0.8 and 1.3 degrees."""


@dataclass(frozen=True)
class ForefootShape:
    """Shape of the forefoot."""

    midfoot: float = 0.87
    """Second heads nearer to the heels than this share of the distance expected for the hips'
    height are markers on the midfoot, as Plug-in Gait allows: it needs a direction only. Feet of
    the built-in subjects: 0.96 to 1.15; of five clinics: 0.71, 0.84, 0.91, 0.96 and 1.02."""
    head_by_hips: float = 0.2238
    head_height: float = 0.1703
    """Distance from heel to first head over the hips' height, and height of the fifth head over
    that distance, by `stature`."""


FOREFOOT: Final = ForefootShape()

MIDFOOT_SOURCE = "markers: forefoot markers on the midfoot, length by the height of the hips"


def on_midfoot(points: Mapping[str, Array]) -> float:
    """Expected distance from heel to first head, m, where the feet have a marker on the midfoot by
    `FOREFOOT.midfoot`, else 0. `points` (3,) m, with the hip joint centres.
    """
    if {f"{side}.{head}" for side in "RL" for head in ("MT1", "MT5")} & points.keys():
        return 0.0
    hips = float(points["R.Hip.Centre"][2] + points["L.Hip.Centre"][2]) / 2
    expected = FOREFOOT.head_by_hips * hips
    along = [(points[f"{side}.MT2"] - points[f"{side}.Heel"])[:2] for side in "RL"]
    return expected if np.linalg.norm(along, axis=1).mean() < FOREFOOT.midfoot * expected else 0.0


def metatarsals(points: Mapping[str, Array]) -> dict[str, Array]:
    """The first and fifth metatarsal heads, (3,) m each, that `points` lack; by `FOOT_SHAPE`."""
    found: dict[str, Array] = {}
    expected = on_midfoot(points)
    for side in "RL":
        heel = points[f"{side}.Heel"]
        if expected:
            along = (points[f"{side}.MT2"] - heel) * [1.0, 1.0, 0.0]
            place = heel + expected * along / np.linalg.norm(along)
            # The top of the midfoot is higher than the heads.
            place[2] = FOREFOOT.head_height * expected
            points = {**points, f"{side}.MT2": place}
        for head, others in (("MT1", ("MT5", "MT2")), ("MT5", ("MT2",))):
            if f"{side}.{head}" in points:
                continue
            other = next(name for name in others if f"{side}.{name}" in points)
            along = points[f"{side}.{other}"] - heel
            length = float(np.hypot(along[0], along[1]))
            x = np.array([along[0], along[1], 0.0])
            medial = np.array([-along[1], along[0], 0.0]) * (1.0 if side == "R" else -1.0)
            forward, inward, up = FOOT_SHAPE[head, other]
            found[f"{side}.{head}"] = (
                heel + forward * x + inward * medial + np.array([0.0, 0.0, along[2] + up * length])
            )
    return found
