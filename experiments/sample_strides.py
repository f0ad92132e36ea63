"""Shipped: writes strides.csv and people.csv of gaitval/samples, virtual people for `patients`.

    python -m experiments.sample_strides reports

Nobody was recorded for them. Each is the walk of a built-in walker in simulation, of which one
stride a side is kept; two of them are given a gait disorder by a rule (`disorders`), on the
coordinates of the whole walk, so that pelvis and both sides fit together.
"""

from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from experiments.shipped import parser_of, ship
from gaitval._internal.io.text_tables import csv_text
from gaitval.apps.export.walked import ExportedWalk
from gaitval.coordinates import COORDINATES
from gaitval.gait.healthy_controls import PROFILE_ANGLES
from gaitval.gait.record import LowPass
from gaitval.gait.sampling import SAMPLES
from gaitval.metrics.comparison import foot_progression, simulated_curves

FOLDER = Path(__file__).resolve().parent.parent / "gaitval" / "samples"
STRIDE = 3
"""Which stride of the walk."""
STEP = 1
"""Decimals of a degree."""
BENT, BEYOND = np.radians(25.0), 0.2
"""A stiff knee: beyond this angle (rad) it bends by this share of what it would."""
CROUCH = {"hip_flexion": 12.0, "knee_angle": 18.0, "ankle_angle": 6.0}
"""deg, added on both sides: the body stays over the feet, as 12 + 6 = 18."""


@dataclass(frozen=True)
class SamplePerson:
    """A virtual person: whose walker, and what is changed of its angles (T, 31) rad."""

    name: str
    group: str
    walker: str
    changed: Callable[[np.ndarray], np.ndarray]


def stiff(positions: np.ndarray) -> np.ndarray:
    """The left knee hardly bends in swing."""
    found = positions.copy()
    knee = found[:, COORDINATES.index("knee_angle_l")]
    found[:, COORDINATES.index("knee_angle_l")] = np.where(
        knee > BENT, BENT + BEYOND * (knee - BENT), knee
    )
    return found


def crouched(positions: np.ndarray) -> np.ndarray:
    """Hips and knees are bent throughout."""
    found = positions.copy()
    for name, more in CROUCH.items():
        for side in "rl":
            found[:, COORDINATES.index(f"{name}_{side}")] += np.radians(more)
    return found


PEOPLE = (
    SamplePerson("V1", "virtual_healthy", "S05", np.copy),
    SamplePerson("V2", "virtual_stiff_knee", "S02", stiff),
    SamplePerson("V3", "virtual_crouch", "S08", crouched),
)


def strides(runs: Path) -> str:
    """A row for each angle of each side."""
    percent = [f"p{each}" for each in range(SAMPLES)]
    rows: list[list[object]] = [["group", "subject", "trial", "side", "angle", *percent]]
    for person in PEOPLE:
        walked = ExportedWalk.of(runs / person.walker / "baseline")
        walk = replace(walked.walk, positions=person.changed(walked.walk.positions))
        stored = walked.stored
        frequency = stored.configuration.validation.filter_frequency  # of moments, unused here
        filters = LowPass(frequency, frequency)
        angles = simulated_curves(
            walk, walked.cycles, mass=stored.model.mass, filters=filters
        ).angles | foot_progression(walk, walked.cycles, walked.body)
        for name in PROFILE_ANGLES:
            for side in "rl":
                values = np.degrees(angles[f"{name}_{side}"][STRIDE]).round(STEP) + 0.0
                trial = f"stride {STRIDE + 1} of a walk in simulation"
                rows.append([person.group, person.name, trial, side.upper(), name, *values])
    return csv_text(rows)


def people(runs: Path) -> str:
    """Of the walkers' people; V2 is stiff on the left."""
    rows: list[list[object]] = [
        ["ID", "Sex", "Age", "Height (m)", "Mass (kg)", "Walking speed (m/s)", "Affected side"]
    ]
    for person in PEOPLE:
        one = ExportedWalk.of(runs / person.walker / "baseline").stored.subject
        side = "left" if person.changed is stiff else ""
        speed = round(one.walking_speed_m_s, 2)
        rows.append([person.name, one.sex, one.age_years, one.height_m, one.mass_kg, speed, side])
    return csv_text(rows)


if __name__ == "__main__":
    ship(
        {FOLDER / "strides.csv": strides, FOLDER / "people.csv": people},
        parser_of(__doc__).parse_args(),
        "sample_strides",
    )
