"""Where frames of a recording were lost, or are there twice: all markers show it together."""

from collections.abc import Mapping
from typing import Final, NamedTuple

import numpy as np

from gaitval.arrays import Array, Flags
from gaitval.errors import count_of
from gaitval.mocap.repairs import seen_frames

BESIDE: Final = 3
"""Steps before and after one whose median is the step that a marker usually makes there."""
LIMITS: Final[Mapping[str, float]] = {
    # m. Of a marker that moves less from frame to frame, noise (0.2 mm) decides how far it
    # steps.
    "least_step": 0.0005,
    # Share of the moving markers that step by half a frame or more too far, or too short.
    "agreeing": 0.9,
}
"""What decides in this module: each in the unit and for the reason that is said before it."""

FEWEST_MARKERS: Final = 6


class Lost(NamedTuple):
    """How many `frames` are missing before a `frame` (counted from 0); negative if too many."""

    frame: int
    frames: int


def lost_frames(markers: Array) -> tuple[Lost, ...]:
    """Frames that all of `markers` (T, M, 3) m, NaN where not seen, show to be missing, or to be
    there twice, in order of time.

    The motion goes on while frames are lost, so every marker steps by its usual step times one more
    than their number. One marker that jumps has a wrong label; all of them show a gap in time.
    """
    # A frame that repeats the one before has no step of its own: what is missing or too many is
    # what the next step has beside the number of frames that are stored.
    kept = np.flatnonzero(np.r_[True, ~_repeats(markers)])
    steps = np.diff(markers[kept], axis=0)
    found = []
    for at in range(BESIDE, len(steps) - BESIDE):
        around = np.r_[at - BESIDE : at, at + 1 : at + 1 + BESIDE]
        usual = np.median(steps[around], axis=0)
        square = (usual**2).sum(axis=1)
        # NaN is no moving marker
        moving = seen_frames(steps[at]) & (square > LIMITS["least_step"] ** 2)
        if np.count_nonzero(moving) < FEWEST_MARKERS:
            continue
        ratio = (steps[at, moving] * usual[moving]).sum(axis=1) / square[moving]
        stored = kept[at + 1] - kept[at]
        missing = ratio - stored
        # Only a frame that is there twice is one too many; markers that rest for a moment are not.
        sign = -1.0 if stored > 1 and np.median(missing) < 0.0 else 1.0
        if np.mean(sign * missing > 0.5) >= LIMITS["agreeing"]:
            weight = square[moving]
            found.append(Lost(int(kept[at + 1]), round(float(weight @ missing / weight.sum()))))
    return tuple(found)


def _repeats(markers: Array) -> Flags:
    """(T - 1,) True where a frame has every marker exactly where the one before has it."""
    same = (markers[1:] == markers[:-1]) | (np.isnan(markers[1:]) & np.isnan(markers[:-1]))
    return np.asarray(same.all(axis=(1, 2)) & seen_frames(markers[1:]).any(axis=1))


def lost_text(frames: int) -> str:
    """How many `frames` are missing, or too many if negative, in words."""
    if frames < 0:
        return count_of(-frames, "repeated frame")
    return (
        f"about {count_of(frames, 'frame')} missing (all markers step "
        f"{frames + 1} times as far as usual)"
    )
