"""Read and write marker and force files that are text: TRC, MOT and STO, and those of WBDS.

Formats: TRC by Motion Analysis, MOT and STO by OpenSim
(https://opensimconfluence.atlassian.net/wiki/spaces/OpenSim/pages/53089999), WBDS by Fukuchi,
Fukuchi & Duarte (2018), PeerJ 6:e4640. All in the laboratory's axes.
"""

import re
from collections.abc import Sequence
from dataclasses import dataclass
from io import StringIO
from pathlib import Path
from typing import Final

import numpy as np

from gaitval.arrays import Array
from gaitval.artefacts import write_text
from gaitval.errors import RecordError
from gaitval.mocap.c3d import CERTAIN_LOAD_N, METRES
from gaitval.mocap.force_plates import UNLOADED_N
from gaitval.mocap.recording import Plate, Recording

WBDS_MARKER_RATE: Final = 150.0
WBDS_FORCE_RATE: Final = 300.0
"""Hz; the force files of WBDS have a sample's index for its time."""

SLOWEST_RATE: Final = 5.0
"""Hz. No camera and no force plate is sampled more slowly."""

LONGEST_LEVER_M: Final = 0.1
"""The torque about the centre of pressure is at most this times the force, m: friction holds it
under half a foot's length. The medians are 0.004 (Rajagopal et al. 2016) and 0.036 (WBDS01 T01,
whose plates are not zeroed)."""

LONGEST_PLATE_M: Final = 1.0
"""A moment about the middle or a corner of a plate is at most this times the force, m."""

_AXES: Final = "xyz"


@dataclass(frozen=True)
class StorageTable:
    """A table over time: what MOT and STO files hold.

    Attributes
    ----------
    columns : C names, without the time.
    time : (T,) s.
    values : (T, C) in the units of the file.
    in_degrees : whether angles are in degrees.
    name : first line of the file; OpenSim shows it.
    """

    columns: tuple[str, ...]
    time: Array
    values: Array
    in_degrees: bool = False
    name: str = "gaitval"

    def column(self, name: str) -> Array:
        """Values (T,) of one column."""
        return self.values[:, self.columns.index(name)]


def _not_text(path: Path) -> RecordError:
    return RecordError(
        f"{path}: not a text file. If it is a C3D file, its name must end in .c3d; else export the "
        "trial again."
    )


def _lines(path: Path) -> list[str]:
    try:
        text = path.read_text(encoding="utf-8-sig")
    except FileNotFoundError:
        raise RecordError(f"{path}: no such file. Check the name and the folder.") from None
    except OSError as error:
        raise RecordError(f"{path}: cannot be opened ({error.strerror}).") from None
    except UnicodeDecodeError:
        try:
            # Motion Analysis and Vicon write the folder's name in the code page of Windows.
            text = path.read_text(encoding="cp1252")
        except UnicodeDecodeError:
            raise _not_text(path) from None
    if not text.strip():
        raise RecordError(f"{path}: the file is empty. Copy or export it again.")
    if "\0" in text:
        raise _not_text(path)
    return text.splitlines()


def _number(field: str, blank: float = np.nan) -> float:
    text = field.strip()
    return float(text) if text else blank


def _table(
    path: Path, rows: Sequence[str], first_line: int, width: int, separator: str | None
) -> Array:
    """Numbers (rows, width) of lines of text; an empty field is NaN."""
    table = np.empty((len(rows), width))
    for i, row in enumerate(rows):
        fields = row.rstrip("\r\n").split(separator)
        while len(fields) > width and not fields[-1].strip():
            fields.pop()
        if len(fields) != width:
            raise RecordError(
                f"{path}: line {first_line + i} has {len(fields)} fields, {width} are expected by "
                "the header: the file is truncated or damaged. Export it again."
            )
        try:
            table[i] = [_number(field) for field in fields]
        except ValueError:
            wrong = next(field for field in fields if not _is_number(field)).strip()
            mend = (
                "It has a decimal comma: set the program, or the region of Windows, to a decimal "
                "point and export the file again"
                if re.fullmatch(r"[+-]?\d+,\d+(e[+-]?\d+)?", wrong, flags=re.IGNORECASE)
                else "Mend it or export the file again"
            )
            raise RecordError(
                f"{path}: line {first_line + i}: {wrong!r} is not a number. {mend}."
            ) from None
    if np.isinf(table).any():
        line = first_line + int(np.flatnonzero(np.isinf(table).any(axis=1))[0])
        raise RecordError(f"{path}: line {line}: an infinite value. Export the file again.")
    return table


