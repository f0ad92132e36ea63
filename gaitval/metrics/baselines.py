"""Predictions without a model: what an error is worth beside them.

An error of 5 % of body weight says little by itself. Beside the error of a prediction that knows
nothing of the person but speed and leg length it says whether the walker knows more than that:
skill = 1 - error / error of the prediction. 1 is perfect, 0 is no better, below 0 is worse.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, fields
from typing import Any

import numpy as np

from gaitval.arrays import Array
from gaitval.datasets.subject import Subject
from gaitval.metrics.comparison import Curves, recorded_curves, rms
from gaitval.metrics.origin import Origins, curve_origin
from gaitval.metrics.recorded import by_kind
from gaitval.prediction.population import (
    FEWEST_PEOPLE,
    dimensionless_speed,
    line_weights,
    same_person,
)


@dataclass(frozen=True)
class Prediction:
    """The curves of a person as someone would guess them who has no model.

    Attributes
    ----------
    name : of the method, as tables tell it.
    told : what the method knows of the person.
    people : how many others it was made from.
    curves : as `comparison.recorded_curves`.
    """

    name: str
    told: str
    people: int
    curves: Curves


def others_line(subject: Subject, others: Sequence[Subject]) -> Prediction | None:
    """The curves that other people would have at the person's speed.

    At every percent of the gait cycle a straight line on dimensionless speed is fitted through the
    recorded curves of the others by least squares, and read at the speed of the person.

    Parameters
    ----------
    others : people to learn from. Whoever has the identifier or the source's person of `subject`
        is left out, so that nobody is predicted from their own record.

    Returns
    -------
    prediction
        None with fewer than `FEWEST_PEOPLE` others.
    """
    learned = [other for other in others if not same_person(subject, other)]
    if len(learned) < FEWEST_PEOPLE:
        return None
    speeds = np.array([dimensionless_speed(other) for other in learned])
    weights = line_weights(speeds, dimensionless_speed(subject))
    recorded = [recorded_curves(other.record()) for other in learned]
    return Prediction(
        name="line through others",
        told="walking speed and leg length",
        people=len(learned),
        curves=_combined(recorded, weights),
    )


def nearest_trial(subject: Subject) -> Prediction | None:
    """The person's other trial at the nearest speed, copied; None without another."""
    trials = _other_trials(subject)
    if not trials:
        return None
    nearest = min(trials, key=lambda t: abs(t.walking_speed_m_s - subject.walking_speed_m_s))
    return Prediction(
        name="nearest trial copied",
        told=f"the person's {nearest.trial} at {nearest.walking_speed_m_s:g} m/s",
        people=0,
        curves=recorded_curves(nearest.record()),
    )


def line_of_trials(subject: Subject) -> Prediction | None:
    """The straight line on speed through the person's two other trials at the nearest speeds; None
    without two of different speed.
    """
    speed = subject.walking_speed_m_s
    trials = sorted(_other_trials(subject), key=lambda t: abs(t.walking_speed_m_s - speed))[:2]
    speeds = [trial.walking_speed_m_s for trial in trials]
    if len(set(speeds)) < 2:
        return None
    return Prediction(
        name="line through two trials",
        told="the person's " + " and ".join(trial.trial for trial in trials),
        people=0,
        curves=_combined(
            [recorded_curves(trial.record()) for trial in trials],
            line_weights(np.array(speeds), speed),
        ),
    )


def change_added(subject: Subject, others: Sequence[Subject]) -> Prediction | None:
    """The person's other trial at the nearest speed, and the change to this speed of the straight
    line through other people; None without another trial or enough people.
    """
    copied = nearest_trial(subject)
    learned = [other for other in others if not same_person(subject, other)]
    if copied is None or len(learned) < FEWEST_PEOPLE:
        return None
    near = min(
        _other_trials(subject), key=lambda t: abs(t.walking_speed_m_s - subject.walking_speed_m_s)
    )
    speeds = np.array([dimensionless_speed(other) for other in learned])
    here, there = (line_weights(speeds, dimensionless_speed(each)) for each in (subject, near))
    recorded = [recorded_curves(other.record()) for other in learned]
    return Prediction(
        name="other people's change added",
        told=copied.told,
        people=len(learned),
        curves=_combined([copied.curves, *recorded], np.append(1.0, here - there)),
    )


def predictions(subject: Subject, others: Sequence[Subject]) -> list[Prediction]:
    """All that can be made for the record of a subject; the line through others comes first."""
    found = (
        others_line(subject, others),
        nearest_trial(subject),
        line_of_trials(subject),
        change_added(subject, others),
    )
    return [each for each in found if each is not None]


def predicted_parts(
    subject: Subject,
    others: Sequence[Subject],
    recorded: Mapping[str, Any],
    origins: Origins,
) -> list[dict[str, Any]]:
    """The predictions' part of `metrics.json`, with their errors from the `recorded` curves: None
    where a curve was not recorded, and no part at all where no curve was.
    """

    def error(kind: str, name: str, curve: Array) -> float | None:
        if curve_origin(kind, name, origins) != "recorded":
            return None
        return rms(curve - recorded[kind][name])

    if not any(curve_origin(k, n, origins) == "recorded" for k in recorded for n in recorded[k]):
        return []
    return [
        {
            "name": each.name,
            "told": each.told,
            "people": each.people,
            "rmse": {
                kind: {name: error(kind, name, curve) for name, curve in curves.items()}
                for kind, curves in by_kind(each.curves).items()
            },
        }
        for each in predictions(subject, others)
    ]


def _other_trials(subject: Subject) -> list[Subject]:
    return [subject.on_trial(trial.name) for trial in subject.trials]


def _combined(curves: Sequence[Curves], weights: Array) -> Curves:
    """Sum of curves times weights."""
    return Curves(
        *(
            {
                name: np.tensordot(weights, [getattr(each, field.name)[name] for each in curves], 1)
                for name in getattr(curves[0], field.name)
            }
            for field in fields(Curves)
        )
    )


def skill(error: float | None, baseline: float | None) -> float | None:
    """1 - error / baseline; None where one of them is not known or the baseline is exact."""
    if error is None or not baseline:
        return None
    return 1.0 - error / baseline
