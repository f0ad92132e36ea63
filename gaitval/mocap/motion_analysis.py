"""Forces of Motion Analysis's Cortex: a `.forces` file beside the markers' TRC.

    [Force Data]
    NumberOfForcePlates=2
    SampleRate=1200.000000
    NumberOfSamples=6000
    #Sample  FX1  FY1  FZ1  X1  Y1  Z1  MZ1  FX2 …

Forces are in N; the centre of pressure is in mm, in the laboratory's axes. The free moment about
the vertical is in Nmm (as `read_forces` of github.com/BMClab/BMC has it) or, by other accounts, in
Nm; its size shows which. Looked up in November 2026.
"""

import re
from functools import partial
from pathlib import Path
from typing import Final

import numpy as np

from gaitval.arrays import Array
from gaitval.errors import RecordError
from gaitval.mocap.force_plates import certain_load, plate_or_fault
from gaitval.mocap.laboratory_forces import FEWEST, sign_on_person, vertical_of
from gaitval.mocap.pressed_plates import pressed_plate
from gaitval.mocap.recording import Plate, Recording
from gaitval.mocap.text_cells import numbers, positive
from gaitval.mocap.text_table import text_lines
from gaitval.units import FREE_MOMENT, MILLIMETRE, unit_of

_QUANTITIES: Final = ("fx", "fy", "fz", "x", "y", "z", "mz")
_HEADER: Final = ("NumberOfForcePlates", "SampleRate", "NumberOfSamples")


def read_motion_analysis_forces(
    path: Path, recording: Recording
) -> tuple[float, float, tuple[Plate, ...]]:
    """Read the `.forces` file `path`, whose first sample is at the time of the first marker frame.
    `recording` has the markers of the trial, whose axes the forces have. Returns the rate Hz, the
    time of the first sample s, and the plates with what acts on the person. Raises RecordError if
    the file is of another kind or truncated, header and columns disagree, or the unit of the free
    moment is not known.
    """
    path = Path(path)
    lines = text_lines(path)
    if lines[0].strip().lower() != "[force data]":
        raise RecordError(
            f"{path}: line 1 is {lines[0].strip()[:40]!r}, but a .forces file of Cortex begins "
            "with [Force Data]. Export the forces from Cortex again, or give OpenSim's .mot."
        )
    header = dict(
        (found[1].lower(), found[2].strip())
        for line in lines[1:10]
        if (found := re.match(r"\s*(\w+)\s*=(.*)", line))
    )
    missing = [name for name in _HEADER if name.lower() not in header]
    if missing:
        raise RecordError(
            f"{path}: {', '.join(missing)} missing in the first lines, so rate and size of the "
            "table are unknown. Export the forces from Cortex again."
        )
    rate = positive(path, header["samplerate"], "SampleRate (Hz)")
    titles = [i for i, line in enumerate(lines[:20]) if line.lstrip().lower().startswith("#sample")]
    if not titles:
        raise RecordError(
            f"{path}: no line of columns that begins with #Sample in the first 20 lines, so it is "
            "unclear what the numbers are. Export the forces from Cortex again."
        )
    names = [name.lower() for name in lines[titles[0]].split()[1:]]
    rows = [line for line in lines[titles[0] + 1 :] if line.strip()]
    _check_counts(path, header, names, rows)
    first, width = titles[0] + 2, len(names) + 1
    separator = "\t" if "\t" in rows[0] else " "
    if separator == " ":
        rows = [" ".join(row.split()) for row in rows]
    table = numbers(path, rows, first, width, separator)[:, 1:]
    plates = []
    for number in range(len(names) // 7):
        name, own = str(number + 1), table[:, 7 * number : 7 * number + 7]
        make = partial(_plate, path, name, own, recording)
        plates.append(plate_or_fault(name, len(own), make))
    return rate, recording.start, tuple(plates)


def _check_counts(path: Path, header: dict[str, str], names: list[str], rows: list[str]) -> None:
    wanted = [f"{name}{plate}" for plate in range(1, len(names) // 7 + 1) for name in _QUANTITIES]
    if names != wanted or not names:
        pairs = zip(names, wanted, strict=False)
        wrong = next((seen for seen, name in pairs if seen != name), names[-1:] and names[-1])
        raise RecordError(
            f"{path}: column {wrong or 'none'} is not where it belongs: each plate has FX, FY, FZ, "
            "X, Y, Z, MZ and its number, in this order. Export the forces from Cortex again."
        )
    for name, seen in (("NumberOfForcePlates", len(names) // 7), ("NumberOfSamples", len(rows))):
        if header[name.lower()] != str(seen):
            raise RecordError(
                f"{path}: {name} is {header[name.lower()]}, but there are {seen}: the file is "
                "truncated or was cut by hand. Export it again."
            )


def _plate(path: Path, name: str, table: Array, recording: Recording) -> Plate:
    force, point = table[:, :3], MILLIMETRE * table[:, 3:6]
    size = np.linalg.norm(force, axis=1)
    strong = certain_load(size)
    if np.count_nonzero(strong) < FEWEST:
        # No step on it: there is nothing to know the unit by, and nothing that needs it.
        return pressed_plate(path, name, force, np.nan_to_num(point), np.zeros_like(force))
    lever = float(np.nanmedian(np.abs(table[strong, 6]) / size[strong]))
    # Hardly any moment is hardly any in each unit.
    seen = unit_of(FREE_MOMENT, size=max(lever, FREE_MOMENT.low))
    if seen.unit is None:
        raise RecordError(
            f"{path}: MZ{name} is {lever:.2g} times the force (median under load), "
            f"{seen.sentence}. Give the .c3d file of the trial, or OpenSim's .mot."
        )
    torque = np.outer(seen.unit.factor * table[:, 6], vertical_of(force[strong]))
    sign = sign_on_person(recording, force, point)
    return pressed_plate(path, name, sign * force, point, sign * torque)
