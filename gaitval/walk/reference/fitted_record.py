"""A record whose moments and forces are those of the motion that was fitted to it.

Of a slope or a load, only changes of angles and of the stride are published; moments and forces
follow from Newton's law in the fit (`walk.reference.dynamic_fit`). What a walk is drawn towards,
and told its distance from, must be those, not the level ones that the fit began from.
"""

from dataclasses import replace
from typing import Final

import numpy as np

from gaitval.arrays import Array
from gaitval.coordinates import ACTUATED, SIDES, Side
from gaitval.gait.record import GaitRecord, PeriodicCurve, periodic_through
from gaitval.walk.reference.motion import FEED_FORWARD, ReferenceMotion

_HARMONICS: Final = 40
_POINTS: Final = 256


def with_fitted_kinetics(record: GaitRecord, reference: ReferenceMotion, mass: float) -> GaitRecord:
    """`record` with the moments of `FEED_FORWARD` and the ground reaction of `reference`, which was
    fitted to it on a body of `mass` kg.
    """
    moments = dict(record.moments)
    forces: dict[Side, tuple[PeriodicCurve, PeriodicCurve, PeriodicCurve]] = {}
    for column, side in enumerate(SIDES):
        start = 0.0 if side == "right" else record.left_phase
        for name in FEED_FORWARD:
            values = reference.moments[:, ACTUATED.index(f"{name}_{side[0]}")] / mass
            moments[f"{name}_{side[0]}"] = _curve(reference, values, start)
        force = reference.ground_reaction[:, column]
        x, y, z = (_curve(reference, part, start) for part in force.T)
        forces[side] = (x, y, z)
    return replace(record, moments=moments, forces=forces)


def _curve(reference: ReferenceMotion, values: Array, start: float) -> PeriodicCurve:
    """`values` (N,) over the right cycle as a series over the cycle that begins at `start`."""
    phase, closed = np.append(reference.phase, 1.0), np.append(values, values[0])
    at = (np.arange(_POINTS) / _POINTS + start) % 1.0
    return periodic_through(np.interp(at, phase, closed), _HARMONICS)
