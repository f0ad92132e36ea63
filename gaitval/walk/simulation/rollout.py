"""The record of one rollout: a simulated walk."""

from dataclasses import dataclass, field, fields
from pathlib import Path
from typing import Final

import numpy as np

from gaitval._internal.io.artefacts import (
    array_names,
    check_arrays,
    check_times,
    read_arrays,
    write_arrays,
)
from gaitval.arrays import Array


@dataclass(frozen=True)
class Travel:
    """How far a simulated walk went and where its feet were on the ground, T samples, one every
    physics step (`time[1] - time[0]`): what is kept of a long walk, a tenth of a `Rollout`.

    Attributes
    ----------
    time : (T,) s.
    ground_reaction : (T, 2, 3) N, force of the ground on the right and the left foot, world axes.
    centre_of_mass : (T, 3) m, of the whole body, world.
    root_force : (T, 6) external force on the pelvis: moment Nm about its origin, force N. Zero
        except during a push.
    start_phase : (1,) phase at which the walk started.
    fell : (1,) 1 if it ended early, 0 if it reached its planned end.
    """

    time: Array
    ground_reaction: Array
    centre_of_mass: Array
    root_force: Array
    start_phase: Array
    fell: Array


SHAPES: Final = {
    "time": (0,),
    "ground_reaction": (0, 2, 3),
    "centre_of_mass": (0, 3),
    "root_force": (0, 6),
    "start_phase": (1,),
    "fell": (1,),
    "phase": (0,),
    "positions": (0, 31),
    "velocities": (0, 31),
    "moments": (0, 25),
    "centre_of_pressure": (0, 2, 3),
    "free_moment": (0, 2),
    "mu": (14,),
    "hip_centre": (2, 2),
}
"""Of the arrays of a `Rollout`; 0 is T, and those without it are of the whole walk."""


@dataclass(frozen=True)
class Rollout(Travel):
    """One simulated walk, whole; see `Travel` for its other arrays.

    Axes are REP-103 (x forward, y left, z up), SI units, radians. All of a row is of one instant:
    the engine is semi-implicit, so what it applies in the step that starts at a state is the force
    there, and the velocity there is the mean of those of the steps before and after. Moments times
    velocities, row by row, are then exactly the work that the engine did, and with central
    differences of the positions they obey Newton's law.

    Attributes
    ----------
    phase : (T,) reference phase of the right gait cycle, not wrapped.
    positions : (T, 31) in the order of `coordinates.COORDINATES` (root: rotation vector, origin).
    velocities : (T, 31) their rates as DART has them (root: angular, linear, world axes).
    moments : (T, 25) Nm, net joint moments (servo + feed-forward + passive damping), order of
        `coordinates.ACTUATED`, positive if they would increase the coordinate.
    centre_of_pressure : (T, 2, 3) m, of each foot, world; NaN while the foot is off the ground.
    free_moment : (T, 2) Nm, of the ground on each foot about the vertical through its centre of
        pressure, positive to the left; 0 while the foot is off the ground.
    mu : (14,) body parameters used in the simulation.
    hip_centre : (2, 2) m, of the record that the walk imitates; see
        `walk.reference.motion.ReferenceMotion`. Moments are about the model's hips all the same.
    """

    phase: Array
    positions: Array
    velocities: Array
    moments: Array
    centre_of_pressure: Array
    mu: Array
    free_moment: Array
    hip_centre: Array = field(default_factory=lambda: np.zeros((2, 2)), kw_only=True)

    def wrenches(self) -> Array:
        """(T, 2, 6) force N of the ground on the right and left foot and its moment Nm about the
        world's origin: what a force plate under each would feel. No moment below 1 N.
        """
        force = self.ground_reaction
        moment = np.cross(np.nan_to_num(self.centre_of_pressure), force)
        moment[..., 2] += self.free_moment
        return np.concatenate([force, moment], axis=-1)

    def save(self, path: Path) -> None:
        """Write as npz, in single precision except for time and phase."""
        write_arrays(
            path,
            {
                f.name: getattr(self, f.name)
                if f.name in ("time", "phase")
                else getattr(self, f.name).astype(np.float32)
                for f in fields(self)
            },
        )

    @classmethod
    def load(cls, path: Path) -> "Rollout":
        """Read what `save` wrote. Raises ArtefactError if the file is missing or damaged, or its
        time does not rise in even steps.
        """
        arrays = read_arrays(path, *array_names(cls))
        check_arrays(arrays, SHAPES, path, may_lack=("centre_of_pressure",))
        check_times(arrays["time"], path)
        return cls(**{name: np.asarray(each, dtype=float) for name, each in arrays.items()})
