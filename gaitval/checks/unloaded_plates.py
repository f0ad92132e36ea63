"""Whether a plate shows nothing while nothing is on it, by its own force alone.

A plate whose file gives a centre of pressure and no moments cannot be zeroed afterwards, and one
without corners does not say which feet can be on it. Its force between two steps shows both.
"""

from collections.abc import Iterator
from typing import Final

import numpy as np

from gaitval.gait.quality_flags import QualityFlag
from gaitval.mocap.recording import Plate

UNLOADED_PLATE: Final = "unloaded plate"
LIGHT: Final = 0.12
"""Of the largest vertical force, below which a plate carries no foot that stands."""
LEAST_SECONDS: Final = 0.15
WINDOW_SECONDS: Final = 1.5
"""More than a stride: each has a time without a foot, of a plate on which one foot walks."""
UNLOADED: Final = 0.025
"""Of the largest vertical force: 20 N of a grown person, at which forces are taken for a foot's.
What feet leave while they come and go is short."""


def unloaded_warnings(plate: Plate, rate: float) -> Iterator[QualityFlag]:
    """A warning about a `plate`, with samples at `rate` Hz, that shows a force while it carries no
    foot: one at most, of where it is largest.
    """
    up, window = plate.force[:, 2], max(round(WINDOW_SECONDS * rate), 1)
    if not len(up) or (peak := float(np.percentile(up, 99.0))) <= 0.0:
        return
    levels = []
    for begin in range(0, len(up), window):
        part = up[begin : begin + window]
        light = part[np.abs(part) < LIGHT * peak]
        if len(light) >= LEAST_SECONDS * rate:
            levels.append(float(np.median(light)))
    worst = max(levels, key=abs, default=0.0)
    if abs(worst) > UNLOADED * peak:
        drifts = np.ptp(levels) > UNLOADED * peak / 2
        yield QualityFlag(
            UNLOADED_PLATE, f"plate {plate.name}", abs(worst), UNLOADED * peak, "N",
            f"between the steps it shows {worst:.0f} N{', and drifts' if drifts else ''}: it was "
            "not zeroed, or its amplifier drifts. Events, forces and moments are off by it, and "
            "with a centre of pressure instead of moments the file cannot be put right here: zero "
            "the plate before the recording, or subtract what its channels show without a foot "
            "before the centre of pressure is worked out",
            plate=plate.name,
        )  # fmt: skip
