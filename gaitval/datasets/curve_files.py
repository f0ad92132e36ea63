"""A subject from anyone's mean curves: CSV, Parquet, or the text files of WBDS.

A table has 101 rows, 0 to 100 % of each side's own gait cycle, and a column for each curve, named
by its kind and the coordinate: `angle_hip_flexion_r`, `moment_knee_angle_l`, `force_up_r`. The
names and signs are those of `gaitval.gait.record.GaitRecord`. The names may end in `_mean` and the
unit, as in the table that an import writes. Other columns are left alone.
"""

import csv
import difflib
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Final, Literal

import numpy as np
import pandas as pd

from gaitval import file_gate
from gaitval.arrays import Array
from gaitval.coordinates import SIDES
from gaitval.datasets.curve_signs import POSITIVE, signs
from gaitval.datasets.wbds_files import MOMENT_SEAM, read_angles, read_kinetics, refuse
from gaitval.errors import RecordError
from gaitval.gait.mean_curves import MeanCurves
from gaitval.gait.record import (
    ANGLE_NAMES,
    MOMENT_NAMES,
    REQUIRED_ANGLES,
    REQUIRED_MOMENTS,
)
from gaitval.gait.sampling import SAMPLES
from gaitval.text_tables import text_table, without_unit

AngleUnit = Literal["deg", "rad"]

_AXES: Final = ("forward", "left", "up")
_FORCES: Final = tuple(f"{axis}_{side}" for side in "rl" for axis in _AXES)

_JUMP: Final = {"angle": 5.0, "moment": 0.3, "force": 0.3}
"""Degrees, Nm/kg, body weights between neighbouring rows, which no mean curve changes by."""

_MOMENT_UNITS: Final = (
    (4.0, 15.0, "% of body weight times height", "Multiply moments by 0.0980665 and the height, m"),
    (30.0, 300.0, "Nm", "Divide moments by the body mass, kg"),
    (500.0, 3000.0, "Nmm/kg", "Divide moments by 1000"),
    (3e4, 3e5, "Nmm", "Divide moments by 1000 and by the body mass, kg"),
)
"""Largest moment of an ankle from, and to, in a unit, and how it becomes Nm/kg. It is 0.6 to 2
Nm/kg in walking; bodies have 40 to 150 kg and 1.2 to 2 m. Between these no unit is guessed."""

_FORCE_UNITS: Final = (
    (3.0, 25.0, "N/kg", "Divide forces by 9.80665"),
    (60.0, 200.0, "% of body weight", "Divide forces by 100"),
    (200.0, 1e4, "N", "Divide by weight, N: mass times 9.80665"),
)
"""Likewise of the largest vertical force, which is 0.8 to 1.5 body weights."""

_WEAKEST: Final = 0.35
"""Nm/kg. Where neither ankle's largest moment reaches this, the body's weight 36 mm before the
joint, the unit is wrong: slow walkers, children and patients have 0.6 on one side at least."""
_NAMED: Final = {"angle": ("deg", "rad"), "moment": ("Nm/kg",), "force": ("BW",)}
"""Units that the name of a column may end in, by its first word."""
SAME_PERCENT: Final = 0.01
"""Of the cycle, %, within which a row is of the percent that its place says."""
_LANDED: Final = 0.05
"""Body weights on a foot that has landed; the ten have 0.24 to 0.6 at 3 to 5 % of their cycle."""
_NONE: Final = 0.05
"""Nm/kg. An ankle of less has no foot on the ground, or its column is empty."""
_STILL: Final = 0.5
"""deg. Every angle of pelvis and leg but the tilt spans more over a cycle: those of 104 people,
healthy and patients, one stride a side, at least 1.0°."""

_NO_TABLES: Final = (".toml", ".c3d", ".trc", ".mot", ".sto", ".osim", ".json", ".xlsx")


