"""Read the gait dataset of Fukuchi, Fukuchi & Duarte (2018) and fit periodic curves to it.

PeerJ 6:e4640, https://doi.org/10.7717/peerj.4640, data CC BY 4.0. The one place where its
conventions (millimetres, degrees, N/kg, axes x forward, y up, z right) become the project's.

Signs. The dataset's angle about X is adduction (ankle: inversion), about Y internal rotation,
about Z flexion (ankle: dorsiflexion), positive on both sides; the foot's angle about Y is
positive toes outwards (it follows the chain pelvis-hip-knee-ankle with a minus sign, while X
and Z follow with a plus).

Moments are internal. About Z: hip flexion, knee extension, ankle plantarflexion positive. About
X: hip and knee abduction, ankle inversion positive. About Y: external rotation positive. The
files do not state X and Y. They were found from the ten subjects in stance: the knee's moment
less the ankle's must equal shank x ground reaction, the hip's less the knee's thigh x ground
reaction. With each moment in the axes of its distal segment, these signs leave the least, 0.19
(hip, knee) and 0.27 Nm/kg root-mean-square (knee, ankle), and changing any one leaves more
(`tests/datasets/test_signs.py`). The same signs are best with the knee's moment in the thigh's or
the laboratory's axes, which fit the ankle's better (0.23, 0.20); so the signs are firm, the axes of
the frontal and transverse moments are not, and the ankle's inversion sign is the least certain
(it depends on taking the foot's axes).

The moments show a calibration error of the force plates against the markers: over the ten
subjects the ankle moment divided by vertical force at 45 % of the cycle is 0.14 m on the right
and 0.10 m on the left, a difference that no gait has; the moments of hip, knee and ankle together
say 3.6 cm (docs/decisions.md). It is left as recorded.
"""

import csv
import difflib
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Final

import numpy as np
from scipy.optimize import minimize_scalar

from gaitval.arrays import Array
from gaitval.artefacts import write_text
from gaitval.constants import STANDARD_GRAVITY
from gaitval.coordinates import SIDES, Side
from gaitval.datasets.subject import (
    BUILTIN,
    MARKERS,
    Forces,
    Gait,
    Printed,
    StanceFraction,
    Subject,
    make_subject,
)
from gaitval.errors import RecordError
from gaitval.gait.mean_curves import (
    ANGLE_TOLERANCE,
    MOMENT_TOLERANCE,
    ROWS,
    STANCE_THRESHOLD,
    fit_curve,
    fit_force,
    mean_vertical_force,
    stance_fraction,
)
from gaitval.gait.record import PeriodicCurve

CITATION: Final = (
    "Fukuchi CA, Fukuchi RK, Duarte M (2018) A public dataset of overground and treadmill walking "
    "kinematics and kinetics in healthy individuals. PeerJ 6:e4640. "
    "https://doi.org/10.7717/peerj.4640"
)
LICENCE: Final = "CC BY 4.0"

MOMENT_SEAM: Final = (97, 98, 99)
"""Rows where the moments jump, the edge of the authors' filter; left out of the fit."""
PELVIS_MISMATCH: Final = float(np.radians(2.0))
"""rad, root-mean-square. Both sides' curves describe one pelvis; the ten agree within 0.16°."""


_LETTER: Final[dict[Side, str]] = {"right": "R", "left": "L"}

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

# The paper's Table 1 as printed: sex, age, mass kg, height m, speed m/s. S05 has mass and height
# swapped, S02 the sex, S06 and S08 other masses and an age.
_PAPER: Final[dict[str, tuple[str, float, float, float, float]]] = {
    "S01": ("M", 25, 74.0, 1.724, 1.25),
    "S02": ("M", 22, 52.9, 1.668, 1.40),
    "S03": ("F", 24, 48.8, 1.58, 1.15),
    "S04": ("M", 22, 61.5, 1.807, 1.28),
    "S05": ("F", 31, 153.0, 0.64, 1.09),
    "S06": ("M", 38, 69.85, 1.55, 1.3),
    "S07": ("F", 57, 64.6, 1.515, 0.91),
    "S08": ("M", 71, 63.3, 1.75, 0.57),
    "S09": ("F", 63, 46.05, 1.492, 0.80),
    "S10": ("M", 84, 66.35, 1.555, 0.60),
}


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
            f"row 1: the columns are of the other kind of file ({unknown[0]} was seen where "
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


