"""The body model from Python."""

from dataclasses import dataclass
from pathlib import Path
from typing import Self

import pandas as pd

from gaitval.artefacts import replacing
from gaitval.interface.result import Result, value_frame
from gaitval.interface.subjects import Subject
from gaitval.model.urdf import read_urdf, write_urdf
from gaitval.scaling import scaling


@dataclass(frozen=True, repr=False)
class ScaledBody(Result, scaling.ScaledBody):
    """`gaitval.scaling.scaling.ScaledBody` that prints itself.

    Attributes
    ----------
    model : 14 segments and 31 coordinates; lengths in m, masses in kg.
    table : how each segment was scaled.
    """

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
        """Write `model.urdf` and `scaling.csv` into a folder, as `gaitval scale` does."""
        write_urdf(self.model, Path(path) / "model.urdf")
        with replacing(Path(path) / "scaling.csv") as temporary:
            self.frame().to_csv(temporary, index=False)

    @classmethod
    def load(cls, path: str | Path) -> Self:
        """Read the folder that `save` or `gaitval scale` wrote. Raises ModelError."""
        rows = pd.read_csv(Path(path) / "scaling.csv").astype(object)
        rows = rows.where(rows.notna(), None)
        table = tuple(scaling.SegmentRow(**row) for row in rows.to_dict("records"))  # type: ignore[arg-type]
        return cls(read_urdf(Path(path) / "model.urdf"), table)


def scale(subject: Subject) -> ScaledBody:
    """Scale the body model to a person.

    Parameters
    ----------
    subject : mass in kg, stature in m, sex, and standing markers in m (x forward, y left, z up),
        measured lengths or lengths by tape measure.

    Returns
    -------
    ScaledBody
        Its mass is exactly the subject's.

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
    return ScaledBody(found.model, found.table)
