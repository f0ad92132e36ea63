"""The columns of a table of mean curves, as laboratories and spreadsheets write them.

A name is a kind and a coordinate (`angle_hip_flexion_r`); it may have capitals, blanks, `_right`
for `_r`, `_mean` at its end, and a unit in brackets or, as an import writes it, at its end
(`_rad`), which is then the unit of its column. A row of units may follow the header. Rows are 0 to
100 % of the cycle; with a column that says where each row lies, there may be another number of
them.
"""

import csv
import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Final, Literal

import numpy as np
import pandas as pd
from scipy.interpolate import PchipInterpolator

from gaitval._internal.io import file_gate
from gaitval._internal.io.text_tables import text_table, without_unit
from gaitval.arrays import Array
from gaitval.errors import RecordError
from gaitval.gait.sampling import SAMPLES
from gaitval.units import ANGLE, FORCE_PER_WEIGHT, MOMENT_PER_MASS, Quantity, unit_of

AngleUnit = Literal["deg", "rad"]

KINDS: Final = ("angle_", "moment_", "force_")
SAME_PERCENT: Final = 0.01
"""Of the cycle, %, within which a row is of the percent that its place says."""
FEWEST_ROWS: Final = 51
"""Of a cycle; between rows farther apart than 2 % a curve has more than can be filled in."""

_NO_TABLES: Final = (".toml", ".c3d", ".trc", ".mot", ".sto", ".osim", ".json", ".xlsx",
                     ".parquet")  # fmt: skip
_PERCENT: Final = ("percent", "%", "cycle", "gait_cycle", "percent_cycle", "cycle_percent",
                   "percent_gait_cycle", "gait_cycle_percent")  # fmt: skip
"""Names of a column that says where in the cycle a row lies."""
_BESIDE: Final = ("_sd", "_band90", "_uncorrected")
_WITH_UNIT: Final = re.compile(r"(.*?)\s*[\[(]([^\[\]()]*(?:\([^()]*\))?[^\[\]()]*)[\])]")
_QUANTITIES: Final[Mapping[str, Quantity]] = {
    "angle_": ANGLE,
    "moment_": MOMENT_PER_MASS,
    "force_": FORCE_PER_WEIGHT,
}


@dataclass(frozen=True)
class CurveColumns:
    """What a file has.

    Attributes
    ----------
    curves : (101,) by name, with the kind and without what the file writes beside it.
    others : names of the columns that are no curves.
    notes : a sentence on each thing in which the file differs from the table that is asked for.
    """

    curves: dict[str, Array]
    others: list[str]
    notes: tuple[str, ...] = ()


def read_columns(path: Path, angle_unit: AngleUnit) -> CurveColumns:
    """Columns of curves in a file, angles in `angle_unit` whatever their header says. Raises
    RecordError where the file is no table of curves, or its rows are not those of one cycle.
    """
    if path.suffix.lower() in _NO_TABLES:
        raise RecordError(
            f"{path}: a {path.suffix} file is no table of mean curves. Give CSV, or "
            "WBDS's ang.txt and knt.txt; `gaitval curves --template` writes a CSV to fill in."
        )
    try:
        table = _csv(path)
    except RecordError:
        raise
    except Exception as error:  # the readers have no common error
        raise RecordError(f"{path}: {_unread(path, error)}") from None
    units = _units_below(table)
    table = table.iloc[1:] if units else table
    _refuse_rows(path, table)
    columns, others, notes = {}, [], list[str]()
    for column in map(str, table.columns):
        name, unit = _plain(column, units.get(column, ""))
        if not name.startswith(KINDS) or name.endswith(_BESIDE):
            others.append(column.strip())
            continue
        values = pd.to_numeric(table[column], errors="coerce").to_numpy(dtype=float)
        if unit:
            values = values * _factor(path, column, name, unit, angle_unit)
            notes.append(f"units are taken from the headers ({column.strip()})")
        if name in columns:
            raise RecordError(f"{path}: {name} is there twice. Give each curve once.")
        columns[name] = values
    if not columns:
        raise RecordError(_no_curves(path, list(map(str, table.columns))))
    columns, more = _of_cycle(path, table, columns)
    return CurveColumns(columns, others, (*notes[:1], *more))


