"""A known walk in which every coordinate moves, seen by markers on every segment."""

from functools import cache

import numpy as np
from known_walk import known_walk

from gaitval.coordinates import ACTUATED, COORDINATES
from gaitval.model.body import SEGMENTS, BodyModel
from gaitval.model.markers import ModelMarker

RATE = 100.0

LEG_SEGMENTS = (
    "pelvis",
    *(f"{part}_{side}" for part in ("thigh", "shank", "foot") for side in "rl"),
)


def spread_markers(model: BodyModel, segments: tuple[str, ...] = SEGMENTS) -> list[ModelMarker]:
    """Four markers at the corners of a tetrahedron, about 16 cm wide, round each segment's centre
    of mass; smaller on the toes."""
    corners = np.array([[1, 1, 1], [1, -1, -1], [-1, 1, -1], [-1, -1, 1]], dtype=float)
    return [
        ModelMarker(
            f"{segment} {i}",
            segment,
            model[segment].centre_of_mass + (0.03 if "toes" in segment else 0.08) * corner,
        )
        for segment in segments
        for i, corner in enumerate(corners)
    ]


@cache
def moving_walk(seconds: float = 2.2, heading: float = 0.0) -> tuple[BodyModel, np.ndarray]:
    """Model and positions (T, 31) at `RATE`: the known walk, to which toes, trunk and arms add
    waves of 1.5 to 2 Hz and 6-17° that differ between the sides."""
    walk = known_walk(seconds=seconds, rate=RATE, heading=heading)
    positions = walk.positions.copy()
    names = [n for n in ACTUATED if n.startswith(("mtp", "lumbar", "arm", "elbow"))]
    for i, name in enumerate(names):
        wave = np.sin(2 * np.pi * (1.5 + 0.03 * i) * walk.time + i)
        positions[:, COORDINATES.index(name)] += (0.1 + 0.01 * i) * wave
    return walk.model, positions
