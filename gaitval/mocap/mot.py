"""Read MOT and STO, the tables of OpenSim, and the forces in them.

https://opensimconfluence.atlassian.net/wiki/spaces/OpenSim/pages/53089999. All in the laboratory's
axes.
"""

import re
from collections.abc import Mapping, Sequence
from functools import partial
from pathlib import Path
from typing import Final

import numpy as np

from gaitval._internal.text.plain_numbers import plain_float
from gaitval.arrays import Array
from gaitval.errors import RecordError
from gaitval.mocap.force_plates import UNLOADED_N, plate_or_fault
from gaitval.mocap.mot_writing import StorageTable
from gaitval.mocap.pressed_plates import pressed_plate
from gaitval.mocap.recording import DeviceTorque, Plate
from gaitval.mocap.repairs import passed_over
from gaitval.mocap.text_table import (
    XYZ,
    counted,
    cut_off,
    numbers_of,
    sample_rate,
    sound_rows,
    text_lines,
)

VERSIONS: Final = ("0", "1", "2", "3")
"""Of the header: OpenSim 4.5 writes 1 (`Storage`) and 3 (`STOFileAdapter`), and reads those
before."""


def read_storage(path: Path) -> StorageTable:
    """Read a MOT or STO file of numbers, of any version of its header.

    It understands `nRows=`, `nColumns=`, `inDegrees=` (version 1), `DataRate=`, `DataType=`
    (version 3; each number of a cell with several, as of Vec3, is a column) and `name`, `datarows`,
    `datacolumns`, `range` (SIMM), with or without a name in the first line. As in OpenSim a key
    ends at a blank or `=`, the time may be in any column, and the `range` of SIMM is that of the
    times of a file without them. The unit of angles is that of `inDegrees`, else of the words
    "Angles are in degrees." or radians; a header of neither is in degrees if it has no version, or
    0 (OpenSim 1 and SIMM): OpenSim 4 says "assuming rotations in Degrees".

    Parameters
    ----------
    path : the file.

    Raises
    ------
    RecordError
        The file is of another kind or cut off in a row, a column appears twice, the time is
        missing, `inDegrees` is neither yes nor no, or the version is unknown. Counts of the header
        unlike the rows are a `RecordWarning`.
    """
    path = Path(path)
    lines = text_lines(path)
    ends = [i for i, line in enumerate(lines) if line.strip().lower() == "endheader"]
    if not ends:
        raise RecordError(
            f"{path}: not a MOT or STO file: no line `endheader`. Give a file in OpenSim's "
            "format; if this is one, it is truncated: export it again."
        )
    header, words = _header(path, lines[: ends[0]])
    numbered = [(i, s) for i, s in enumerate(lines[ends[0] + 1 :], ends[0] + 2) if s.strip()]
    if not numbered:
        raise RecordError(f"{path}: nothing follows the header: truncated. Export it again.")
    labels = numbered[0][1].split()
    at = next((i for i, name in enumerate(labels) if name.lower() == "time"), None)
    if at is None and "range" not in header:
        raise RecordError(
            f"{path}: line {numbered[0][0]}: a column must be named time, but the first "
            f"is {labels[0]!r}. Export the file again."
        )
    twice = sorted({name for name in labels if labels.count(name) > 1})
    if twice:
        raise RecordError(
            f"{path}: column {twice[0]} appears {labels.count(twice[0])} times. Keep one."
        )
    rows = _as_many_as_said(path, header, labels, numbered[1:])
    if not rows:
        raise RecordError(f"{path}: no rows. Export the file again.")
    count = COMPONENTS[header.get("datatype", "double").lower()]
    if count > 1:
        labels, rows = _flattened(labels, rows, count)
        at = None if at is None else next(i for i, n in enumerate(labels) if n.lower() == "time")
    table = numbers_of(path, [row for _, row in rows], rows[0][0], len(labels), separator=None)
    if at is None:
        times = _range(path, header["range"], len(table))
    else:
        times, table = table[:, at], np.delete(table, at, axis=1)
        labels = labels[:at] + labels[at + 1 :]
    kept = sound_rows(path, times)
    # The name is optional: a first line with `=` is part of the header already.
    name = header.get("name", "")
    if not name and ends[0] and "=" not in lines[0]:
        name = lines[0].strip()
    return StorageTable(
        columns=tuple(labels),
        time=times[:kept],
        values=table[:kept],
        in_degrees=_in_degrees(path, header, words),
        name=name or path.stem,
    )


