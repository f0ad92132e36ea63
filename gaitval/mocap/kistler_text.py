"""Forces of Kistler plates as BioWare exports them: text with a column for each quantity.

A header is followed by a line of names, which begins with `abs time (s)`, and mostly by one of
units. For each plate there are either Fx, Fy, Fz, Ax, Ay (and Tz, if it was exported): force and
centre of pressure in the plate's axes; or its eight sensors Fx12, Fx34, Fy14, Fy23, Fz1 to Fz4.
Several plates have the same names again, or their number behind or before them. A Tz is that of
the plate of its number; without numbers, every plate has one or none has.

BioWare does not know where in the laboratory a plate is. `NAME.plates.toml` beside `NAME.txt`, or
`plates.toml` in its folder, says so, with a table for each plate in the order of the columns:

    [[plates]]
    corners = [[0.6, 0.4, 0.0], [0.0, 0.4, 0.0], [0.0, 0.0, 0.0], [0.6, 0.0, 0.0]]
    sensors = [0.2, 0.12]   # half the distances between the sensors along x and y, m
    depth = 0.054           # of the sensors below the surface, m

Corners are in m in the markers' axes, in C3D's order: by the quadrants of the plate's own axes, +x
+y, -x +y, -x -y, +x -y. `sensors` and `depth` are needed for the eight sensors only.

Names and units are those that readers on GitHub meet, looked up in November 2026. The polynomial
with which BioWare refines the centre of pressure is not applied to the eight sensors.
"""

import re
from collections.abc import Mapping, Sequence
from functools import partial
from pathlib import Path
from typing import Any, Final

import numpy as np

from gaitval._internal.io import file_gate
from gaitval._internal.io.artefacts import read_toml
from gaitval._internal.io.text_tables import separator_of
from gaitval.arrays import Array
from gaitval.errors import RecordError
from gaitval.mocap.force_plates import make_plate, plate_axes, plate_or_fault, plate_wrench
from gaitval.mocap.laboratory_forces import person_of
from gaitval.mocap.pressed_plates import measured_points
from gaitval.mocap.recording import Plate, Recording
from gaitval.mocap.repairs import passed_over
from gaitval.mocap.text_cells import cells_of, numbers
from gaitval.mocap.text_table import sample_rate, text_lines
from gaitval.mocap.wbds_text import read_wbds_forces
from gaitval.units import FORCE, LENGTH, MOMENT, TIME, stated_factor

_SENSORS: Final = ("fx12", "fx34", "fy14", "fy23", "fz1", "fz2", "fz3", "fz4")
_RESULTS: Final = ("fx", "fy", "fz", "ax", "ay")
_BEFORE: Final = re.compile(r"^(?:plate|fp)\s*(\d+)[\s_.:-]*")
"""A plate's number before the name of a column."""
_HEAD: Final = 16_384
"""Bytes of a file in which the line of names is."""
_LINES: Final = 60
"""Lines likewise."""


def read_kistler_text(path: Path, recording: Recording) -> tuple[float, float, tuple[Plate, ...]]:
    """Read BioWare's text export at `path`, or another text as WBDS's `grf.txt`, in N, m and Nm if
    it has no line of units. The first sample of both is at the time of the first marker frame.
    `recording` has the markers of the trial, which show which side of a plate is up. Returns the
    rate Hz, the time of the first sample s, and the plates with what acts on the person.

    Raises RecordError if the file is truncated or neither of these, a plate lacks a column, a unit
    is unknown; or the place of the plates is not said, or cannot be.
    """
    path = Path(path)
    with file_gate.opened(path, RecordError, largest=file_gate.SIZES.table) as file:
        head = file.read(_HEAD).decode("cp1252", "replace").splitlines()
    lines = [] if _names_at(head) is None else text_lines(path)
    at = _names_at(lines)
    if at is None:
        rate, _, of_wbds = read_wbds_forces(path)
        return rate, recording.start, of_wbds
    separator = separator_of(lines[at])
    names = cells_of(lines[at], separator)
    units, begin = _units(lines, at, separator, len(names))
    rows = [line for line in lines[begin:] if line.strip()]
    table = numbers(path, rows, begin + 1, len(names), separator)
    rate = sample_rate(path, _factor(path, "time", units[0]) * table[:, 0])
    found = _plates_of(path, at + 1, names)
    places, where = _places(path, len(found))
    plates = []
    for number, (columns, place) in enumerate(zip(found, places, strict=True), start=1):
        scaled = {
            name: table[:, at] * _factor(path, name, units[at]) for name, at in columns.items()
        }
        make = partial(_plate, path, where, str(number), scaled, place, recording)
        plates.append(plate_or_fault(str(number), len(table), make))
    return rate, recording.start, tuple(plates)


