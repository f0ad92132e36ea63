"""Whether the markers of a walk were low-passed at a few Hz before their file was written."""

from collections.abc import Iterator
from typing import Final

import numpy as np

from gaitval.gait.filters import octave
from gaitval.gait.quality_flags import QualityFlag
from gaitval.mocap.recording import Recording

SMOOTHED: Final = "smoothed markers"
"""The check that says so."""
LEAST_FALL: Final = -4.5
"""Octaves by which the markers' rate falls from 4 to 8 Hz: -2.4 ± 0.6 in 23 public recordings (-3.5
at least), -3.8 to -6.5 after a zero-lag low-pass at 4 to 2 Hz."""
LEAST_RATE: Final = 50.0
"""Hz of the markers, from which on their rate at 8 Hz is known."""


def fall_of_markers(walk: Recording) -> float:
    """Octaves by which the rate of the markers of a `walk` changes from 4 to 8 Hz; NaN where none
    is seen in all frames, or it is too short.
    """
    if walk.marker_rate < LEAST_RATE or len(walk.markers) < walk.marker_rate:
        return float("nan")
    seen = np.isfinite(walk.markers).all(axis=(0, 2))
    if not seen.any():
        return float("nan")
    return octave(walk.markers[:, seen].reshape(len(walk.markers), -1), walk.marker_rate, 4.0)


def smoothed(walk: Recording) -> bool:
    """Whether hardly anything is fast in the markers of a `walk`, as after a low-pass."""
    return fall_of_markers(walk) < LEAST_FALL


def smoothed_warnings(walk: Recording) -> Iterator[QualityFlag]:
    """Warning about a `walk`, as it was recorded, that was smoothed: one at most."""
    if not smoothed(walk):
        return
    fall = fall_of_markers(walk)
    yield QualityFlag(
        SMOOTHED, "all markers", fall, LEAST_FALL, "octaves",
        "hardly anything in them is faster than 4 Hz (from there to 8 Hz their rate falls by "
        f"{-fall:.1f} octaves, elsewhere by at most 3.5): they were low-passed at a few Hz before "
        "the file was written. Angles are flattened, distances between markers of a segment and "
        "accelerations change: export them as they were recorded",
    )  # fmt: skip
