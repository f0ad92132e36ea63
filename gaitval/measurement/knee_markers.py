"""Whether the markers of the knees are in walking where they are in standing."""

from collections.abc import Iterator, Mapping, Sequence
from typing import Final

import numpy as np

from gaitval.arrays import Array
from gaitval.gait.quality_flags import QualityFlag
from gaitval.model.body import SEGMENTS, BodyModel
from gaitval.model.markers import ModelMarker
from gaitval.model.tree import segment_frames
from gaitval.session.trial import WalkingTrial

LARGEST_KNEE_ASYMMETRY: Final = 0.004
"""m, by which the knees' markers may differ in how far forward of their places on the body they
are in walking: at most 2.7 mm in eleven children of McGill and five people of Geneva, Luxembourg
and Aalborg, patients among them; 5.4 to 12.5 mm with one marker 30 mm forward or back in the walk
only, which turns the knee by 5 to 8 degrees."""


def knee_warnings(
    model: BodyModel,
    markers: Sequence[ModelMarker],
    walks: Sequence[WalkingTrial],
    landmarks: Mapping[str, str],
) -> Iterator[QualityFlag]:
    """Warning about a knee's marker that is elsewhere on the leg in a walk than in standing: one at
    most, of that of all `walks` in which they differ most.

    The body (`model`, with its `markers`) is fitted to standing and walk, so each marker of the leg
    gives way a little. Skin does the same to both legs, so the difference of the two knees is what
    is seen of a marker that was moved. `landmarks` names the landmarks' markers; legs with other
    markers than each other are not compared.
    """
    placed = {marker.name: marker for marker in markers}
    found = []
    for walk in walks:
        right, left = (
            {mark[2:] for mark in landmarks if mark[:2] == f"{side}." and landmarks[mark] in there}
            for there in [placed.keys() & walk.recording.names]
            for side in "RL"
        )
        if right == left and "Knee" in right:
            frames = segment_frames(model, walk.kinematics.positions)
            knees = [placed[landmarks[f"{side}.Knee"]] for side in "RL"]
            found.append((walk.name, [_forward(frames, knee, walk) for knee in knees]))
    if not found:
        return
    name, (right_knee, left_knee) = max(found, key=lambda one: abs(one[1][0] - one[1][1]))
    if abs(right_knee - left_knee) > LARGEST_KNEE_ASYMMETRY:
        yield QualityFlag(
            "place of a knee's marker", " and ".join(landmarks[f"{side}.Knee"] for side in "RL"),
            abs(right_knee - left_knee), LARGEST_KNEE_ASYMMETRY, "m",
            f"in {name} they are {round(1000 * right_knee):+d} and {round(1000 * left_knee):+d} mm "
            "forward of their places on the body, which fits standing and walk (elsewhere within "
            f"{1000 * LARGEST_KNEE_ASYMMETRY:.0f} mm of each other): between the trials one of "
            "them was moved, by about four times the difference, or another marker of its leg, and "
            "the leg's angles are off by some degrees. Record both with the markers untouched",
        )  # fmt: skip


def _forward(frames: Array, marker: ModelMarker, walk: WalkingTrial) -> float:
    """m, mean over a walk of how far forward of its place on its segment a marker is."""
    segment = frames[:, SEGMENTS.index(marker.segment)]
    away = walk.recording.marker(marker.name) - segment[:, :3, 3]
    forward = np.einsum("ti,ti->t", segment[:, :3, 0], away) - marker.position[0]
    known = np.isfinite(forward) & walk.kinematics.converged
    return float(forward[known].mean()) if known.any() else 0.0