def _plain(column: str, unit: str) -> tuple[str, str]:
    """The name that a column has here, and its unit, if it says one."""
    name = column.strip()
    if found := _WITH_UNIT.fullmatch(name):
        name, unit = found[1], found[2]
    known, ending = without_unit(re.sub(r"\s+", "_", name.strip()).lower())
    unit, known = unit or ending, known.removesuffix("_mean")
    for word, letter in (("_right", "_r"), ("_left", "_l")):
        if known.startswith(KINDS) and known != f"force{word}":  # that is a direction
            known = known.removesuffix(word) + letter if known.endswith(word) else known
    return known, unit


def _factor(path: Path, column: str, name: str, unit: str, angle_unit: AngleUnit) -> float:
    """From the `unit` of a header to `angle_unit`, Nm/kg or body weights."""
    quantity = _QUANTITIES[next(kind for kind in KINDS if name.startswith(kind))]
    known = quantity.named(unit)
    if known is None:
        raise RecordError(
            f"{path}: column {column.strip()}: {unit_of(quantity, unit).sentence}. Say another one "
            "in the header, or leave it out."
        )
    in_degrees = quantity is ANGLE and angle_unit == "deg"
    return float(np.degrees(known.factor)) if in_degrees else known.factor


# ---- Rows. ----


def _units_below(table: pd.DataFrame) -> dict[str, str]:
    """The cells of a row of units below the header; nothing if there is none."""
    if not len(table):
        return {}
    cells = {str(name): str(cell).strip() for name, cell in table.iloc[0].items()}
    curves = {name: cell for name, cell in cells.items() if _plain(name, "")[0].startswith(KINDS)}
    texts = [cell for cell in curves.values() if cell and not _is_number(cell)]
    of_units = len(texts) == len(curves) > 0 and any(
        quantity.named(text) for text in texts for quantity in _QUANTITIES.values()
    )
    return {name: cell.strip("[]() ") for name, cell in curves.items()} if of_units else {}


def _is_number(cell: str) -> bool:
    try:
        float(cell)
    except ValueError:
        return False
    return True


def _refuse_rows(path: Path, table: pd.DataFrame) -> None:
    """Refuse rows that are no instants of the cycle: a header again, a mean or a total."""
    lines = table.attrs.get("lines")
    if lines is None:
        return
    curves = [name for name in map(str, table) if _plain(name, "")[0].startswith(KINDS)]
    place = _place(table)
    lines = lines[len(lines) - len(table) :]
    for line, (_, row) in zip(lines, table.iterrows(), strict=True):
        cells = {str(name): str(cell).strip() for name, cell in row.items()}
        texts = [cells[name] for name in curves]
        at = cells[place] if place else ""
        if curves and any(texts) and not any(map(_is_number, texts)) and len(curves) > 1:
            seen = ", ".join([text for text in texts if text][:2])
            raise RecordError(
                f"{path}: line {line} has no numbers, but {seen} …: a header again, or a row of "
                "units or of another table. Take it out."
            )
        if at and not _is_number(at):
            raise RecordError(
                f"{path}: line {line}: {at!r} where a percent of the gait cycle is needed. If it "
                "is a row of means or totals, take it out."
            )


def _place(table: pd.DataFrame) -> str | None:
    """The name of the column that says where in the cycle each row lies."""
    plain = {str(name): _plain(str(name), "")[0] for name in table.columns}
    return next((name for name, each in plain.items() if each in _PERCENT), None)