def _refuse(path: Path, problems: Sequence[str]) -> None:
    """Raise a `RecordError` that lists the first problems, if there are any."""
    if problems:
        shown = [f"  - {problem}" for problem in problems[:10]]
        if len(problems) > len(shown):
            shown.append(f"  … and {len(problems) - len(shown)} more")
        raise RecordError(f"{path}: cannot be used\n" + "\n".join(shown))


def _text(path: Path) -> str:
    try:
        return path.read_text(encoding="utf-8")
    except FileNotFoundError:
        raise RecordError(
            f"{path}: no such file. Give the folder that holds processed/, stride_times.csv, "
            "WBDS_subjects_merged.csv and static_markers_10subjects.csv."
        ) from None
    except UnicodeDecodeError:
        raise RecordError(f"{path}: not text. Download the file again.") from None


def _read_processed(
    path: Path, columns: Sequence[str], other: str, may_be_nan: str
) -> dict[str, Array]:
    """Columns of a tab-separated file of 101 rows; NaN only where a name has `may_be_nan`."""
    lines = _text(path).splitlines()
    header = lines[0].split("\t") if lines else []
    _refuse(path, _header_problems(header, columns, other))
    problems = []
    if len(lines) - 1 != ROWS:
        problems.append(
            f"{len(lines) - 1} rows of data, {ROWS} expected (0 to 100 % of the gait cycle): the "
            "file is truncated or not time-normalised. Download it again."
        )
    table = np.full((len(lines) - 1, len(header)), np.nan)
    for i, line in enumerate(lines[1:]):
        fields = line.split("\t")
        if len(fields) != len(header):
            problems.append(
                f"row {i + 2}: {len(fields)} fields, {len(header)} columns: the row is truncated. "
                "Download the file again."
            )
            continue
        for j, field in enumerate(fields):
            try:
                table[i, j] = float(field)
            except ValueError:
                problems.append(
                    f"row {i + 2}, column {header[j]}: {field!r} is not a number. Mend it."
                )
                continue
            if not np.isfinite(table[i, j]) and not (may_be_nan and may_be_nan in header[j]):
                problems.append(
                    f"row {i + 2}, column {header[j]}: {field.strip()}; the mean curve has a gap. "
                    "Use a trial without gaps."
                )
    _refuse(path, problems)
    found = {name: table[:, header.index(name)] for name in columns}
    if not np.array_equal(found.pop("Time"), np.arange(ROWS)):
        _refuse(path, ["column Time: not 0, 1 … 100 (% of the gait cycle). Normalise the time."])
    return found


def read_angles(path: Path) -> dict[str, Array]:
    """Mean angles of a `…ang.txt` file.

    Returns
    -------
    dict
        Keys of `ANGLE_NAMES`; (101,) rad each, project's signs, 0 to 100 % of the side's cycle.

    Raises
    ------
    RecordError
        Missing or renamed columns, an exchanged file, truncation, NaN, radians, or hip and knee
        columns whose curves are not a hip's and a knee's.
    """
    path = Path(path)
    found = _read_processed(path, _columns(list(_ANGLES)), other="Moment", may_be_nan="")
    problems = []
    for letter in _LETTER.values():
        knee, hip = found[f"{letter}KneeAngleZ"], found[f"{letter}HipAngleZ"]
        if np.ptp(knee) < 2:
            problems.append(
                f"column {letter}KneeAngleZ: its range is {np.ptp(knee):.3g}; this looks like "
                "radians, the file must be in degrees. Multiply all angles by 180/pi."
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
    _refuse(path, problems)
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
                "Nm or Nmm/kg, the file must be in Nm/kg. Divide by the body mass, or by 1000."
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
                f"in N/kg (about 10), this looks like {looks}. If it is another direction, "
                "the GRF columns are exchanged."
            )
        elif np.nan_to_num(up[80:90]).max() >= STANCE_THRESHOLD * STANDARD_GRAVITY:
            problems.append(
                f"column {letter}GRFY: the foot is still on the ground at 80-90 % of the cycle; a "
                "walking foot swings there. Was the force plate's offset removed?"
            )
    return problems


def read_kinetics(path: Path) -> Kinetics:
    """Mean moments and ground reactions of a `…knt.txt` file.

    Swing is coded 0 in some files and NaN in others; both become zero.

    Raises
    ------
    RecordError
        Missing or renamed columns, an exchanged file, truncation, NaN in moments or stance,
        moments in Nm, forces in N, or implausible signs.
    """
    path = Path(path)
    names = [*_MOMENTS, *_FORCES]
    found = _read_processed(path, _columns(names), other="Angle", may_be_nan="GRF")
    _refuse(path, _kinetics_problems(found))
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