def read_mean_curves(paths: Sequence[Path], *, angle_unit: AngleUnit = "deg") -> MeanCurves:
    """The curves of one trial from one file or several (`paths`), angles in `angle_unit` unless the
    names of their columns say another (`angle_hip_flexion_r_mean_rad`). Raises
    RecordError, which lists what is wrong, and where, if a file or a curve cannot be used.
    """
    if any(_is_wbds(path) for path in paths):
        return _from_wbds(paths)
    columns: dict[str, tuple[Path, Array]] = {}
    left_out: list[str] = []
    for path in paths:
        curves, others = _table(path, angle_unit)
        left_out += others
        for name, values in curves.items():
            if name in columns:
                raise RecordError(
                    f"{path}: column {name} is in {columns[name][0]} too. Give each curve once."
                )
            columns[name] = path, values
    where = ", ".join(str(path) for path in paths)
    angles = _of_kind(columns, "angle", ANGLE_NAMES, REQUIRED_ANGLES, where)
    kinetic = any(name.startswith(("moment_", "force_")) for name in columns)
    moments = _of_kind(columns, "moment", MOMENT_NAMES, REQUIRED_MOMENTS, where) if kinetic else {}
    forces = _of_kind(columns, "force", _FORCES, _FORCES, where) if kinetic else {}
    degrees = angles if angle_unit == "deg" else {k: np.degrees(v) for k, v in angles.items()}
    problems = [
        *_gaps({"angle": angles, "moment": moments, "force": forces}),
        *_angle_problems(degrees, angle_unit),
        *_kinetic_problems(moments, forces),
    ]
    refuse(where, problems)
    refuse(where, _jumps({"angle": degrees, "moment": moments, "force": forces}))
    known = signs(degrees, moments, forces)
    refuse(where, known.wrong)
    return MeanCurves(
        {name: np.radians(values) for name, values in degrees.items()},
        moments,
        {
            side: np.stack([forces[f"{axis}_{side[0]}"] for axis in _AXES], axis=1)
            for side in SIDES
            if forces
        },
        left_out=tuple(dict.fromkeys(left_out)),
        warnings=(*known.warnings, *_untold(known.untold)),
    )


def _untold(names: Sequence[str]) -> list[str]:
    """A sentence on angles whose sign the curves do not show."""
    if not names:
        return []
    listed = "; ".join(f"angle_{name}: {POSITIVE[name]}" for name in names)
    return [f"these curves do not show whether the sign is right of {listed}. Look it up."]


def curve_problems(
    degrees: Mapping[str, Array], moments: Mapping[str, Array], forces: Mapping[str, Array]
) -> list[str]:
    """What cannot be a gait's in curves (101,) by their names without the kind: a sentence for each
    sign, unit or side that is wrong. Angles in degrees, moments in Nm/kg, forces in body weights.
    """
    return (
        [*_angle_problems(degrees, "deg"), *_kinetic_problems(moments, forces)]
        or _jumps({"angle": degrees, "moment": moments, "force": forces})
        or list(signs(degrees, moments, forces).wrong)
    )


def _is_wbds(path: Path) -> bool:
    try:
        header = file_gate.read_text(path, RecordError, largest=file_gate.VALUES).partition("\n")[0]
    except (RecordError, UnicodeDecodeError):
        return False
    return "RKneeAngleZ" in header or "RKneeMomentZ" in header


def _from_wbds(paths: Sequence[Path]) -> MeanCurves:
    kinetics = [path for path in paths if "knt" in path.name]
    angles = [path for path in paths if path not in kinetics]
    if len(angles) != 1 or len(kinetics) > 1:
        raise RecordError(
            f"{', '.join(map(str, paths))}: give one ang.txt and at most one knt.txt of WBDS, with "
            "these names."
        )
    found = read_angles(angles[0])
    if not kinetics:
        return MeanCurves(found, {}, {})
    of_forces = read_kinetics(kinetics[0])
    return MeanCurves(found, of_forces.moments, of_forces.forces, MOMENT_SEAM)


