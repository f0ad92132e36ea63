"""An imported session, read from its folder."""

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Self

import numpy as np
import pandas as pd

from gaitval._internal.io import file_gate
from gaitval._internal.io.artefacts import copy_files, read_json
from gaitval._internal.io.text_tables import without_unit
from gaitval._internal.text.display import Displayed
from gaitval._internal.text.frames import DEGREES, FORCE, MOMENT, curve_frame, of_kind
from gaitval.arrays import Array
from gaitval.errors import ArtefactError
from gaitval.kinetics.inverse.scaled_markers import MarkedBody
from gaitval.metrics.recording_limits import CONSISTENT, state_of
from gaitval.metrics.tolerances import load_registry
from gaitval.session.importing.files import CURVES, FOLDER, RECORD, SUBJECT
from gaitval.subjects.subject import Subject
from gaitval.subjects.subject_file import load_subject

KINDS: Mapping[str, tuple[str, str, float]] = {
    "angle": ("", "deg", DEGREES),
    "moment": (MOMENT, "Nm/kg", 1.0),
    "force": (FORCE, "% BW", 100.0),
}
"""Of the columns of `curves.csv`: the word for a table, the unit, and what to multiply by."""


@dataclass(frozen=True, repr=False)
class Session(Displayed):
    """A laboratory's session, imported.

    Attributes
    ----------
    folder : with the files of the import.
    subject : for the main job; None without forces.
    body : the body model, fitted to the standing and the walking trial, with its markers.
    record : what `import.json` holds: decisions, figures of each trial, verdicts.
    curves : mean and standard deviation over the gait cycles, in rad, Nm/kg and body weights: the
        columns of `curves.csv` without their units.
    """

    folder: Path
    subject: Subject | None
    body: MarkedBody
    record: dict[str, Any]
    curves: pd.DataFrame

    def title(self) -> str:
        """Whose session, and its trials."""
        trials = ", ".join(trial["trial"] for trial in self.record["trials"])
        return f"Session of {self.record['person']['identifier']}: {trials}"

    def overview(self) -> pd.DataFrame:
        """Marker errors, residuals, weight on the plates and angles in standing against their
        limits. The verdict is "passed", "FAILED", or "not judged" (limits of residuals in N and Nm,
        of a motion without residual reduction).
        """
        return pd.DataFrame(limits_of_record(self.record))

    def to_frame(self) -> pd.DataFrame:
        """Mean joint angles (deg), joint moments (Nm/kg) and ground reaction (% of body weight) at
        0, 1, … 100 % of each side's gait cycle.
        """
        return curve_frame(
            self._curve(column.removesuffix("_mean"))
            for column in self.curves.columns
            if column.endswith("_mean") and column.partition("_")[0] in KINDS
        )

    def _curve(self, column: str) -> tuple[str, str, Array]:
        kind, _, name = column.partition("_")
        word, unit, factor = KINDS[kind]
        values = np.asarray(self.curves[f"{column}_mean"], dtype=float)
        return of_kind(name, word), unit, factor * values

    def save(self, path: str | Path) -> None:
        """Copy the files of the import into a folder, each whole or not at all."""
        files = [each for each in self.folder.glob(f"{FOLDER}/*") if each.is_file()]
        names = [f"{FOLDER}/{each.name}" for each in files]
        copy_files(self.folder, Path(path), (*names, *([SUBJECT] if self.subject else [])))

    @classmethod
    def load(cls, path: str | Path) -> Self:
        """Read the folder of an import. Raises ArtefactError where there is none."""
        folder = Path(path)
        if not (folder / FOLDER / RECORD).is_file():
            raise ArtefactError(
                f"{folder}: no {FOLDER}/{RECORD}, so no import ended here. Give the folder that "
                "`gaitval import --out` or import_session wrote."
            )
        subject = folder / SUBJECT
        return cls(
            folder=folder,
            subject=load_subject(subject) if subject.is_file() else None,
            body=MarkedBody.load(folder / FOLDER),
            record=read_json(folder / FOLDER / RECORD),
            curves=file_gate.csv_frame(folder / FOLDER / CURVES, ArtefactError).rename(
                columns=lambda name: without_unit(name)[0]
            ),
        )


def limits_of_record(record: Mapping[str, Any]) -> list[dict[str, Any]]:
    """The limits of an import from the contents `record` of `import.json`: a row each of quantity,
    target, value, limit, unit and verdict.
    """
    titles = {row.id: row.title for row in load_registry().tolerance}
    found = [
        (titles.get(row["id"], row["id"]), row["target"], row["id"], row)
        for row in record["verdicts"]
    ]
    found += [
        (row["name"], "standing", "", row) for row in record["placement"] if row["unit"] == "deg"
    ]
    return [
        {
            "quantity": quantity,
            "target": target,
            **{name: row[name] for name in ("value", "limit", "unit")},
            "verdict": state_of(known, row["passed"], reduced=target.endswith(CONSISTENT)),
        }
        for quantity, target, known, row in found
    ]
