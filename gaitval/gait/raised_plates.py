"""Force plates that no foot can be on: handrails, seats, walls, and what is no plate: devices.

Axes: the project's (REP-103, z up).
"""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Final

import numpy as np

from gaitval.arrays import Array
from gaitval.errors import RecordError
from gaitval.gait.quality_flags import QualityFlag
from gaitval.mocap.foot_markers import foot_markers
from gaitval.mocap.recording import Plate, Recording


@dataclass(frozen=True)
class RaisedLimits:
    """What tells that a plate is not the floor."""

    lowest_m: float = 0.3
    """m above the lowest marker of the feet. What is lower may be a step or a sloping treadmill."""
    clear_m: float = 0.1
    """m above the highest place at which a whole foot ever is: the markers are on top of the
    shoe."""
    usual: float = 98.0
    """Percentile of a foot's heights that stands for the highest: a marker may be a ghost for
    once."""
    overhead_m: float = 1.5
    """m above the highest marker, at which a support may hang."""
    no_weight_n: float = 20.0
    """N. Who never pushes a plate down by more does not stand on it."""
    off_floor_m: float = 0.04
    """m above the lowest marker of the feet. What pushes sideways there, and never down, is no
    floor's, whose point of application is below the markers."""
    loaded_n: float = 10.0
    """N. The point of a smaller force is not known."""


RAISED: Final = RaisedLimits()


def without_raised(
    recording: Recording, landmarks: Mapping[str, str], *, aid: str | None = None
) -> tuple[Recording, tuple[QualityFlag, ...]]:
    """The trial without the plates that are above both feet all the time, and what is said of each.

    Parameters
    ----------
    recording : cleaned, in the project's axes.
    landmarks : see `foot_markers`.
    aid : what carries a part of the body, as the user says it; then nothing has to be said.
    """
    heights = [_height(plate) for plate in recording.plates]
    if not np.isfinite(heights).any():
        return recording, ()
    try:
        seen = foot_markers(recording, landmarks)
    except RecordError:  # said when joints and events are found, with all that is missing
        return recording, ()
    feet = [each.outline[..., 2] for each in seen.values()]
    floor = float(np.nanpercentile(np.concatenate(feet, axis=1), 100.0 - RAISED.usual))
    lowest = [each[np.isfinite(each).any(axis=1)] for each in feet]
    reached = max(float(np.percentile(np.nanmin(each, axis=1), RAISED.usual)) for each in lowest)
    head = float(np.nanmax(recording.markers[..., 2]))
    kept, flags = list[Plate](), list[QualityFlag]()
    for plate, height in zip(recording.plates, heights, strict=True):
        high = max(floor + RAISED.lowest_m, reached + RAISED.clear_m)
        # Where the corners are known, it is a plate, and its vertical channel is dead.
        sideways = height <= high and np.isnan(plate.corners).any() and _never_down(plate)
        if (
            not (floor + RAISED.off_floor_m if sideways else high)
            < height
            < head + RAISED.overhead_m
        ):
            kept.append(plate)
            continue
        load = float(np.linalg.norm(plate.force - np.median(plate.force, axis=0), axis=1).max())
        unused = f"It is used for no foot (its force changes by up to {load:.0f} N)"
        what = (
            f"it is, or acts, {height - floor:.2f} m above the floor, where no foot is, or it "
            "never pushes up: a handrail, a seat, a support, or a device on the body, such as an "
            f"exoskeleton's cuff. {unused}; joint moments are those of person and device together. "
            "If a rail or a support carried weight, say so with aid = 'rail' or 'support' in a "
            "session file"
        )
        flags.append(
            QualityFlag(
                "plate above the feet", f"plate {plate.name}", height - floor, RAISED.lowest_m, "m",
                what, plate=plate.name,
            )
        )  # fmt: skip
    return replace(recording, plates=tuple(kept)), () if aid else tuple(flags)


def _never_down(plate: Plate) -> bool:
    """Whether a plate's force pushes nobody up."""
    return bool(np.abs(plate.force[:, 2]).max(initial=0.0) < RAISED.no_weight_n)


def _height(plate: Plate) -> float:
    """m, of the surface of a plate, or of the points of its force; NaN if nothing tells it."""
    if np.isfinite(plate.corners).all():
        return float(plate.corners[:, 2].mean())
    heights: Array = plate.centre_of_pressure[
        np.linalg.norm(plate.force, axis=1) > RAISED.loaded_n, 2
    ]
    heights = heights[np.isfinite(heights)]
    return float(np.median(heights)) if len(heights) else float("nan")
