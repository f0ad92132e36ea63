"""A reference motion as its title and a tidy table (`display.Displayed`)."""

import numpy as np
import pandas as pd

from gaitval.frames import FORCE, angle_curves, curve_frame, moment_curves, of_kind
from gaitval.reference.motion import ReferenceMotion


def title(reference: ReferenceMotion) -> str:
    """Length and speed of the cycle of a `reference`."""
    return f"Reference motion: stride time {reference.stride_time:.2f} s, {reference.speed:.2f} m/s"


def to_frame(reference: ReferenceMotion) -> pd.DataFrame:
    """Joint angles (deg), moments (Nm) and ground reaction (% of body weight) of a `reference`, of
    both sides at % of the right gait cycle. A moment that no record has is left out.
    """
    moments = moment_curves(reference.moments)
    forces = (
        (f"{axis}_{side}", 100.0 * reference.ground_reaction[:, i, j])
        for i, side in enumerate("rl")
        for j, axis in enumerate(("forward", "left", "up"))
    )
    return curve_frame(
        [
            *angle_curves(reference.positions),
            *(moment for moment in moments if np.any(moment[-1])),
            *((of_kind(name, FORCE), "% BW", each) for name, each in forces),
        ],
        at=100.0 * reference.phase,
    )
