"""A scaled body with the markers on its segments, and its folder."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import cached_property
from pathlib import Path
from typing import Self

import numpy as np

from gaitval._internal.io import file_gate
from gaitval._internal.io.artefacts import read_json
from gaitval.errors import ArtefactError
from gaitval.kinetics.inverse.marker_placement import place_markers
from gaitval.model.markers import MARKERS, ModelMarker, numbers_of, save_markers
from gaitval.model.urdf import read_urdf, write_urdf
from gaitval.scaling.joint_centres import measure
from gaitval.scaling.marker_sets import load_marker_set
from gaitval.scaling.scaling import ScaledBody
from gaitval.scaling.segments import ScaledSegment


@dataclass(frozen=True, repr=False)
class MarkedBody(ScaledBody):
    """A scaled body and where markers sit on it, if that is known.

    Attributes
    ----------
    marker_set : name or file of the marker set that `markers` are of; "" for a body without.
    standing : (3,) m, where each marker of the set was in standing; empty for a body without.
    fitted : markers on the segments where a session's fit placed them; `standing` is then empty.
    """

    marker_set: str = ""
    standing: Mapping[str, tuple[float, ...]] = field(default_factory=dict)
    fitted: tuple[ModelMarker, ...] = ()

    @cached_property
    def markers(self) -> tuple[ModelMarker, ...]:
        """Markers on the segments: as fitted, else placed by standing; empty for a body without.

        Raises ScalingError where the standing markers cannot be placed.
        """
        if self.fitted or not self.standing:
            return self.fitted
        marker_set = load_marker_set(self.marker_set)
        measured = measure(marker_set.on_landmarks(self.standing))
        return place_markers(self.model, measured, self.standing, marker_set).markers

    def save(self, path: str | Path) -> None:
        """Write `model.urdf` and `scaling.csv` into a folder, as the stage `scale` does, and the
        markers, if there are any, as `markers.json`.
        """
        write_urdf(self.model, Path(path) / "model.urdf")
        self.write_table(Path(path) / "scaling.csv")
        if self.marker_set:
            save_markers(Path(path) / MARKERS, self.fitted, self.marker_set, self.standing)

    @classmethod
    def load(cls, path: str | Path) -> Self:
        """Read the folder that `save` or the stage `scale` wrote, or `recording` in the folder of
        an import. Raises ModelError, ArtefactError.
        """
        rows = file_gate.csv_frame(Path(path) / "scaling.csv", ArtefactError).astype(object)
        rows = rows.where(rows.notna(), None)
        table = tuple(ScaledSegment(**row) for row in rows.to_dict("records"))  # type: ignore[arg-type]
        stored = Path(path) / MARKERS
        fitted, marker_set, standing = load_markers(stored) if stored.is_file() else ((), "", {})
        return cls(read_urdf(Path(path) / "model.urdf"), table, marker_set, standing, fitted)


def load_markers(path: Path) -> tuple[tuple[ModelMarker, ...], str, dict[str, tuple[float, ...]]]:
    """Markers, marker set and standing places that `save_markers` wrote to `path`. Raises
    ArtefactError for a missing or damaged file.
    """
    values = read_json(path)
    try:
        rows = [{**row, "position": np.array(row["position"], float)} for row in values["markers"]]
        standing = {name: tuple(numbers_of(place)) for name, place in values["standing"].items()}
        return tuple(ModelMarker(**row) for row in rows), str(values["marker_set"]), standing
    except (AttributeError, KeyError, TypeError, ValueError) as error:
        raise ArtefactError(
            f"{path}: not the markers of a body model ({error!r}); the file was edited or is of "
            "another version of gaitval. Write it again with what made the folder."
        ) from None
