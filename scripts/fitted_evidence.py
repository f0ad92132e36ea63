"""How much the walkers, who were told the record, know more than a guess: the ten stored baselines.

    python scripts/fitted_evidence.py

Reads `reports/Snn/baseline/metrics.json` and writes the rows of `reports/evidence/fitted.csv`:
means over ten subjects and both sides. Skill is 1 less the mean RMSE over that of a straight line
on dimensionless speed through the nine others. Forces are compared with the record as it is, and
with every record scaled so that its mean vertical force is one body weight.
"""

import json
from pathlib import Path
from typing import Any

import evidence
import numpy as np

from gaitval.datasets.subject_file import builtin_subjects
from gaitval.metrics.baselines import dimensionless_speed

ROOT = Path(__file__).resolve().parent.parent
COMMAND = "python scripts/fitted_evidence.py"
FORCES = {"vertical": (0.5, 0.3), "forward": (0.4, 0.15), "medial": (0.4, 0.15)}
MOMENTS = {"hip_flexion": "hip", "knee_angle": "knee", "ankle_angle": "ankle"}
LARGEST = {
    "force_ringing": ("ringing of the vertical force, 12-25 Hz, RMS", "% BW", 1.5, 3.0),
    "shoulder_moment_rms": ("shoulder moment, RMS", "Nm", 5.0, 8.0),
    "shoulder_moment_peak": ("shoulder moment, peak", "Nm", 12.0, 20.0),
    "arm_work_share": ("positive work of the arms over that of the legs", "%", 5.0, 10.0),
}


def main() -> None:
    """Write and print the rows."""
    stored = [
        json.loads((ROOT / f"reports/S{number:02d}/baseline/metrics.json").read_text())
        for number in range(1, 11)
    ]
    rows = [*_skills(stored), *_means(stored), _goals(stored)]
    for row in rows:
        print(f"{row.what}: {row.value:.3g} {row.unit}")
    print(evidence.write("fitted", rows))


def _skills(stored: list[Any]) -> list[evidence.Row]:
    weights = np.array([each["record"]["consistency"]["mean_force"]["vertical"] for each in stored])
    told = "fitted walkers (told the record)"
    rows = []
    for scale, record in ((np.ones(10), "record as it is"), (weights, "record scaled to 1 BW")):
        for name, (goal, must) in FORCES.items():
            value = _skill(stored, "forces", name, scale)
            rows.append(_at_least(f"{told}: skill, {name} force, {record}", value, goal, must))
    for name, joint in MOMENTS.items():
        value = _skill(stored, "moments", name, np.ones(10))
        rows.append(_at_least(f"{told}: skill, {joint} moment", value, 0.5, 0.3))
    return rows


def _skill(stored: list[Any], kind: str, name: str, scale: Any) -> float:
    """1 - mean error of the walkers / mean error of the guesses."""
    speed = np.array([dimensionless_speed(subject) for subject in builtin_subjects()])
    ours, guesses = [], []
    for side in "rl":
        curve = f"{name}_{side}"
        recorded = np.array([each["record"]["curves"][kind][curve] for each in stored])
        recorded = recorded / scale[:, None]
        for person, each in enumerate(stored):
            others = np.arange(len(stored)) != person
            slope, start = np.polyfit(speed[others], recorded[others], 1)
            walked = each["walks"][each["final"]]["curves"][kind][curve]["mean"]
            for predicted, errors in ((walked, ours), (start + slope * speed[person], guesses)):
                errors.append(np.sqrt(np.mean((predicted - recorded[person]) ** 2)))
    return float(1.0 - np.mean(ours) / np.mean(guesses))


def _means(stored: list[Any]) -> list[evidence.Row]:
    rows = []
    for measure, (what, unit, goal, must) in LARGEST.items():
        values = [
            row["value"] for each in stored for row in each["measures"] if row["measure"] == measure
        ]
        mean = float(np.mean(values))
        rows.append(evidence.Row(what, mean, unit, "<=", goal, must, len(values), COMMAND))
    return rows


def _goals(stored: list[Any]) -> evidence.Row:
    reached = sum(each["summary"]["goals_reached"] for each in stored)
    goals = sum(each["summary"]["goals"] for each in stored)
    what = "goals of acceptance reached, arms free to help"
    return evidence.Row(what, reached, "goals", ">=", 430, 420, goals, COMMAND)


def _at_least(what: str, value: float, goal: float, must: float) -> evidence.Row:
    return evidence.Row(what, value, "1", ">=", goal, must, 20, COMMAND)


if __name__ == "__main__":
    main()
