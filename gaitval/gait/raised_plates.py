"""Force plates that no foot can be on: handrails, seats, walls, supports, devices.

Axes: the project's (REP-103, z up).
"""

from collections.abc import Mapping
from dataclasses import replace
from typing import Final

import numpy as np

from gaitval.arrays import Array
from gaitval.errors import RecordError
from gaitval.gait.quality_flags import QualityFlag
from gaitval.mocap.foot_markers import foot_markers
from gaitval.mocap.recording import Plate, Recording

RAISED: Final = 0.3
"""m above the lowest marker of the feet, which is higher than a whole foot swings. What is lower
may be a step or a sloping treadmill."""
LOWEST: Final = 2.0
"""Percentile of heights that stands for the lowest: a marker may be a ghost for once."""
LOADED_N: Final = 10.0
"""N. The point of a smaller force is not known."""


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
    outlines = [each.outline[..., 2] for each in seen.values()]
    floor = float(np.nanpercentile(np.concatenate(outlines, axis=1), LOWEST))
    kept, flags = list[Plate](), list[QualityFlag]()
    for plate, height in zip(recording.plates, heights, strict=True):
        if not height > floor + RAISED:  # nor where it is not known
            kept.append(plate)
            continue
        load = float(np.linalg.norm(plate.force - np.median(plate.force, axis=0), axis=1).max())
        what = (
            f"it is, or acts, {height - floor:.2f} m above the floor, where no foot is: a rail, a "
            "seat, a support, or a device on the body. It is used for no foot (its force changes "
            f"by up to {load:.0f} N); joint moments are those of person and device together. If a "
            "rail or a support carried weight, say so with aid = 'rail' or 'support' in a session "
            "file"
        )
        flags.append(
            QualityFlag(
                "plate above the feet", f"plate {plate.name}", height - floor, RAISED, "m", what,
                plate=plate.name,
            )
        )  # fmt: skip
    return replace(recording, plates=tuple(kept)), () if aid else tuple(flags)


def _height(plate: Plate) -> float:
    """m, of the surface of a plate, or of the points of its force; NaN if nothing tells it."""
    if np.isfinite(plate.corners).all():
        return float(plate.corners[:, 2].mean())
    heights: Array = plate.centre_of_pressure[np.linalg.norm(plate.force, axis=1) > LOADED_N, 2]
    heights = heights[np.isfinite(heights)]
    return float(np.median(heights)) if len(heights) else float("nan")