def left_phase(angles: Mapping[str, PeriodicCurve]) -> tuple[float, float]:
    """Phase of the right cycle at left heel strike, from the pelvis.

    The pelvis is one body, so what the left cycle calls its tilt is the right one's a while
    later, and list and rotation are the same with the sign changed. The phase is the shift of
    the smallest sum of squared differences, each curve less its mean (the means differ by the
    markers' asymmetry, below 0.25°).

    Returns
    -------
    phase, mismatch
        The mismatch is the root-mean-square difference of the worst curve, rad.
    """
    phase = np.arange(200) / 200

    def differences(shift: float) -> Array:
        return np.stack(
            [
                angles[f"{name}_r"](phase)
                - angles[f"{name}_r"].mean
                - sign * (angles[f"{name}_l"](phase - shift) - angles[f"{name}_l"].mean)
                for name, sign in (("pelvis_tilt", 1), ("pelvis_list", -1), ("pelvis_rotation", -1))
            ]
        )

    best = minimize_scalar(
        lambda shift: float(np.sum(differences(shift) ** 2)),
        bounds=(0.4, 0.6),
        method="bounded",
        options={"xatol": 1e-7},
    )
    mismatch = np.sqrt(np.mean(differences(best.x) ** 2, axis=1)).max()
    return float(best.x), float(mismatch)


def left_phase_from_force(forces: Mapping[Side, Array]) -> float:
    """Phase of the right cycle at left heel strike, from the vertical forces.

    Two equal steps make the sum of both feet's vertical force periodic in half a stride: the
    phase is the shift that leaves least in the odd harmonics (1, 3, 5, 7) of the sum.
    """
    harmonics = np.array([1, 3, 5, 7])
    right, left = (np.fft.rfft(forces[side][:100, 2])[harmonics] for side in SIDES)
    best = minimize_scalar(
        lambda shift: float(
            np.sum(np.abs(right + left * np.exp(-2j * np.pi * harmonics * shift)) ** 2)
        ),
        bounds=(0.4, 0.6),
        method="bounded",
        options={"xatol": 1e-7},
    )
    return float(best.x)


def _rows(path: Path, needed: Sequence[str]) -> list[dict[str, str]]:
    reader = csv.DictReader(_text(path).splitlines())
    problems = [
        f"row 1: column {name} is missing. Add it."
        for name in needed
        if name not in (reader.fieldnames or ())
    ]
    _refuse(path, problems)
    return list(reader)


def _value(path: Path, row: Mapping[str, str], column: str) -> float:
    try:
        value = float(row[column])
    except (TypeError, ValueError):
        value = np.nan
    if not np.isfinite(value):
        raise RecordError(
            f"{path}: column {column}: {row[column]!r} is not a number (row {dict(row)}). Mend it."
        )
    return value


def read_static_markers(path: Path, person: str) -> dict[str, tuple[float, float, float]]:
    """Standing marker positions of one person, m, REP-103 axes of the laboratory.

    Parameters
    ----------
    path : `static_markers_10subjects.csv`, mm, x forward, y up, z right.
    person : "WBDS14".

    Raises
    ------
    RecordError
        Missing file, column or person, a value that is not a number, or metres for millimetres.
    """
    path = Path(path)
    rows = _rows(path, ["Subject", *(f"{name}{axis}" for name in MARKERS for axis in "XYZ")])
    row = next((row for row in rows if row["Subject"] == person), None)
    if row is None:
        raise RecordError(
            f"{path}: no row for {person}. It holds {', '.join(r['Subject'] for r in rows)}."
        )
    markers = {}
    for name in MARKERS:
        x, y, z = (_value(path, row, f"{name}{axis}") / 1000 for axis in "XYZ")
        markers[name] = (x, -z, y)
    if markers["R.ASIS"][2] < 0.1:
        raise RecordError(
            f"{path}: column R.ASISY of {person}: {row['R.ASISY']}; this looks like metres, the "
            "file must be in millimetres. Multiply by 1000."
        )
    return markers


