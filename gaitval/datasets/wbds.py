"""Read the gait dataset of Fukuchi, Fukuchi & Duarte (2018) and fit periodic curves to it.

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
the left, a difference that no gait has (docs/paper.md). The curves are left as recorded;
`plates` finds the correction, which each subject's file has beside them.
"""

from collections.abc import Mapping
from pathlib import Path
from typing import Any, Final

import numpy as np
from scipy.optimize import minimize_scalar

from gaitval.arrays import Array
from gaitval.artefacts import write_text
from gaitval.coordinates import SIDES, Side
from gaitval.datasets.gait_values import gait_values
from gaitval.datasets.identity import WBDS
from gaitval.datasets.subject import Printed, Subject, make_subject
from gaitval.datasets.subject_file import BUILTIN
from gaitval.datasets.wbds_files import (
    MOMENT_SEAM,
    number_in,
    read_angles,
    read_kinetics,
    read_static_markers,
    table_rows,
)
from gaitval.errors import RecordError
from gaitval.gait.mean_curves import MeanCurves

CITATION: Final = (
    "Fukuchi CA, Fukuchi RK, Duarte M (2018) A public dataset of overground and treadmill walking "
    "kinematics and kinetics in healthy individuals. PeerJ 6:e4640. "
    "https://doi.org/10.7717/peerj.4640"
)
LICENCE: Final = "CC BY 4.0"


FURTHER_TRIALS: Final[Mapping[str, tuple[str, ...]]] = {
    "S01": ("T03",),
    "S04": ("T02",),
    "S05": ("T03", "T06"),
}
"""Trials of the ten people at other speeds."""

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


def left_phase_from_force(forces: Mapping[Side, Array]) -> float:
    """Phase of the right cycle at left heel strike, from the vertical forces.

    Two equal steps make the sum of both feet's vertical force periodic in half a stride: the
    phase is the shift that leaves least in the odd harmonics (1, 3, 5, 7) of the sum.
    """
    harmonics = np.array([1, 3, 5, 7])
    # Without row 100, which repeats row 0: a period of 100 samples. A shift by φ multiplies
    # harmonic n by exp(-2πi n φ).
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


def _metadata(folder: Path, person: str, trial: str) -> dict[str, str | float]:
    """Who walked and how fast, from the tables of the dataset, under the names of `Subject`."""
    people_path, strides_path = folder / "WBDS_subjects_merged.csv", folder / "stride_times.csv"
    number = int(person.removeprefix("WBDS"))
    people = table_rows(people_path, ["Subject", "Gender", "Age", "Height", "Mass", "LegLen"])
    someone = next((row for row in people if row["Subject"] == str(number)), None)
    strides = table_rows(strides_path, ["WBDS", "trial", "belt_speed_m_s", "stride_time_s"])
    stride = next(
        (row for row in strides if int(row["WBDS"]) == number and row["trial"] == trial), None
    )
    if someone is None or stride is None:
        path = people_path if someone is None else strides_path
        raise RecordError(f"{path}: no row for {person} {trial}. Add one.")
    return {
        "sex": someone["Gender"],
        "age_years": number_in(people_path, someone, "Age"),
        "mass_kg": number_in(people_path, someone, "Mass"),
        "height_m": number_in(people_path, someone, "Height"),
        "leg_length_m": number_in(people_path, someone, "LegLen"),
        "walking_speed_m_s": number_in(strides_path, stride, "belt_speed_m_s"),
        "stride_time_s": number_in(strides_path, stride, "stride_time_s"),
    }


def read_trial(folder: Path, identifier: str, person: str, trial: str) -> Subject:
    """Read one person's (`person`, "WBDS14") treadmill `trial`, "T05", and fit its curves; the
    subject is named by `identifier`, "S05". `folder` holds `processed/` and the three tables of the
    dataset. Raises RecordError when a file cannot be used (see the readers), SubjectError when the
    person's values are implausible.
    """
    folder = Path(folder)
    angles_path = folder / "processed" / f"{person}walk{trial}ang.txt"
    kinetics_path = folder / "processed" / f"{person}walk{trial}knt.txt"
    about: dict[str, Any] = _metadata(folder, person, trial)
    if (paper := _PAPER.get(identifier)) is not None:
        about["paper"] = dict(zip(Printed.model_fields, paper, strict=True))
    about["markers"] = read_static_markers(folder / "static_markers_10subjects.csv", person)
    return subject_of_curves(identifier, person, trial, angles_path, kinetics_path, about)


def subject_of_curves(
    identifier: str,
    person: str,
    trial: str,
    angles_path: Path,
    kinetics_path: Path,
    about: Mapping[str, Any],
) -> Subject:
    """A `person` on a `trial`, named by `identifier`, from the two files of mean curves and the
    other values of a subject, `about`. Raises as `read_trial`.
    """
    angles, kinetics = read_angles(angles_path), read_kinetics(kinetics_path)
    curves = MeanCurves(angles, kinetics.moments, kinetics.forces, MOMENT_SEAM)
    return make_subject(
        {
            "identifier": identifier,
            "person": person,
            "trial": trial,
            "laboratory": WBDS,
            "source": f"{person} {trial}",
            "citation": CITATION,
            "licence": LICENCE,
            "left_phase_from_force": left_phase_from_force(kinetics.forces),
            **gait_values(curves, f"{angles_path}, {kinetics_path.name}"),
            **about,
        },
        f"{person} {trial}",
    )


def build_subjects(data_folder: Path, out_folder: Path) -> list[Path]:
    """Make the ten built-in subject files, S01.toml … S10.toml, in `out_folder`; equal data give
    equal files. `data_folder` is the dataset's, with `processed/`, `WBDS_subjects_merged.csv`,
    `stride_times.csv` and `static_markers_10subjects.csv`. Returns the files written; raises
    RecordError when one of the dataset is missing or cannot be used.
    """
    written = []
    for identifier, (person, trial) in BUILTIN.items():
        path = Path(out_folder) / f"{identifier}.toml"
        subject = read_trial(data_folder, identifier, person, trial)
        for further in FURTHER_TRIALS.get(identifier, ()):
            subject = subject.with_trial(read_trial(data_folder, identifier, person, further))
        write_text(path, subject.to_toml())
        written.append(path)
    return written
