"""Markers attached to the segments of a body model."""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from gaitval._internal.io.artefacts import write_json
from gaitval.coordinates import Side

MARKERS = "markers.json"
"""What `save_markers` writes, beside the model's URDF."""


@dataclass(frozen=True)
class ModelMarker:
    """A marker that is fixed to a segment.

    Attributes
    ----------
    name : as in the recording, after aliases are resolved.
    segment : one of `model.body.SEGMENTS`.
    position : (3,) m, in the segment's frame (REP-103 in the neutral pose).
    weight : weight of its squared distance in inverse kinematics, relative to the others.
    """

    name: str
    segment: str
    position: NDArray[np.float64]
    weight: float = 1.0


def save_markers(
    path: Path,
    markers: Sequence[ModelMarker],
    marker_set: str,
    standing: Mapping[str, Sequence[float]] | None = None,
    knees: Mapping[Side, float] | None = None,
) -> None:
    """Write the `markers` of a body to `path` as JSON, with the name or file of their `marker_set`;
    none where they are still to be placed by where each was in `standing`, (3,) m. `knees` m, by
    side, are where the middles of the knees are (`LoadedMotion.knees`), if markers show it.
    """
    rows = [{**vars(marker), "position": numbers_of(marker.position)} for marker in markers]
    places = {name: numbers_of(place) for name, place in (standing or {}).items()}
    values = {"marker_set": marker_set, "markers": rows, "standing": places}
    write_json(path, values if knees is None else values | {"knees": dict(knees)})


def numbers_of(place: Iterable[float]) -> list[float]:
    """A `place` for JSON."""
    return [float(value) for value in place]
