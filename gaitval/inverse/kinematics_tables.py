"""Joint angles of a trial as their title and a tidy table (`display.Displayed`)."""

import numpy as np
import pandas as pd

from gaitval.coordinates import ACTUATED, COORDINATES
from gaitval.frames import angle_curves, curve_frame
from gaitval.inverse.inverse_kinematics import InverseKinematics, marker_errors


def title(found: InverseKinematics) -> str:
    """Trial of what was `found`, length, distance of measured and model markers."""
    what = f"Joint angles of {found.source or 'a trial'}"
    length = f"{len(found.positions)} frames"
    if found.time is not None:
        length = f"{found.time[-1] - found.time[0]:.2f} s"
    return f"{what}: {length}, markers {1000 * marker_errors(found).whole_rms:.1f} mm RMS"


def to_frame(found: InverseKinematics) -> pd.DataFrame:
    """The joint angles `found` (deg) by time (s), of the coordinates that the markers show; by
    frame where the time is not known.
    """
    ever = np.asarray(found.determined.any(axis=0))
    shown = [name for name in ACTUATED if ever[COORDINATES.index(name)]]
    curves = angle_curves(found.positions, shown)
    if found.time is None:
        return curve_frame(curves, axis="frame", at=np.arange(float(len(found.positions))))
    return curve_frame(curves, axis="time", at=found.time)