def _is_number(field: str) -> bool:
    try:
        _number(field)
    except ValueError:
        return False
    return True


def sample_rate(path: Path, time: Array) -> float:
    """Rate of uniform samples, Hz, from times that may be rounded.

    The rate is that of the straight line through all times; a whole number of Hz is taken where
    it explains the times as well (WBDS: 0.007, 0.013, 0.020 s are 150 Hz).

    Raises
    ------
    RecordError
        Times that do not increase, or are not evenly spaced.
    """
    if not np.isfinite(time).all():
        raise RecordError(f"{path}: a time is missing or not a number. Export the file again.")
    if len(time) < 2:
        raise RecordError(f"{path}: one sample only has no rate. Export the whole trial.")
    steps = np.diff(time)
    if (steps <= 0).any():
        row = int(np.flatnonzero(steps <= 0)[0])
        raise RecordError(
            f"{path}: the time goes from {time[row]:g} s to {time[row + 1]:g} s in sample "
            f"{row + 2} instead of increasing: two trials in one file, or times rounded too much. "
            "Export it again."
        )
    index = np.arange(len(time), dtype=float)
    step, first = np.polyfit(index, time, 1)
    spread = float(np.abs(time - first - step * index).max())
    if spread > 0.3 * step:
        row = int(np.argmax(np.abs(time - first - step * index)))
        raise RecordError(
            f"{path}: the times are not evenly spaced: around sample {row + 1} "
            f"(t = {time[row]:g} s) they are {spread / step:.1f} steps of {step:.4g} s off. "
            "Samples are missing; export the trial whole, with gaps left empty."
        )
    rate = 1.0 / float(step)
    if rate < SLOWEST_RATE:
        raise RecordError(
            f"{path}: the times go in steps of {step:.4g} s, {rate:.3g} Hz: they look like "
            "milliseconds or numbers of frames. Write the time in seconds and export again."
        )
    whole = round(rate)
    if whole:
        misfit = time - index / whole
        if np.ptp(misfit) <= 2 * max(2 * spread, 1e-7):
            return float(whole)
    return rate


