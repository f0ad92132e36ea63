"""What a user gives to import a session."""

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

from gaitval.scaling.anthropometry import Sex
from gaitval.scaling.landmarks import Width

Tell = Callable[[str, str], None]


@dataclass(frozen=True)
class Request:
    """What the user gives.

    Attributes
    ----------
    static : file of the standing trial.
    trials : files of the walking trials, of the same session.
    forces : file of the ground reaction of each trial, if the trial's own file has none; as many as
        `trials`, or none.
    identifier : name of the subject.
    mass_kg, height_m, sex : of the person.
    marker_set : name or file; recognised by the markers' names when None.
    axes : as `axes.parse_axes` reads; found from the standing trial when None.
    knee_width_m, ankle_width_m, elbow_width_m : across the joint, of both sides or of each (right,
        left), for marker sets without medial markers.
    without_forces : kinematics only.
    no_plate : names of force plates that are left out of every trial.
    consistent : also find the smallest change of motion and masses that lowers the residuals, and
        use that motion for the moments.
    """

    static: Path
    trials: tuple[Path, ...]
    identifier: str
    mass_kg: float
    height_m: float
    sex: Sex
    forces: tuple[Path, ...] = ()
    marker_set: str | None = None
    axes: str | None = None
    knee_width_m: Width = None
    ankle_width_m: Width = None
    elbow_width_m: Width = None
    without_forces: bool = False
    no_plate: tuple[str, ...] = ()
    consistent: bool = False

    @property
    def widths(self) -> dict[str, Width]:
        """Keyword arguments of scaling."""
        return {
            "knee_width": self.knee_width_m,
            "ankle_width": self.ankle_width_m,
            "elbow_width": self.elbow_width_m,
        }


def silent(step: str, message: str) -> None:
    """Report nothing."""
