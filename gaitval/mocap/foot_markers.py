"""Where the feet are and where the person faces, from markers known by their anatomical role."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Final

import numpy as np

from gaitval.arrays import Array
from gaitval.coordinates import SIDES, Side
from gaitval.errors import RecordError
from gaitval.mocap.recording import Recording

FRONT: Final = ("MT1", "MT2", "MT5")
"""Landmarks of the forefoot; any one is enough."""

TOES: Final = 0.35
"""Distance of the toe tip ahead of the metatarsal heads, as a fraction of the distance from heel to
heads: 1 / 0.74 − 1, because the ball of the foot is at 74 % of its length (ANSUR II, Gordon et al.
2014)."""
FOREFOOT: Final = {"MT1": (-0.45,), "MT2": (0.15, -0.25), "MT5": (0.48,)}
"""Offset of the other metatarsal heads from a single marked one, towards the midline of the body,
as a fraction of the distance from the heel to it: means over the feet of the ten built-in subjects.
Two digits are enough for the outline of the foot."""
OPPOSITE: Final = float(np.cos(np.radians(130.0)))
"""Cosine of the angle between pelvis and a foot beyond which one faces backwards; feet turn out by
25°."""


@dataclass(frozen=True)
class FootMarkers:
    """Trajectories of one foot's markers, T frames, m.

    Attributes
    ----------
    heel : (T, 3).
    front : (T, 3) mean of the forefoot's markers that are seen.
    outline : (T, n, 3) heel, metatarsal heads and, where there is one, ankle, and the toes ahead of
        the heads; heads without a marker are placed where most people have them.
    """

    heel: Array
    front: Array
    outline: Array


def foot_markers(recording: Recording, landmarks: Mapping[str, str]) -> dict[Side, FootMarkers]:
    """Heel and forefoot of both feet in `recording`, z up, m. Of `landmarks`, by their markers, it
    uses, with `R.` or `L.` before them, `Heel`, any of `MT1`, `MT2`, `MT5`, and `Ankle` if there is
    one. Raises RecordError if a foot has no heel marker or no forefoot marker.
    """
    feet: dict[Side, FootMarkers] = {}
    for side in SIDES:
        letter = side[0].upper()
        heel = _trajectories(recording, landmarks, [f"{letter}.Heel"])
        heads = {
            name: path
            for name in FRONT
            for path in _trajectories(recording, landmarks, [f"{letter}.{name}"])
        }
        ankle = _trajectories(recording, landmarks, [f"{letter}.Ankle"])
        if not heel or not heads:
            lacking = "heel" if not heel else f"forefoot ({', '.join(FRONT)})"
            raise RecordError(
                f"{recording.source}: no marker on the {side} {lacking} is seen. Gait events, and "
                "the foot on each force plate, are found from heel and forefoot; markers seen: "
                f"{', '.join(recording.names)}. If one of these is it, name it in the marker set."
            )
        feet[side] = FootMarkers(
            heel=heel[0],
            front=_mean([*heads.values()]),
            outline=np.stack([*_sole(side, heel[0], heads), *ankle], axis=1),
        )
    return feet


def facing(recording: Recording, landmarks: Mapping[str, str]) -> Array:
    """Horizontal direction that the person faces, a unit vector (3,) with z = 0, the median over
    the trial `recording`, z up, m.

    It points from the posterior to the anterior iliac spines (of `landmarks`, see `foot_markers`:
    `R.ASIS`, `L.ASIS`, and `R.PSIS`, `L.PSIS` or `Sacrum`) or, without them, from heels to
    forefeet. Raises RecordError if neither is seen, or pelvis and feet do not face one way.
    """
    front = _trajectories(recording, landmarks, ["R.ASIS", "L.ASIS"])
    back = _back_of_pelvis(recording, landmarks)
    feet = {
        side: _mean(heads) - heel[0]
        for side in SIDES
        if (heel := _trajectories(recording, landmarks, [f"{side[0].upper()}.Heel"]))
        and (
            heads := _trajectories(recording, landmarks, [f"{side[0].upper()}.{n}" for n in FRONT])
        )
    }
    if len(front) < 2 or not back:
        # Frames of both feet together, so that toeing out cancels in the median.
        return _level_direction(recording, np.concatenate([*feet.values(), np.empty((0, 3))]))
    forward = _level_direction(recording, _mean(front) - _mean(back))
    for side, ahead in feet.items():
        seen = np.isfinite(ahead).all(axis=1).any()
        if seen and _level_direction(recording, ahead) @ forward < OPPOSITE:
            raise RecordError(
                f"{recording.source}: the {side} foot faces away from the pelvis: front and rear "
                "markers of one of them (toes and heel, or ASIS and PSIS) are exchanged. Correct "
                "these labels in the recording program, in all trials, and export them again."
            )
    return forward


def _level_direction(recording: Recording, ways: Array) -> Array:
    """Horizontal unit vector (3,) along the median of `ways` (n, 3) m, where they are seen."""
    level = ways[np.isfinite(ways).all(axis=1)][:, :2]
    if not len(level):
        raise RecordError(
            f"{recording.source}: the markers of pelvis and feet are never seen together, so it "
            "is unknown which way the person faces. Label them, or name them in the marker set."
        )
    direction = np.median(level, axis=0)
    return np.append(direction / np.linalg.norm(direction), 0.0)


def pelvis_markers(recording: Recording, landmarks: Mapping[str, str]) -> Array:
    """Middle (T, 3) m of the back of the pelvis in `recording` (`R.PSIS` and `L.PSIS` of
    `landmarks`, see `foot_markers`, or `Sacrum`) or, if that is not marked, of its front (`R.ASIS`
    and `L.ASIS`); NaN in frames that do not show all markers used. Raises RecordError if neither is
    seen.
    """
    back = _back_of_pelvis(recording, landmarks)
    front = _trajectories(recording, landmarks, ["R.ASIS", "L.ASIS"])
    if not back and len(front) < 2:
        raise RecordError(
            f"{recording.source}: no pair of markers on the pelvis is seen (R.PSIS and L.PSIS, "
            "Sacrum, or R.ASIS and L.ASIS). Toe-off is found from how far the foot is behind the "
            "pelvis. Label them, or name them in the marker set."
        )
    return _mean(back or front)


def _back_of_pelvis(recording: Recording, landmarks: Mapping[str, str]) -> list[Array]:
    back = _trajectories(recording, landmarks, ["R.PSIS", "L.PSIS"])
    # One PSIS alone is beside the middle.
    return back if len(back) == 2 else _trajectories(recording, landmarks, ["Sacrum"])


def _sole(side: Side, heel: Array, marked: Mapping[str, Array]) -> list[Array]:
    """Heel, metatarsal heads, of which some are `marked`, and toes, (T, 3) each."""
    heads = list(marked.values())
    if len(marked) == 1:
        ((name, head),) = marked.items()
        along = head - heel
        # The line from heel to head, turned by 90° to the left: towards the midline of the body for
        # the right foot.
        medial = np.stack([-along[:, 1], along[:, 0], np.zeros(len(along))], axis=1)
        medial *= 1.0 if side == "right" else -1.0
        heads += [head + share * medial for share in FOREFOOT[name]]
    return [heel, *heads, *(head + TOES * (head - heel) for head in heads)]


def _trajectories(
    recording: Recording, landmarks: Mapping[str, str], wanted: list[str]
) -> list[Array]:
    """Trajectories (T, 3) of the landmarks that the recording shows."""
    found = []
    for landmark in wanted:
        name = landmarks.get(landmark)
        if name in recording.names:
            path = recording.marker(name)
            if np.isfinite(path).any():
                found.append(path)
    return found


def _mean(paths: list[Array]) -> Array:
    """Mean of the trajectories; NaN where one is not seen, because the mean would jump."""
    return np.asarray(np.mean(paths, axis=0))
