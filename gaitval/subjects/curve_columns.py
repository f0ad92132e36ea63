"""The columns of a table of mean curves, as laboratories and spreadsheets write them.

A name is a kind and a coordinate (`angle_hip_flexion_r`); it may have capitals, blanks, `_right`
for `_r`, `_mean` at its end, and a unit in brackets or, as an import writes it, at its end
(`_rad`), which is then the unit of its column; or it is one of WBDS (`wbds.COLUMNS`). Rows are 0 to
100 % of the cycle; with a column that says where each row lies, there may be another number of
them.
"""

import re
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Final, Literal

import numpy as np
from scipy.interpolate import PchipInterpolator

from gaitval._internal.io import file_gate
from gaitval._internal.io.text_tables import MISSING, without_unit
from gaitval.arrays import Array
from gaitval.errors import RecordError
from gaitval.gait.sampling import SAMPLES
from gaitval.subjects.wbds import COLUMNS, MOMENT_SEAM
from gaitval.units import ANGLE, FORCE_PER_WEIGHT, MOMENT_PER_MASS, Quantity, stated_factor

AngleUnit = Literal["deg", "rad"]

KINDS: Final[Mapping[str, Quantity]] = {
    "angle_": ANGLE,
    "moment_": MOMENT_PER_MASS,
    "force_": FORCE_PER_WEIGHT,
}
SAME_PERCENT: Final = 0.01
"""Of the cycle, %, within which a row is of the percent that its place says."""
FEWEST_ROWS: Final = 51
"""Of a cycle; between rows farther apart than 2 % a curve has more than can be filled in."""
SWING: Final = 40
"""Row from which on a force that is not a number is one of swing, which is zero."""

_PERCENT: Final = ("percent", "%", "cycle", "gait_cycle", "percent_cycle", "cycle_percent",
                   "percent_gait_cycle", "gait_cycle_percent")  # fmt: skip
"""Names of a column that says where in the cycle a row lies."""
_BESIDE: Final = ("_sd", "_band90", "_uncorrected")
_WITH_UNIT: Final = re.compile(r"(.*?)\s*[\[(]([^\[\]()]*(?:\([^()]*\))?[^\[\]()]*)[\])]")
_TEMPLATE: Final = "`gaitval curves --template` writes a table with all of them"


@dataclass(frozen=True)
class CurveColumns:
    """What a file has.

    Attributes
    ----------
    curves : (101,) by name, with the kind and without what the file writes beside it; NaN where
        there is no number.
    others : names of the columns that are no curves.
    notes : a sentence on each thing in which the file differs from the table that is asked for.
    seam : rows whose moments are not to be trusted.
    """

    curves: dict[str, Array]
    others: list[str]
    notes: tuple[str, ...] = ()
    seam: tuple[int, ...] = ()


def read_columns(path: Path, angle_unit: AngleUnit) -> CurveColumns:
    """Columns of curves in a file, angles in `angle_unit` whatever their header says. Raises
    RecordError where the file is no table of curves, or its rows are not those of one cycle.
    """
    rows = [
        {name: (cell or "").strip() for name, cell in cells.items() if name is not None}
        for _, cells in file_gate.csv_rows(path, RecordError, largest=file_gate.SIZES.values)
    ]
    while rows and not any(rows[-1].values()):
        rows.pop()
    order = {name: place for place, name in enumerate(COLUMNS)}
    headers = sorted(rows[0] if rows else [], key=lambda name: order.get(name.strip(), -1))
    read, others, notes = dict[str, Array](), list[str](), list[str]()
    place, seam = None, tuple[int, ...]()
    for header in headers:
        name, sign, unit = _meaning(header)
        values = np.array([_number(row[header]) for row in rows])
        if name in _PERCENT and place is None:
            place = values
        if not name.startswith(tuple(KINDS)) or name.endswith(_BESIDE):
            others.append(header.strip())
            continue
        if unit:
            values = sign * _factor(path, header, name, unit, angle_unit) * values
            notes.append(f"units are taken from the headers ({header.strip()})")
        if name in read:
            raise RecordError(f"{path}: {name} is there twice. Give each curve once.")
        if header.strip() in COLUMNS and name.startswith("moment_"):
            seam = MOMENT_SEAM
        read[name] = values
    if not read:
        seen = ", ".join(headers[:6]) or "none"
        raise RecordError(
            f"{path}: no column of a curve; its columns are {seen}. Name them by kind and "
            f"coordinate: angle_hip_flexion_r, moment_knee_angle_l, force_up_r. {_TEMPLATE}."
        )
    curves = _of_cycle(path, len(rows), place, read)
    if len(rows) != SAMPLES:
        notes.append(f"{len(rows)} rows were brought to 101")
    late = np.arange(SAMPLES) >= SWING
    for name, curve in curves.items():
        if name.startswith("force_"):
            curves[name] = np.where(np.isnan(curve) & late, 0.0, curve)
    return CurveColumns(curves, others, (*notes[:1], *notes[-1:]), seam)


def _number(cell: str) -> float:
    """That of a cell; NaN if it is none, or stands for one that is missing."""
    try:
        value = float(cell)
    except ValueError:
        return np.nan
    return np.nan if not np.isfinite(value) or abs(value) in MISSING else value


def _meaning(header: str) -> tuple[str, int, str]:
    """The name that a column has here, its sign, and its unit, if it says one."""
    name, unit = header.strip(), ""
    if name in COLUMNS:
        return COLUMNS[name]
    if found := _WITH_UNIT.fullmatch(name):
        name, unit = found[1], found[2]
    known, ending = without_unit(re.sub(r"\s+", "_", name.strip()).lower())
    known = known.removesuffix("_mean")
    if known.startswith(tuple(KINDS)) and known != "force_left":  # that is a direction
        known = re.sub("_(r|l)(ight|eft)$", r"_\1", known)
    return known, 1, unit or ending


def _factor(path: Path, column: str, name: str, unit: str, angle_unit: AngleUnit) -> float:
    """From the `unit` of a header to `angle_unit`, Nm/kg or body weights."""
    quantity = next(of for kind, of in KINDS.items() if name.startswith(kind))
    factor = stated_factor(f"{path}: column {column.strip()}", quantity, unit)
    return float(np.degrees(factor)) if quantity is ANGLE and angle_unit == "deg" else factor


def _of_cycle(
    path: Path, rows: int, place: Array | None, columns: dict[str, Array]
) -> dict[str, Array]:
    """The columns at 0, 1, … 100 % of the cycle; `place` says where the rows are, in % or as a
    share.
    """
    percent = np.linspace(0.0, 100.0, rows)
    seen = percent if place is None else place * (100.0 if abs(place[-1] - 1.0) < 1e-6 else 1.0)
    enough = rows == SAMPLES or (place is not None and rows >= FEWEST_ROWS)
    if not enough or not (np.abs(seen - percent) < SAME_PERCENT).all():
        raise RecordError(
            f"{path}: its {rows} rows are no gait cycle. There must be {SAMPLES}, 0 to 100 % of "
            f"each side's own cycle; or at least {FEWEST_ROWS}, evenly spaced, with a column "
            "percent from 0 to 100. Several trials, rows of units and of means are to be taken out."
        )
    if rows == SAMPLES:
        return columns
    even = np.arange(SAMPLES)
    return {
        name: PchipInterpolator(percent, values)(even)
        if np.isfinite(values).all()
        else np.interp(even, percent, values)  # a gap stays one, and is named
        for name, values in columns.items()
    }
