"""Markers attached to the segments of a body model."""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from gaitval.artefacts import read_json, write_json
from gaitval.errors import ArtefactError

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
) -> None:
    """Write the markers of a body to `path` as JSON.

    Parameters
    ----------
    markers : on its segments; none where they are still to be placed by `standing`.
    marker_set : name or file of the set that they are of.
    standing : (3,) m, where each marker was in standing.
    """
    rows = [{**vars(marker), "position": _numbers(marker.position)} for marker in markers]
    places = {name: _numbers(place) for name, place in (standing or {}).items()}
    write_json(path, {"marker_set": marker_set, "markers": rows, "standing": places})


def _numbers(place: Iterable[float]) -> list[float]:
    return [float(value) for value in place]


def load_markers(
    path: Path,
) -> tuple[tuple[ModelMarker, ...], str, dict[str, tuple[float, ...]]]:
    """Markers, marker set and standing places that `save_markers` wrote to `path`. Raises
    ArtefactError for a missing or damaged file.
    """
    values = read_json(path)
    try:
        rows = [{**row, "position": np.array(row["position"], float)} for row in values["markers"]]
        standing = {name: tuple(_numbers(place)) for name, place in values["standing"].items()}
        return tuple(ModelMarker(**row) for row in rows), str(values["marker_set"]), standing
    except (AttributeError, KeyError, TypeError, ValueError) as error:
        raise ArtefactError(
            f"{path}: not the markers of a body model ({error!r}); the file was edited or is of "
            "another version of gaitval. Write it again with what made the folder."
        ) from None
