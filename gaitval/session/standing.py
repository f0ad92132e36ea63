"""The standing trial: where its markers are, and whether the person stands."""

from collections.abc import Mapping
from typing import Final

import numpy as np

from gaitval.arrays import Array
from gaitval.errors import RecordError
from gaitval.gait.quality_flags import QualityFlag
from gaitval.mocap.recording import Recording

LARGEST_SWAY: Final = 0.04
"""m. In a standing trial every marker of pelvis and feet is within this distance of its median
position in 90 % of the frames; at most 0.019 in those of WBDS01 and Rajagopal et al. 2016, but 0.07
or more in walking, also on a treadmill."""


def standing_places(recording: Recording) -> dict[str, Array]:
    """Median place of each marker of `recording` over the frames, (3,) m; none if never seen."""
    places = {}
    for name in recording.names:
        trajectory = recording.marker(name)
        seen = trajectory[np.isfinite(trajectory).all(axis=1)]
        if len(seen):
            places[name] = np.median(seen, axis=0)
    return places


SELDOM: Final = 0.1
"""Of the frames of a standing trial: a marker that fewer show is a ghost more often than a marker
(0.01 in a file of MOtoNMS, 11 cm from its place), and its place is not taken from them."""


def without_seldom(recording: Recording) -> tuple[Recording, list[QualityFlag]]:
    """The standing trial without markers that hardly any frame shows, and a warning about each."""
    seen = np.isfinite(recording.markers).all(axis=2) & (recording.markers != 0.0).any(axis=2)
    markers, flags = recording.markers.copy(), list[QualityFlag]()
    for column, (name, frames) in enumerate(zip(recording.names, seen.sum(axis=0), strict=True)):
        if 0 < frames < SELDOM * len(markers):
            markers[:, column] = np.nan
            flags.append(QualityFlag(
                "seldom seen", name, float(frames) / len(markers), SELDOM, "of the frames",
                f"only {frames} of the {len(markers)} frames of the standing trial show it, so it "
                "is left out there: label it in the recording program, and export again",
            ))  # fmt: skip
    return (recording.with_markers(recording.names, markers) if flags else recording), flags


def check_stands(recording: Recording, landmarks: Mapping[str, str]) -> None:
    """Refuse a standing trial in which the person walks or moves away; `landmarks` names the
    markers of `recording` that must be still.

    Raises RecordError, which names the marker that moves most.
    """
    sway = {}
    for landmark, name in landmarks.items():
        if name in recording.names and landmark.rpartition(".")[2] in _STILL:
            trajectory = recording.marker(name)
            seen = trajectory[np.isfinite(trajectory).all(axis=1)]
            if len(seen):
                away = np.linalg.norm(seen - np.median(seen, axis=0), axis=1)
                sway[name] = float(np.percentile(away, 90.0))
    most = max(sway, key=lambda name: sway[name], default=None)
    if most is not None and sway[most] > LARGEST_SWAY:
        raise RecordError(
            f"{recording.source}: the person does not stand still: {most} is more than "
            f"{100 * sway[most]:.0f} cm from its median position in a tenth of the frames "
            f"(standing: at most {100 * LARGEST_SWAY:.0f} cm). Give a standing trial as --static, "
            "name the time in which the person stands (static_time = [0.5, 2] in a session file), "
            "or leave --static out: the standing pose is then put together from the walk."
        )


_STILL = ("ASIS", "PSIS", "Sacrum", "Heel", "Ankle", "MT1", "MT2", "MT5", "Toe")
"""Landmarks that stay in place in standing; knees may bend and arms may move."""
