"""Errors of groups of curves: the walk's beside those of predictions without a model."""

from collections.abc import Mapping
from typing import Any, Final, NamedTuple

import numpy as np

from gaitval.gait.record import Origin
from gaitval.metrics.baselines import skill
from gaitval.metrics.origin import curve_origin, furthest, origins_in

GROUPS: Final[Mapping[str, tuple[str, tuple[str, ...]]]] = {
    "sagittal angles": ("angles", ("hip_flexion", "knee_angle", "ankle_angle")),
    "moments": ("moments", ("hip_flexion", "knee_angle", "ankle_angle")),
    "vertical force": ("forces", ("vertical",)),
    "fore-aft force": ("forces", ("forward",)),
    "medial force": ("forces", ("medial",)),
}
"""Kind and names of the curves of each group; both sides."""


class GroupRow(NamedTuple):
    """Mean RMSE of a group of curves.

    Attributes
    ----------
    walked : of the walk; None if it is too short.
    guesses : by name of the prediction without a model; None where nothing was recorded.
    origin : where what the walk is compared with comes from. If some curves of the group were
        recorded, the means are over those.
    """

    group: str
    unit: str
    status: str
    walked: float | None
    guesses: dict[str, float | None]
    origin: Origin = "recorded"

    def skills(self) -> dict[str, float | None]:
        """Skill of the walk against each prediction."""
        return {name: skill(self.walked, guess) for name, guess in self.guesses.items()}


def group_curves(metrics: Mapping[str, Any]) -> dict[str, tuple[str, list[str], str]]:
    """Kind, curves of both sides, and unit of each group."""
    return {
        group: (kind, [f"{name}_{side}" for name in names for side in "rl"], metrics["units"][kind])
        for group, (kind, names) in GROUPS.items()
    }


def group_rows(metrics: Mapping[str, Any]) -> list[GroupRow]:
    """A row for every group, from `metrics.json`."""
    errors, origins = metrics["walks"][metrics["final"]]["errors"], origins_in(metrics)
    rows = []
    for group, (kind, every, unit) in group_curves(metrics).items():
        curves = [name for name in every if curve_origin(kind, name, origins) == "recorded"]
        recorded, curves = bool(curves), curves or every
        found = [errors[kind][curve] for curve in curves]
        walked = None if None in found else float(np.mean([error["rmse"] for error in found]))
        guesses = {
            prediction["name"]: float(np.mean([prediction["rmse"][kind][c] for c in curves]))
            if recorded
            else None
            for prediction in metrics["predictions"]
        }
        status = "fitted" if metrics["told"][kind] else "predicted"
        origin = furthest([curve_origin(kind, name, origins) for name in curves])
        rows.append(GroupRow(group, unit, status, walked, guesses, origin))
    return rows
