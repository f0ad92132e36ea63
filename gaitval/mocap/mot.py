"""Read MOT and STO, the tables of OpenSim, and the forces in them.

https://opensimconfluence.atlassian.net/wiki/spaces/OpenSim/pages/53089999. All in the laboratory's
axes.
"""

import re
from collections.abc import Sequence
from functools import partial
from pathlib import Path
from typing import Final

import numpy as np

from gaitval.errors import RecordError
from gaitval.mocap.force_plates import plate_or_fault
from gaitval.mocap.mot_writing import StorageTable
from gaitval.mocap.pressed_plates import pressed_plate
from gaitval.mocap.recording import Plate
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
    (version 3) and `datarows`, `datacolumns` (SIMM), with or without a name in the first line.

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
    header = _header(path, lines[: ends[0]])
    numbered = [(i, s) for i, s in enumerate(lines[ends[0] + 1 :], ends[0] + 2) if s.strip()]
    if not numbered:
        raise RecordError(f"{path}: nothing follows the header: truncated. Export it again.")
    labels = numbered[0][1].split()
    if not labels or labels[0].lower() != "time":
        raise RecordError(
            f"{path}: line {numbered[0][0]}: the first column must be named time, but is "
            f"{labels[0]!r}. Export the file again."
        )
    twice = sorted({name for name in labels if labels.count(name) > 1})
    if twice:
        raise RecordError(
            f"{path}: column {twice[0]} appears {labels.count(twice[0])} times. Keep one."
        )
    rows = numbered[1:]
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
    if not rows:
        raise RecordError(f"{path}: no rows. Export the file again.")
    table = numbers_of(path, [row for _, row in rows], rows[0][0], len(labels), separator=None)
    table = table[: sound_rows(path, table[:, 0])]
    # The name is optional: a first line with `=` is part of the header already.
    name = lines[0].strip() if ends[0] and "=" not in lines[0] else ""
    return StorageTable(
        columns=tuple(labels[1:]),
        time=table[:, 0],
        values=table[:, 1:],
        in_degrees=_in_degrees(path, header.get("indegrees", "no")),
        name=name or path.stem,
    )


def _header(path: Path, lines: Sequence[str]) -> dict[str, str]:
    """What the `lines` before `endheader` say, by lower-case key; refused if it cannot be read."""
    header: dict[str, str] = {}
    for line in lines:
        # `key = value` of OpenSim, or `datarows 12` of SIMM.
        found = re.match(r"\s*([A-Za-z]\w*)\s*=\s*(.*)$", line) or re.match(
            r"\s*(datacolumns|datarows)\s+(\d+)\s*$", line
        )
        if found:
            header[found[1].lower()] = found[2].strip()
    version = header.get("version", "1")
    if version not in VERSIONS:
        raise RecordError(
            f"{path}: version is {version!r}, but OpenSim has written versions {VERSIONS[0]} to "
            f"{VERSIONS[-1]} only; what another means is unknown. Correct the line, or export the "
            "file again."
        )
    if header.get("datatype", "double").lower() != "double":
        raise RecordError(
            f"{path}: DataType is {header['datatype']}, but only tables of numbers (double) can "
            "be read. Export it with one column for each component."
        )
    return header


def _in_degrees(path: Path, said: str) -> bool:
    """Whether angles are in degrees, by what the header at `path` says, as OpenSim reads it."""
    if said.lower() not in ("yes", "y", "no", "n"):
        raise RecordError(
            f"{path}: inDegrees is {said!r}, which OpenSim does not know: write yes if the angles "
            "are in degrees, no if they are in radians."
        )
    return said.lower() in ("yes", "y")


def read_ground_reaction(path: Path) -> tuple[float, float, tuple[Plate, ...]]:
    """Force plates of a MOT or STO file in OpenSim's convention: N, m, Nm, on the person.

    A plate is nine columns: force `…force…v{x,y,z}…`, point of application `…force…p{x,y,z}…` and
    torque `…torque…{x,y,z}…`, as in `ground_force_vx1`, `ground_force_r_vx`, `1_ground_force_vx`.
    The rest of the names is the plate's name; `FP1_vx`, `FP1_px`, `FP1_mx` are read too. Columns
    for one foot over all its steps also count as a plate, so a torque may have three components.

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
    found: dict[str, dict[str, str]] = {}
    for column in table.columns:
        part = _part(column)
        if part is not None:
            plate, quantity = part
            found.setdefault(plate, {})[quantity] = column
    if not found:
        found = _short_names(table.columns)
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
        # The lowest free number from this plate's own on, because other plates may be named by
        # numbers.
        unnamed = next(n for n in map(str, range(number, 2 * len(found) + 1)) if n not in found)
        make = partial(pressed_plate, path, name or unnamed, force, point, torque)
        plates.append(plate_or_fault(name or unnamed, len(force), make))
    return sample_rate(path, table.time), float(table.time[0]), tuple(plates)


def _short_names(columns: Sequence[str]) -> dict[str, dict[str, str]]:
    """Plates of columns without the words force and torque, if all nine of a plate are there."""
    plates: dict[str, dict[str, str]] = {}
    for column in columns:
        named = re.fullmatch(r"(.*[a-z0-9])_([vpm][xyz])", column.lower())
        if named is not None:
            plates.setdefault(named[1], {})[named[2]] = column
    return {name: parts for name, parts in plates.items() if len(parts) == 9}


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
