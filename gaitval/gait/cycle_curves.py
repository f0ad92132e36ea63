"""Curves over the gait cycle by name: those of a record, and the names of all that are compared."""

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from gaitval.arrays import Array
from gaitval.coordinates import SIDES
from gaitval.gait.record import RECORDED_ANGLES, GaitRecord
from gaitval.gait.sampling import SAMPLES

if TYPE_CHECKING:
    from gaitval._internal.text.frames import NamedCurve

JOINT_ANGLES = RECORDED_ANGLES
PELVIS_ANGLES: tuple[str, ...] = ("pelvis_tilt", "pelvis_list", "pelvis_rotation")
JOINT_MOMENTS: tuple[str, ...] = ("hip_flexion", "hip_adduction", "knee_angle", "ankle_angle")
FORCES: tuple[str, ...] = ("forward", "medial", "vertical")
"""Components of the ground reaction; positive means the same on both feet."""


@dataclass(frozen=True)
class Curves:
    """Curves over each side's own gait cycle, by name with `_r` or `_l`.

    The last axis of all arrays has the 101 samples of the cycle; simulated ones are (n, 101) for n
    cycles, recorded ones (101,).

    Attributes
    ----------
    angles : rad, `JOINT_ANGLES` and `PELVIS_ANGLES`, signs of `GaitRecord`.
    moments : Nm/kg, `JOINT_MOMENTS`, positive where they would increase their coordinate.
    forces : body weights, `FORCES`, ground reaction on the foot.
    """

    angles: dict[str, Array]
    moments: dict[str, Array]
    forces: dict[str, Array]

    def named(self) -> "list[NamedCurve]":
        """Every curve in the unit of reports: deg, Nm/kg, % of body weight."""
        from gaitval._internal.text.frames import DEGREES, FORCE, MOMENT, of_kind

        return [
            *((name, "deg", DEGREES * each) for name, each in self.angles.items()),
            *((of_kind(name, MOMENT), "Nm/kg", each) for name, each in self.moments.items()),
            *((of_kind(name, FORCE), "% BW", 100.0 * each) for name, each in self.forces.items()),
        ]


def recorded_curves(record: GaitRecord) -> Curves:
    """The curves of a `record` at 101 points, names and signs as
    `gaitval.metrics.comparison.simulated_curves`.
    """
    phase = np.linspace(0.0, 1.0, SAMPLES)
    curves = Curves({}, {}, {})
    for side in SIDES:
        suffix, mirror = side[0], 1.0 if side == "right" else -1.0
        for name in (*JOINT_ANGLES, *PELVIS_ANGLES):
            curves.angles[f"{name}_{suffix}"] = record.angles[f"{name}_{suffix}"](phase)
        for name in JOINT_MOMENTS:
            curves.moments[f"{name}_{suffix}"] = record.moments[f"{name}_{suffix}"](phase)
        # phase 1 is the next heel strike, the same instant of the cycle as phase 0
        force = record.ground_reaction(side, phase % 1.0) * np.array([1.0, mirror, 1.0])
        for index, name in enumerate(FORCES):
            curves.forces[f"{name}_{suffix}"] = force[:, index]
    return curves
