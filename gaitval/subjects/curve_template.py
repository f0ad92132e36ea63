"""A table of mean curves to fill in, from a built-in subject, which `curve_files` reads back."""

from typing import Final

import numpy as np

from gaitval._internal.io.text_tables import csv_text
from gaitval.arrays import Array
from gaitval.coordinates import SIDES
from gaitval.gait.record import ANGLE_NAMES, MOMENT_NAMES
from gaitval.gait.sampling import SAMPLES
from gaitval.subjects.subject import Subject

_UNITS: Final = (
    "Mean curves for gaitval curves: replace the numbers of {name} by your own and keep the names.",
    "101 rows: percent 0 to 100 of each side's own gait cycle, from heel strike to heel strike.",
    "angle_*: degrees. Flexion, dorsiflexion, adduction, inversion, internal rotation, anterior "
    "tilt, own side up and own side forward are positive.",
    "moment_*: Nm/kg, internal, positive where they increase the angle.",
    "force_*: body weights, of the ground on the foot, forward, to the person's left, up; 0 in "
    "swing.",
    "Without moments and forces delete these columns (all of them) and give --stance. Columns of "
    "other names, such as percent, are left out. Lines that start with # are not read.",
)


def curves_of(subject: Subject) -> dict[str, Array]:
    """Mean curves (101,) of all that a subject's record has, in the units of the template."""
    record, phase = subject.measured(), np.linspace(0.0, 1.0, SAMPLES)
    found = {f"angle_{name}": np.degrees(record.angles[name](phase))
             for name in ANGLE_NAMES if name in record.angles}  # fmt: skip
    found |= {f"moment_{name}": record.moments[name](phase)
              for name in MOMENT_NAMES if name in record.moments}  # fmt: skip
    for side in SIDES if record.forces else ():
        # 100 % is the next heel strike: the last moment of swing, not the first of stance
        reaction = record.ground_reaction(side, np.minimum(phase, 1.0 - 1e-9))
        for axis, values in zip(("forward", "left", "up"), reaction.T, strict=True):
            found[f"force_{axis}_{side[0]}"] = values
    return found


def curve_template(subject: Subject) -> str:
    """CSV text with the columns of all curves that a subject's record has, and their units in lines
    that start with `#`.
    """
    columns = {"percent": [f"{row}" for row in range(SAMPLES)]}
    for name, curve in curves_of(subject).items():
        digits = 2 if name.startswith("angle_") else 4
        columns[name] = [f"{value:.{digits}f}" for value in curve]
    notes = "".join(f"# {line.format(name=subject.identifier)}\n" for line in _UNITS)
    return notes + csv_text([columns, *zip(*columns.values(), strict=True)])
