"""The processed files and tables of WBDS, checked and in the project's axes, units and signs.

`wbds` has the source and says how the signs were found.
"""

import csv
import difflib
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Final

import numpy as np

from gaitval import file_gate
from gaitval.arrays import Array
from gaitval.constants import STANDARD_GRAVITY
from gaitval.coordinates import SIDES, Side
from gaitval.datasets.subject import (
    MARKERS,
)
from gaitval.errors import RecordError
from gaitval.gait.mean_curves import (
    STANCE_THRESHOLD,
)
from gaitval.gait.sampling import SAMPLES
from gaitval.plain_numbers import plain_float

_LETTER: Final[dict[Side, str]] = {"right": "R", "left": "L"}

MOMENT_SEAM: Final = (97, 98, 99)
"""Rows where the moments jump, an edge effect of the authors' filter; left out of the fit."""

# Project name and sign (to the project's convention) of each column, without its side.
_ANGLES: Final[dict[str, tuple[str, int]]] = {
    "PelvisAngleX": ("pelvis_list", 1),
    "PelvisAngleY": ("pelvis_rotation", 1),
    "PelvisAngleZ": ("pelvis_tilt", 1),
    "HipAngleX": ("hip_adduction", 1),
    "HipAngleY": ("hip_rotation", 1),
    "HipAngleZ": ("hip_flexion", 1),
    "KneeAngleX": ("knee_adduction", 1),
    "KneeAngleY": ("knee_rotation", 1),
    "KneeAngleZ": ("knee_angle", 1),
    "AnkleAngleX": ("subtalar_angle", 1),
    "AnkleAngleY": ("ankle_rotation", 1),
    "AnkleAngleZ": ("ankle_angle", 1),
    "FootAngleX": ("foot_list", 1),
    "FootAngleY": ("foot_progression", -1),
    "FootAngleZ": ("foot_pitch", 1),
}
_MOMENTS: Final[dict[str, tuple[str, int]]] = {
    "HipMomentX": ("hip_adduction", -1),
    "HipMomentY": ("hip_rotation", -1),
    "HipMomentZ": ("hip_flexion", 1),
    "KneeMomentX": ("knee_adduction", -1),
    "KneeMomentY": ("knee_rotation", -1),
    "KneeMomentZ": ("knee_angle", -1),
    "AnkleMomentX": ("subtalar_angle", 1),
    "AnkleMomentY": ("ankle_rotation", -1),
    "AnkleMomentZ": ("ankle_angle", -1),
}
_FORCES: Final = ("GRFX", "GRFY", "GRFZ")


@dataclass(frozen=True)
class Kinetics:
    """Mean moments and forces of one trial in the project's convention.

    Attributes
    ----------
    moments : Nm/kg, (101,) each, keys of `MOMENT_NAMES`. Rows 97-99 are not to be trusted.
    forces : body weights, (101, 3) for each side: forward, left, up; zero in swing.
    """

    moments: Mapping[str, Array]
    forces: Mapping[Side, Array]


def _columns(names: Sequence[str]) -> tuple[str, ...]:
    return ("Time", *(f"{letter}{name}" for letter in _LETTER.values() for name in names))


def _header_problems(seen: Sequence[str], expected: Sequence[str], other: str) -> list[str]:
    """Problems of a header; `other` is a word that only columns of the other file contain."""
    missing = [name for name in expected if name not in seen]
    unknown = [name for name in seen if name not in expected]
    if missing and any(other in name for name in unknown):
        return [
            f"row 1: the columns are those of the other kind of file ({unknown[0]} was seen where "
            f"{missing[0]} was expected): the ang and knt files look exchanged. Exchange them."
        ]
    problems = []
    for name in missing:
        near = difflib.get_close_matches(name, unknown, n=1)
        problems.append(
            f"row 1: column {name} is missing"
            + (f"; was it renamed to {near[0]}? Name it {name}." if near else ". Add it.")
        )
    problems += [
        f"row 1: column {name} appears {seen.count(name)} times. Keep one."
        for name in dict.fromkeys(seen)
        if seen.count(name) > 1
    ]
    return problems


def refuse(where: str | Path, problems: Sequence[str]) -> None:
    """Raise a `RecordError` that says `where` they are and lists the first of the `problems`, if
    there are any.
    """
    if problems:
        shown = [f"  - {problem}" for problem in problems[:10]]
        if len(problems) > len(shown):
            shown.append(f"  … and {len(problems) - len(shown)} more")
        raise RecordError(f"{where}: cannot be used\n" + "\n".join(shown))


