"""The standing trial: where its markers are, and whether the person stands."""

from collections.abc import Mapping
from typing import Final

import numpy as np

from gaitval.arrays import Array
from gaitval.errors import RecordError
from gaitval.findings import Result, look
from gaitval.findings.markers import Stood
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


def without_seldom(recording: Recording) -> tuple[Recording, Result]:
    """The standing trial without markers that hardly any frame shows, and what was found of it."""
    found = look(Stood(recording))
    left_out = {flag.where for flag in found.flags}
    if not left_out:
        return recording, found
    markers = recording.markers.copy()
    markers[:, [name in left_out for name in recording.names]] = np.nan
    return recording.with_markers(recording.names, markers), found


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