def _plain(name: str) -> str:
    """A name of a column in small letters, without its plate's number or unit."""
    plain = re.sub(r"\s*[\[(].*", "", name.strip()).lower()
    return _BEFORE.sub("", plain)


def _names_at(lines: Sequence[str]) -> int | None:
    for number, line in enumerate(lines[:_LINES]):
        names = [_plain(cell) for cell in cells_of(line, separator_of(line))]
        known = {re.sub(r"_?\d$", "", name) for name in names}
        if names[:1] and re.match(r"(abs )?time", names[0]) and (
            {"ax", "ay"} <= known or set(_SENSORS[:4]) & set(names)
        ):  # fmt: skip
            return number
    return None


def _units(lines: Sequence[str], at: int, separator: str, count: int) -> tuple[list[str], int]:
    """Units of the columns, empty where none are said, and the first line of numbers."""
    following = cells_of(lines[at + 1], separator) if at + 1 < len(lines) else []
    if following and not any(any(letter.isdigit() for letter in cell) for cell in following):
        return [*following, *[""] * count][:count], at + 2
    return [""] * count, at + 1


def _plates_of(path: Path, line: int, names: Sequence[str]) -> list[dict[str, int]]:
    """Columns of each plate: those of one number; without numbers, a name that comes again begins
    the next plate.
    """
    eight = "fx12" in map(_plain, names)
    wanted = _SENSORS if eight else _RESULTS
    found: list[tuple[str, dict[str, int]]] = []
    for place, name in enumerate(names):
        plain, number = _numbered(name, eight)
        if plain not in wanted and (eight or plain != "tz"):
            continue
        own = (plate for of, plate in found if of == number and plain not in plate)
        plate = next(own, None)
        if plate is None:
            plate = {}
            found.append((number, plate))
        plate[plain] = place
    plates = [plate for _, plate in found]
    without_number = ["tz" in plate for number, plate in found if not number]
    if len({*without_number}) > 1 or {"tz"} in [plate.keys() for plate in plates]:
        raise RecordError(
            f"{path}: line {line}: nothing shows of which plate a Tz is. Export Tz of every plate "
            "from BioWare, or of none."
        )
    for order, plate in enumerate(plates, start=1):
        missing = [name.capitalize() for name in wanted if name not in plate]
        if missing:
            raise RecordError(
                f"{path}: line {line}: plate {order} lacks {', '.join(missing)}, without which "
                f"its force has no place. Export {', '.join(n.capitalize() for n in wanted)} of "
                "every plate from BioWare."
            )
    without = [str(i) for i, plate in enumerate(plates, start=1) if "tz" not in plate]
    if without and not eight:
        passed_over(
            f"{path}: no column Tz of plate {', '.join(without)} (in the order of the columns), "
            "so the free moment there is taken as 0; export Tz of every plate from BioWare"
        )
    return plates


def _numbered(name: str, eight: bool) -> tuple[str, str]:
    """The plain name of a column and its plate's number, which may be before or behind it."""
    plain = _plain(name)
    before = _BEFORE.match(name.strip().lower())
    behind = None if eight else re.search(r"_?(\d+)$", plain)  # of the eight it is the sensor's
    number = before or behind
    return plain[: behind.start()] if behind else plain, number[1] if number else ""


def _factor(path: Path, name: str, unit: str) -> float:
    quantity = {"time": TIME, "a": LENGTH, "t": MOMENT}.get(
        name if name == "time" else name[0], FORCE
    )
    where = f"{path}: the unit of column {name.capitalize()}"
    return stated_factor(where, quantity, unit or quantity.units[0].name)


