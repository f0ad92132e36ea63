"""Whether the markers of the feet are in walking where they are in standing.

Axes: the project's (REP-103, z up).
"""

from collections.abc import Iterator, Mapping
from typing import Final

import numpy as np

from gaitval.gait.doubts import Doubt
from gaitval.mocap.recording import Recording

LARGEST_HEIGHT_CHANGE: Final = 0.02
"""m. When a foot is flat, each of its markers is as high as in standing, but for what the floor of
the two trials differs by: within 8 mm in the recordings named in `force_checks`."""
FLAT_PERCENTILE: Final = 15.0
"""Of a marker's height over the trial: a foot is flat for a quarter of the stride or more."""
FEWEST_MARKERS: Final = 4
_ON_FEET: Final = ("Heel", "Ankle", "MT1", "MT2", "MT5", "Toe")


def foot_marker_doubts(
    standing: Recording, walking: Recording, landmarks: Mapping[str, str]
) -> Iterator[Doubt]:
    """Markers of the feet that are higher or lower in the walk's flat foot than in standing.

    Parameters
    ----------
    landmarks : see `foot_markers`.
    """
    changes = {}
    for landmark, name in landmarks.items():
        shown = name in standing.names and name in walking.names
        if shown and landmark.rpartition(".")[2] in _ON_FEET:
            stood, walked = (
                heights[np.isfinite(heights)]
                for heights in (standing.marker(name)[:, 2], walking.marker(name)[:, 2])
            )
            if len(stood) and len(walked):
                flat = np.percentile(walked, FLAT_PERCENTILE)
                changes[name] = float(flat - np.median(stood))
    if len(changes) < FEWEST_MARKERS:
        return
    floor = float(np.median(list(changes.values())))
    for name, change in changes.items():
        if abs(change - floor) > LARGEST_HEIGHT_CHANGE:
            yield Doubt(
                "height of a foot's marker", name, abs(change - floor), LARGEST_HEIGHT_CHANGE, "m",
                f"with the foot flat it is {1000 * abs(change - floor):.0f} mm "
                f"{'higher' if change > floor else 'lower'} in walking than in standing (elsewhere "
                f"within {1000 * LARGEST_HEIGHT_CHANGE:.0f} mm): it has moved or is mislabelled in "
                "one of the trials, or the foot is never put down flat",
            )  # fmt: skip
