"""How near the fitted walks come to the record, and at what price: the ten stored baselines.

Reads `reports/Snn/baseline/metrics.json`. Means are over ten people and both sides, against the
record corrected for the plates. What needs runs of its own (unseen speeds, kinetics from
kinematics) is in held_out.csv.
"""

from argparse import Namespace
from collections.abc import Iterator

import numpy as np

import evidence
from evidence.fitted import MOMENTS, Stored, corrected, skill_of, stored_baselines, values_of
from gaitval.metrics.groups import GROUPS, group_rows
from gaitval.metrics.results import Metrics, metrics_from

BOUNDS = {
    "sagittal angles": (1.0, 1.15),
    "moments": (0.025, 0.032),
    "vertical force": (1.3, 1.6),
    "fore-aft force": (0.6, 0.75),
    "medial force": (0.45, 0.6),
}
"""Goal and must of each of `GROUPS`, in its unit."""
PRICES = {
    "force_ringing": ("ringing of the vertical force, 12-25 Hz, RMS, mean", "% BW", 1.5, 2.0),
    "shoulder_moment_peak": ("shoulder moment, peak, mean", "Nm", 12.0, 15.0),
}
OWN_LINE = "line through two trials"
MEASURES = {
    "*": {
        "code": (
            "gaitval/metrics/groups.py:GROUPS,group_rows,group_curves",
            "gaitval/prediction/speed_line.py:dimensionless_speed",
            "evidence/fitted.py:skill_of,values_of,corrected,stored_baselines,MOMENTS",
        ),
        "data": ("reports/S??/baseline/metrics.json",),
    },
}
"""What the rows depend on; see evidence/stale.py."""


@evidence.measurement()
def baselines(_: Namespace) -> list[evidence.Row]:
    """Errors, skills, goals and side effects of the fitted walks of the ten stored baselines."""
    stored = stored_baselines()
    metrics = [metrics_from(each, f"S{person:02d}") for person, each in enumerate(stored, 1)]
    return [*_errors(metrics), *_skills(stored), _own_line(metrics[4]), *_prices(stored)]


def _errors(stored: list[Metrics]) -> Iterator[evidence.Row]:
    by_person = [{row.group: row for row in group_rows(each)} for each in stored]
    for group, (goal, must) in BOUNDS.items():
        rows = [found[group] for found in by_person]
        mean = float(np.mean([row.walked for row in rows if row.walked is not None]))
        count = 2 * len(GROUPS[group][1]) * len(rows)
        yield evidence.Row(
            f"fitted walk: {group}, RMSE", mean, rows[0].unit, "<=", goal, must, count
        )


def _skills(stored: list[Stored]) -> Iterator[evidence.Row]:
    for name, joint in MOMENTS.items():
        value = skill_of(stored, "moments", name, corrected)
        what = f"fitted walk: skill against nine others, {joint} moment"
        yield evidence.Row(what, value, "1", ">=", 0.75, 0.65, 2 * len(stored))


def _own_line(metrics: Metrics) -> evidence.Row:
    skills = [row.skills()[OWN_LINE] for row in group_rows(metrics)]
    better = sum(skill is not None and skill > 0.0 for skill in skills)
    what = "fitted S05: groups of curves nearer than the line through two own other trials"
    return evidence.Row(what, better, "groups", ">=", 5, 2, len(BOUNDS))


def _prices(stored: list[Stored]) -> Iterator[evidence.Row]:
    for measure, (what, unit, goal, must) in PRICES.items():
        values = values_of(stored, measure)
        yield evidence.Row(what, float(np.mean(values)), unit, "<=", goal, must, len(values))
    reached = sum(each["summary"]["goals_reached"] for each in stored)
    goals = sum(each["summary"]["goals"] for each in stored)
    yield evidence.Row("goals of acceptance", reached, "goals", ">=", 438, 432, goals)
