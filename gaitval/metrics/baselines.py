"""Predictions without a model: what an error is worth beside them.

An error of 5 % of body weight says little by itself. Beside the error of a prediction that knows
nothing of the person but speed and leg length it says whether the walker knows more than that:
skill = 1 - error / error of the prediction. 1 is perfect, 0 is no better, below 0 is worse.
"""

from collections.abc import Sequence
from dataclasses import dataclass, fields

import numpy as np

from gaitval.datasets.subject import Subject
from gaitval.metrics.comparison import Curves, recorded_curves
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
        curves=Curves(
            *(
                {
                    name: np.tensordot(
                        weights, [getattr(each, field.name)[name] for each in recorded], 1
                    )
                    for name in getattr(recorded[0], field.name)
                }
                for field in fields(Curves)
            )
        ),
    )


def skill(error: float | None, baseline: float | None) -> float | None:
    """1 - error / baseline; None where one of them is not known or the baseline is exact."""
    if error is None or not baseline:
        return None
    return 1.0 - error / baseline
