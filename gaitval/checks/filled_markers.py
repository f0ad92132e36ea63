"""Whether a gap that was filled by a spline before the file was written was filled wrongly.

A spline has an exact polynomial in a gap, without the noise of the cameras, which every marker that
was seen has. Most fills are good; one that is not leaves the marker's place on its segment.
"""

from collections.abc import Iterator, Mapping
from typing import Final

import numpy as np

from gaitval.arrays import Array, Flags, runs
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
LONG: Final = 0.3
"""s, filled in all, of a segment that fewer than two other markers show: a distance to one of them
does not show where a marker is."""


def filled_warnings(recording: Recording, segments: Mapping[str, str]) -> Iterator[QualityFlag]:
    """A warning for all markers of a `recording`, as read, with a gap that was filled wrongly;
    `segments` has the segment of each marker.
    """
    found: dict[str, tuple[float, str]] = {}
    for name in recording.names:
        filled = _filled(recording, name)
        seconds = float(filled.sum() / recording.marker_rate)
        others = [
            other
            for other in recording.names
            if other != name and segments.get(other) == segments.get(name, "torso") != "torso"
        ]
        away = max((_away(recording, name, other, filled) for other in others), default=np.nan)
        if away > AWAY:
            found[name] = (seconds, f"by up to {1000 * away:.0f} mm")
        elif len(others) < 2 and seconds > LONG:
            found[name] = (seconds, "where too few other markers show its segment")
    if found:
        parts = [f"{name} for {seconds:.2f} s, {off}" for name, (seconds, off) in found.items()]
        yield QualityFlag(
            "filled gap", ", ".join(found), max(seconds for seconds, _ in found.values()), 0.0, "s",
            "paths that are exact polynomials, and farther from the other markers of their "
            f"segments than in the rest of the trial, or not held by them: {'; '.join(parts)}. "
            "Gaps were filled by splines before the file was written, and the angles of these "
            "segments are wrong there. Export the trial with the gaps left open, or fill them by "
            "the other markers of the segment",
        )  # fmt: skip


def _filled(recording: Recording, name: str) -> Flags:
    """(T,) whether the path of a marker is an exact polynomial around a frame."""
    path, rate = recording.marker(name), recording.marker_rate
    found: Flags = np.zeros(len(path), dtype=bool)
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


def _away(recording: Recording, name: str, other: str, filled: Flags) -> float:
    """m; NaN where the two are not seen together."""
    apart: Array = np.linalg.norm(recording.marker(name) - recording.marker(other), axis=1)
    seen = np.isfinite(apart)
    inside, outside = apart[seen & filled], apart[seen & ~filled]
    if not len(inside) or not len(outside):
        return float("nan")
    middle = np.median(outside)
    return float(np.abs(inside - middle).max() - np.abs(outside - middle).max())
