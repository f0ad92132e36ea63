"""Qualisys Track Manager's TSV export: `walk.tsv`, and `walk_f_1.tsv`, … for each force plate.

A file begins with lines of a name and its values. Markers are in mm. The force of a plate is in N,
its moment in Nm or Nmm by version, its centre of pressure in mm, all in the plate's axes or in the
laboratory's, as DESCRIPTION says. QTM writes the corners of the plate in the order of C3D.

Headers and columns are those that readers on GitHub meet (mocap and Bertec exports of several
versions), looked up in November 2026.
"""

import re
from collections.abc import Mapping
from functools import partial
from pathlib import Path
from typing import Final, NamedTuple

import numpy as np

from gaitval._internal.text.plain_numbers import plain_float
from gaitval.arrays import Array
from gaitval.errors import RecordError
from gaitval.mocap.force_plates import plate_axes, plate_or_fault
from gaitval.mocap.laboratory_forces import placed_plate
from gaitval.mocap.recording import Plate, Recording
from gaitval.mocap.separate_forces import with_plates
from gaitval.mocap.text_cells import cells_of, markers_named, numbers, positive
from gaitval.mocap.text_table import text_lines, with_gaps
from gaitval.units import FREE_MOMENT, MILLIMETRE

_QUADRANTS: Final = ("POSX_POSY", "NEGX_POSY", "NEGX_NEGY", "POSX_NEGY")
_MOMENTS: Final = {unit.name: unit.factor for unit in FREE_MOMENT.units}
_FORCE_COLUMNS: Final = 9

_PlateForces = tuple[float, float, tuple[Plate, ...]]


class _Table(NamedTuple):
    """Header by name, and the numbers."""

    header: dict[str, list[str]]
    values: Array


def read_qualisys_tsv(path: Path) -> Recording:
    """Read a trial that QTM exported as TSV (`path`, the markers' `NAME.tsv`), with the forces of
    the files beside it, `NAME_f_1.tsv` and so on. Markers are in m, in the laboratory's axes;
    empty, NULL, NaN and 0, 0, 0 are gaps. Plates have what acts on the person. Raises RecordError
    if the file is of another kind or truncated, header and rows disagree, or the forces are of
    another trial.
    """
    path = Path(path)
    table = _table(path, text_lines(path))
    if "MARKER_NAMES" not in table.header:
        raise RecordError(
            f"{path}: its header has no line MARKER_NAMES (there are "
            f"{', '.join(list(table.header)[:6]) or 'none'}), so it is not a TSV export of markers "
            "by QTM. Export 3D data as TSV with a header, or give the .c3d file."
        )
    names = [name for name in table.header["MARKER_NAMES"] if name]
    rate = positive(path, _first(table, "FREQUENCY"), "FREQUENCY (Hz)")
    values, start = _without_clock(path, table, 3 * len(names), rate)
    _check_count(path, table, "NO_OF_FRAMES", len(values))
    kept = markers_named(path, names)
    recording = Recording(
        source=str(path),
        axes="laboratory",
        names=tuple(names[i] for i in kept),
        markers=with_gaps(MILLIMETRE * values.reshape(len(values), -1, 3)[:, kept]),
        marker_rate=rate,
        start=start or 0.0,
    )
    beside = sorted(path.parent.glob(f"{_literal(path.stem)}_f_*{path.suffix}"), key=_number)
    if not beside:
        return recording
    force_rate, begin, plates = _forces(beside, recording)
    several = path.with_name(f"{path.stem}_f_*{path.suffix}")
    return with_plates(recording, several, plates, rate=force_rate, start=begin)


def read_qualisys_forces(path: Path, recording: Recording) -> _PlateForces:
    """Read the plates of a trial: that of `path`, `…_f_1.tsv`, and those beside it with other
    numbers. `recording` has the markers of the trial. Returns the rate Hz, the time of the first
    sample s, and the plates. Raises RecordError if a file is no force file of QTM, is truncated,
    lacks a corner, or is of another rate.
    """
    path = Path(path)
    named = re.fullmatch(r"(.*_f_)\d+", path.stem)
    files = [path]
    if named is not None:
        files = sorted(path.parent.glob(f"{_literal(named[1])}*{path.suffix}"), key=_number)
    return _forces(files if path in files else [path], recording)


def _literal(text: str) -> str:
    """A part of a file's name, of which no letter is a pattern."""
    return re.sub(r"([\[\]*?])", r"[\1]", text)


def _number(path: Path) -> tuple[int, str]:
    found = re.search(r"(\d+)$", path.stem)
    return (int(found[1]) if found else 0, path.stem)


def _forces(files: list[Path], recording: Recording) -> _PlateForces:
    found = [_plate(path, recording) for path in files]
    rates = {rate for rate, _, _ in found}
    counts = {len(plate.force) for _, _, plate in found}
    if len(rates) > 1 or len(counts) > 1:
        raise RecordError(
            f"{files[0]} and {len(files) - 1} more: the plates have {_listed(counts)} samples at "
            f"{_listed(rates)} Hz, but all of a trial have the same. Leave files of other trials "
            "out of the folder."
        )
    return found[0][0], found[0][1], tuple(plate for _, _, plate in found)


def _listed(values: set[float] | set[int]) -> str:
    return " and ".join(f"{value:g}" for value in sorted(values))


