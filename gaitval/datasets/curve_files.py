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
from gaitval.datasets.curve_causes import SAGITTAL, advised, doubts, explained
from gaitval.datasets.curve_columns import AngleUnit, read_columns
from gaitval.datasets.curve_signs import POSITIVE, signs
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

_SHEAR_UNITS: Final = (
    (0.8, 6.0, "N/kg", "Divide forces by 9.80665"),
    (6.0, 50.0, "% of body weight", "Divide forces by 100"),
    (50.0, 1e3, "N", "Divide by weight, N: mass times 9.80665"),
)
"""Likewise of the largest horizontal force, which is 0.05 to 0.35 body weights."""

_COLUMNS_OR_ROWS: Final = (
    "Are columns exchanged, or are the rows not 0 to 100 % of this side's own cycle?"
)
_ZEROS: Final[Mapping[str, tuple[str, float]]] = {
    "knee_angle": ("180° in standing", 90.0),
    "ankle_angle": ("90° in standing", 45.0),
    "hip_flexion": ("90° or 180° in standing", 60.0),
    "pelvis_tilt": ("another axis than the vertical", 50.0),
    "pelvis_list": ("another axis than the vertical", 30.0),
    "pelvis_rotation": ("an axis of the laboratory and not from the way of walking", 40.0),
}
"""Where an angle may be measured from, and the median, deg, that shows it."""
_NO_SWING: Final = {"knee_angle": 2.0, "hip_flexion": 1.2, "ankle_angle": 1.0}
"""deg. Who walks swings knee and hip by 20 and more; so does a sound ankle, in radians 0.4."""
_NEVER: Final = 0.1
"""deg. A joint that spans less is still in any unit."""
_IN_THE_AIR: Final = 0.25
"""Nm/kg, with which a foot's own weight and inertia cannot load its ankle."""
_ZERO: Final = np.zeros(SAMPLES)
_FLIGHT: Final = 0.5
"""Stance fraction below which both feet are in the air at times."""

_WEAKEST: Final = 0.35
"""Nm/kg. Where neither ankle's largest moment reaches this, the body's weight 36 mm before the
joint, the unit is wrong: slow walkers, children and patients have 0.6 on one side at least."""
_LANDED: Final = 0.05
"""Body weights on a foot that has landed; the ten have 0.24 to 0.6 at 3 to 5 % of their cycle."""
_NONE: Final = 0.05
"""Nm/kg. An ankle of less has no foot on the ground, or its column is empty."""
_STILL: Final = 0.5
"""deg. Every angle of pelvis and leg but the tilt spans more over a cycle: those of 104 people,
healthy and patients, one stride a side, at least 1.0°."""


def read_mean_curves(paths: Sequence[Path], *, angle_unit: AngleUnit = "deg") -> MeanCurves:
    """The curves of one trial from one file or several (`paths`), angles in `angle_unit`. Raises
    RecordError, which lists what is wrong, and where, if a file or a curve cannot be used.
    """
    if any(_is_wbds(path) for path in paths):
        return _from_wbds(paths)
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
    where = ", ".join(str(path) for path in paths)
    angles = _of_kind(columns, "angle", ANGLE_NAMES, REQUIRED_ANGLES, where)
    kinetic = any(name.startswith(("moment_", "force_")) for name in columns)
    moments = _of_kind(columns, "moment", MOMENT_NAMES, REQUIRED_MOMENTS, where) if kinetic else {}
    forces = _of_kind(columns, "force", _FORCES, _FORCES, where) if kinetic else {}
    degrees = angles if angle_unit == "deg" else {k: np.degrees(v) for k, v in angles.items()}
    refuse(where, _gaps({"angle": angles, "moment": moments, "force": forces}))
    refuse(where, _running(forces))
    refuse(where, [*_angle_problems(degrees, angle_unit), *_kinetic_problems(moments, forces)])
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
        warnings=(
            *known.warnings,
            *doubts(degrees, moments, forces),
            *_untold(known.untold),
        ),
        notes=tuple(dict.fromkeys(notes)),
    )


