"""The hip centres that moments are about: a record's are not where the model has them."""

from collections.abc import Mapping
from dataclasses import replace
from typing import Final

import numpy as np

from gaitval.arrays import Array
from gaitval.constants import GRAVITY
from gaitval.coordinates import SIDES
from gaitval.gait.cycle_curves import Curves

HIP_SIGNS: Final[Mapping[str, float]] = {"hip_flexion": 1.0, "hip_adduction": -1.0}
"""What a hip centre further forward and further outward adds to the moments about it under a
vertical force; the order is that of the columns of `ReferenceMotion.hip_centre`."""


def about_record(moment: Array, name: str, hip_centre: Array, vertical: Array) -> Array:
    """A net joint moment about the hip centre of the record instead of the model's.

    A hip that lies further forward has the force under its foot further back, which needs more
    flexion (or less extension); one that lies further outward has it further inward, which needs
    more abduction. Of the force through the hip only the ground's vertical part counts: the weight
    of the leg and the other components change the moment by less than a fifth of it.

    Parameters
    ----------
    moment : (...,) about the model's hip, any unit; flexion and adduction positive.
    name : of the coordinate, without a side; others than the hip's are returned as they are.
    hip_centre : (2,) m, of the side; see `ReferenceMotion.hip_centre`.
    vertical : (...,) force under the foot, in the moment's unit per metre.
    """
    if name not in HIP_SIGNS:
        return moment
    lever = HIP_SIGNS[name] * hip_centre[list(HIP_SIGNS).index(name)]
    return np.asarray(moment + lever * vertical)


def about_model(curves: Curves, hip_centre: Array) -> Curves:
    """The same `curves` with moments of the hips about the model's own hip centres.

    A moment about another point than the joint's gives another power.

    Parameters
    ----------
    curves : (n, 101) or (101,), moments Nm/kg about the record's hips, forces in body weights.
    hip_centre : (2, 2) m, right and left; see `ReferenceMotion.hip_centre`.
    """
    moments = dict(curves.moments)
    for place, side in zip(hip_centre, SIDES, strict=True):
        for name in HIP_SIGNS:
            curve = f"{name}_{side[0]}"
            if curve in moments and np.any(place):
                # body weights times g are N/kg
                vertical = curves.forces[f"vertical_{side[0]}"] * GRAVITY
                moments[curve] = about_record(moments[curve], name, -place, vertical)
    return replace(curves, moments=moments)