def _plate(path: Path, recording: Recording) -> tuple[float, float, Plate]:
    table = _table(path, text_lines(path))
    if "FORCE_PLATE_CORNER_POSX_POSY_X" not in table.header:
        raise RecordError(
            f"{path}: its header has no corner of a force plate "
            "(FORCE_PLATE_CORNER_POSX_POSY_X), so it is no force file of QTM, or was exported "
            "without a header. Export the force data as TSV with a header."
        )
    rate = positive(path, _first(table, "FREQUENCY"), "FREQUENCY (Hz)")
    values, begin = _without_clock(path, table, _FORCE_COLUMNS, rate)
    _check_count(path, table, "NO_OF_SAMPLES", len(values))
    force, moment, pressure = values[:, :3], values[:, 3:6], MILLIMETRE * values[:, 6:]
    corners = np.array([[_corner(path, table, q, axis) for axis in "XYZ"] for q in _QUADRANTS])
    corners = corners * MILLIMETRE
    area = np.cross(corners[0] - corners[1], corners[0] - corners[3])
    if not np.linalg.norm(area) > 1e-4:
        raise RecordError(
            f"{path}: the corners of the plate (FORCE_PLATE_CORNER_…) are "
            f"{np.round(corners, 3).tolist()} m, which span no plate, so its place is unknown. "
            "Enter them in QTM's project options and export again."
        )
    middle = corners.mean(axis=0)
    places: Mapping[str, Array | None] = {"the middle of the plate": middle}
    if "local" in " ".join(table.header.get("DESCRIPTION", [])).lower():
        axes = plate_axes(corners)
        force, moment, pressure = force @ axes.T, moment @ axes.T, pressure @ axes.T + middle
    else:
        places = {**places, "the origin": np.zeros(3)}
    name = _first(table, "FORCE_PLATE_NAME") or path.stem
    wrench = force, pressure, moment
    make = partial(placed_plate, path, name, recording, wrench, places, _MOMENTS, corners)
    plate = plate_or_fault(name, len(force), make)
    return rate, recording.start if begin is None else begin, plate


def _corner(path: Path, table: _Table, quadrant: str, axis: str) -> float:
    text = _first(table, f"FORCE_PLATE_CORNER_{quadrant}_{axis}")
    try:
        value = plain_float(text)
    except ValueError:
        value = np.nan
    if not abs(value) < 1e6:  # a kilometre
        raise RecordError(
            f"{path}: FORCE_PLATE_CORNER_{quadrant}_{axis} is {text or 'missing'!r}, but must be a "
            "length in mm: the place of the plate is unknown. Export the forces again."
        )
    return value


def _table(path: Path, lines: list[str]) -> _Table:
    header: dict[str, list[str]] = {}
    begin = 0
    for number, line in enumerate(lines):
        cells = cells_of(line, "\t")
        if cells and _is_number(cells[0]):
            break
        if not cells or not cells[0]:  # a first row may begin with a gap
            continue
        begin = number + 1
        if re.fullmatch(r"[A-Z][A-Z0-9_]*", cells[0]) and not _are_columns(cells):
            header[cells[0]] = cells[1:]
    # Nobody is seen in a row of tabs, but it is one of the frames.
    rows = [line for line in lines[begin:] if "\t" in line or line.strip()]
    if not rows or not header:
        raise RecordError(
            f"{path}: {'no rows of numbers' if header else 'no header of names in capitals'}, as "
            "QTM's TSV export has. Export the trial again, with a header, or give the .c3d file."
        )
    widths = [len(row.rstrip("\r\n").split("\t")) for row in rows[:-1]] or [
        len(rows[0].rstrip("\r\n").split("\t"))
    ]
    width = max(widths, key=widths.count)
    # rows may end with a tab
    return _Table(header, numbers(path, rows, begin + 1, width, "\t", fewest=width - 1))


def _are_columns(cells: list[str]) -> bool:
    """Whether a line of capitals is that of the columns: SAMPLE, TIME, FORCE_X, …"""
    return cells[0] in ("SAMPLE", "FRAME", "FORCE_X") and len(cells) > 2


def _is_number(text: str) -> bool:
    # with a decimal comma too, which is refused later by its name
    return re.fullmatch(r"[+-]?(\d+[.,]?\d*|[.,]\d+)(e[+-]?\d+)?|nan|null", text, re.I) is not None


def _first(table: _Table, name: str) -> str:
    values = table.header.get(name, [])
    return values[0] if values else ""


def _without_clock(
    path: Path, table: _Table, width: int, rate: float
) -> tuple[Array, float | None]:
    """The quantities (T, width), and the time of the first row, s: two columns may come before
    them, the number and the time of the sample. None if there are none.
    """
    values = table.values
    while values.shape[1] > width and np.isnan(values[:, -1]).all():
        values = values[:, :-1]
    extra = values.shape[1] - width
    if extra == 0:
        return values, None
    if extra != 2:
        raise RecordError(
            f"{path}: rows of {values.shape[1]} numbers, but the header names {width} quantities, "
            "with at most a frame and a time before them. Export the trial again."
        )
    time = values[:, 1]
    steps = np.diff(time)
    if not np.isfinite(time).all() or (
        len(steps) and np.abs(time - time[0] - np.arange(len(time)) / rate).max() > 0.5 / rate
    ):
        raise RecordError(
            f"{path}: the second column goes from {time[0]:g} to {time[-1]:g} s in {len(time)} "
            f"rows, but FREQUENCY is {rate:g} Hz. Export the trial again."
        )
    return values[:, 2:], float(time[0])


def _check_count(path: Path, table: _Table, name: str, seen: int) -> None:
    promised = _first(table, name)
    if promised and promised != str(seen):
        raise RecordError(
            f"{path}: {name} is {promised}, but there are {seen} rows: the file is truncated or "
            "was cut by hand. Export it again."
        )
