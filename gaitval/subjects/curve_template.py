"""A table of mean curves to fill in, from a built-in subject, which `curve_files` reads back."""

from typing import Final

import numpy as np

from gaitval._internal.io.text_tables import csv_text
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


def curve_template(subject: Subject) -> str:
    """CSV text with the columns of all curves that a subject's record has, and their units in lines
    that start with `#`.
    """
    record = subject.measured()
    phase = np.arange(SAMPLES) / (SAMPLES - 1)
    columns: dict[str, list[str]] = {"percent": [f"{100 * at:.0f}" for at in phase]}
    for name in ANGLE_NAMES:
        if name in record.angles:
            degrees = np.degrees(record.angles[name](phase))
            columns[f"angle_{name}"] = [f"{value:.2f}" for value in degrees]
    for name in MOMENT_NAMES:
        if name in record.moments:
            columns[f"moment_{name}"] = [f"{value:.4f}" for value in record.moments[name](phase)]
    for side in SIDES if record.forces else ():
        # 100 % is the next heel strike: the last moment of swing, not the first of stance
        reaction = record.ground_reaction(side, np.minimum(phase, 1.0 - 1e-9))
        for axis, values in zip(("forward", "left", "up"), reaction.T, strict=True):
            columns[f"force_{axis}_{side[0]}"] = [f"{value:.4f}" for value in values]
    notes = "".join(f"# {line.format(name=subject.identifier)}\n" for line in _UNITS)
    return notes + csv_text([columns, *zip(*columns.values(), strict=True)])
