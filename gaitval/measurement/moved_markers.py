"""Whether each landmark's marker is in walking where it is in standing, by the fit to both.

The body is fitted to the standing trial and the walk together, so a marker that was moved between
them, or was another place's in one of them, is beside its place on the body all through the walk.
Skin moves markers as well, and on both sides alike: the right side less the left one is about a
millimetre in sound recordings, and a quarter to a half of what a marker was moved by.
"""

from collections.abc import Iterator, Mapping, Sequence
from typing import Final

import numpy as np

from gaitval.arrays import Array
from gaitval.gait.quality_flags import QualityFlag
from gaitval.model.body import SEGMENTS, BodyModel
from gaitval.model.markers import ModelMarker
from gaitval.model.tree import segment_frames
from gaitval.session.trial import WalkingTrial

MOVED: Final[Mapping[str, tuple[float, float, float]]] = {
    "ASIS": (0.0020, 0.0020, 0.0022),
    "Knee": (0.0040, 0.0065, 0.0040),
    "Ankle": (0.0025, 0.0035, 0.0035),
    "Heel": (0.0020, 0.0040, 0.0035),
    "MT1": (0.0045, 0.0045, 0.0040),
    "MT2": (0.0040, 0.0045, 0.0040),
    "MT5": (0.0040, 0.0045, 0.0040),
    "Toe": (0.0040, 0.0045, 0.0040),
}
"""m, forward, outward and up on the segment, by which right and left may differ. Of 18 recordings
of 18 people (nine of McGill, four of Stanford, others of Brazil and Plug-in Gait's samples) at
most 0.8, 0.7, 1.1 (ASIS), 2.0, 3.6, 1.6 (knee), 0.7, 1.5, 1.6 (ankle), 0.6, 1.9, 1.5 (heel) and
2.4, 2.2, 2.0 mm (forefoot)."""
KNOWN_BY: Final = frozenset((
    "displaced marker", "height of a foot's marker", "twist of the pelvis", "level of the pelvis",
    "lost marker", "straight line", "filled gap", "loose marker", "noise", "scale of the trials",
    "place of a knee's marker", "stuck coordinate",
))  # fmt: skip
"""Checks of warnings about what puts a marker beside its place too, or says so better."""
LEAST_FRAMES: Final = 20
WAYS: Final = (("forward", "back"), ("outward", "inward"), ("up", "down"))


def moved_warnings(
    model: BodyModel,
    markers: Sequence[ModelMarker],
    walks: Sequence[WalkingTrial],
    landmarks: Mapping[str, str],
) -> Iterator[QualityFlag]:
    """A warning about the landmark whose markers are most beside their places in a walk, on one
    side more than on the other: one at most. `markers` are on the `model`; `landmarks` names the
    landmarks' markers.
    """
    placed = {marker.name: marker for marker in markers}
    worst: tuple[float, str, str, int, float] | None = None
    for walk in walks:
        frames = segment_frames(model, walk.kinematics.positions)
        for landmark, limits in MOVED.items():
            pair = [placed.get(landmarks.get(f"{side}.{landmark}", "")) for side in "RL"]
            away = [None if one is None else _beside(frames, one, walk) for one in pair]
            if away[0] is None or away[1] is None:
                continue
            # outward is to the right on the right side
            apart = away[0] * [1.0, -1.0, 1.0] - away[1]
            axis = int(np.argmax(np.abs(apart) / limits))
            share = float(abs(apart[axis]) / limits[axis])
            if share > 1.0 and (worst is None or share > worst[0]):
                worst = share, walk.name, landmark, axis, float(apart[axis])
    if worst is None:
        return
    _, name, landmark, axis, size = worst
    names = [landmarks[f"{side}.{landmark}"] for side in "RL"]
    limit = MOVED[landmark][axis]
    yield QualityFlag(
        "place of a marker", " and ".join(names), abs(size), limit, "m",
        f"in {name}, {names[0]} is {1000 * abs(size):.1f} mm farther {WAYS[axis][size < 0.0]} "
        f"beside its place on the body, which fits standing and walk, than {names[1]} (elsewhere "
        f"within {1000 * limit:.1f} mm): one of them was moved between the trials, by two to four "
        "times as much, or another marker of its segment was. Angles of that leg, or of the "
        "pelvis, are some degrees off. Record both with the markers untouched",
    )  # fmt: skip


def _beside(frames: Array, marker: ModelMarker, walk: WalkingTrial) -> Array | None:
    """(3,) m on its segment, mean over a walk of where a marker is beside its place; None where it
    is hardly seen.
    """
    if marker.name not in walk.recording.names:
        return None
    segment = frames[:, SEGMENTS.index(marker.segment)]
    from_origin = walk.recording.marker(marker.name) - segment[:, :3, 3]
    beside = np.einsum("tij,ti->tj", segment[:, :3, :3], from_origin) - marker.position
    known = np.isfinite(beside).all(axis=1) & walk.kinematics.converged
    if known.sum() < LEAST_FRAMES:
        return None
    return np.asarray(beside[known].mean(axis=0))
