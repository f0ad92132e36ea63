"""The body model from Python."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import cached_property
from pathlib import Path
from typing import Self

import pandas as pd

from gaitval.artefacts import replacing
from gaitval.errors import RecordError
from gaitval.interface.result import Result, value_frame
from gaitval.interface.subjects import Subject
from gaitval.inverse.marker_placement import place_markers
from gaitval.model.markers import MARKERS, ModelMarker, load_markers, save_markers
from gaitval.model.urdf import read_urdf, write_urdf
from gaitval.scaling import scaling
from gaitval.scaling.joint_centres import measure
from gaitval.scaling.marker_sets import load_marker_set, recognise


@dataclass(frozen=True, repr=False)
class ScaledBody(Result, scaling.ScaledBody):
    """`gaitval.scaling.scaling.ScaledBody` that prints itself.

    Attributes
    ----------
    model : 14 segments and 31 coordinates; lengths in m, masses in kg.
    table : how each segment was scaled.
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

    def title(self) -> str:
        """Name and mass."""
        return f"Body model {self.model.name}, {self.model.mass:.1f} kg"

    def summary(self) -> pd.DataFrame:
        """Length, mass and factor over the population's mean, of each segment."""
        return self.frame()[["segment", "length_m", "mass_kg", "factor"]]

    def to_frame(self) -> pd.DataFrame:
        """Length in m and mass in kg of each segment."""
        return value_frame(
            [
                *(("", f"{row.segment} length", row.length_m, "m") for row in self.table),
                *(
                    ("", f"{row.segment} mass", row.mass_kg, "kg")
                    for row in self.table
                    if row.mass_kg is not None
                ),
            ]
        )

    def save(self, path: str | Path) -> None:
        """Write `model.urdf` and `scaling.csv` into a folder, as `gaitval scale` does, and the
        markers, if there are any, as `markers.json`.
        """
        write_urdf(self.model, Path(path) / "model.urdf")
        with replacing(Path(path) / "scaling.csv") as temporary:
            self.frame().to_csv(temporary, index=False)
        if self.marker_set:
            save_markers(Path(path) / MARKERS, self.fitted, self.marker_set, self.standing)

    @classmethod
    def load(cls, path: str | Path) -> Self:
        """Read the folder that `save` or `gaitval scale` wrote, or `recording` in the folder of an
        import. Raises ModelError, ArtefactError.
        """
        rows = pd.read_csv(Path(path) / "scaling.csv").astype(object)
        rows = rows.where(rows.notna(), None)
        table = tuple(scaling.SegmentRow(**row) for row in rows.to_dict("records"))  # type: ignore[arg-type]
        stored = Path(path) / MARKERS
        fitted, marker_set, standing = load_markers(stored) if stored.is_file() else ((), "", {})
        return cls(read_urdf(Path(path) / "model.urdf"), table, marker_set, standing, fitted)


def scale(subject: Subject) -> ScaledBody:
    """Scale the body model to a person.

    Parameters
    ----------
    subject : mass in kg, stature in m, sex, and standing markers in m (x forward, y left, z up),
        measured lengths or lengths by tape measure.

    Returns
    -------
    ScaledBody
        Its mass is exactly the subject's. It has `markers` where the lengths are from those of a
        standing trial.

    Raises
    ------
    ScalingError
        The markers cannot be used, or the body that they give is not plausible.

    References
    ----------
    De Leva (1996), J. Biomech. 29:1223, table 4: masses, centres and inertias of the segments.

    Examples
    --------
    >>> import gaitval as gv
    >>> subject = gv.load_subject(5)
    >>> body = gv.scale(subject)
    >>> abs(body.model.mass - subject.mass_kg) < 1e-9
    True
    >>> body.summary().columns.tolist()
    ['segment', 'length_m', 'mass_kg', 'factor']
    """
    found = scaling.scale_subject(subject)
    if not subject.markers or subject.measurements:
        return ScaledBody(found.model, found.table)
    try:
        marker_set = recognise(subject.markers).name
    except RecordError:
        return ScaledBody(found.model, found.table)
    return ScaledBody(found.model, found.table, marker_set, subject.markers)
