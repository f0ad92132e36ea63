"""The import of a laboratory's session from Python."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Self, Unpack

import numpy as np
import pandas as pd

from gaitval.arrays import Array
from gaitval.artefacts import read_json
from gaitval.configuration import load_configuration
from gaitval.errors import ArtefactError
from gaitval.interface.bodies import ScaledBody
from gaitval.interface.result import DEGREES, Result, curve_frame, of_kind
from gaitval.interface.subjects import FORCE, MOMENT, Subject
from gaitval.session.importing import Options, import_files
from gaitval.session.request import Tell, silent
from gaitval.session.summary import limits_of_record
from gaitval.session.write import FOLDER, RECORD, SUBJECT
from gaitval.study.inputs import copy_files

CURVES = "curves.csv"
KINDS: Mapping[str, tuple[str, str, float]] = {
    "angle": ("", "deg", DEGREES),
    "moment": (MOMENT, "Nm/kg", 1.0),
    "force": (FORCE, "% BW", 100.0),
}
"""Of the columns of `curves.csv`: the word for a table, the unit, and what to multiply by."""


@dataclass(frozen=True, repr=False)
class Session(Result):
    """A laboratory's session, imported.

    Attributes
    ----------
    folder : with the files of the import.
    subject : for the main job; None without forces.
    body : the body model, fitted to the standing and the walking trial, with its markers.
    record : what `import.json` holds: decisions, figures of each trial, verdicts.
    curves : mean and standard deviation over the gait cycles, as `curves.csv` has them: rad,
        Nm/kg, body weights.
    """

    folder: Path
    subject: Subject | None
    body: ScaledBody
    record: dict[str, Any]
    curves: pd.DataFrame

    def title(self) -> str:
        """Whose session, and its trials."""
        trials = ", ".join(trial["trial"] for trial in self.record["trials"])
        return f"Session of {self.record['person']['identifier']}: {trials}"

    def summary(self) -> pd.DataFrame:
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
            if column.endswith("_mean")
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
            subject=Subject.load(subject) if subject.is_file() else None,
            body=ScaledBody.load(folder / FOLDER),
            record=read_json(folder / FOLDER / RECORD),
            curves=pd.read_csv(folder / FOLDER / CURVES),
        )


def import_session(
    static: str | Path | None,
    trials: str | Path | Sequence[str | Path],
    *,
    mass: float | None = None,
    height: float | None = None,
    sex: str,
    out: str | Path,
    config: str | Path | None = None,
    settings: Sequence[str] = (),
    tell: Tell = silent,
    **options: Unpack[Options],
) -> Session:
    """Turn a laboratory's recordings into a subject, as `gaitval import` does.

    It finds the axes and the marker set, cleans the markers, fits the body to the standing and the
    walking trials, and works out joint angles, joint moments and the mean gait cycle. It takes
    seconds for a walk over plates, a minute for long trials.

    Parameters
    ----------
    static : the standing trial: C3D, TRC; None puts a standing pose together from the walk.
    trials : the walking trials: C3D, TRC, WBDS mkr.txt; their cycles are pooled.
    mass, height : kg, m; left out if a C3D file knows them.
    sex : "F" or "M"; selects the segment tables.
    out : folder for the files; the subject is named after it.
    config : TOML file of settings, or the name of a built-in one, as for `--config`.
    settings : "section.key=value", as for `--set`.
    tell : called with each decision: the step, and a sentence.
    options : see `gaitval.session.importing.Options`: forces, marker_set, axes, knee_width,
        ankle_width, elbow_width, static_time, floor, feet_flat, functional, hip_centre, age,
        citation, licence, consistent, kinematics_only, mirror, no_plate, halves.

    Returns
    -------
    Session
        With its `subject`, for `run_study`, and its `body`, for `inverse_kinematics`. Lengths in m,
        masses in kg; axes x forward, y left, z up.

    Raises
    ------
    SubjectError
        A mass, a stature or a sex that cannot be.
    RecordError, ScalingError
        The files cannot be used; the message says which, why, and how to mend it.
    ArtefactError
        The folder cannot be written to.

    References
    ----------
    Hicks et al. (2015), J. Biomech. Eng. 137:020905: how marker errors and residuals are judged.

    Examples
    --------
    >>> import gaitval as gv
    >>> session = gv.import_session(
    ...     "stand.c3d", "walk.c3d", mass=74.3, height=1.725, sex="M", out="mine"
    ... )  # doctest: +SKIP
    >>> study = gv.run_study(session.subject, out="mine/run")  # doctest: +SKIP

    What cannot be true is refused before a file is read:

    >>> gv.import_session("stand.c3d", "walk.c3d", mass=74.3, height=172.5, sex="M", out="mine")
    Traceback (most recent call last):
    gaitval.errors.SubjectError: --height 172.5: this looks like centimetres. Give metres: --height
    1.725.
    """
    files = [trials] if isinstance(trials, str | Path) else trials
    import_files(
        static,
        files,
        Path(out),
        mass=mass,
        height=height,
        sex=sex,
        configuration=load_configuration(config, settings=settings),
        tell=tell,
        **options,
    )
    return Session.load(out)
