"""A force of one foot for the other, whose stance is longer or shorter."""

from functools import cache

import numpy as np

from gaitval.gait.mean_curves import FORCE_TOLERANCE
from gaitval.gait.record import PeriodicCurve, fit_periodic


@cache
def stretched(curve: PeriodicCurve, sign: float, shown: float, hidden: float) -> PeriodicCurve:
    """A `curve` of stance over the fraction `shown`, times a `sign`, over the fraction `hidden`."""
    if abs(shown - hidden) < 1e-9:
        return PeriodicCurve(
            sign * curve.mean,
            tuple(sign * value for value in curve.cosine),
            tuple(sign * value for value in curve.sine),
        )
    # As `mean_curves.fit_force` fits a force: in stance, and at the next heel strike.
    rows = np.append(np.arange(int(hidden * 100) + 1), 100) / 100
    values = sign * curve(np.where(rows < 1.0, rows * shown / hidden, 0.0))
    return fit_periodic(rows, values, FORCE_TOLERANCE)[0]