def _running(forces: Mapping[str, Array]) -> list[str]:
    """A sentence if both feet are in the air at times."""
    if not forces or not np.isfinite([*forces.values()]).all():
        return []
    ends = [_stance_of(forces[f"up_{side}"]) for side in "rl"]
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


def _untold(names: Sequence[str]) -> list[str]:
    """A sentence on angles whose sign the curves do not show."""
    if not names:
        return []
    listed = "; ".join(f"angle_{name}: {POSITIVE[name]}" for name in names)
    return [f"these curves do not show whether the sign is right of {listed}. Look it up."]


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
        none = "" if found else f" None begins with {kind}_: rename yours."
        problems.append(f"missing columns: {', '.join(missing)}.{none}")
    refuse(where, problems)
    return found


def _gaps(kinds: Mapping[str, Mapping[str, Array]]) -> list[str]:
    problems = []
    for kind, curves in kinds.items():
        for name, values in curves.items():
            bad = np.flatnonzero(~np.isfinite(values))
            filled = np.flatnonzero(np.isin(np.abs(values), MISSING))
            if len(filled):
                problems.append(
                    f"column {kind}_{name}: {values[filled[0]]:g} in row {filled[0] + 2}"
                    + (f" and {len(filled) - 1} others" if len(filled) > 1 else "")
                    + " stands for a value that is missing; a mean curve has no gaps."
                )
            elif len(bad):
                problems.append(
                    f"column {kind}_{name}: not a number in row {bad[0] + 2}"
                    + (f" and {len(bad) - 1} others" if len(bad) > 1 else "")
                    + "; a mean curve has no gaps (forces in swing are 0)."
                )
    return problems


def _angle_problems(angles: Mapping[str, Array], unit: AngleUnit) -> list[str]:
    """What is wrong with angles in degrees."""
    problems = [*_other_zeros(angles), *unit_problems(angles, unit)]
    if problems:
        return problems
    for side in "rl":
        knee, hip = angles[f"knee_angle_{side}"], angles[f"hip_flexion_{side}"]
        ankle, name = angles[f"ankle_angle_{side}"], f"column angle_knee_angle_{side}"
        if not np.isfinite([knee, hip, ankle]).all():
            continue
        span = float(np.ptp(knee))
        odd = advice = ""
        if 55 <= np.argmin(knee) <= 90 and not 55 <= np.argmax(knee) <= 90:
            odd = (
                f"{name}: smallest at {np.argmin(knee)} % of the cycle. Knee flexion is positive, "
                "and largest in swing (55-90 %)."
            )
            advice = "Change its sign."
        elif not 55 <= np.argmax(knee) <= 90 or span < 25:
            odd = (
                f"{name}: largest at {np.argmax(knee)} % of the cycle with a range of {span:.3g}°; "
                "knee flexion is largest in swing (55-90 %) with more than 25°."
            )
            advice = _COLUMNS_OR_ROWS
        elif 35 <= np.argmax(hip) <= 75:
            odd = (
                f"column angle_hip_flexion_{side}: largest at {np.argmax(hip)} % of the cycle. Hip "
                "flexion is positive, and smallest at 35-75 %."
            )
            advice = "Change its sign."
        elif not 35 <= np.argmin(hip) <= 75:
            odd = (
                f"column angle_hip_flexion_{side}: smallest at {np.argmin(hip)} % of the cycle; "
                "the hip is most extended at 35-75 %."
            )
            advice = _COLUMNS_OR_ROWS
        elif ankle[35:52].mean() < ankle[57:72].mean():
            odd = (
                f"column angle_ankle_angle_{side}: larger after push-off (57-72 %) than before it. "
                "Dorsiflexion is positive."
            )
            advice = "Change its sign."
        if odd:
            problems.append(f"{odd} {advised('angle', side, angles, advice)}")
    return problems


