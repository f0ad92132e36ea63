"""Whether a marker shakes against the others of its segment, as one does that is loose.

Skin moves slowly with a segment and at the strike of a heel; between two markers of one segment it
leaves less than a millimetre above 5 Hz.
"""

from collections.abc import Iterator, Mapping
from itertools import combinations
from typing import Final

import numpy as np

from gaitval.arrays import Array
from gaitval.checks.marker_checks import MEDIAN_TO_SD
from gaitval.gait.filters import low_pass
from gaitval.gait.quality_flags import QualityFlag
from gaitval.mocap.recording import Recording

SHAKES_HZ: Final = 5.0
LARGEST_SHAKE: Final = 0.002
"""m, SD above `SHAKES_HZ` of the distances to the other markers of a segment, in the median of
these: at most 0.9 mm of all markers in 22 public recordings of 20 people."""
LARGEST_PATH: Final = 0.004
MORE: Final = 2.5
"""m, median of a landmark's own path above `SHAKES_HZ`, and times that of the other side's: one of
two markers of a segment may shake across the line between them. Of twelve people at most 2.7 mm,
and 2.0 times."""
LEAST_FRAMES: Final = 60


def loose_warnings(
    recording: Recording, segments: Mapping[str, str], landmarks: Mapping[str, str]
) -> Iterator[QualityFlag]:
    """A warning for each marker that shakes; of two that only each other shows, one for both.

    `recording` is in the project's axes; `segments` has the segment of each marker, `landmarks` the
    markers on landmarks. The trunk, in which shoulder blades move, is left out.
    """
    beside = [*_loose_on_segments(recording, segments)]
    yield from beside or _loose_paths(recording, segments, landmarks)


def _loose_paths(
    recording: Recording, segments: Mapping[str, str], landmarks: Mapping[str, str]
) -> Iterator[QualityFlag]:
    """By what shakes more than the same landmark of the other side."""
    for landmark, right in landmarks.items():
        left = landmarks.get(f"L.{landmark[2:]}", "") if landmark.startswith("R.") else ""
        known = [n for n in (right, left) if segments.get(n, "torso") != "torso"]
        if len(known) < 2 or not all(name in recording.names for name in known):
            continue
        sizes = {name: _own(recording, name) for name in known}
        worst = max(known, key=lambda name: sizes[name])
        if sizes[worst] > max(LARGEST_PATH, MORE * min(sizes.values())):
            yield QualityFlag(
                "loose marker", worst, sizes[worst], LARGEST_PATH, "m",
                f"above {SHAKES_HZ:g} Hz its path has {1000 * sizes[worst]:.1f} mm in the median, "
                f"that of the other side {1000 * min(sizes.values()):.1f} mm (elsewhere at most "
                "2.7 mm, and twice the other side's): it is loose and shakes, or the cameras lose "
                "it. Moments, and angles of its segment, shake with it; fix it, or leave it out "
                "of the file",
            )  # fmt: skip


def _own(recording: Recording, name: str) -> float:
    """m, median of a marker's path above `SHAKES_HZ`; 0 where it is hardly seen."""
    path = recording.marker(name)
    seen = np.isfinite(path).all(axis=1)
    if seen.sum() < LEAST_FRAMES:
        return 0.0
    frames = np.arange(len(path))
    whole = np.stack([np.interp(frames, frames[seen], path[seen, i]) for i in range(3)], axis=1)
    slow = low_pass(whole, rate=recording.marker_rate, cutoff_hz=SHAKES_HZ)
    return float(np.median(np.linalg.norm(whole - slow, axis=1)[seen]))


def _loose_on_segments(recording: Recording, segments: Mapping[str, str]) -> Iterator[QualityFlag]:
    """By what shakes against the other markers of its segment."""
    of: dict[str, list[str]] = {}
    for name in recording.names:
        if segments.get(name, "torso") != "torso":
            of.setdefault(segments[name], []).append(name)
    for names in of.values():
        shakes = {pair: _shake(recording, *pair) for pair in combinations(names, 2)}
        own = {
            name: [s for pair, s in shakes.items() if name in pair and np.isfinite(s)]
            for name in names
        }
        found = {name: float(np.median(own[name])) for name in names if own[name]}
        worst = max(found, key=lambda name: found[name], default="")
        if not worst or found[worst] <= LARGEST_SHAKE:
            continue
        # What shakes moves its distances to all others; theirs to each other stay.
        every = [name for name in found if min(own[name]) > LARGEST_SHAKE]
        loose = every if worst in every else [worst]
        yield QualityFlag(
            "loose marker", " or ".join(loose), found[worst], LARGEST_SHAKE, "m",
            f"above {SHAKES_HZ:g} Hz its distance to the other markers of its segment changes by "
            f"{1000 * found[worst]:.1f} mm (SD; elsewhere below 1 mm): it is loose and shakes, or "
            "the cameras lose it. Moments, and angles of its segment, shake with it; fix it, or "
            "leave it out of the file",
        )  # fmt: skip


def _shake(recording: Recording, one: str, other: str) -> float:
    """m; NaN where the two are hardly seen together, or one scatters from frame to frame."""
    apart: Array = np.linalg.norm(recording.marker(one) - recording.marker(other), axis=1)
    seen = np.isfinite(apart)
    if seen.sum() < LEAST_FRAMES:
        return float("nan")
    frames = np.arange(len(apart))
    whole = np.interp(frames, frames[seen], apart[seen])[:, None]
    slow = low_pass(whole, rate=recording.marker_rate, cutoff_hz=SHAKES_HZ)
    return float(MEDIAN_TO_SD * np.median(np.abs(whole - slow)[seen]))