def _check_there(path: Path, plate: str, columns: Mapping[str, Array]) -> None:
    for name, values in columns.items():
        if not np.isfinite(values).all():
            row = int(np.flatnonzero(~np.isfinite(values))[0])
            raise RecordError(
                f"{path}: plate {plate}: column {name.capitalize()} is empty in sample {row + 1}, "
                "but a force has no gaps. Export the trial from BioWare again."
            )


def _places(path: Path, count: int) -> tuple[list[dict[str, Any]], Path]:
    """A table for each plate, and the file that has them."""
    tried = (path.with_suffix(".plates.toml"), path.with_name("plates.toml"))
    file = next((each for each in tried if each.exists()), None)
    if file is None:
        raise RecordError(
            f"{path}: BioWare does not say where in the laboratory its plates are, so the forces "
            f"have no place. Write their corners into {tried[0].name} beside it: a table "
            "[[plates]] for each, with corners = [[x, y, z], …] in m, in the markers' axes and the "
            "order of C3D."
        )
    tables = read_toml(file, RecordError, "Check the name and the folder").get("plates")
    if not isinstance(tables, list) or len(tables) != count:
        seen = len(tables) if isinstance(tables, list) else 0
        raise RecordError(
            f"{file}: {seen} tables [[plates]], but {path.name} has the columns of {count} plates, "
            "so it is unclear which is where. Write one for each, in the order of the columns."
        )
    return tables, file


def _numbers(where: str, table: Any, key: str, shape: tuple[int, ...], why: str) -> Array:
    given = table.get(key) if isinstance(table, dict) else None
    try:
        found = np.array(given, dtype=float)
    except (TypeError, ValueError):
        found = np.array(np.nan)
    if found.shape != shape or not (np.isfinite(found).all() and np.abs(found).max() < 1e3):
        raise RecordError(
            f"{where}: {key} is {given!r}, but {why}. Write it as the how-to on formats has it."
        )
    return found


def _plate(
    path: Path,
    places: Path,
    name: str,
    columns: Mapping[str, Array],
    place: Any,
    recording: Recording,
) -> Plate:
    where = f"{places}: plate {name}"
    corners = _numbers(where, place, "corners", (4, 3), "must be four points [x, y, z] in m")
    area = np.linalg.norm(np.cross(corners[0] - corners[1], corners[0] - corners[3]))
    if area < 1e-4:
        raise RecordError(
            f"{where}: corners {corners.tolist()} span no plate, so its place is unknown. Give the "
            "four corners in m, one after the other around the plate."
        )
    # The person is above the plate, whichever way its own z points, and is pushed up.
    upward = float(np.sign(plate_axes(corners)[:, 2] @ (person_of(recording) - corners.mean(0))))
    if "fx12" in columns:
        half = _numbers(where, place, "sensors", (2,), "must be [x, y] in m for the eight sensors")
        depth = _numbers(where, place, "depth", (), "must be a length in m for the eight sensors")
        channels = np.column_stack([columns[each] for each in _SENSORS])
        to_surface = abs(float(depth)) if upward > 0 else -abs(float(depth))
        force, moment = plate_wrench(3, channels, np.array([*half, to_surface]))
    else:
        torque = columns.get("tz", np.zeros_like(columns["fz"]))
        pushed = np.column_stack([columns[each] for each in _RESULTS[:3]])
        pressure = np.column_stack([columns["ax"], columns["ay"], np.zeros(len(pushed))])
        # BioWare may write 0 below a threshold of its own.
        pressure = measured_points(path, name, pushed, pressure)
        columns = {**columns, "ax": pressure[:, 0], "ay": pressure[:, 1]}
        channels = np.column_stack([*(columns[each] for each in _RESULTS), torque])
        force, moment = plate_wrench(1, channels, np.zeros(3))
    sign = -1.0 if upward * force[:, 2].sum() < 0.0 else 1.0
    _check_there(path, name, columns)
    return make_plate(name, corners, sign * force, sign * moment)