def read_trc(path: Path) -> Recording:
    """Read a TRC file; blank, NaN and 0, 0, 0 are gaps.

    Raises
    ------
    RecordError
        Not a TRC file, truncated, header and columns or rate and times disagree, unit missing
        or unknown.
    """
    path = Path(path)
    lines = _lines(path)
    if len(lines) < 5 or not lines[0].startswith("PathFileType"):
        raise RecordError(
            f"{path}: not a TRC file: the first line must begin with PathFileType and five lines "
            "of header must follow. Export it again."
        )
    if not all("\t" in line for line in lines[1:4]):
        raise RecordError(
            f"{path}: the fields of lines 2 to 4 are not separated by tabs (by commas, semicolons "
            "or blanks?), as the format has them. Export the file again as TRC."
        )
    keys, values = lines[1].split(), lines[2].split()
    header = dict(zip(keys, values, strict=False))
    for key in ("DataRate", "NumFrames", "NumMarkers", "Units"):
        if len(keys) != len(values) or key not in header:
            raise RecordError(
                f"{path}: line 3 has {len(values)} values for the {len(keys)} names of line 2, "
                f"and {key} must be among them. Write units (mm), rate and counts into line 3."
            )
    if header["Units"].lower() not in METRES:
        raise RecordError(
            f"{path}: Units is {header['Units']!r} in line 3, which is not known. Known are "
            f"{', '.join(METRES)}: write the right one there."
        )
    try:
        rate, frames, count = (
            float(header["DataRate"]),
            int(header["NumFrames"]),
            int(header["NumMarkers"]),
        )
    except ValueError:
        rate = np.nan
    if not 0 < rate < np.inf:
        raise RecordError(
            f"{path}: line 3: DataRate, NumFrames and NumMarkers are {header['DataRate']}, "
            f"{header['NumFrames']}, {header['NumMarkers']}; a rate above 0 Hz and whole numbers "
            "are needed. Correct them."
        )
    cells = [cell.strip() for cell in lines[3].split("\t")[2:]]
    names = [cell for cell in cells if cell]
    if len(names) != count or not names:
        raise RecordError(
            f"{path}: NumMarkers is {count}, but line 4 names {len(names)} markers. Export the "
            "file again, or correct NumMarkers in line 3."
        )
    numbered = [(i, line) for i, line in enumerate(lines[5:], start=6) if line.strip()]
    if len(numbered) != frames:
        raise RecordError(
            f"{path}: NumFrames is {frames}, but there are {len(numbered)} rows: the file is "
            "truncated or was cut by hand. Export it again, or correct NumFrames in line 3."
        )
    if not numbered:
        raise RecordError(f"{path}: no frames. Export the trial again.")
    table = _table(
        path, [line for _, line in numbered], numbered[0][0], 2 + 3 * count, separator="\t"
    )
    time = table[:, 1]
    if frames > 1:
        seen = sample_rate(path, time)
        # A rate of 119.88 Hz may be written as 120 and the other way round.
        if abs(seen - rate) > 0.005 * rate:
            raise RecordError(
                f"{path}: DataRate is {rate:g} Hz, but the times go in steps of {1 / seen:.5g} s "
                f"({seen:.5g} Hz). Correct the one that is wrong."
            )
        rate = seen
    markers = table[:, 2:].reshape(frames, count, 3)
    return Recording(
        source=str(path),
        axes="laboratory",
        names=tuple(names),
        markers=_with_gaps(markers) * METRES[header["Units"].lower()],
        marker_rate=rate,
        start=float(time[0]),
    )


def _with_gaps(markers: Array) -> Array:
    """NaN where a marker has not all three coordinates, or is exactly at the origin."""
    hidden = np.isnan(markers).any(axis=2) | (markers == 0).all(axis=2)
    return np.where(hidden[:, :, None], np.nan, markers)


def write_trc(path: Path, recording: Recording) -> None:
    """Write markers as TRC in mm, in the axes that they are in; gaps are NaN.

    OpenSim expects y up: turn the recording first. It refuses a row that ends in empty cells, so
    gaps are not left empty. Written whole or not at all.
    """
    frames, count = recording.markers.shape[:2]
    rate = f"{recording.marker_rate:.12g}"
    lines = [
        f"PathFileType\t4\t(X/Y/Z)\t{Path(path).name}",
        "DataRate\tCameraRate\tNumFrames\tNumMarkers\tUnits\tOrigDataRate\tOrigDataStartFrame\t"
        "OrigNumFrames",
        f"{rate}\t{rate}\t{frames}\t{count}\tmm\t{rate}\t1\t{frames}",
        "Frame#\tTime\t" + "\t\t\t".join(recording.names) + "\t\t",
        "\t\t" + "\t".join(f"{axis}{i}" for i in range(1, count + 1) for axis in "XYZ"),
        "",
    ]
    for i, (time, row) in enumerate(zip(recording.time, recording.markers * 1e3, strict=True)):
        cells = ["NaN" if np.isnan(value) else f"{value:.9g}" for value in row.ravel()]
        lines.append("\t".join([str(i + 1), f"{time:.12g}", *cells]))
    write_text(Path(path), "\n".join(lines) + "\n")