def _text(path: Path) -> str:
    try:
        fix = (
            "Give the folder that holds processed/, stride_times.csv, WBDS_subjects_merged.csv and "
            "static_markers_10subjects.csv"
        )
        return file_gate.read_text(path, RecordError, largest=file_gate.TABLE, fix=fix)
    except UnicodeDecodeError:
        raise RecordError(f"{path}: not text. Download the file again.") from None


def _read_processed(
    path: Path, columns: Sequence[str], other: str, may_be_nan: str
) -> dict[str, Array]:
    """Columns of a tab-separated file of 101 rows; NaN only where a name has `may_be_nan`."""
    lines = _text(path).splitlines()
    header = lines[0].split("\t") if lines else []
    refuse(path, _header_problems(header, columns, other))
    problems = []
    if len(lines) - 1 != SAMPLES:
        problems.append(
            f"{len(lines) - 1} rows of data, but there must be {SAMPLES} (0 to 100 % of the gait "
            "cycle): the file is truncated or not time-normalised. Download it again."
        )
    table = np.full((len(lines) - 1, len(header)), np.nan)
    for i, line in enumerate(lines[1:]):
        fields = line.split("\t")
        if len(fields) != len(header):
            problems.append(
                f"row {i + 2}: {len(fields)} fields, but {len(header)} columns: the row is "
                "truncated. Download the file again."
            )
            continue
        for j, field in enumerate(fields):
            try:
                table[i, j] = plain_float(field)
            except ValueError:
                problems.append(
                    f"row {i + 2}, column {header[j]}: {field!r} is not a number. Correct it."
                )
                continue
            if not np.isfinite(table[i, j]) and not (may_be_nan and may_be_nan in header[j]):
                problems.append(
                    f"row {i + 2}, column {header[j]}: {field.strip()}; the mean curve has a gap. "
                    "Use a trial without gaps."
                )
    refuse(path, problems)
    found = {name: table[:, header.index(name)] for name in columns}
    if not np.array_equal(found.pop("Time"), np.arange(SAMPLES)):
        refuse(path, ["column Time: not 0, 1 … 100 (% of the gait cycle). Normalise the time."])
    return found


def read_angles(path: Path) -> dict[str, Array]:
    """Mean angles of the `…ang.txt` file `path`, by keys of `ANGLE_NAMES`: (101,) rad each,
    project's signs, 0 to 100 % of the side's cycle.

    Raises RecordError for missing or renamed columns, an exchanged file, truncation, NaN, radians,
    or hip and knee columns whose curves are not a hip's and a knee's.
    """
    path = Path(path)
    found = _read_processed(path, _columns(list(_ANGLES)), other="Moment", may_be_nan="")
    problems = []
    for letter in _LETTER.values():
        knee, hip = found[f"{letter}KneeAngleZ"], found[f"{letter}HipAngleZ"]
        if np.ptp(knee) < 2:
            problems.append(
                f"column {letter}KneeAngleZ: its range is {np.ptp(knee):.3g}; this looks like "
                "radians, but the file must be in degrees. Multiply all angles by 180/pi."
            )
        elif not 55 <= np.argmax(knee) <= 90 or np.ptp(knee) < 25:
            problems.append(
                f"column {letter}KneeAngleZ: largest at {np.argmax(knee)} % of the cycle with a "
                f"range of {np.ptp(knee):.3g}°; knee flexion is largest in swing (55-90 %) with "
                "more than 25°. Are hip, knee or ankle columns exchanged, or the sign changed?"
            )
        elif not 35 <= np.argmin(hip) <= 75:
            problems.append(
                f"column {letter}HipAngleZ: smallest at {np.argmin(hip)} % of the cycle; the hip "
                "is most extended at 35-75 %. Are columns exchanged, or the sign changed?"
            )
    refuse(path, problems)
    return {
        f"{name}_{side[0]}": sign * np.radians(found[_LETTER[side] + column])
        for side in SIDES
        for column, (name, sign) in _ANGLES.items()
    }