def _as_many_as_said(
    path: Path, header: Mapping[str, str], labels: Sequence[str], rows: list[tuple[int, str]]
) -> list[tuple[int, str]]:
    """The `rows` of a file, held against what its `header` says of rows and columns."""
    for what, keys, seen in (
        ("columns", ("ncolumns", "datacolumns"), len(labels)),
        ("rows", ("nrows", "datarows"), len(rows)),
    ):
        promised = next((header[key] for key in keys if key in header), str(seen))
        if promised != str(seen):
            if what == "rows" and rows and len(rows[-1][1].split()) < len(labels):
                raise cut_off(path, "the header's count of rows", promised, seen)
            counted(path, f"the header's count of {what}", promised, seen, what)
            # A row that the file's end cut in a number looks whole.
            if what == "rows" and promised.isdigit() and 1 < seen < int(promised):
                rows.pop()
    return rows


KEYS: Final = "name|datacolumns|datarows|ncolumns|nrows|indegrees|version|range|datarate|datatype"
"""Keys of headers that a blank may part from their value."""


COMPONENTS: Final = {"double": 1, "vec3": 3, "quaternion": 4, "spatialvec": 6}
"""Numbers in a cell by the `DataType` of the header; they are parted by commas."""


def _flattened(
    labels: Sequence[str], rows: Sequence[tuple[int, str]], count: int
) -> tuple[list[str], list[tuple[int, str]]]:
    """A table of `count` numbers in each cell but that of the time as one of single numbers, with
    the names that OpenSim's `flatten` gives them: force_1, force_2, force_3.
    """
    names = [
        name
        for label in labels
        for name in (
            [label]
            if label.lower() == "time"
            else [f"{label}_{number}" for number in range(1, count + 1)]
        )
    ]
    return names, [(line, re.sub(r"[(),]", " ", row)) for line, row in rows]


def _header(path: Path, lines: Sequence[str]) -> tuple[dict[str, str], list[str]]:
    """What the `lines` before `endheader` say, by lower-case key, and the units of angles that they
    say in words; refused if it cannot be read.
    """
    header: dict[str, str] = {}
    words: list[str] = []
    for line in lines:
        # `key = value` of OpenSim, or `datarows 12` of SIMM.
        found = re.match(r"\s*([A-Za-z]\w*)\s*=\s*(.*)$", line) or re.match(
            rf"\s*({KEYS})\s+(\S.*)$", line, flags=re.IGNORECASE
        )
        if found:
            header[found[1].lower()] = found[2].strip()
        elif value := re.search(r"angles\s+are\s+in\s+(degrees|radians)", line, re.IGNORECASE):
            words.append(value[1].lower())
    version = header.get("version", "1")
    if version not in VERSIONS:
        raise RecordError(
            f"{path}: version is {version!r}, but OpenSim has written versions {VERSIONS[0]} to "
            f"{VERSIONS[-1]} only; what another means is unknown. Correct the line, or export the "
            "file again."
        )
    if header.get("datatype", "double").lower() not in COMPONENTS:
        raise RecordError(
            f"{path}: DataType is {header['datatype']}, but only tables of numbers "
            f"({', '.join(COMPONENTS)}) can be read. Export it with one column for each component."
        )
    return header, words


def _range(path: Path, value: str, rows: int) -> Array:
    """Times (`rows`,) s of a SIMM motion without them: evenly over its range."""
    try:
        begin, end = map(plain_float, value.split()[:2])
    except ValueError:
        begin = end = np.nan
    if not begin < end < np.inf:
        raise RecordError(
            f"{path}: no column is named time, and the range {value!r} is not that of its times "
            "(two times in s). Export the file again."
        )
    return np.linspace(begin, end, rows)


def _in_degrees(path: Path, header: Mapping[str, str], words: Sequence[str]) -> bool:
    """Whether angles are in degrees, by the `header` at `path` and what it says in `words`."""
    value = header.get("indegrees")
    if value is None and words:
        if len(set(words)) > 1:
            raise RecordError(
                f"{path}: the header says that angles are in degrees, and that they are in "
                "radians. Correct it."
            )
        return words[0] == "degrees"
    if value is None:
        try:
            return plain_float(header.get("version", "0")) < 1
        except ValueError:
            raise RecordError(
                f"{path}: version is {header['version']!r}, which is no number, and nothing else "
                "says the unit of angles. Add the line inDegrees=yes, or inDegrees=no for radians."
            ) from None
    if value.lower() not in ("yes", "y", "no", "n"):
        raise RecordError(
            f"{path}: inDegrees is {value!r}, which OpenSim does not know: write yes if the angles "
            "are in degrees, no if they are in radians."
        )
    return value.lower() in ("yes", "y")


