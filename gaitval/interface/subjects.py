"""Subjects from Python."""

from dataclasses import replace
from pathlib import Path
from typing import Literal, Self

import numpy as np
import pandas as pd

from gaitval.arrays import Array
from gaitval.artefacts import write_text
from gaitval.coordinates import SIDES, Side
from gaitval.datasets import subject as stored
from gaitval.datasets import subject_file
from gaitval.interface.result import DEGREES, Result, curve_frame, of_kind, value_frame
from gaitval.metrics.comparison import Curves, recorded_curves

MOMENT, FORCE = "moment", "ground reaction"
"""Words that follow a curve's name in a table, so that it is not taken for an angle."""


class Subject(Result, stored.Subject):
    """`gaitval.datasets.subject.Subject` that prints itself and has a table of its curves."""

    def title(self) -> str:
        """Name, person and trial."""
        return f"Subject {self.identifier} ({self.source})"

    def summary(self) -> pd.DataFrame:
        """Build and gait, in SI units."""
        return value_frame(
            [
                ("", "mass", self.mass_kg, "kg"),
                ("", "height", self.height_m, "m"),
                ("", "leg length", self.leg_length_m, "m"),
                ("", "walking speed", self.walking_speed_m_s, "m/s"),
                ("", "stride time", self.stride_time_s, "s"),
                ("right", "stance fraction", self._stance("right"), "1"),
                ("left", "stance fraction", self._stance("left"), "1"),
            ]
        ).drop(columns="percent")

    def to_frame(self) -> pd.DataFrame:
        """Recorded joint angles (deg), joint moments (Nm/kg) and ground reaction (% of body
        weight) at 0, 1, … 100 % of each side's gait cycle. An angle has its coordinate's name
        (`knee_angle`), the moment about it "moment" after that (`knee_angle moment`). A side that
        was not recorded (`origin`) has no rows.
        """
        curves = recorded_curves(self.record())

        def recorded(
            values: dict[str, Array], kind: Literal["angles", "kinetics"]
        ) -> dict[str, Array]:
            origin = {side[0]: self.origin(side, kind) for side in SIDES}
            return {n: v for n, v in values.items() if origin[n[-1]] == "recorded"}

        return curve_frame(
            named_curves(
                replace(
                    curves,
                    angles=recorded(curves.angles, "angles"),
                    moments=recorded(curves.moments, "kinetics"),
                    forces=recorded(curves.forces, "kinetics"),
                )
            )
        )

    def _stance(self, side: Side) -> float:
        """Stance fraction of a side; NaN if it was not recorded."""
        value = self.stance_fraction.of(side)
        return np.nan if value is None or self.origin(side, "stance") != "recorded" else value

    def __str__(self) -> str:
        return repr(self)

    def save(self, path: str | Path) -> None:
        """Write the subject's TOML file."""
        write_text(Path(path), self.to_toml())

    @classmethod
    def load(cls, path: str | Path) -> Self:
        """Read a subject's TOML file. Raises SubjectError."""
        return cls.model_validate(subject_file.load_subject(Path(path)).model_dump())


def named_curves(curves: Curves) -> list[tuple[str, str, Array]]:
    """Name, unit of reports and values of every curve."""
    return [
        *((name, "deg", DEGREES * angle) for name, angle in curves.angles.items()),
        *((of_kind(name, MOMENT), "Nm/kg", each) for name, each in curves.moments.items()),
        *((of_kind(name, FORCE), "% BW", 100.0 * each) for name, each in curves.forces.items()),
    ]


def load_subject(name_or_path: str | int | Path) -> Subject:
    """A built-in subject, or one of a subject file.

    Parameters
    ----------
    name_or_path : 5, "5", "S05", the dataset's name "WBDS14", or the path of a .toml file.

    Returns
    -------
    Subject
        Mass in kg, lengths in m, speed in m/s; standing markers in m (x forward, y left, z up);
        the mean gait cycle of each side.

    Raises
    ------
    SubjectError
        There is no such subject, or the file has problems (all are listed).

    References
    ----------
    Fukuchi, Fukuchi, Duarte (2018), PeerJ 6:e4640: the built-in subjects are computed from it.

    Examples
    --------
    >>> import gaitval as gv
    >>> subject = gv.load_subject(5)
    >>> subject.identifier
    'S05'
    >>> list(subject.to_frame().columns)
    ['side', 'quantity', 'percent', 'value', 'unit']
    """
    return Subject.model_validate(subject_file.load_subject(name_or_path).model_dump())