def _other_zeros(angles: Mapping[str, Array]) -> list[str]:
    """Angles that are measured from 90°, 180° or another zero than standing, or direction."""
    problems = []
    for name, (zero, farthest) in _ZEROS.items():
        off = {
            side: float(np.median(angles[f"{name}_{side}"]))
            for side in "rl"
            if f"{name}_{side}" in angles
            and np.median(np.abs(angles[f"{name}_{side}"])) > farthest
            and np.ptp(angles[f"{name}_{side}"]) < 180.0
        }
        for side, median in off.items():
            problems.append(
                f"column angle_{name}_{side}: {median:.0f}° (median). It is measured from {zero}, "
                f"but here standing is 0: give the difference; {POSITIVE[name]}."
            )
    return problems


def unit_problems(angles: Mapping[str, Array], unit: AngleUnit = "deg") -> list[str]:
    """What shows that angles in degrees, which were said to be in `unit`, are not, or not all."""
    problems = []
    other, option = ("radians", "rad") if unit == "deg" else ("degrees", "deg")
    spans = {
        name: float(np.ptp(values))
        for name, values in angles.items()
        if name[:-2] in SAGITTAL and np.isfinite(values).all()
    }
    small = [name for name, span in spans.items() if _NEVER < span < _NO_SWING[name[:-2]]]
    knees = [
        name
        for name, span in spans.items()
        if name.startswith("knee") and (span > 180.0 or name in small)
    ]
    for name in knees:
        problems.append(
            f"column angle_{name}: it spans {spans[name]:.3g}° if it is in "
            f"{'degrees' if unit == 'deg' else unit}; this looks like {other}. Give "
            f"--angle-unit {option}."
        )
    if len(knees) == 2:
        return problems
    for name, span in spans.items():
        if span <= _NEVER and not name.startswith("ankle"):  # a prosthesis may have no ankle
            problems.append(
                f"column angle_{name}: is {angles[name][0]:.3g}° in all rows, and nobody walks "
                "without moving it. Is the column empty, or filled in?"
            )
        elif name not in knees and (name in small or span > 180.0):
            problems.append(
                f"column angle_{name}: it spans {span:.2g}°, and a knee "
                f"{max(spans.values()):.0f}°; this looks like {other}, unlike other columns. "
                "Write all of them in one unit."
            )
    return problems or _still_angles(angles)


def _still_angles(angles: Mapping[str, Array]) -> list[str]:
    """Angles that hardly move, on one side or both, while the knee does: they are in radians."""
    problems = []
    for name in (name for name in angles if "tilt" not in name):
        span, other = (float(np.ptp(angles.get(each, _ZERO))) for each in (name, mirrored(name)))
        if 0.0 < span < _STILL and other > 2 * _STILL and 0.2 < np.degrees(span) / other < 5.0:
            problems.append(
                f"column angle_{name}: it spans {span:.2g}°, and that of the other side "
                f"{other:.2g}°; this looks like radians. Write all columns in one unit."
            )
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
        if np.isfinite([ankle, up]).all():
            problems += _ankle_problems(moments, side)
            problems += _force_problems(forces, side)
    return problems


def _ankle_problems(moments: Mapping[str, Array], side: str) -> list[str]:
    """What is wrong with the moment of the ankle, which shows the unit and the cycle of all."""
    ankle, name = moments[f"ankle_angle_{side}"], f"column moment_ankle_angle_{side}"
    largest = np.abs(ankle).max()
    if largest > _MOMENT_UNITS[0][0]:
        return [f"{name}: {_unit_of(largest, _MOMENT_UNITS, 'Nm/kg')}"]
    if ankle[40:55].mean() > 0.1:
        advice = advised("moment", side, moments, "Change its sign.")
        return [
            f"{name}: {ankle[40:55].mean():.2g} Nm/kg at push-off (40-55 %). Moments are internal "
            f"and positive where they increase the angle, so the calf's is below 0. {advice}"
        ]
    if np.abs(ankle[75:97]).max() > _IN_THE_AIR:
        advice = advised("moment", side, moments, _COLUMNS_OR_ROWS)
        return [
            f"{name}: {np.abs(ankle[75:97]).max():.2g} Nm/kg in swing (75-96 %), where the foot is "
            f"in the air. {advice}"
        ]
    if side == "r" and (weak := _weak_ankles(moments)):
        return [weak]
    if largest < _NONE:
        return [
            f"{name}: reaches only {largest:.2g} Nm/kg, which no foot on the ground has. Is the "
            "column empty, or another joint's?"
        ]
    return []