def read_ground_reaction(path: Path) -> tuple[float, float, tuple[Plate, ...]]:
    """Force plates of a MOT or STO file in OpenSim's convention: N, m, Nm, on the person.

    A plate is nine columns: force `…force…v{x,y,z}…`, point of application `…force…p{x,y,z}…` and
    torque `…torque…{x,y,z}…`, as in `ground_force_vx1`, `ground_force_r_vx`, `1_ground_force_vx`.
    The rest of the names is the plate's name; `FP1_vx`, `FP1_px`, `FP1_mx` are read too, as are
    `FP1_Fx`, `FP1_COPx`, `FP1_Mx` and `Fx1`, `COPx1`, `Tx1`, and `f1_1`, `p1_1`, `m1_1` of
    OpenSim's own reader of C3D, also in mm and Nmm. Columns for one foot over all its steps also
    count as a plate, so a torque may have three components. What is no plate is named and left
    out: a torque without a force is a device's (`read_device_torques`), other columns are nobody's.

    Parameters
    ----------
    path : the file.

    Returns
    -------
    tuple
        Rate Hz, time of the first sample s, plates.

    Raises
    ------
    RecordError
        As `read_storage`; there are no forces; a plate lacks its point or torque.
    """
    path = Path(path)
    table = read_storage(path)
    found = _groups(table.columns)
    _tell_unused(path, table.columns, found)
    devices = _devices(table, found)
    if devices:
        _tell_devices(path, devices)
    for name in devices:
        del found[name]
    if not any("vx" in parts for parts in found.values()):
        raise RecordError(
            f"{path}: no ground reaction forces: columns such as ground_force_vx, "
            "ground_force_px, ground_torque_x are needed, but there are "
            f"{', '.join(table.columns[:6])} …. Give the file of the force plates."
        )
    plates = []
    for number, (name, parts) in enumerate(found.items(), start=1):
        missing = [kind + axis for kind in "vpm" for axis in XYZ if kind + axis not in parts]
        if missing:
            seen = ", ".join(parts.values())
            wanted = {"v": "force", "p": "point of application", "m": "torque"}
            raise RecordError(
                f"{path}: the plate of the columns {seen} lacks the {wanted[missing[0][0]]} "
                f"({', '.join(name[1] for name in missing if name[0] == missing[0][0])}). Add "
                "the columns; a torque that was not measured is zero."
            )
        force, point, torque = (
            np.column_stack([table.column(parts[kind + axis]) for axis in XYZ]) for kind in "vpm"
        )
        if all(re.fullmatch(r"[pm]\d+_[1-3]", parts[f"{kind}x"].lower()) for kind in "pm"):
            point, torque = _in_metres(path, name, force, point, torque)
        # The lowest free number from this plate's own on, because other plates may be named by
        # numbers.
        unnamed = next(n for n in map(str, range(number, 2 * len(found) + 1)) if n not in found)
        make = partial(pressed_plate, path, name or unnamed, force, point, torque)
        plates.append(plate_or_fault(name or unnamed, len(force), make))
    return sample_rate(path, table.time), float(table.time[0]), tuple(plates)


def read_device_torques(path: Path) -> tuple[Array, dict[str, Array]]:
    """Times (N,) s of a file of forces, and the torques (N, 3) Nm of the devices in it by their
    names: of the groups of columns that `read_ground_reaction` says are no plates'. Raises
    RecordError as `read_storage`.
    """
    table = read_storage(Path(path))
    groups = _groups(table.columns)
    nothing = np.zeros(len(table.time))
    return table.time, {
        name: np.column_stack(
            [
                table.column(groups[name][f"m{x}"]) if f"m{x}" in groups[name] else nothing
                for x in XYZ
            ]
        )
        for name in _devices(table, groups)
    }


def _groups(columns: Sequence[str]) -> dict[str, dict[str, str]]:
    """Columns of each plate or device by its name, and by quantity (`vx`, `py`, `mz` …)."""
    found: dict[str, dict[str, str]] = {}
    for column in columns:
        part = _part(column)
        if part is not None:
            plate, quantity = part
            found.setdefault(plate, {})[quantity] = column
    return found or _short_names(columns)


def _short_names(columns: Sequence[str]) -> dict[str, dict[str, str]]:
    """Plates of columns without the words force and torque, if all nine of a plate are there."""
    plates: dict[str, dict[str, str]] = {}
    for column in columns:
        named = re.fullmatch(r"(.*[a-z0-9])_([vpm][xyz])", column.lower())
        if named is not None:
            plates.setdefault(named[1], {})[named[2]] = column
        # `f1_1`, `p1_1`, `m1_1` of OpenSim's C3DFileAdapter: plate and component by number.
        numbered = re.fullmatch(r"([fpm])(\d+)_([1-3])", column.lower())
        if numbered is not None:
            kind, plate, axis = numbered.groups()
            quantity = f"{'v' if kind == 'f' else kind}{XYZ[int(axis) - 1]}"
            plates.setdefault(plate, {})[quantity] = column
        # `FP1_Fx`, `FP1_COPx`, `FP1_Mx`, or `Fx1`, `COPx1`, `Tx1`, as plates' own programs say.
        lettered = re.fullmatch(r"(|.*[_ .]|.*\d)(f|cop|[mt])([xyz])(_?\d*)", column.lower())
        if lettered is not None:
            before, letter, axis, after = lettered.groups()
            plate = "_".join(re.findall(r"[a-z0-9]+", f"{before}_{after}"))
            quantity = {"f": "v", "cop": "p"}.get(letter, "m") + axis
            plates.setdefault(plate, {})[quantity] = column
    return {name: parts for name, parts in plates.items() if len(parts) == 9}


