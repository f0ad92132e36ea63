"""Errors of groups of curves: the walk's beside those of predictions without a model."""

from collections.abc import Mapping
from typing import Final, NamedTuple

import numpy as np

from gaitval.gait.record import Origin
from gaitval.metrics.baselines import skill
from gaitval.metrics.origin import curve_origin, furthest
from gaitval.metrics.record_results import Kind
from gaitval.metrics.results import Metrics
from gaitval.metrics.typed import array, number, sided

GROUPS: Final[Mapping[str, tuple[Kind, tuple[str, ...]]]] = {
    "sagittal angles": ("angles", ("hip_flexion", "knee_angle", "ankle_angle")),
    "other angles": (
        "angles",
        ("hip_adduction", "hip_rotation", "pelvis_tilt", "pelvis_list", "pelvis_rotation"),
    ),
    "moments": ("moments", ("hip_flexion", "knee_angle", "ankle_angle")),
    "hip adduction moment": ("moments", ("hip_adduction",)),
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
    guesses : by name of the prediction without a model; None where nothing was recorded, or the
        prediction has no such curves.
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


def group_curves(metrics: Metrics) -> dict[str, tuple[Kind, tuple[str, ...], str]]:
    """Kind, curves of both sides, and unit in `metrics` of each of `GROUPS`."""
    return {
        group: (kind, sided(names), metrics.units.of(kind))
        for group, (kind, names) in GROUPS.items()
    }


def group_rows(metrics: Metrics) -> list[GroupRow]:
    """Mean RMSE in `metrics` of each of `GROUPS`, of walk and predictions without a model."""
    errors, origins = metrics.walk.errors, metrics.origins
    rows = []
    for group, (kind, every, unit) in group_curves(metrics).items():
        curves = [name for name in every if curve_origin(kind, name, origins) == "recorded"]
        # if nothing of the group was recorded, the row is the distance from all its curves, without
        # skill
        recorded, curves = bool(curves), curves or list(every)
        found = [errors.of(kind)[curve] for curve in curves]
        rmse = [error.rmse for error in found if error is not None]
        # a mean over fewer curves could not be compared with the predictions' mean
        walked = float(np.mean(array(rmse))) if len(rmse) == len(found) else None
        guesses = {
            prediction.name: number(
                float(np.mean(array([prediction.rmse.of(kind)[c] for c in curves])))
            )
            if recorded
            else None
            for prediction in metrics.predictions
        }
        status = "fitted" if metrics.known[kind] else "predicted"
        origin = furthest([curve_origin(kind, name, origins) for name in curves])
        rows.append(GroupRow(group, unit, status, walked, guesses, origin))
    return rows