def read_storage(path: Path) -> StorageTable:
    """Read a MOT or STO file of numbers, of any version of its header.

    Understood are `nRows=`, `nColumns=`, `inDegrees=` (version 1), `DataRate=`, `DataType=`
    (version 3) and `datarows`, `datacolumns` (SIMM), with or without a first line that is a name.

    Raises
    ------
    RecordError
        Not such a file, truncated, header and columns disagree, a column twice, time missing.
    """
    path = Path(path)
    lines = _lines(path)
    ends = [i for i, line in enumerate(lines) if line.strip().lower() == "endheader"]
    if not ends:
        raise RecordError(
            f"{path}: not a MOT or STO file: no line `endheader`. Give OpenSim's format, or the "
            "file is truncated: export it again."
        )
    header: dict[str, str] = {}
    for line in lines[: ends[0]]:
        found = re.match(r"\s*([A-Za-z]\w*)\s*=\s*(.*)$", line) or re.match(
            r"\s*(datacolumns|datarows)\s+(\d+)\s*$", line
        )
        if found:
            header[found[1].lower()] = found[2].strip()
    if header.get("datatype", "double").lower() != "double":
        raise RecordError(
            f"{path}: DataType is {header['datatype']}; only a table of numbers (double) is read. "
            "Export it with one column for each component."
        )
    numbered = [(i, s) for i, s in enumerate(lines[ends[0] + 1 :], ends[0] + 2) if s.strip()]
    if not numbered:
        raise RecordError(f"{path}: nothing follows the header: truncated. Export it again.")
    labels = numbered[0][1].split()
    if not labels or labels[0].lower() != "time":
        raise RecordError(
            f"{path}: line {numbered[0][0]}: the names of the columns must begin with time, here "
            f"with {labels[0]!r}. Export the file again."
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
            raise RecordError(
                f"{path}: the header promises {promised} {what}, there are {seen}: truncated, or "
                "cut by hand. Export the file again, or correct the header."
            )
    if not rows:
        raise RecordError(f"{path}: no rows. Export the file again.")
    table = _table(path, [row for _, row in rows], rows[0][0], len(labels), separator=None)
    name = lines[0].strip() if ends[0] and "=" not in lines[0] else ""
    return StorageTable(
        columns=tuple(labels[1:]),
        time=table[:, 0],
        values=table[:, 1:],
        in_degrees=header.get("indegrees", "no").lower() in ("yes", "true", "1"),
        name=name or path.stem,
    )


def write_storage(path: Path, table: StorageTable) -> None:
    """Write a MOT or STO file that OpenSim reads, whole or not at all."""
    lines = [
        table.name,
        "version=1",
        f"nRows={len(table.time)}",
        f"nColumns={len(table.columns) + 1}",
        f"inDegrees={'yes' if table.in_degrees else 'no'}",
        "endheader",
        "\t".join(["time", *table.columns]),
    ]
    rows = StringIO()
    np.savetxt(rows, np.column_stack([table.time, table.values]), fmt="%.12g", delimiter="\t")
    write_text(Path(path), "\n".join(lines) + "\n" + rows.getvalue())


def read_ground_reaction(path: Path) -> tuple[float, float, tuple[Plate, ...]]:
    """Force plates of a MOT or STO file in OpenSim's convention: N, m, Nm, on the person.

    A plate is nine columns: force `…force…v{x,y,z}…`, point of application `…force…p{x,y,z}…` and
    torque `…torque…{x,y,z}…`, as in `ground_force_vx1`, `ground_force_r_vx`,
    `1_ground_force_vx`. What is left of the names is the plate's name. A file for one foot in
    all its steps is a plate for us, so a torque may have all three components.

    Returns
    -------
    tuple
        Rate Hz, time of the first sample s, plates.

    Raises
    ------
    RecordError
        As `read_storage`; no forces; a plate whose point or torque is missing.
    """
    path = Path(path)
    table = read_storage(path)
    found: dict[str, dict[str, str]] = {}
    for column in table.columns:
        part = _part(column)
        if part is not None:
            plate, quantity = part
            found.setdefault(plate, {})[quantity] = column
    if not any("vx" in parts for parts in found.values()):
        raise RecordError(
            f"{path}: no ground reaction forces: columns such as ground_force_vx, ground_force_px, "
            f"ground_torque_x are needed, there are {', '.join(table.columns[:6])} …. Give the "
            "file of the force plates."
        )
    plates = []
    for number, (name, parts) in enumerate(found.items(), start=1):
        missing = [kind + axis for kind in "vpm" for axis in _AXES if kind + axis not in parts]
        if missing:
            seen = ", ".join(parts.values())
            wanted = {"v": "force", "p": "point of application", "m": "torque"}
            raise RecordError(
                f"{path}: the plate of the columns {seen} lacks the {wanted[missing[0][0]]} "
                f"({', '.join(name[1] for name in missing if name[0] == missing[0][0])}). Add "
                "the columns; a torque that was not measured is zero."
            )
        force, point, torque = (
            np.column_stack([table.column(parts[kind + axis]) for axis in _AXES]) for kind in "vpm"
        )
        plates.append(_pressed(path, name or str(number), force, point, torque))
    return sample_rate(path, table.time), float(table.time[0]), tuple(plates)


def _part(column: str) -> tuple[str, str] | None:
    """Plate and quantity (`vx`, `py`, `mz` …) of a column's name; None for other columns."""
    plain = column.lower()
    found = re.fullmatch(r"(.*)(force|torque|moment)(.*?)(?:_?([vpm]))?([xyz])(_?\d*)", plain)
    if found is None:
        return None
    before, word, between, kind, axis, after = found.groups()
    if word == "force" and kind is None:
        return None
    if word != "force":
        kind = "m"
    name = "_".join(re.findall(r"[a-z0-9]+", f"{before}_{between}_{after}".replace("ground", "")))
    return name, f"{kind}{axis}"


def _pressed(path: Path, name: str, force: Array, point: Array, torque: Array) -> Plate:
    """A plate of a file that has the centre of pressure, in N, m, Nm; corners are not known."""
    if not np.isfinite(force).all():
        raise RecordError(
            f"{path}: plate {name}: {np.count_nonzero(~np.isfinite(force).all(axis=1))} samples "
            "of the force are missing. Export the forces without gaps."
        )
    loaded = np.linalg.norm(force, axis=1) >= UNLOADED_N
    if not (np.isfinite(point[loaded]).all() and np.isfinite(torque[loaded]).all()):
        raise RecordError(
            f"{path}: plate {name}: the centre of pressure or the torque is missing where the "
            "plate is loaded. Export the forces without gaps."
        )
    _check_torque(path, name, force, torque)
    return Plate(
        name=name,
        corners=np.full((4, 3), np.nan),
        force=force,
        centre_of_pressure=np.where(loaded[:, None], point, np.nan),
        free_moment=np.where(loaded[:, None], torque, 0.0),
    )


def _check_torque(path: Path, name: str, force: Array, torque: Array) -> None:
    """Refuse a torque about the centre of pressure that no foot can give."""
    size = np.linalg.norm(force, axis=1)
    strong = size > CERTAIN_LOAD_N
    if not strong.any():
        return
    lever = float(np.median(np.linalg.norm(torque[strong], axis=1) / size[strong]))
    if lever <= LONGEST_LEVER_M:
        return
    why = (
        "It looks like Nmm: divide the torques by 1000"
        if lever > LONGEST_PLATE_M
        else "It looks like the moment about the plate's middle or origin: export the free moment "
        "about the centre of pressure"
    )
    raise RecordError(
        f"{path}: plate {name}: the torque is {lever:.3g} m times the force under load (median); "
        f"a foot turns on the ground with at most {LONGEST_LEVER_M:g} m. {why}."
    )


def _tabbed(path: Path) -> tuple[list[str], Array]:
    """Header and numbers of a file of WBDS."""
    lines = [line for line in _lines(path) if line.strip()]
    header = [name.strip() for name in lines[0].split("\t")]
    if len(lines) < 2:
        raise RecordError(f"{path}: no rows below the header: truncated. Download it again.")
    return header, _table(path, lines[1:], 2, len(header), separator="\t")


def read_wbds_markers(path: Path) -> Recording:
    """Read a `…mkr.txt` file of WBDS: `Time` in s, three columns (X, Y, Z, mm) for each marker.

    Raises
    ------
    RecordError
        Other columns, truncated, times not evenly spaced.
    """
    path = Path(path)
    header, table = _tabbed(path)
    names = [column[:-1] for column in header[1::3]]
    expected = [name + axis for name in names for axis in "XYZ"]
    if header[0] != "Time" or header[1:] != expected or not names:
        wrong = next(
            (seen for seen, name in zip(header[1:], expected, strict=False) if seen != name),
            header[-1],
        )
        raise RecordError(
            f"{path}: not a marker file of WBDS: Time and then X, Y, Z of each marker are "
            f"expected; column {wrong!r} breaks this. Download it again or give a .trc or .c3d."
        )
    rate = sample_rate(path, table[:, 0]) if len(table) > 1 else WBDS_MARKER_RATE
    return Recording(
        source=str(path),
        axes="laboratory",
        names=tuple(names),
        markers=_with_gaps(table[:, 1:].reshape(len(table), -1, 3)) * METRES["mm"],
        marker_rate=rate,
        start=float(table[0, 0]),
    )


def read_wbds_forces(path: Path) -> tuple[float, float, tuple[Plate, ...]]:
    """Read a `…grf.txt` file of WBDS.

    `Time` is the sample's index at 300 Hz; each plate has Fx, Fy, Fz (N), COPx, COPy, COPz (mm)
    and Ty (Nmm), with the plate's number behind. On the treadmill plate 1 is the left one. The
    treadmill's plates are not zeroed, and the file does not allow to mend that: prefer the C3D.

    Returns
    -------
    tuple
        Rate Hz, time of the first sample s (0), plates.

    Raises
    ------
    RecordError
        Other columns, truncated, not a whole number of plates.
    """
    path = Path(path)
    header, table = _tabbed(path)
    if not header[0].strip().lower().startswith("time"):
        raise RecordError(
            f"{path}: not a force file of WBDS: the first column is {header[0]!r}, Time is "
            "expected. Download it again."
        )
    columns: dict[str, dict[str, int]] = {}
    for i, column in enumerate(header[1:], start=1):
        found = re.fullmatch(r"(F|COP|T)([xyz])_?(\d*)", column, flags=re.IGNORECASE)
        if found is None:
            raise RecordError(
                f"{path}: column {column!r} is not one of Fx, Fy, Fz, COPx, COPy, COPz, Ty with "
                "the plate's number behind. Download it again or give OpenSim's .mot."
            )
        quantity = found[1].upper() + found[2].lower()
        columns.setdefault(found[3] or "1", {})[quantity] = i
    plates = []
    for name, places in columns.items():
        wanted = ("Fx", "Fy", "Fz", "COPx", "COPy", "COPz", "Ty")
        missing = [quantity for quantity in wanted if quantity not in places]
        if missing:
            raise RecordError(
                f"{path}: plate {name} lacks {', '.join(missing)}: truncated. Download it again."
            )
        force = table[:, [places[f"F{axis}"] for axis in _AXES]]
        point = table[:, [places[f"COP{axis}"] for axis in _AXES]] * METRES["mm"]
        torque = np.zeros_like(force)
        torque[:, 1] = table[:, places["Ty"]] * 1e-3
        plates.append(_pressed(path, name, force, point, torque))
    return WBDS_FORCE_RATE, 0.0, tuple(plates)
