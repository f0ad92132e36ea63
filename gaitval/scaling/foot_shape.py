"""Metatarsal heads without a marker, by the mean shape of a foot."""

from collections.abc import Mapping

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


def metatarsals(points: Mapping[str, Array], side: str) -> dict[str, Array]:
    """The first and fifth metatarsal heads, (3,) m each, that the `points` of a `side` ("R" or "L")
    lack; by `FOOT_SHAPE`.
    """
    heel = points[f"{side}.Heel"]
    found = {}
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
