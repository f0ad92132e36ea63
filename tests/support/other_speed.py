"""How a recorded walk differs from the published curves of the same person at another speed."""

import json
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from gaitval.session.session import Import
from gaitval.subjects.subject_file import load_subject

PHASE = np.linspace(0.0, 1.0, 101)
SAGITTAL = {
    "hip flexion": ("hip_flexion", "HipAngles"),
    "knee flexion": ("knee_angle", "KneeAngles"),
    "ankle dorsiflexion": ("ankle_angle", "AnkleAngles"),
    "hip moment": ("hip_flexion", "HipMoment"),
    "knee moment": ("knee_angle", "KneeMoment"),
    "ankle moment": ("ankle_angle", "AnkleMoment"),
}
"""Our name of the coordinate, and the group of Schwartz et al. 2008."""


@dataclass(frozen=True)
class Change:
    """The change of a mean curve from the one speed to the other, degrees or Nm/kg.

    Attributes
    ----------
    rms : root mean square of what is left when the change that is usual is taken away.
    mean : mean of what is left.
    between_people : standard deviation between people at their own speed, root mean square.
    correlation : of the change with the usual one.
    """

    rms: float
    mean: float
    between_people: float
    correlation: float


def normative(gait_data: Path, group: str) -> dict[str, tuple[np.ndarray, np.ndarray]]:
    """Mean and standard deviation between people by speed, (101,): degrees, Nm/kg (extensor and
    plantarflexor +). Schwartz et al. 2008."""
    path = gait_data / "normative" / "Schwartz2008.json"
    speeds = json.loads(path.read_text(encoding="utf-8"))["Schwartz2008"]
    found = {}
    unit = 1e-3 if group.endswith("Moment") else 1.0
    for name in ("VerySlow", "Free"):
        percent, low, high = np.array(speeds[name][group]["X"], dtype=float).T
        middle, half = unit * (low + high) / 2, unit * (high - low) / 2
        found[name] = (
            np.interp(100 * PHASE, percent, middle),
            np.interp(100 * PHASE, percent, half),
        )
    return found


def change_from_t05(found: Import, gait_data: Path, title: str) -> Change:
    """From WBDS01's published T05 (1.21 m/s, our subject S01) to an import of T01 (0.49 m/s).

    The usual change is that of Schwartz et al. 2008 from "free" to "very slow" walking: T05 and
    T01 are there by their dimensionless speeds, 0.41 and 0.17. Means of both sides, for the
    published moments of right and left differ by what a shift between the two plates makes,
    in all ten subjects.
    """
    name, group = SAGITTAL[title]
    moments = group.endswith("Moment")
    published = load_subject("S01").measured()
    curves, theirs = (
        (found.moments, published.moments) if moments else (found.angles, published.angles)
    )
    change = np.mean(
        [curves[f"{name}_{s}"].mean - theirs[f"{name}_{s}"](PHASE) for s in "rl"], axis=0
    )
    if not moments:
        change = np.degrees(change)
    of_people = normative(gait_data, group)
    expected = (-1 if moments else 1) * (of_people["VerySlow"][0] - of_people["Free"][0])
    left = change - expected
    return Change(
        rms=float(np.sqrt((left**2).mean())),
        mean=float(left.mean()),
        between_people=float(np.sqrt((of_people["Free"][1] ** 2).mean())),
        correlation=float(np.corrcoef(change, expected)[0, 1]),
    )