def _of_cycle(
    path: Path, table: pd.DataFrame, columns: dict[str, Array]
) -> tuple[dict[str, Array], list[str]]:
    """The columns at 0, 1, … 100 % of the cycle, and a sentence if they had other rows."""
    place, rows = _place(table), len(table)
    if not rows:
        raise RecordError(_another_length(path, rows))
    percent = None
    if place is not None:
        percent = pd.to_numeric(table[place], errors="coerce").to_numpy(dtype=float)
        if rows and abs(percent[0]) < 1e-9 and abs(percent[-1] - 1.0) < 1e-6:
            percent = 100.0 * percent
    if percent is None:
        if rows != SAMPLES:
            raise RecordError(_another_length(path, rows))
        return columns, []
    if rows == SAMPLES and (np.abs(percent - np.arange(SAMPLES)) < SAME_PERCENT).all():
        return columns, []
    whole = rows >= FEWEST_ROWS and abs(percent[0]) < 1e-9 and abs(percent[-1] - 100.0) < 0.01
    if whole and rows != SAMPLES and (np.diff(percent) > 0.0).all():
        even = np.arange(SAMPLES)
        found = {
            name: PchipInterpolator(percent, values)(even)
            if np.isfinite(values).all()
            else np.interp(even, percent, values)  # a gap stays one, and is named
            for name, values in columns.items()
        }
        return found, [f"{rows} rows were brought to 101 by the column {place}"]
    again = np.flatnonzero(np.diff(percent) < 0.0)
    if rows != SAMPLES and len(again) and abs(percent[again[0] + 1] - percent[0]) < 1e-9:
        raise RecordError(
            f"{path}: column {place} begins again after {again[0] + 1} rows: several trials, "
            "people or sides stand below each other. Give one table for each trial, with the "
            "sides as columns that end in _r and _l."
        )
    if rows != SAMPLES:
        raise RecordError(
            f"{path}: {rows} rows of data, but there must be {SAMPLES}: 0 to 100 % of each side's "
            f"own gait cycle, and column {place} goes from {percent[0]:g} to {percent[-1]:g}. "
            "Resample the curves, or take out what is no row of the cycle."
        )
    row = int(np.flatnonzero(~(np.abs(percent - np.arange(rows)) < SAME_PERCENT))[0])
    raise RecordError(
        f"{path}: column {place}: {percent[row]:g} in row {row + 2}, where {row} is needed. "
        "Rows are 0, 1, … 100 % of the gait cycle, from heel strike to heel strike. Sort or "
        "resample the curves, or leave the column out if it is something else."
    )


def _another_length(path: Path, rows: int) -> str:
    if rows == 0:
        return f"{path}: has a header and no rows. Give the curves, 101 rows."
    return (
        f"{path}: {rows} rows of data, but there must be {SAMPLES}: 0 to 100 % of each side's own "
        "gait cycle. Resample the curves, or add a column percent that says where each row lies."
    )


# ---- Files. ----


def _no_curves(path: Path, names: Sequence[str]) -> str:
    if not names:
        return f"{path}: is empty. Give a table of mean curves; --template writes one."
    return (
        f"{path}: no column of a curve; its columns are {', '.join(names[:6])}. Name them by kind "
        "and coordinate: angle_hip_flexion_r, moment_knee_angle_l, force_up_r. `gaitval curves "
        "--template` writes a file with all of them."
    )


def _csv(path: Path) -> pd.DataFrame:
    """The table of a file, NaN where a row ends early, without the empty rows at its end."""
    text = file_gate.read_text(path, RecordError, largest=file_gate.SIZES.values)
    names, rows = text_table(text.splitlines())
    while rows and not any(map(str.strip, rows[-1][1])):
        rows.pop()
    for line, cells in rows:
        if any(map(str.strip, cells[len(names) :])):
            raise RecordError(
                f"{path}: cannot be read as CSV: line {line} has {len(cells)} values, but the "
                f"header has {len(names)}. Export it with one header and a value for each column "
                "in every row."
            )
    table = pd.DataFrame(
        [dict(zip(names, cells, strict=False)) for _, cells in rows], columns=names
    )
    table.attrs["lines"] = [line for line, _ in rows]
    return table


def _unread(path: Path, error: Exception) -> str:
    """Why a file is no table of curves, for whoever exported it."""
    if isinstance(error, UnicodeDecodeError):
        return "cannot be read as CSV: it is not UTF-8 text. Export it as CSV in UTF-8."
    why = f" ({error})" if isinstance(error, csv.Error) else ""
    return (
        f"cannot be read as CSV{why}. Export it again, with a header and the same columns in each "
        "row."
    )