def _table(path: Path, angle_unit: AngleUnit) -> tuple[dict[str, Array], list[str]]:
    """Columns of curves in a file, without `_mean` and the unit, angles in `angle_unit`, and the
    names of the others.
    """
    if path.suffix.lower() in _NO_TABLES:
        raise RecordError(
            f"{path}: a {path.suffix} file is no table of mean curves. Give CSV or Parquet, or "
            "WBDS's ang.txt and knt.txt; `gaitval curves --template` writes a CSV to fill in."
        )
    try:
        table = _parquet(path) if path.suffix.lower() in (".parquet", ".pq") else _csv(path)
    except RecordError:
        raise
    except Exception as error:  # the readers have no common error
        raise RecordError(f"{path}: {_unread(path, error)}") from None
    found, others = {}, []
    for name in map(str, table.columns):
        plain, unit = without_unit(name.strip())
        plain = plain.removesuffix("_mean")
        beside = plain.endswith(("_sd", "_band90", "_uncorrected"))
        if not plain.startswith(("angle_", "moment_", "force_")) or beside:
            if plain.lower() == "percent":
                _check_percent(path, pd.to_numeric(table[name], errors="coerce").to_numpy())
            others.append(name.strip())
            continue
        values = pd.to_numeric(table[name], errors="coerce").to_numpy(dtype=float)
        if len(values) != SAMPLES:
            raise RecordError(_another_length(path, len(values)))
        if unit and unit not in _NAMED.get(plain.partition("_")[0], ()):
            raise RecordError(
                f"{path}: column {name.strip()}: {unit} is no unit of such a curve. Give angles in "
                "deg or rad, moments in nm_kg, forces in bw (body weights), or leave the unit out."
            )
        if unit == "rad" and angle_unit == "deg":
            values = np.degrees(values)
        elif unit == "deg" and angle_unit == "rad":
            values = np.radians(values)
        found[plain] = values
    if not found:
        seen = ", ".join(map(str, list(table.columns)[:6]))
        raise RecordError(
            f"{path}: no column of a curve; its columns are {seen}. Name them by kind and "
            "coordinate: angle_hip_flexion_r, moment_knee_angle_l, force_up_r. `gaitval curves "
            "--template` writes a file with all of them."
        )
    return found, others


def _check_percent(path: Path, percent: Array) -> None:
    """Refuse rows whose own column says that they are not 0 to 100 % of the cycle, in order."""
    wrong = np.flatnonzero(~(np.abs(percent - np.arange(len(percent))) < SAME_PERCENT))
    if len(percent) == SAMPLES and len(wrong):
        row = int(wrong[0])
        raise RecordError(
            f"{path}: column percent: {percent[row]:g} in row {row + 2}, where {row} is needed. "
            "Rows are 0, 1, … 100 % of the gait cycle, from heel strike to heel strike. Sort or "
            "resample the curves, or leave the column out if it is something else."
        )


def _parquet(path: Path) -> pd.DataFrame:
    """The table of a file; one of another length is not read."""
    rows = file_gate.parquet_rows(path, RecordError, largest=file_gate.VALUES)
    if rows != SAMPLES:
        raise RecordError(_another_length(path, rows))
    return pd.read_parquet(path)


def _csv(path: Path) -> pd.DataFrame:
    """The table of a file, NaN where a row ends early, without the empty rows at its end."""
    text = file_gate.read_text(path, RecordError, largest=file_gate.VALUES)
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
    return pd.DataFrame([dict(zip(names, cells, strict=False)) for _, cells in rows], columns=names)


def _another_length(path: Path, rows: int) -> str:
    return (
        f"{path}: {rows} rows of data, but there must be {SAMPLES}: 0 to 100 % of each side's own "
        "gait cycle. Resample the curves."
    )


def _unread(path: Path, error: Exception) -> str:
    """Why a file is no table of curves, for whoever exported it."""
    if path.suffix.lower() in (".parquet", ".pq"):
        return "cannot be read as Parquet; it is damaged, or something else. Export it again."
    if isinstance(error, UnicodeDecodeError):
        return "cannot be read as CSV: it is not UTF-8 text. Export it as CSV in UTF-8."
    why = f" ({error})" if isinstance(error, csv.Error) else ""
    return (
        f"cannot be read as CSV{why}. Export it again, with a header and the same columns in each "
        "row."
    )


def _of_kind(
    columns: Mapping[str, tuple[Path, Array]],
    kind: str,
    known: Sequence[str],
    required: Sequence[str],
    where: str,
) -> dict[str, Array]:
    found = {
        name.removeprefix(f"{kind}_"): values
        for name, (_, values) in columns.items()
        if name.startswith(f"{kind}_")
    }
    problems = []
    for name in found:
        if name not in known:
            near = difflib.get_close_matches(name, known, n=1)
            hint = f" Is it {kind}_{near[0]}?" if near else ""
            problems.append(f"column {kind}_{name}: not the name of a curve.{hint}")
    missing = [f"{kind}_{name}" for name in required if name not in found]
    if missing:
        problems.append(f"missing columns: {', '.join(missing)}.")
    refuse(where, problems)
    return found


def _gaps(kinds: Mapping[str, Mapping[str, Array]]) -> list[str]:
    problems = []
    for kind, curves in kinds.items():
        for name, values in curves.items():
            bad = np.flatnonzero(~np.isfinite(values))
            if len(bad):
                problems.append(
                    f"column {kind}_{name}: not a number in row {bad[0] + 2}"
                    + (f" and {len(bad) - 1} others" if len(bad) > 1 else "")
                    + "; a mean curve has no gaps (forces in swing are 0)."
                )
    return problems