def read_trial(folder: Path, identifier: str, person: str, trial: str) -> Subject:
    """Read one person's trial and fit its curves.

    Parameters
    ----------
    folder : holds `processed/` and the three tables of the dataset.
    identifier : name for the subject, "S05".
    person : "WBDS14".
    trial : treadmill trial, "T05".

    Raises
    ------
    RecordError
        When a file cannot be used; see the readers.
    SubjectError
        When the person's values are implausible.
    """
    folder = Path(folder)
    angles_path = folder / "processed" / f"{person}walk{trial}ang.txt"
    kinetics_path = folder / "processed" / f"{person}walk{trial}knt.txt"
    people_path, strides_path = folder / "WBDS_subjects_merged.csv", folder / "stride_times.csv"
    sampled_angles, kinetics = read_angles(angles_path), read_kinetics(kinetics_path)

    number = int(person.removeprefix("WBDS"))
    people = _rows(people_path, ["Subject", "Gender", "Age", "Height", "Mass", "LegLen"])
    someone = next((row for row in people if row["Subject"] == str(number)), None)
    strides = _rows(strides_path, ["WBDS", "trial", "belt_speed_m_s", "stride_time_s"])
    stride = next(
        (row for row in strides if int(row["WBDS"]) == number and row["trial"] == trial), None
    )
    if someone is None or stride is None:
        path = people_path if someone is None else strides_path
        raise RecordError(f"{path}: no row for {person} {trial}. Add one.")

    phase = np.arange(ROWS) / (ROWS - 1)
    angles = {
        name: fit_curve(name, phase, values, ANGLE_TOLERANCE, angles_path)
        for name, values in sampled_angles.items()
    }
    trusted = np.delete(np.arange(ROWS), MOMENT_SEAM)
    moments = {
        name: fit_curve(name, phase[trusted], values[trusted], MOMENT_TOLERANCE, kinetics_path)
        for name, values in kinetics.moments.items()
    }
    stance = {side: stance_fraction(kinetics.forces[side][:, 2]) for side in SIDES}
    left, mismatch = left_phase({name: curve.periodic() for name, curve in angles.items()})
    if mismatch > PELVIS_MISMATCH:
        raise RecordError(
            f"{angles_path}: the pelvis curves of right and left differ by "
            f"{np.degrees(mismatch):.1f}° however they are shifted; one pelvis cannot. Are columns "
            "of RPelvisAngle and LPelvisAngle exchanged, of another trial or with other signs?"
        )
    forces = {side: fit_force(kinetics.forces[side], stance[side], kinetics_path) for side in SIDES}
    paper = _PAPER.get(identifier)
    return make_subject(
        {
            "identifier": identifier,
            "source": f"{person} {trial}",
            "citation": CITATION,
            "licence": LICENCE,
            "sex": someone["Gender"],
            "age_years": _value(people_path, someone, "Age"),
            "mass_kg": _value(people_path, someone, "Mass"),
            "height_m": _value(people_path, someone, "Height"),
            "leg_length_m": _value(people_path, someone, "LegLen"),
            "walking_speed_m_s": _value(strides_path, stride, "belt_speed_m_s"),
            "stride_time_s": _value(strides_path, stride, "stride_time_s"),
            "left_phase": left,
            "left_phase_from_force": left_phase_from_force(kinetics.forces),
            "mean_vertical_force": mean_vertical_force(kinetics.forces),
            "stance_fraction": StanceFraction(right=stance["right"], left=stance["left"]),
            "paper": None if paper is None else dict(zip(Printed.model_fields, paper, strict=True)),
            "gait": Gait(
                samples=ROWS,
                angles=angles,
                moments=moments,
                forces=Forces(right=forces["right"], left=forces["left"]),
            ),
            "markers": read_static_markers(folder / "static_markers_10subjects.csv", person),
        },
        f"{person} {trial}",
    )


def build_subjects(data_folder: Path, out_folder: Path) -> list[Path]:
    """Make the ten built-in subject files.

    Parameters
    ----------
    data_folder : the dataset's folder, with `processed/`, `WBDS_subjects_merged.csv`,
        `stride_times.csv` and `static_markers_10subjects.csv`.
    out_folder : receives S01.toml … S10.toml; equal data give equal files.

    Returns
    -------
    list of Path
        The files written.

    Raises
    ------
    RecordError
        When a file of the dataset is missing or cannot be used.
    """
    written = []
    for identifier, source in BUILTIN.items():
        person, trial = source.split()
        path = Path(out_folder) / f"{identifier}.toml"
        write_text(path, read_trial(data_folder, identifier, person, trial).to_toml())
        written.append(path)
    return written
