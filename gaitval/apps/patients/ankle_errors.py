"""How far the ankle moments that are expected of an amputee are off, measured in others.

`ankle_errors.csv` has it: the root mean square over amputees whose ankle moments were measured,
each expected without their own. `experiments/sound_sides.py` computes it.
"""

from typing import Final, NamedTuple

import numpy as np

from gaitval.apps.patients.sound_side import rows_of
from gaitval.arrays import Array
from gaitval.coordinates import Side
from gaitval.measurement.sources import NINETY

ERRORS: Final = "ankle_errors.csv"


class AnkleError(NamedTuple):
    """Errors of one kind of side.

    Attributes
    ----------
    people : in whom they were measured.
    mean : Nm/kg, RMS over the cycle, mean of the people.
    half : (101,) Nm/kg, half of the width of a band of 90 % at each percent of the cycle.
    """

    people: int
    mean: float
    half: Array


def ankle_error(side: Side, prosthesis: Side | None) -> AnkleError:
    """Those of a `side` of an amputee with a `prosthesis`."""
    kind = "prosthetic" if side == prosthesis else "sound"
    (row,) = (each for each in rows_of(ERRORS) if each["side"] == kind)
    points = np.array([float(row[f"p{each}"]) for each in range(101)])
    return AnkleError(int(row["people"]), float(row["mean"]), NINETY * points)
