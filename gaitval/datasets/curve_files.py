"""A subject from anyone's mean curves: CSV, or the text files of WBDS.

A table has 101 rows, 0 to 100 % of each side's own gait cycle, and a column for each curve, named
by its kind and the coordinate: `angle_hip_flexion_r`, `moment_knee_angle_l`, `force_up_r`. The
names and signs are those of `gaitval.gait.record.GaitRecord`. The names may end in `_mean` and the
unit, as in the table that an import writes. Other columns are left alone.
"""

import difflib
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Final

import numpy as np

from gaitval._internal.io import file_gate
from gaitval._internal.io.text_tables import MISSING
from gaitval.arrays import Array
from gaitval.coordinates import SIDES, mirrored
from gaitval.datasets.curve_columns import AngleUnit, read_columns
from gaitval.datasets.curve_consistency import expected_curve, judge_curves
from gaitval.datasets.curve_mistakes import POSITIVE
from gaitval.datasets.wbds import MOMENT_SEAM, read_angles, read_kinetics, refuse
from gaitval.errors import RecordError
from gaitval.gait.mean_curves import MeanCurves, stance_fraction
from gaitval.gait.record import (
    ANGLE_NAMES,
    MOMENT_NAMES,
    REQUIRED_ANGLES,
    REQUIRED_MOMENTS,
)
from gaitval.gait.sampling import SAMPLES

_AXES: Final = ("forward", "left", "up")
_FORCES: Final = [f"{axis}_{side}" for side in "rl" for axis in _AXES]
_KINDS: Final[Mapping[str, tuple[Sequence[str], Sequence[str]]]] = {
    "angle": (ANGLE_NAMES, [n for n in REQUIRED_ANGLES if not n.startswith("subtalar")]),
    "moment": (MOMENT_NAMES, REQUIRED_MOMENTS),
    "force": (_FORCES, _FORCES),
}
"""Names that curves of a kind may have, and those that a table has to have."""
_JUMP: Final = {"angle": (5.0, 60.0), "moment": (0.3, 1.5), "force": (0.3, 1.5)}
"""Degrees, Nm/kg, body weights: between neighbouring rows no mean curve changes by the first; of
one that spans more than the second, by as many times more."""
_FLIGHT: Final = 0.5
"""Stance fraction below which both feet are in the air at times."""


def read_mean_curves(
    paths: Sequence[Path],
    *,
    angle_unit: AngleUnit = "deg",
    mass: float | None = None,
    height: float | None = None,
) -> MeanCurves:
    """The curves of one trial from one file or several (`paths`), angles in `angle_unit`, of a
    person of this `mass`, kg, and `height`, m. Raises RecordError, which lists what is wrong, and
    where, if a file or a curve cannot be used.
    """
    where = ", ".join(map(str, paths))
    if any(_is_wbds(path) for path in paths):
        curves = _from_wbds(paths)
        return _sound(curves, where, mass, height, seam=MOMENT_SEAM)
    columns: dict[str, tuple[Path, Array]] = {}
    left_out: list[str] = []
    notes: list[str] = []
    for path in paths:
        read = read_columns(path, angle_unit)
        left_out += read.others
        notes += read.notes
        for name, values in read.curves.items():
            if name in columns:
                raise RecordError(
                    f"{path}: column {name} is in {columns[name][0]} too. Give each curve once."
                )
            columns[name] = path, values
    curves = {name: values for name, (_, values) in columns.items()}
    if alone := [] if _has(curves, "force_") else [n for n in curves if n.startswith("moment_")]:
        left_out += alone
        notes.append("moments are not used, because there are no forces beside them")
        curves = {name: values for name, values in curves.items() if name not in alone}
    for kind in _KINDS if _has(curves, "force_") else ("angle",):
        refuse(where, _names([n for n in curves if n.startswith(f"{kind}_")], kind))
    if angle_unit == "rad":
        curves |= {n: np.degrees(c) for n, c in curves.items() if n.startswith("angle_")}
    return _sound(curves, where, mass, height, left_out=left_out, notes=notes)


def _sound(
    curves: dict[str, Array],
    where: str,
    mass: float | None,
    height: float | None,
    *,
    seam: tuple[int, ...] = (),
    left_out: Sequence[str] = (),
    notes: Sequence[str] = (),
) -> MeanCurves:
    """The `curves`, deg, Nm/kg and body weights, if they can be a walker's."""
    refuse(where, _gaps(curves))
    refuse(where, [*_still(curves), *_running(curves)])
    judged = judge_curves(
        {n: _without(c, seam) if n.startswith("moment_") else c for n, c in curves.items()},
        mass=mass,
        height=height,
    )
    if judged.refused:
        raise RecordError(f"{where}: cannot be used: {judged.words}")
    if not seam:
        refuse(where, _jumps(curves))
    if expected := [n for n in REQUIRED_ANGLES if f"angle_{n}" not in curves]:
        notes = [
            *notes,
            f"{' and '.join(expected)} are not in it: as those of healthy people",
        ]
        curves |= {f"angle_{name}": expected_curve(f"angle_{name}") for name in expected}
    return MeanCurves(
        {n[6:]: np.radians(values) for n, values in curves.items() if n.startswith("angle_")},
        {n[7:]: values for n, values in curves.items() if n.startswith("moment_")},
        {
            side: np.stack([curves[f"force_{axis}_{side[0]}"] for axis in _AXES], axis=1)
            for side in SIDES
            if _has(curves, "force_")
        },
        seam,
        left_out=tuple(dict.fromkeys(left_out)),
        warnings=(*[judged.words] * bool(judged.words), *_empty(curves), *_untold(judged.untold)),
        notes=tuple(dict.fromkeys(notes)),
    )


