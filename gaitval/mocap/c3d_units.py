"""The unit of length of a C3D file."""

from pathlib import Path
from typing import Final

import numpy as np

from gaitval.errors import RecordError
from gaitval.mocap.c3d_contents import Contents
from gaitval.mocap.recording import PERSON_SPREAD_M
from gaitval.mocap.repairs import passed_over
from gaitval.mocap.units import METRES, unit_factor

WHERE: Final = "POINT:UNITS"


def length_unit(path: Path, contents: Contents) -> float:
    """Metres of the unit of points, corners and origins of a C3D file.

    Programs of before 1998 write no `POINT:UNITS`. Then the only unit in which the points of a
    frame are as far apart as a person's markers is taken, with a warning. Raises RecordError if it
    is unknown, or if it is missing and none or several could be meant.
    """
    text = contents.text("POINT", "UNITS")
    if text.strip():
        return unit_factor(path, text, METRES, WHERE)
    points, hidden = contents.points, contents.residuals < 0
    seen = np.where((hidden | (points == 0.0).all(axis=2))[..., None], np.nan, points)
    seen = seen[np.isfinite(seen).all(axis=2).sum(axis=1) > 1]
    # The longest side of what the points fill, in the middle of all frames.
    extent = (np.nanmax(seen, axis=1) - np.nanmin(seen, axis=1)).max(axis=1)
    spread = float(np.median(extent)) if len(seen) else 0.0
    low, high = PERSON_SPREAD_M
    # In feet a child's legs would be as far apart as an adult is in metres; no program writes them.
    meant = [name for name, f in METRES.items() if name != "ft" and low <= f * spread <= high]
    if len(meant) != 1:
        raise RecordError(
            f"{path}: {WHERE} is missing, and the points of a frame spread over {spread:.3g}, "
            "which a person's markers do in none of the known units, or in several "
            f"({', '.join(METRES)}): set the right one in the program that made the file, and "
            "export again."
        )
    passed_over(
        f"{path}: {WHERE} is missing. The points of a frame spread over {spread:.3g}, as a "
        f"person's do in {meant[0]}, which is taken; also for the force plates"
    )
    return METRES[meant[0]]