LIMITS: Final[Mapping[str, float]] = {
    # N. A group of columns that never has more is no plate that somebody stands on.
    "no_force_n": 1.0,
    # Nm. Without a force a plate shows less.
    "some_torque": 0.5,
    # m. No plate of a laboratory is farther from its origin.
    "farthest_m": 20.0,
}
"""What decides in this module: each in the unit and for the reason that is said before it."""

NAMED: Final = 6
"""Columns that are named in a message."""


def _devices(table: StorageTable, found: Mapping[str, Mapping[str, str]]) -> dict[str, float]:
    """Groups of columns with a torque and no force, which are those of a device and no plates, and
    the largest component of each torque, Nm.
    """
    devices, plates = {}, 0
    for name, parts in found.items():
        columns = {kind: [parts[k] for k in parts if k[0] == kind] for kind in "vm"}
        force, torque = (
            max((float(np.abs(table.column(c)).max()) for c in columns[kind]), default=0.0)
            for kind in "vm"
        )
        # NaN is not small: a plate says itself what it lacks.
        if force <= LIMITS["no_force_n"] and torque >= LIMITS["some_torque"]:
            devices[name] = torque
        plates += force > LIMITS["no_force_n"]
    return devices if plates else {}  # in another unit than N all plates are weak


def _tell_devices(path: Path, devices: Mapping[str, float]) -> None:
    """Say which groups of columns are those of devices, and what becomes of them."""
    value = ", ".join(
        f"{name or 'without a name'} (up to {t:.3g} Nm)" for name, t in devices.items()
    )
    unclear = [name for name in devices if DeviceTorque(name, np.zeros((0, 3))).joint is None]
    apart = (
        f"The name of {', '.join(unclear)} does not say a joint and a side, so they cannot be told "
        "apart: name the columns as in exo_hip_r_torque_x (hip, knee or ankle; the torque on the "
        "segment below it)"
        if unclear
        else "An import writes those of person and device apart"
    )
    passed_over(
        f"{path}: {value}: a torque without a force is no force plate's, but a device's on the "
        "body. It is kept as the device's record, and joint moments are those of person and device "
        f"together. {apart}"
    )


def _tell_unused(
    path: Path, columns: Sequence[str], found: Mapping[str, Mapping[str, str]]
) -> None:
    """Say which columns of a file of forces are not read."""
    used = {column for parts in found.values() for column in parts.values()}
    rest = [column for column in columns if column not in used]
    if rest and used:
        more = f" and {len(rest) - NAMED} more" if len(rest) > NAMED else ""
        passed_over(f"{path}: no ground reaction, and not used: {', '.join(rest[:NAMED])}{more}")


def _in_metres(
    path: Path, name: str, force: Array, point: Array, torque: Array
) -> tuple[Array, Array]:
    """Points and torques of OpenSim's reader of C3D in m and Nm; it leaves them in mm and Nmm."""
    loaded = np.linalg.norm(force, axis=1) > UNLOADED_N
    if (
        not loaded.any()
        or not np.nanmedian(np.abs(point[loaded]).max(axis=1)) > LIMITS["farthest_m"]
    ):
        return point, torque
    passed_over(
        f"{path}: plate {name}: its points are too far away for m, as OpenSim writes them from C3D "
        "files in mm; points are read in mm, torques in Nmm"
    )
    return point / 1000.0, torque / 1000.0


def _part(column: str) -> tuple[str, str] | None:
    """Plate and quantity (`vx`, `py`, `mz` …) from a column's name; None for other columns."""
    plain = column.lower()
    # `1_ground_force_vx` has the plate before the word, `ground_force_r_vx` between the word and
    # the axis, `ground_force_vx1` after the axis.
    found = re.fullmatch(r"(.*)(force|torque|moment)(.*?)(?:_?([vpm]))?([xyz])(_?\d*)", plain)
    if found is None:
        return None
    before, word, between, kind, axis, after = found.groups()
    # Without v or p it may be a muscle's force; a torque needs no such letter.
    if word == "force" and kind is None:
        return None
    if word != "force":
        kind = "m"
    name = "_".join(re.findall(r"[a-z0-9]+", f"{before}_{between}_{after}".replace("ground", "")))
    return name, f"{kind}{axis}"
