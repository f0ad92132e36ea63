"""A simulated walk as a user of Python has it: it prints itself, becomes a table, is saved."""

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, ClassVar, Self

import numpy as np

from gaitval._internal.io.artefacts import check_arrays, check_times
from gaitval._internal.text.display import Saved
from gaitval.walk.simulation.rollout import SHAPES, Rollout

if TYPE_CHECKING:
    import pandas as pd


@dataclass(frozen=True, repr=False)
class SimulatedWalk(Saved, Rollout):
    """A rollout, and who walked; `save` keeps double precision.

    Attributes
    ----------
    walker : name of the subject.
    mass_kg : of the body that walked.
    """

    KIND: ClassVar[str] = "Rollout"

    walker: str
    mass_kg: float

    @classmethod
    def load(cls, path: str | Path) -> Self:
        """Read what `save` wrote. Raises ArtefactError if the file is missing or damaged."""
        found = super().load(path)
        arrays = {name: np.asarray(getattr(found, name)) for name in SHAPES}
        check_arrays(arrays, SHAPES, Path(path), may_lack=("centre_of_pressure",))
        check_times(arrays["time"], Path(path))
        return found

    def title(self) -> str:
        """Who walked, how far."""
        ended = "fell" if self.fell[0] else "did not fall"
        distance = self.centre_of_mass[-1, 0] - self.centre_of_mass[0, 0]
        return f"Walk of {self.walker}: {self.time[-1]:.2f} s, {distance:.2f} m, {ended}"

    def to_frame(self) -> "pd.DataFrame":
        """Joint angles (deg) and joint moments (Nm) by time (s)."""
        from gaitval._internal.text.frames import angle_curves, curve_frame, moment_curves

        curves = [*angle_curves(self.positions), *moment_curves(self.moments)]
        return curve_frame(curves, axis="time", at=self.time)