def _angle_problems(angles: Mapping[str, Array], unit: AngleUnit) -> list[str]:
    """What is wrong with angles in degrees."""
    problems = []
    other = "radians" if unit == "deg" else "degrees"
    option = "rad" if unit == "deg" else "deg"
    for side in "rl":
        knee, hip = angles[f"knee_angle_{side}"], angles[f"hip_flexion_{side}"]
        ankle, name = angles[f"ankle_angle_{side}"], f"column angle_knee_angle_{side}"
        if not np.isfinite([knee, hip, ankle]).all():
            continue
        for joint, curve, neutral in (("knee", knee, 180.0), ("ankle", ankle, 90.0)):
            if np.median(np.abs(curve)) > 0.5 * neutral and unit == "deg":
                problems.append(
                    f"column angle_{joint}_angle_{side}: {np.median(curve):.0f}° (median). It is "
                    f"measured from {neutral:.0f}° in standing, but here standing is 0: give the "
                    "difference, positive in flexion of the knee and dorsiflexion of the ankle."
                )
                return problems
        span = float(np.ptp(knee))
        if span < 2.0 or span > 180.0:
            problems.append(
                f"{name}: it spans {span:.3g}° if it is in {'degrees' if unit == 'deg' else unit}; "
                f"this looks like {other}. Give --angle-unit {option}."
            )
        elif 55 <= np.argmin(knee) <= 90 and not 55 <= np.argmax(knee) <= 90:
            problems.append(
                f"{name}: smallest at {np.argmin(knee)} % of the cycle. Knee flexion is positive, "
                "and largest in swing (55-90 %). Change its sign."
            )
        elif not 55 <= np.argmax(knee) <= 90 or span < 25:
            problems.append(
                f"{name}: largest at {np.argmax(knee)} % of the cycle with a range of {span:.3g}°; "
                "knee flexion is largest in swing (55-90 %) with more than 25°. Are columns "
                "exchanged, or are the rows not 0 to 100 % of this side's own cycle?"
            )
        elif 35 <= np.argmax(hip) <= 75:
            problems.append(
                f"column angle_hip_flexion_{side}: largest at {np.argmax(hip)} % of the cycle. Hip "
                "flexion is positive, and smallest at 35-75 %. Change its sign."
            )
        elif not 35 <= np.argmin(hip) <= 75:
            problems.append(
                f"column angle_hip_flexion_{side}: smallest at {np.argmin(hip)} % of the cycle; "
                "the hip is most extended at 35-75 %. Are columns exchanged, or are the rows not "
                "0 to 100 % of this side's own cycle?"
            )
        elif ankle[35:52].mean() < ankle[57:72].mean():
            problems.append(
                f"column angle_ankle_angle_{side}: larger after push-off (57-72 %) than before it. "
                "Dorsiflexion is positive. Change its sign."
            )
    return problems or _still_angles(angles)


def _still_angles(angles: Mapping[str, Array]) -> list[str]:
    """Angles that hardly move on either side, while the knee does: they are in radians."""
    problems = []
    for name in dict.fromkeys(name[:-2] for name in angles if "tilt" not in name):
        spans = [float(np.ptp(angles[f"{name}_{s}"])) for s in "rl" if f"{name}_{s}" in angles]
        if 0.0 < max(spans) < _STILL and np.degrees(max(spans)) > 2 * _STILL:
            problems.append(
                f"columns angle_{name}_r and angle_{name}_l: they span {max(spans):.2g}°, and "
                "nobody walks with so still a joint; this looks like radians, while other columns "
                "are in degrees. Write all of them in one unit, or leave out an angle that was not "
                "measured."
            )
    return problems


