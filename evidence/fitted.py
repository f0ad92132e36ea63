"""How much nearer the fitted walkers are to the record than a guess: the ten stored baselines.

Reads `reports/Snn/baseline/metrics.json` and writes the rows of `reports/evidence/fitted.csv`:
means over ten subjects and both sides. Skill is 1 less the mean RMSE over that of a straight line
on dimensionless speed through the nine others, both against the same records: with the faults of
the force plates corrected, scaled to one body weight only, and as measured. A walker follows the
corrected record in all three.
"""

import json
from argparse import Namespace
from collections.abc import Callable
from typing import Any

import numpy as np
from numpy.typing import NDArray

import evidence
from evidence import ROOT
from gaitval.datasets.subject_file import builtin_subjects
from gaitval.prediction.speed_line import dimensionless_speed

FORCES = {"vertical": (0.5, 0.3), "forward": (0.4, 0.15), "medial": (0.4, 0.15)}
MOMENTS = {"hip_flexion": "hip", "knee_angle": "knee", "ankle_angle": "ankle"}
LARGEST = {
    "force_ringing": ("ringing of the vertical force, 12-25 Hz, RMS", "% BW", 1.5, 3.0),
    "shoulder_moment_rms": ("shoulder moment, RMS", "Nm", 5.0, 8.0),
    "shoulder_moment_peak": ("shoulder moment, peak", "Nm", 12.0, 20.0),
    "arm_work_share": ("positive work of the arms over that of the legs", "%", 5.0, 10.0),
}
Stored = dict[str, Any]
Curves = Callable[[Stored, str, str], NDArray[np.float64]]
MEASURES = {
    "left-right difference *": {
        "code": ("gaitval/datasets/subject.py:Subject", "gaitval/gait/record.py"),
        "data": ("gaitval/datasets/builtin/*.toml",),
    },
    "general policy to report, *": {"data": ("reports/S05/baseline/times.json",)},
    "*": {
        "code": ("gaitval/prediction/speed_line.py:dimensionless_speed",),
        "data": ("reports/S??/baseline/metrics.json",),
    },
}
"""What the rows depend on; see evidence/stale.py."""


def corrected(stored: Stored, kind: str, curve: str) -> NDArray[np.float64]:
    """A recorded curve without the faults of the plates."""
    return np.array(stored["record"]["curves"][kind][curve])


def measured(stored: Stored, kind: str, curve: str) -> NDArray[np.float64]:
    """A recorded curve as measured."""
    found = stored["record"]["as_measured"] or stored["record"]["curves"]
    return np.array(found[kind][curve])


def stored_baselines() -> list[Stored]:
    """`metrics.json` of the ten."""
    return [
        json.loads((ROOT / f"reports/S{number:02d}/baseline/metrics.json").read_text())
        for number in range(1, 11)
    ]


@evidence.measurement()
def baselines(_: Namespace) -> list[evidence.Row]:
    """Skills, means, ankles, goals and time of the ten stored baselines."""
    stored = stored_baselines()
    (evidence.FOLDER / "fitted.csv").unlink(missing_ok=True)  # all its rows are made here
    return [*_skills(stored), *_means(stored), ankles(), *_goals(stored), _time()]


def _skills(stored: list[Stored]) -> list[evidence.Row]:
    skill = "fitted walkers (record known to the model): skill"
    rows = []
    for which, curves in (("record corrected", corrected), ("record as measured", measured)):
        for name, bounds in FORCES.items():
            value = skill_of(stored, "forces", name, curves)
            rows.append(_at_least(f"{skill}, {name} force, {which}", value, *bounds))
        for name, joint in MOMENTS.items():
            value = skill_of(stored, "moments", name, curves)
            rows.append(_at_least(f"{skill}, {joint} moment, {which}", value, 0.5, 0.3))
    return rows


def skill_of(stored: list[Stored], kind: str, name: str, curves: Curves) -> float:
    """1 - mean error of the walkers / mean error of the guesses."""
    speed = np.array([dimensionless_speed(subject) for subject in builtin_subjects()])
    ours, guesses = [], []
    for side in "rl":
        curve = f"{name}_{side}"
        recorded = np.array([curves(each, kind, curve) for each in stored])
        for person, each in enumerate(stored):
            others = np.arange(len(stored)) != person
            slope, start = np.polyfit(speed[others], recorded[others], 1)
            walked = each["walks"][each["final"]]["curves"][kind][curve]["mean"]
            for predicted, errors in ((walked, ours), (start + slope * speed[person], guesses)):
                errors.append(np.sqrt(np.mean((predicted - recorded[person]) ** 2)))
    return float(1.0 - np.mean(ours) / np.mean(guesses))


def _means(stored: list[Stored]) -> list[evidence.Row]:
    rows = []
    for measure, (what, unit, goal, must) in LARGEST.items():
        values = values_of(stored, measure)
        rows.append(evidence.Row(what, float(np.mean(values)), unit, "<=", goal, must, len(values)))
    return rows


def values_of(stored: list[Stored], measure: str) -> list[float]:
    """The values of a measure, of all that it is of."""
    return [
        row["value"] for each in stored for row in each["measures"] if row["measure"] == measure
    ]


def ankles() -> evidence.Row:
    """Positive work of the two recorded ankles, after the correction of the plates."""
    phase = np.arange(1000) / 1000
    apart = []
    for subject in builtin_subjects():
        record, work = subject.record(), []
        for side in "rl":
            name = f"ankle_angle_{side}"
            power = record.moments[name](phase) * record.angles[name].derivative(phase)
            work.append(np.clip(power, 0.0, None).mean())
        apart.append(200.0 * abs(work[0] - work[1]) / (work[0] + work[1]))
    what = "left-right difference of the ankle's positive work, plates corrected, mean"
    return evidence.Row(what, float(np.mean(apart)), "%", "<=", 10.0, 15.0, len(apart))


def _goals(stored: list[Stored]) -> list[evidence.Row]:
    reached = sum(each["summary"]["goals_reached"] for each in stored)
    goals = sum(each["summary"]["goals"] for each in stored)
    what = "acceptance goals reached (arms not actuated by the policy; force plates corrected)"
    rows = [evidence.Row(what, reached, "goals", ">=", 430, 420, goals)]
    second = [each["witness"] for each in stored if each["witness"] is not None]
    there = sum(each["goals_reached"] for each in second)
    possible = sum(each["goals"] for each in second)
    standing = sum(not each["fell"] for each in second)
    rows.append(
        evidence.Row(
            "the same policies in MuJoCo: goals of accuracy reached",
            there, "goals", ">=", possible, round(0.9 * possible), possible,
        )
    )  # fmt: skip
    rows.append(
        evidence.Row(
            "the same policies in MuJoCo: walkers that do not fall",
            standing, "walkers", ">=", 10, 10, len(second),
        )
    )  # fmt: skip
    return rows


def _time() -> evidence.Row:
    """The stages of S05's stored run, which started from the general policy."""
    times = json.loads((ROOT / "reports/S05/baseline/times.json").read_text())
    minutes = times["general"]["seconds"] / 60.0
    what = "general policy to report, S05, 2 cores"
    return evidence.Row(what, minutes, "min", "<=", 5.0, 5.0, 1)


def _at_least(what: str, value: float, goal: float, must: float) -> evidence.Row:
    return evidence.Row(what, value, "1", ">=", goal, must, 20)
