"""Joint moments of a trial as their title and a tidy table (`display.Displayed`)."""

import numpy as np
import pandas as pd

from gaitval.arrays import Flags
from gaitval.frames import MOMENT, curve_frame, of_kind
from gaitval.inverse.inverse_dynamics import InverseDynamics, residuals


def title(found: InverseDynamics) -> str:
    """Trial of what was `found`, and how large the residuals are."""
    known, where = _known(found), f"Joint moments of {found.source or 'a trial'}: "
    if not known.any() or not found.peak_external_force:
        return f"{where}in no frame is the ground reaction on both feet known"
    left = residuals(found, known)
    return (
        f"{where}{known.sum()} of {len(known)} frames known, residuals "
        f"{left.force_rms:.1f} N and {left.moment_rms:.1f} Nm RMS"
    )


def to_frame(found: InverseDynamics) -> pd.DataFrame:
    """The joint moments `found` (Nm/kg), and the lengths of the residual force (N) and moment (Nm),
    by time (s); NaN where they are not `known`.
    """
    moments = found.recorded_moments().items()
    rows = [
        *((of_kind(name, MOMENT), "Nm/kg", each / found.mass_kg) for name, each in moments),
        ("residual force", "N", np.linalg.norm(found.residual_force, axis=1)),
        ("residual moment", "Nm", np.linalg.norm(found.residual_moment, axis=1)),
    ]
    shown = [(name, unit, np.where(_known(found), each, np.nan)) for name, unit, each in rows]
    return curve_frame(shown, axis="time", at=found.time)


def _known(found: InverseDynamics) -> Flags:
    """(T,) whether a frame counts; all do if nobody said."""
    return np.ones(len(found.time), dtype=bool) if found.known is None else found.known
