"""A record as correct force plates would have measured it.

Two faults of plates show in a mean gait cycle. The mean vertical force of both feet is not one body
weight, which it is in every periodic motion: the plates' calibration, or the body mass, is off. And
the centre of pressure of a plate is too far forward or back, which changes the sagittal moments of
its leg by the vertical force times that distance (`experiments/plate_corrections.py` finds it).
"""

from collections.abc import Mapping
from dataclasses import replace
from typing import Annotated, Final

import numpy as np
from pydantic import Field

from gaitval.constants import STANDARD_GRAVITY
from gaitval.coordinates import SIDES, Side
from gaitval.gait.record import (
    HARMONICS,
    FiniteNumber,
    GaitRecord,
    StoredPart,
    periodic_through,
    weighted_sum,
)

SHIFT_SIGNS: Final[Mapping[str, float]] = {
    "hip_flexion": -1.0,
    "knee_angle": 1.0,
    "ankle_angle": -1.0,
}
"""Signs of what a force further forward adds to the internal moments of its leg: hip extension,
knee flexion and ankle plantarflexion increase."""

LOADED = 0.2
"""Body weights on a foot above which its moments are taken to be the ground's alone."""

_SAMPLES = 400


class PlateCorrection(StoredPart):
    """What was wrong with the plates of a record; `corrected` takes it away."""

    scale: Annotated[FiniteNumber, Field(gt=0.5, lt=2.0)] = 1.0
    """True force / measured force."""
    scale_sd: Annotated[FiniteNumber, Field(ge=0, lt=1.0)] = 0.0
    shift_right: Annotated[FiniteNumber, Field(gt=-0.2, lt=0.2)] = 0.0
    """m, by which the centre of pressure under the right foot is too far forward."""
    shift_right_sd: Annotated[FiniteNumber, Field(ge=0, lt=0.2)] = 0.0
    shift_left: Annotated[FiniteNumber, Field(gt=-0.2, lt=0.2)] = 0.0
    shift_left_sd: Annotated[FiniteNumber, Field(ge=0, lt=0.2)] = 0.0

    @property
    def shift(self) -> dict[Side, float]:
        """m, by side."""
        return {"right": self.shift_right, "left": self.shift_left}


def corrected(record: GaitRecord, plates: PlateCorrection) -> GaitRecord:
    """A new `record`, without the faults of its `plates`, such as those of
    `experiments/plate_corrections.py`; angles and events stay.

    Forces are multiplied by the scale. So are the moments of a loaded leg (those of a swinging leg
    come from its inertia; that of a loaded one adds a few hundredths Nm/kg, of which the scale's
    few percent are neglected). The shift changes the sagittal moments.
    """
    phase = np.arange(_SAMPLES) / _SAMPLES
    moments = dict(record.moments)
    for side in SIDES:
        vertical = record.ground_reaction(side, phase)[:, 2]
        # From 1 in swing to the scale at `LOADED`, linearly, so that the moments do not jump.
        loaded = 1.0 + (plates.scale - 1.0) * np.clip(vertical / LOADED, 0.0, 1.0)
        for name, curve in record.moments.items():
            if name[-1] != side[0]:
                continue
            sign = SHIFT_SIGNS.get(name[:-2], 0.0)
            # Body weights times g are N/kg, and times m Nm/kg. The shift is taken away from the
            # true force, so it is scaled as well.
            lever = sign * plates.shift[side] * plates.scale * vertical * STANDARD_GRAVITY
            moments[name] = periodic_through(curve(phase) * loaded - lever, HARMONICS.harmonics_cap)
    forces = {}
    for side in SIDES:
        forward, left, up = (weighted_sum([curve], [plates.scale]) for curve in record.forces[side])
        forces[side] = (forward, left, up)
    return replace(record, moments=moments, forces=forces)