def _force_problems(forces: Mapping[str, Array], side: str) -> list[str]:
    """What is wrong with the ground reaction on one foot."""
    forward, left, up = (forces[f"{axis}_{side}"] for axis in _AXES)
    name, odd, advice = f"column force_up_{side}", "", _COLUMNS_OR_ROWS
    if np.abs(up).max() > _FORCE_UNITS[0][0]:
        return [f"{name}: {_unit_of(np.abs(up).max(), _FORCE_UNITS, 'body weights')}"]
    if np.abs(up).max() == 0.0:
        return [
            f"{name}: is 0 in all rows. If forces were not measured, leave out all columns of "
            "forces and moments, and give --stance."
        ]
    for axis, values, most in (("forward", forward, 0.8), ("left", left, 0.5)):
        if np.abs(values).max() > most and np.abs(values).max() > np.abs(up).max():
            unit = _unit_of(np.abs(values).max(), _SHEAR_UNITS, "body weights")
            cause = explained("force", side, forces)
            return [f"column force_{axis}_{side}: {f'it seems that {cause}.' if cause else unit}"]
    if up[10:50].mean() < 0.3:
        odd = (
            f"{name}: its mean is {up[10:50].mean():.2g} body weights in stance (10-50 %); the "
            "ground pushes up."
        )
        advice = "Is its sign changed, or is it the other foot's?"
    elif up[75:97].max() > 0.1:
        odd = f"{name}: {up[75:97].max():.2g} body weights in swing (75-96 %)."
        advice = "Are the sides exchanged, or the rows not of this side's own cycle?"
    elif up[3:6].mean() < _LANDED:
        return [
            f"{name}: {up[3:6].mean():.2g} body weights at 3-5 %, where the foot has landed. "
            "Are the rows not from heel strike to heel strike of this side?"
        ]
    elif not forward[5:25].mean() < forward[40:58].mean():
        odd = (
            f"column force_forward_{side}: it does not brake first (5-25 %) and drive then "
            "(40-58 %). The force on the foot is positive forward."
        )
        advice = "Change its sign."
    if odd:
        return [f"{odd} {advised('force', side, forces, advice)}"]
    return _off_the_midline(forces, side)


def _off_the_midline(forces: Mapping[str, Array], side: str) -> list[str]:
    inward = {
        each: sign * forces[f"left_{each}"][15:45].mean()
        for each, sign in (("r", 1.0), ("l", -1.0))
    }
    if max(inward.values()) < 0.0 and side == "r":
        return [
            "columns force_left_r and force_left_l: both point away from the midline in "
            "mid-stance. Either right and left are exchanged, in all columns: exchange them; or "
            "this force is positive to the right: then change its sign on both feet. It is "
            "positive to the person's left on both. Look which it is: a sign that is changed would "
            "hide exchanged sides."
        ]
    if inward[side] < 0.0 <= max(inward.values()):
        return [
            f"column force_left_{side}: it points away from the midline in mid-stance. It is "
            "positive to the person's left on both feet. Change its sign."
        ]
    return []


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
        "0.6 to 2 Nm/kg, and less on one side only. Were they divided by the body mass twice, by "
        "the weight in N (then multiply by 9.80665) or by weight times height (then by the height, "
        "m, too), or are they another joint's? They must be in Nm/kg."
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
