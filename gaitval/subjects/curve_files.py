"""A subject from anyone's mean curves: CSV, or the text files of WBDS.

A table has 101 rows, 0 to 100 % of each side's own gait cycle, and a column for each curve, named
by its kind and the coordinate: `angle_hip_flexion_r`, `moment_knee_angle_l`, `force_up_r`. The
names and signs are those of `gaitval.gait.record.GaitRecord`. The names may end in `_mean` and the
unit, as in the table that an import writes. Other columns are left alone.
"""

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Final

import numpy as np

from gaitval.arrays import Array
from gaitval.coordinates import SIDES, mirrored
from gaitval.errors import RecordError
from gaitval.gait.mean_curves import MeanCurves
from gaitval.gait.record import (
    ANGLE_NAMES,
    MOMENT_NAMES,
    REQUIRED_ANGLES,
    REQUIRED_MOMENTS,
)
from gaitval.gait.sampling import SAMPLES
from gaitval.subjects.curve_columns import AngleUnit, read_columns
from gaitval.subjects.curve_consistency import expected_curve, judge_curves

_AXES: Final = ("forward", "left", "up")
_FORCES: Final = [f"{axis}_{side}" for side in "rl" for axis in _AXES]
_KINDS: Final[Mapping[str, tuple[Sequence[str], Sequence[str]]]] = {
    "angle": (ANGLE_NAMES, [n for n in REQUIRED_ANGLES if not n.startswith("subtalar")]),
    "moment": (MOMENT_NAMES, REQUIRED_MOMENTS),
    "force": (_FORCES, _FORCES),
}
"""Names that curves of a kind may have, and those that a table has to have."""
_MOVED: Final = ("angle_hip_flexion", "angle_knee_angle", "force_up")
"""What nobody walks without."""


def read_mean_curves(paths: Sequence[Path], *, angle_unit: AngleUnit = "deg") -> MeanCurves:
    """The curves of one trial from one file or several (`paths`), angles in `angle_unit`. Raises
    RecordError, which says what is wrong, and where, if a file or a curve cannot be used.
    """
    where = ", ".join(map(str, paths))
    curves: dict[str, Array] = {}
    left_out, notes, seam = list[str](), list[str](), tuple[int, ...]()
    for path in paths:
        read = read_columns(path, angle_unit)
        if twice := read.curves.keys() & curves.keys():
            raise RecordError(f"{path}: {min(twice)} is there twice. Give each curve once.")
        curves |= read.curves
        left_out += read.others
        notes += read.notes
        seam = seam or read.seam
    with_forces = any(name.startswith("force_") for name in curves)
    if alone := [] if with_forces else [n for n in curves if n.startswith("moment_")]:
        left_out += alone
        notes.append("moments are not used, because there are no forces beside them")
        curves = {name: values for name, values in curves.items() if name not in alone}
    _refuse(where, _unusable(curves, with_forces=with_forces))
    if angle_unit == "rad":
        curves |= {n: np.degrees(c) for n, c in curves.items() if n.startswith("angle_")}
    judged = judge_curves(
        {n: _without(c, seam) if n.startswith("moment_") else c for n, c in curves.items()}
    )
    if judged.refused:
        raise RecordError(f"{where}: cannot be used: {judged.words}")
    if expected := [n for n in REQUIRED_ANGLES if f"angle_{n}" not in curves]:
        notes.append(f"{' and '.join(expected)} are not in it: as those of healthy people")
        curves |= {f"angle_{name}": expected_curve(f"angle_{name}") for name in expected}
    warnings = [judged.words, *_not_measured(curves), judged.unseen]
    return MeanCurves(
        {n[6:]: np.radians(values) for n, values in curves.items() if n.startswith("angle_")},
        {n[7:]: values for n, values in curves.items() if n.startswith("moment_")},
        {
            side: np.stack([curves[f"force_{axis}_{side[0]}"] for axis in _AXES], axis=1)
            for side in SIDES
            if with_forces
        },
        seam,
        left_out=tuple(dict.fromkeys(left_out)),
        warnings=tuple(filter(None, warnings)),
        notes=tuple(dict.fromkeys(notes)),
    )


def _without(curve: Array, rows: Sequence[int]) -> Array:
    """A closed curve (101,) that runs straight over `rows` that are not to be trusted."""
    trusted = np.delete(np.arange(SAMPLES), rows)
    return np.interp(np.arange(SAMPLES), trusted, curve[trusted], period=float(SAMPLES - 1))


def _unusable(curves: Mapping[str, Array], *, with_forces: bool) -> list[str]:
    """Sentences on names that are unknown or missing, and on curves with gaps or without motion."""
    problems = []
    for kind in _KINDS if with_forces else ("angle",):
        known, required = ([f"{kind}_{name}" for name in names] for names in _KINDS[kind])
        own = [name for name in curves if name.startswith(f"{kind}_")]
        problems += [f"column {name}: not the name of a curve" for name in own if name not in known]
        if missing := [name for name in required if name not in own]:
            problems.append(f"missing columns: {', '.join(missing)}")
    for name, values in curves.items():
        gaps = np.flatnonzero(np.isnan(values))
        if len(gaps):
            problems.append(
                f"column {name}: not a number in row {gaps[0] + 2}; a curve has no gaps"
            )
        elif name[:-2] in _MOVED and np.ptp(values) < 1e-9:
            problems.append(f"column {name}: the same in all rows, and nobody walks without it")
    return problems


def _refuse(where: str, problems: Sequence[str]) -> None:
    if problems:
        shown = "\n".join(f"  - {problem}" for problem in problems[:10])
        raise RecordError(
            f"{where}: cannot be used\n{shown}\n`gaitval curves --template` writes a table with "
            "all columns. If forces were not measured, leave out all of them and give --stance."
        )


def _not_measured(curves: Mapping[str, Array]) -> list[str]:
    """Sentences on curves that were not measured, or not on both sides."""
    found = []
    if still := [name for name, values in curves.items() if np.ptp(values) < 1e-9]:
        found.append(
            f"{', '.join(still)}: the same number in all rows, so it was not measured. What is "
            "found about it means nothing."
        )
    angles = [n for n in curves if n.startswith("angle_") and n not in still]
    if angles and all(np.array_equal(curves[n], curves[mirrored(n)]) for n in angles):
        found.append(
            "right and left have the same angles to the last digit: one side is a copy of the "
            "other, or both are the mean of both. What is found of right against left means nothing"
        )
    return found
