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
LEAST_FRAMES: Final = 60


def loose_warnings(recording: Recording, segments: Mapping[str, str]) -> Iterator[QualityFlag]:
    """A warning for each marker that shakes; of two that only each other shows, one for both.

    `recording` is in the project's axes; `segments` has the segment of each marker. The trunk, in
    which shoulder blades move, is left out.
    """
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