def _kinetic_problems(moments: Mapping[str, Array], forces: Mapping[str, Array]) -> list[str]:
    problems = []
    for side in "rl" if moments else "":
        ankle, up = moments[f"ankle_angle_{side}"], forces[f"up_{side}"]
        if not np.isfinite([ankle, up]).all():
            continue
        name = f"column moment_ankle_angle_{side}"
        largest = np.abs(ankle).max()
        if largest > _MOMENT_UNITS[0][0]:
            problems.append(f"{name}: {_unit_of(largest, _MOMENT_UNITS, 'Nm/kg')}")
        elif ankle[40:55].mean() > 0.1:
            problems.append(
                f"{name}: {ankle[40:55].mean():.2g} Nm/kg at push-off (40-55 %). Moments are "
                "internal and positive where they increase the angle, so the calf's is below "
                "0. Change its sign."
            )
        elif side == "r" and (weak := _weak_ankles(moments)):
            problems.append(weak)
        elif largest < _NONE:
            problems.append(
                f"{name}: reaches only {largest:.2g} Nm/kg, which no foot on the ground has. Is "
                "the column empty, or another joint's?"
            )
        name = f"column force_up_{side}"
        if np.abs(up).max() > _FORCE_UNITS[0][0]:
            problems.append(f"{name}: {_unit_of(np.abs(up).max(), _FORCE_UNITS, 'body weights')}")
        elif up[10:50].mean() < 0.3:
            problems.append(
                f"{name}: its mean is {up[10:50].mean():.2g} body weights in stance (10-50 %); the "
                "ground pushes up. Is its sign changed, or is it the other foot's?"
            )
        elif up[75:97].max() > 0.1:
            problems.append(
                f"{name}: {up[75:97].max():.2g} body weights in swing (75-96 %). Are the sides "
                "exchanged, or the rows not of this side's own cycle?"
            )
        elif up[3:6].mean() < _LANDED:
            problems.append(
                f"{name}: {up[3:6].mean():.2g} body weights at 3-5 %, where the foot has landed. "
                "Are the rows not from heel strike to heel strike of this side?"
            )
        elif not forces[f"forward_{side}"][5:25].mean() < forces[f"forward_{side}"][40:58].mean():
            problems.append(
                f"column force_forward_{side}: it does not brake first (5-25 %) and drive then "
                "(40-58 %). The force on the foot is positive forward. Change its sign."
            )
        else:
            inward = {
                each: sign * forces[f"left_{each}"][15:45].mean()
                for each, sign in (("r", 1.0), ("l", -1.0))
            }
            if max(inward.values()) < 0.0 and side == "r":
                problems.append(
                    "columns force_left_r and force_left_l: both point away from the midline in "
                    "mid-stance. Either right and left are exchanged, in all columns: exchange "
                    "them; or this force is positive to the right: then change its sign on both "
                    "feet. It is positive to the person's left on both. Look which it is: a sign "
                    "that is changed would hide exchanged sides."
                )
            elif inward[side] < 0.0 <= max(inward.values()):
                problems.append(
                    f"column force_left_{side}: it points away from the midline in mid-stance. It "
                    "is positive to the person's left on both feet. Change its sign."
                )
    return problems


def _unit_of(largest: float, units: Sequence[tuple[float, float, str, str]], wanted: str) -> str:
    """What unit the largest value of a curve shows, and how it becomes the wanted one."""
    size = f"reaches {largest:.4g}; "
    for low, high, unit, fix in units:
        if low < largest <= high:
            return f"{size}this looks like {unit}. {fix}: they must be in {wanted}."
    known = ", ".join(f"{unit} {low:g} to {high:g}" for low, high, unit, _ in units)
    return (
        f"{size}no usual unit has this ({known}), and they must be in {wanted}. Export them again, "
        "or find out what they were divided by."
    )


def _weak_ankles(moments: Mapping[str, Array]) -> str:
    """A sentence if the ankles' moments (101,) are too small to be in Nm/kg, else an empty one."""
    right, left = (np.abs(moments[f"ankle_angle_{side}"]).max() for side in "rl")
    if not max(right, left) < _WEAKEST:  # a gap is named elsewhere
        return ""
    return (
        f"columns moment_ankle_angle_r and _l: reach {right:.2g} and {left:.2g}; a walker's are "
        "0.6 to 2 Nm/kg, and less on one side only. Were they divided by the body mass twice, or "
        "are they another joint's? They must be in Nm/kg."
    )


def _jumps(kinds: Mapping[str, Mapping[str, Array]]) -> list[str]:
    problems = []
    for kind, curves in kinds.items():
        for name, values in curves.items():
            step = np.abs(np.diff(values))
            if step.max() > _JUMP[kind] * max(1.0, np.ptp(values) / {"angle": 60.0}.get(kind, 1.5)):
                problems.append(
                    f"column {kind}_{name}: jumps by {step.max():.3g} between rows "
                    f"{step.argmax() + 2} and {step.argmax() + 3}; a mean curve is smooth."
                )
    return problems
