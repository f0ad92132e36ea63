"""Read mean curves of the gait dataset of Fukuchi, Fukuchi & Duarte (2018).

PeerJ 6:e4640, https://doi.org/10.7717/peerj.4640, data CC BY 4.0. This is the only place where its
conventions (millimetres, degrees, N/kg, axes x forward, y up, z right) become the project's.

Signs. The dataset's angle about X is adduction (ankle: inversion), about Y internal rotation,
about Z flexion (ankle: dorsiflexion), positive on both sides; the foot's angle about Y is
positive toes outwards (it follows the chain pelvis-hip-knee-ankle with a minus sign, while X
and Z follow with a plus).

Moments are internal. About Z: hip flexion, knee extension, ankle plantarflexion positive. About X:
hip and knee abduction, ankle inversion positive. About Y: external rotation positive. The files do
not state X and Y. They were found from the ten subjects in stance: the knee's moment less the
ankle's must equal shank x ground reaction, the hip's less the knee's thigh x ground reaction. With
each moment in the axes of its distal segment, these signs leave the least, 0.19 (hip, knee) and
0.27 Nm/kg root-mean-square (knee, ankle), and changing any one leaves more
(`tests/datasets/test_signs.py`). The same signs are also best with the knee's moment in the thigh's
or the laboratory's axes, which fit the ankle's moment better (0.23, 0.20). So the signs are
certain, but the axes of the frontal and transverse moments are not, and the ankle's inversion sign
is the least certain (it depends on using the foot's axes).

The moments show a calibration error of the force plates against the markers: over the ten subjects
the ankle moment divided by vertical force at 45 % of the cycle is 0.14 m on the right and 0.10 m on
the left, a difference that no gait has (docs/paper.md). The curves are left as recorded; the files
of the built-in subjects have the correction beside them.
"""

import difflib
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Final

import numpy as np

from gaitval._internal.io import file_gate
from gaitval._internal.text.plain_numbers import plain_float
from gaitval.arrays import Array
from gaitval.constants import STANDARD_GRAVITY
from gaitval.coordinates import SIDES, Side
from gaitval.errors import RecordError
from gaitval.gait.sampling import SAMPLES

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


def _read_processed(path: Path, columns: Sequence[str], other: str) -> dict[str, Array]:
    """Columns of a tab-separated file of 101 rows, with its gaps."""
    try:
        lines = file_gate.read_text(path, RecordError, largest=file_gate.SIZES.table).splitlines()
    except UnicodeDecodeError:
        raise RecordError(f"{path}: not text. Download the file again.") from None
    header = lines[0].split("\t") if lines else []
    refuse(path, _header_problems(header, columns, other))
    rows = [line.split("\t") for line in lines[1:]]
    if len(rows) != SAMPLES or any(len(row) != len(header) for row in rows):
        raise RecordError(
            f"{path}: not {SAMPLES} whole rows of {len(header)} numbers (0 to 100 % of the gait "
            f"cycle), but {len(rows)}: the file is truncated or not time-normalised. Download it "
            "again."
        )
    found = {}
    for name in columns:
        at = header.index(name)
        try:
            found[name] = np.array([plain_float(row[at]) for row in rows])
        except ValueError as error:
            raise RecordError(f"{path}: column {name}: {error}. Correct it.") from None
    if not np.array_equal(found.pop("Time"), np.arange(SAMPLES)):
        refuse(path, ["column Time: not 0, 1 … 100 (% of the gait cycle). Normalise the time."])
    return found


def read_angles(path: Path) -> dict[str, Array]:
    """Mean angles of the `…ang.txt` file `path`, by keys of `ANGLE_NAMES`: (101,) rad each,
    project's signs, 0 to 100 % of the side's cycle.

    Raises RecordError for missing or renamed columns, an exchanged file or truncation; whether the
    curves are a walker's, `curve_consistency` says.
    """
    path = Path(path)
    found = _read_processed(path, _columns(list(_ANGLES)), other="Moment")
    return {
        f"{name}_{side[0]}": sign * np.radians(found[_LETTER[side] + column])
        for side in SIDES
        for column, (name, sign) in _ANGLES.items()
    }


def read_kinetics(path: Path) -> Kinetics:
    """Mean moments and ground reactions of the `…knt.txt` file `path`.

    Swing is coded 0 in some files and NaN in others; both become zero, but for a gap at the begin
    of stance. Raises RecordError as `read_angles`.
    """
    path = Path(path)
    names = [*_MOMENTS, *_FORCES]
    found = _read_processed(path, _columns(names), other="Angle")
    forces: dict[Side, Array] = {}
    for side in SIDES:
        letter, medial = _LETTER[side], 1 if side == "right" else -1
        early = np.arange(SAMPLES) < 40
        forward, up, medially = (
            np.where(np.isnan(values) & ~early, 0.0, values)
            for values in (found[letter + name] for name in _FORCES)
        )
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