def _without(curve: Array, rows: Sequence[int]) -> Array:
    """A closed curve (101,) that runs straight over `rows` that are not to be trusted."""
    trusted = np.delete(np.arange(SAMPLES), rows)
    return np.interp(np.arange(SAMPLES), trusted, curve[trusted], period=float(SAMPLES - 1))


def _has(curves: Mapping[str, Array], kind: str) -> bool:
    return any(name.startswith(kind) for name in curves)


def _still(curves: Mapping[str, Array]) -> list[str]:
    """Sentences on curves that are still, and that nobody walks without."""
    return [
        f"column {name}: is {values[0]:.3g} in all rows, and nobody walks without it. Is the "
        "column empty, or filled in? If forces were not measured, leave out all columns of them "
        "and give --stance."
        for name, values in curves.items()
        if name[:-2] in ("angle_hip_flexion", "angle_knee_angle", "force_up")
        and np.ptp(values) < 1e-9
    ]


def _running(curves: Mapping[str, Array]) -> list[str]:
    """A sentence if both feet are in the air at times."""
    if not _has(curves, "force_"):
        return []
    ends = [_stance_of(curves[f"force_up_{side}"]) for side in "rl"]
    if not max(ends) < _FLIGHT:
        return []
    return [
        f"columns force_up_r and force_up_l: each foot is on the ground for only "
        f"{100 * ends[0]:.0f} and {100 * ends[1]:.0f} % of its cycle, so both are in the air at "
        "times: this is running. gaitval takes walking only."
    ]


def _stance_of(up: Array) -> float:
    """Stance fraction; of a force that is not loaded once, from the strike, 1."""
    normal = up[3:20].mean() > 0.2 and np.abs(up[55:97]).max() < 0.1
    return stance_fraction(up) if normal else 1.0


def _empty(curves: Mapping[str, Array]) -> list[str]:
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


def _untold(names: Sequence[str]) -> list[str]:
    """A sentence on angles whose sign the curves do not show."""
    listed = "; ".join(f"angle_{name}: {POSITIVE[name]}" for name in names if name in POSITIVE)
    if not listed:
        return []
    return [f"these curves do not show whether the sign is right of {listed}. Look it up."]


def _is_wbds(path: Path) -> bool:
    try:
        header = file_gate.read_text(path, RecordError, largest=file_gate.SIZES.values).partition(
            "\n"
        )[0]
    except (RecordError, UnicodeDecodeError):
        return False
    return "RKneeAngleZ" in header or "RKneeMomentZ" in header


def _from_wbds(paths: Sequence[Path]) -> dict[str, Array]:
    kinetics = [path for path in paths if "knt" in path.name]
    angles = [path for path in paths if path not in kinetics]
    if len(angles) != 1 or len(kinetics) > 1:
        raise RecordError(
            f"{', '.join(map(str, paths))}: give one ang.txt and at most one knt.txt of WBDS, with "
            "these names."
        )
    found = {f"angle_{name}": np.degrees(each) for name, each in read_angles(angles[0]).items()}
    for path in kinetics:
        of_forces = read_kinetics(path)
        found |= {f"moment_{name}": values for name, values in of_forces.moments.items()}
        for side, force in of_forces.forces.items():
            found |= {f"force_{a}_{side[0]}": f for a, f in zip(_AXES, force.T, strict=True)}
    return found


def _names(found: Sequence[str], kind: str) -> list[str]:
    """What is wrong with the names of the columns of a `kind` that were `found`."""
    known, required = ([f"{kind}_{name}" for name in names] for names in _KINDS[kind])
    problems = []
    for name in found:
        if name not in known:
            near = difflib.get_close_matches(name, known, n=1)
            hint = f" Is it {near[0]}?" if near else ""
            problems.append(f"column {name}: not the name of a curve.{hint}")
    if missing := [name for name in required if name not in found]:
        none = "" if found else f" None begins with {kind}_: rename yours."
        problems.append(
            f"missing columns: {', '.join(missing)}.{none} `gaitval curves --template` writes a "
            "table with all of them."
        )
    return problems


def _gaps(curves: Mapping[str, Array]) -> list[str]:
    problems = []
    for name, values in curves.items():
        bad = np.flatnonzero(~np.isfinite(values))
        filled = np.flatnonzero(np.isin(np.abs(values), MISSING))
        for rows, seen in ((filled, "{0:g} in row {1}{2} stands for a value that is missing"),
                           (bad, "not a number in row {1}{2}")):  # fmt: skip
            if len(rows):
                more = f" and {len(rows) - 1} others" if len(rows) > 1 else ""
                problems.append(
                    f"column {name}: {seen.format(values[rows[0]], rows[0] + 2, more)}; a mean "
                    "curve has no gaps (forces in swing are 0)."
                )
                break
    return problems


def _jumps(curves: Mapping[str, Array]) -> list[str]:
    problems = []
    for name, values in curves.items():
        step = np.abs(np.diff(values))
        most, wide = _JUMP[name.partition("_")[0]]
        if step.max() > most * max(1.0, np.ptp(values) / wide):
            problems.append(
                f"column {name}: jumps by {step.max():.3g} between rows "
                f"{step.argmax() + 2} and {step.argmax() + 3}; a mean curve is smooth."
            )
    return problems
