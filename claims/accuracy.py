"""How near the fitted walks of the ten stored baselines come to their records, and at what price.

Reads `reports/Snn/baseline/metrics.json`: means over ten people and both sides. Skill is 1 less the
mean RMSE over that of a straight line on dimensionless speed through the nine others, both against
the same records: with the faults of the force plates corrected, scaled to one body weight only, and
as measured. A walker follows the corrected record in both.
"""

from collections.abc import Callable, Iterator
from typing import Any

import numpy as np
from numpy.typing import NDArray

import claims
from claims import ROOT, Claim
from gaitval.metrics.baselines import GROUPS, group_rows
from gaitval.metrics.results import metrics_from, read_metrics
from gaitval.subjects.prediction.speed_line import dimensionless_speed
from gaitval.subjects.subject_file import builtin_subjects

FORCES = ("vertical", "forward", "medial")
MOMENTS = {"hip_flexion": "hip", "knee_angle": "knee", "ankle_angle": "ankle"}
LARGEST = {
    "force_ringing": ("ringing of the vertical force, 12-25 Hz, RMS", "% BW"),
    "shoulder_moment_rms": ("shoulder moment, RMS", "Nm"),
    "shoulder_moment_peak": ("shoulder moment, peak", "Nm"),
    "arm_work_share": ("positive work of the arms over that of the legs", "%"),
}
_Stored = dict[str, Any]
_CurvesOf = Callable[[_Stored, str, str], NDArray[np.float64]]


def corrected(stored: _Stored, kind: str, curve: str) -> NDArray[np.float64]:
    """A recorded curve without the faults of the plates."""
    return np.array(stored["record"]["curves"][kind][curve])


def measured(stored: _Stored, kind: str, curve: str) -> NDArray[np.float64]:
    """A recorded curve as measured."""
    found = stored["record"]["as_measured"] or stored["record"]["curves"]
    return np.array(found[kind][curve])


def stored_baselines() -> list[_Stored]:
    """`metrics.json` of the ten."""
    paths = [ROOT / f"reports/S{number:02d}/baseline/metrics.json" for number in range(1, 11)]
    return [read_metrics(path).as_dict() for path in paths]


@claims.measured()
def baselines(_: claims.Given) -> list[Claim]:
    """Errors, skills, limits and side effects of the ten stored baselines."""
    stored = stored_baselines()
    return [*_errors(stored), *_skills(stored), *_means(stored), *_limits(stored)]


def _errors(stored: list[_Stored]) -> Iterator[Claim]:
    people = [metrics_from(each, f"S{person:02d}") for person, each in enumerate(stored, 1)]
    by_person = [{row.group: row for row in group_rows(each)} for each in people]
    for group, (_, names) in GROUPS.items():
        rows = [found[group] for found in by_person]
        mean = float(np.mean([row.walked for row in rows if row.walked is not None]))
        yield Claim(f"fitted walk: {group}, RMSE", mean, rows[0].unit, 2 * len(names) * len(rows))


def _skills(stored: list[_Stored]) -> Iterator[Claim]:
    curves = [(f"{name} force", "forces", name) for name in FORCES]
    curves += [(f"{joint} moment", "moments", name) for name, joint in MOMENTS.items()]
    for which, of in (("record corrected", corrected), ("record as measured", measured)):
        for noun, kind, name in curves:
            what = f"fitted walkers (record known to the model): skill, {noun}, {which}"
            yield Claim(what, skill_of(stored, kind, name, of), "1", 20)


def skill_of(stored: list[_Stored], kind: str, name: str, curves: _CurvesOf) -> float:
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


def _means(stored: list[_Stored]) -> Iterator[Claim]:
    for measure, (what, unit) in LARGEST.items():
        values = [
            row["value"] for each in stored for row in each["measures"] if row["measure"] == measure
        ]
        yield Claim(what, float(np.mean(values)), unit, len(values))


def _limits(stored: list[_Stored]) -> Iterator[Claim]:
    for found, of, what, unit in (
        ("nearer", "curves", "nearer than the best prediction without a model", "curves"),
        ("guess_within", "guess_judged", "that prediction meets limits on curves", "limits"),
    ):
        count, every = (sum(each["summary"][name] for each in stored) for name in (found, of))
        yield Claim(f"fitted walks: {what}", count, unit, every)
    second = [each["second_engine"] for each in stored if each["second_engine"] is not None]
    met, every = (sum(each[name] for each in second) for name in ("limits_met", "limits"))
    what = "the same policies in MuJoCo"
    yield Claim(f"{what}: limits met", met, "limits", every)
    standing = sum(not each["fell"] for each in second)
    yield Claim(f"{what}: walkers that do not fall", standing, "walkers", len(second))
