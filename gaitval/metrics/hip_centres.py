"""The hip centres that a record's moments are about, and what taking them into account changes."""

import numpy as np

from gaitval.arrays import Array
from gaitval.coordinates import SIDES
from gaitval.gait.cycle_curves import Curves
from gaitval.metrics.comparison import rms
from gaitval.metrics.walk_results import HipCentre, HipCentres
from gaitval.reference.hip_moments import HIP_SIGNS, about_model


def hip_centres(places: Array, walked: Curves, recorded: Curves) -> HipCentres | None:
    """Where the record's hip centres are (`places` (2, 2) m, `ReferenceMotion.hip_centre`), and the
    errors of the moments about the model's own; None if they are the model's own, or a side has no
    complete gait cycle. `walked` and `recorded` are mean curves (101,): moments Nm/kg, those walked
    about `places`; forces body weights.
    """
    names = [f"{name}_{side[0]}" for side in SIDES for name in HIP_SIGNS]
    if not np.any(places) or any(name not in walked.moments for name in names):
        return None
    own, found = about_model(walked, places).moments, {}
    for (forward, outward), side in zip(places, SIDES, strict=True):
        errors = {
            name: rms(own[f"{name}_{side[0]}"] - recorded.moments[f"{name}_{side[0]}"])
            for name in HIP_SIGNS
        }
        found[side] = HipCentre(
            forward=float(forward), outward=float(outward), rmse_about_model=errors
        )
    return HipCentres(right=found["right"], left=found["left"])
