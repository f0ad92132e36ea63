"""What a user gives to import a session."""

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Final, Literal, get_args

from gaitval.scaling.anthropometry import Sex
from gaitval.scaling.landmarks import Width, Widths

Tell = Callable[[str, str], None]

HipCentre = Literal["regression", "functional"]
"""Where the hip centres of the standing trial come from."""
HIP_CENTRES: Final[tuple[HipCentre, ...]] = get_args(HipCentre)


@dataclass(frozen=True)
class Request:
    """What the user gives.

    Attributes
    ----------
    static : file of the standing trial; the first of `trials` if there is none.
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
    functional : files of range-of-motion trials of the same session, from which hip centres and
        knee axes are found; a walking trial may be one.
    hip_centre : "functional" uses those hip centres whose error is small.
    no_plate : names of force plates that are left out of every trial.
    static_time : part of the standing trial, s; all of it when None.
    floor_m : height of what the person stands on in the standing trial, m.
    feet_flat : whether the feet are flat on the floor in standing.
    consistent : also find the smallest change of motion and masses that lowers the residuals, and
        use that motion for the moments.
    mirror : fill in a side that no trial shows with the other one's mirror image.
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
    functional: tuple[Path, ...] = ()
    hip_centre: HipCentre = "regression"
    no_plate: tuple[str, ...] = ()
    static_time: tuple[float, float] | None = None
    floor_m: float = 0.0
    feet_flat: bool = True
    consistent: bool = False
    mirror: bool = False

    @property
    def stands_in_walk(self) -> bool:
        """Whether there is no standing trial, and the pose is put together from the walk."""
        return self.static == self.trials[0]

    @property
    def widths(self) -> Widths:
        """Keyword arguments of scaling."""
        return {
            "knee_width": self.knee_width_m,
            "ankle_width": self.ankle_width_m,
            "elbow_width": self.elbow_width_m,
        }


def silent(step: str, message: str) -> None:
    """Report nothing."""
