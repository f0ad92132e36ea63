"""Read marker and force files of WBDS: Fukuchi, Fukuchi & Duarte (2018), PeerJ 6:e4640.

All in the laboratory's axes.
"""

import re
from functools import partial
from pathlib import Path
from typing import Final

import numpy as np

from gaitval.arrays import Array
from gaitval.errors import RecordError
from gaitval.mocap.force_plates import plate_or_fault
from gaitval.mocap.pressed_plates import pressed_plate
from gaitval.mocap.recording import Plate, Recording
from gaitval.mocap.text_table import XYZ, numbers_of, sample_rate, text_lines, with_gaps
from gaitval.units import MILLIMETRE

WBDS_MARKER_RATE: Final = 150.0
WBDS_FORCE_RATE: Final = 300.0
"""Hz; the force files of WBDS give the sample index instead of the time."""


def _tabbed(path: Path, kind: str, instead: str) -> tuple[list[str], Array]:
    """Header and numbers of a WBDS file of a `kind`; `instead` names other formats of such data."""
    lines = [line for line in text_lines(path) if line.strip()]
    header = [name.strip() for name in lines[0].split("\t")]
    if not header[0].lower().startswith("time"):
        raise RecordError(
            f"{path}: not a {kind} file that is read: the first column of a .txt must be Time, as "
            f"in WBDS, but is {header[0][:40]!r}. Give {instead}."
        )
    if len(lines) < 2:
        raise RecordError(
            f"{path}: no rows below the header: the file is truncated. Download it again."
        )
    return header, numbers_of(path, lines[1:], 2, len(header), separator="\t")


def read_wbds_markers(path: Path) -> Recording:
    """Read `path`, a `…mkr.txt` file of WBDS: `Time` in s, three columns (X, Y, Z, mm) for each
    marker. Raises RecordError if the columns differ, the file is truncated, or the times are not
    evenly spaced.
    """
    path = Path(path)
    header, table = _tabbed(path, "marker", "a .trc or .c3d")
    # Every third column is the x of a marker; its last letter is the axis.
    names = [column[:-1] for column in header[1::3]]
    expected = [name + axis for name in names for axis in "XYZ"]
    if header[0] != "Time" or header[1:] != expected or not names:
        wrong = next(
            (seen for seen, name in zip(header[1:], expected, strict=False) if seen != name),
            header[-1],
        )
        raise RecordError(
            f"{path}: not a marker file of WBDS: the columns must be Time and then X, Y, Z of "
            f"each marker, but column {wrong!r} is not. Download it again or give a .trc or .c3d."
        )
    rate = sample_rate(path, table[:, 0]) if len(table) > 1 else WBDS_MARKER_RATE
    return Recording(
        source=str(path),
        axes="laboratory",
        names=tuple(names),
        markers=with_gaps(table[:, 1:].reshape(len(table), -1, 3)) * MILLIMETRE,
        marker_rate=rate,
        start=float(table[0, 0]),
    )


def read_wbds_forces(path: Path) -> tuple[float, float, tuple[Plate, ...]]:
    """Read `path`, a `…grf.txt` file of WBDS; returns the rate Hz, the time of the first sample s
    (0), and the plates.

    `Time` is the sample's index at 300 Hz; each plate has Fx, Fy, Fz (N), COPx, COPy, COPz (mm) and
    Ty (Nmm), followed by the plate's number. On the treadmill, plate 1 is the left one. The
    treadmill's plates are not zeroed, which cannot be corrected from this file: prefer the C3D.

    Raises RecordError if the columns differ, the file is truncated, or a plate is incomplete.
    """
    path = Path(path)
    header, table = _tabbed(path, "force", "BioWare's text export, a .mot or .c3d")
    columns: dict[str, dict[str, int]] = {}
    for i, column in enumerate(header[1:], start=1):
        found = re.fullmatch(r"(F|COP|T)([xyz])_?(\d*)", column, flags=re.IGNORECASE)
        if found is None:
            raise RecordError(
                f"{path}: column {column!r} is not one of Fx, Fy, Fz, COPx, COPy, COPz, Ty "
                "followed by the plate's number. Download it again or give OpenSim's .mot."
            )
        quantity = found[1].upper() + found[2].lower()
        columns.setdefault(found[3] or "1", {})[quantity] = i
    plates = []
    for name, places in columns.items():
        wanted = ("Fx", "Fy", "Fz", "COPx", "COPy", "COPz", "Ty")
        missing = [quantity for quantity in wanted if quantity not in places]
        if missing:
            raise RecordError(
                f"{path}: plate {name} lacks {', '.join(missing)}: the file is truncated. "
                "Download it again."
            )
        force = table[:, [places[f"F{axis}"] for axis in XYZ]]
        point = table[:, [places[f"COP{axis}"] for axis in XYZ]] * MILLIMETRE
        torque = np.zeros_like(force)
        # y is up in WBDS, so the free moment is about y; Nmm to Nm.
        torque[:, 1] = table[:, places["Ty"]] * MILLIMETRE
        make = partial(pressed_plate, path, name, force, point, torque)
        plates.append(plate_or_fault(name, len(force), make))
    return WBDS_FORCE_RATE, 0.0, tuple(plates)
