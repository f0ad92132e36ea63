"""Whether a gap that was filled by a spline before the file was written was filled wrongly.

A spline has an exact polynomial in a gap, without the noise of the cameras, which every marker that
was seen has. Most fills are good; one that is not leaves the marker's place on its segment.
"""

from collections.abc import Iterator, Mapping
from typing import Final

import numpy as np

from gaitval.arrays import Array, runs
from gaitval.checks.marker_checks import STUCK_TRAVEL
from gaitval.gait.quality_flags import QualityFlag
from gaitval.mocap.recording import Recording

ORDERS: Final = {4: 4e-6, 6: 16e-6}
"""Order of differences that a polynomial of third or fifth degree does not have, and the size (m)
that rounding to a thousandth of a millimetre leaves of them. The noise of cameras is twenty times
that, and of markers that were smoothed and move ten times."""
SHARE: Final = 0.1
"""Of the marker's own median of that difference."""
LEAST_SECONDS: Final = 0.15
"""Of 25 public trials three have longer ones, all splines: a child's (HC040A, 0.4 s) and two of the
instrumented knee (0.25 s)."""
LEAST_FRAMES: Final = 6
AWAY: Final = 0.006
"""m, by which the distance to another marker of the segment is farther from its median than in the
rest of the trial: skin moves by less than it does there."""
LONG: Final = 0.25
"""s, of a fill of a segment's only marker, which nothing else shows."""


def filled_warnings(recording: Recording, segments: Mapping[str, str]) -> Iterator[QualityFlag]:
    """A warning for each marker of a `recording`, as read, with a gap that was filled wrongly;
    `segments` has the segment of each marker.
    """
    for name in recording.names:
        filled = _filled(recording, name)
        if not filled.any():
            continue
        others = [
            other
            for other in recording.names
            if other != name and segments.get(other) == segments.get(name, "torso") != "torso"
        ]
        seconds = float(filled.sum() / recording.marker_rate)
        away = max((_away(recording, name, other, filled) for other in others), default=np.nan)
        if away > AWAY or (not others and seconds > LONG):
            off = (
                f"and is up to {1000 * away:.0f} mm farther from its place beside the other "
                "markers of its segment than in the rest of the trial"
                if others
                else "and no other marker shows its segment"
            )
            yield QualityFlag(
                "filled gap", name, seconds, 0.0, "s",
                f"its path is an exact polynomial for {seconds:.2f} s in all, {off}: a gap was "
                "filled by a spline before the file was written, and the angles of its segment are "
                "wrong there. Export the trial with the gaps left open, or fill them by the other "
                "markers of the segment",
            )  # fmt: skip


def _filled(recording: Recording, name: str) -> Array:
    """(T,) whether the path of a marker is an exact polynomial around a frame."""
    path, rate = recording.marker(name), recording.marker_rate
    found = np.zeros(len(path), dtype=bool)
    for order, rounding in ORDERS.items():
        size = np.linalg.norm(np.diff(path, n=order, axis=0), axis=1)
        seen = size[np.isfinite(size)]
        if not len(seen):
            continue
        for begin, end in zip(*runs(size < min(rounding, SHARE * np.median(seen))), strict=True):
            last = end - 1 + order
            enough = end - begin >= LEAST_FRAMES and (last + 1 - begin) / rate >= LEAST_SECONDS
            # A marker that rests has no differences either, and no gap.
            if enough and np.linalg.norm(path[last] - path[begin]) > STUCK_TRAVEL:
                found[begin : last + 1] = True
    return found


def _away(recording: Recording, name: str, other: str, filled: Array) -> float:
    """m; NaN where the two are not seen together."""
    apart: Array = np.linalg.norm(recording.marker(name) - recording.marker(other), axis=1)
    seen = np.isfinite(apart)
    inside, outside = apart[seen & filled.astype(bool)], apart[seen & ~filled.astype(bool)]
    if not len(inside) or not len(outside):
        return float("nan")
    middle = np.median(outside)
    return float(np.abs(inside - middle).max() - np.abs(outside - middle).max())
