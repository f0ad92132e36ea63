"""Shipped: the ten built-in subjects, gaitval/subjects/builtin/S01.toml to S10.toml.

    python -m experiments.ten_subjects ../shared/data/wbds [--check]

DATA is the data set of Fukuchi, Fukuchi & Duarte (2018): mean curves in `processed/`, and as CSV
`WBDS_subjects_merged` (people), `stride_times` and `static_markers_10subjects`. The correction of
the plates is kept as it is in the shipped files; it is that of `plate_corrections`.
"""

import csv
from collections.abc import Mapping
from functools import partial
from pathlib import Path
from typing import Any, Final

import numpy as np
from scipy.optimize import minimize_scalar

from experiments.shipped import parser_of, ship
from gaitval.arrays import Array
from gaitval.coordinates import SIDES, Side
from gaitval.subjects.curve_files import read_mean_curves
from gaitval.subjects.gait_values import gait_values
from gaitval.subjects.identity import WBDS
from gaitval.subjects.subject import MARKERS, Printed, Subject, make_subject
from gaitval.subjects.subject_file import BUILTIN, load_subject

FILES: Final = Path(__file__).resolve().parent.parent / "gaitval" / "subjects" / "builtin"

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
_AXES: Final = (("X", 1), ("Z", -1), ("Y", 1))
"""Forward, left and up in the laboratory."""


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


def rows_of(path: Path) -> list[dict[str, str]]:
    """Rows of a table by the names of its columns."""
    with path.open(encoding="utf-8-sig", newline="") as file:
        return list(csv.DictReader(file))


def about_person(folder: Path, person: str, trial: str) -> dict[str, Any]:
    """Who walked and how fast, and where the markers were in standing (m, REP-103 axes of the
    laboratory), under the names of `Subject`.
    """
    number = str(int(person.removeprefix("WBDS")))
    someone = next(
        row for row in rows_of(folder / "WBDS_subjects_merged.csv") if row["Subject"] == number
    )
    stride = next(
        row
        for row in rows_of(folder / "stride_times.csv")
        if (row["WBDS"].lstrip("0"), row["trial"]) == (number, trial)
    )
    standing = next(
        row for row in rows_of(folder / "static_markers_10subjects.csv") if row["Subject"] == person
    )
    # the table has mm, x forward, y up, z right
    markers = {
        name: tuple(sign * float(standing[name + axis]) / 1000 for axis, sign in _AXES)
        for name in MARKERS
    }
    return {
        "sex": someone["Gender"],
        "age_years": float(someone["Age"]),
        "mass_kg": float(someone["Mass"]),
        "height_m": float(someone["Height"]),
        "leg_length_m": float(someone["LegLen"]),
        "walking_speed_m_s": float(stride["belt_speed_m_s"]),
        "stride_time_s": float(stride["stride_time_s"]),
        "markers": markers,
    }


def subject_of(folder: Path, identifier: str, trial: str) -> Subject:
    """The built-in person `identifier`, "S05", on a treadmill `trial`, "T05"."""
    person, _ = BUILTIN[identifier]
    stem = folder / "processed" / f"{person}walk{trial}"
    curves = read_mean_curves([stem.with_name(f"{stem.name}{kind}.txt") for kind in ("ang", "knt")])
    return make_subject(
        {
            "identifier": identifier,
            "person": person,
            "trial": trial,
            "laboratory": WBDS,
            "source": f"{person} {trial}",
            "citation": CITATION,
            "licence": LICENCE,
            "left_phase_from_force": left_phase_from_force(curves.forces),
            "paper": dict(zip(Printed.model_fields, _PAPER[identifier], strict=True)),
            **gait_values(curves, str(stem)),
            **about_person(folder, person, trial),
        },
        f"{person} {trial}",
    )


def file_of(identifier: str, folder: Path) -> str:
    """The file of a built-in person, with the trials at other speeds; `folder` is the data's."""
    subject = subject_of(folder, identifier, BUILTIN[identifier][1])
    for further in FURTHER_TRIALS.get(identifier, ()):
        subject = subject.with_trial(subject_of(folder, identifier, further))
    plates = load_subject(identifier).plates
    return subject.model_copy(update={"plates": plates}).to_toml()


if __name__ == "__main__":
    ship(
        {FILES / f"{name}.toml": partial(file_of, name) for name in BUILTIN},
        parser_of(__doc__).parse_args(),
        "ten_subjects",
    )