def _kinetics_problems(found: Mapping[str, Array]) -> list[str]:
    problems = []
    for letter in _LETTER.values():
        ankle, up = found[f"{letter}AnkleMomentZ"][:97], found[f"{letter}GRFY"][:97]
        if np.abs(ankle).max() > 5:
            problems.append(
                f"column {letter}AnkleMomentZ: reaches {np.abs(ankle).max():.4g}; this looks like "
                "Nm or Nmm/kg, but the file must be in Nm/kg. Divide by the body mass, or by "
                "1000."
            )
        elif ankle.max() < 0.3:
            problems.append(
                f"column {letter}AnkleMomentZ: its largest value is {ankle.max():.3g} Nm/kg; "
                "plantarflexion is positive and above 0.3 at push-off. Are columns exchanged, or "
                "the sign changed?"
            )
        if np.isnan(up[:40]).any():
            row = int(np.flatnonzero(np.isnan(up[:40]))[0])
            problems.append(
                f"row {row + 2}, column {letter}GRFY: NaN in stance ({row} % of the cycle); only "
                "swing may be NaN. Use a trial without gaps."
            )
        elif not 5 < np.nanmax(up) < 25:
            looks = (
                "N; divide by the body mass"
                if np.nanmax(up) >= 25
                else f"body weights; multiply by {STANDARD_GRAVITY}"
            )
            problems.append(
                f"column {letter}GRFY: its largest value is {np.nanmax(up):.4g}; the file must be "
                f"in N/kg (about 10), but this looks like {looks}. If it is another direction, "
                "the GRF columns are exchanged."
            )
        elif np.nan_to_num(up[80:90]).max() >= STANCE_THRESHOLD * STANDARD_GRAVITY:
            problems.append(
                f"column {letter}GRFY: the foot is still on the ground at 80-90 % of the cycle; a "
                "walking foot swings there. Was the force plate's offset removed?"
            )
    return problems


def read_kinetics(path: Path) -> Kinetics:
    """Mean moments and ground reactions of the `…knt.txt` file `path`.

    Swing is coded 0 in some files and NaN in others; both become zero. Raises RecordError for
    missing or renamed columns, an exchanged file, truncation, NaN in moments or stance, moments in
    Nm, forces in N, or implausible signs.
    """
    path = Path(path)
    names = [*_MOMENTS, *_FORCES]
    found = _read_processed(path, _columns(names), other="Angle", may_be_nan="GRF")
    refuse(path, _kinetics_problems(found))
    forces: dict[Side, Array] = {}
    for side in SIDES:
        letter, medial = _LETTER[side], 1 if side == "right" else -1
        forward, up, medially = (np.nan_to_num(found[letter + name]) for name in _FORCES)
        # Towards the midline is to the left for the right foot, to the right for the left one.
        forces[side] = np.stack([forward, medial * medially, up], axis=1) / STANDARD_GRAVITY
    return Kinetics(
        moments={
            f"{name}_{side[0]}": sign * found[_LETTER[side] + column]
            for side in SIDES
            for column, (name, sign) in _MOMENTS.items()
        },
        forces=forces,
    )


def table_rows(path: Path, needed: Sequence[str]) -> list[dict[str, str]]:
    """Rows of the CSV file `path` by the names of its columns, of which some are `needed`."""
    reader = csv.DictReader(_text(path).splitlines())
    problems = [
        f"row 1: column {name} is missing. Add it."
        for name in needed
        if name not in (reader.fieldnames or ())
    ]
    refuse(path, problems)
    try:
        return list(reader)
    except csv.Error as error:
        raise RecordError(f"{path}: cannot be read as CSV ({error}). Download it again.") from None


def number_in(path: Path, row: Mapping[str, str], column: str) -> float:
    """The number in a `column` of a `row` of `path`. Raises RecordError if it is not finite."""
    try:
        value = plain_float(row[column])
    except (TypeError, ValueError):
        value = np.nan
    if not np.isfinite(value):
        raise RecordError(
            f"{path}: column {column}: {row[column]!r} is not a number (row {dict(row)}). Correct "
            "it."
        )
    return value


def read_static_markers(path: Path, person: str) -> dict[str, tuple[float, float, float]]:
    """Standing marker positions of one `person` ("WBDS14"), m, REP-103 axes of the laboratory, from
    `path`: `static_markers_10subjects.csv`, mm, x forward, y up, z right.

    Raises RecordError for a missing file, column or person, a value that is not a number, or metres
    for millimetres.
    """
    path = Path(path)
    rows = table_rows(path, ["Subject", *(f"{name}{axis}" for name in MARKERS for axis in "XYZ")])
    row = next((row for row in rows if row["Subject"] == person), None)
    if row is None:
        raise RecordError(
            f"{path}: no row for {person}. It contains {', '.join(r['Subject'] for r in rows)}."
        )
    markers = {}
    for name in MARKERS:
        x, y, z = (number_in(path, row, f"{name}{axis}") / 1000 for axis in "XYZ")
        markers[name] = (x, -z, y)
    if markers["R.ASIS"][2] < 0.1:
        raise RecordError(
            f"{path}: column R.ASISY of {person}: {row['R.ASISY']}; this looks like metres, but "
            "the file must be in millimetres. Multiply by 1000."
        )
    return markers
