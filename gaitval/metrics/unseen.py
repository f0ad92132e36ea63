"""The walk against trials at the same speed that the run was not told.

Such as the other half of a session's gait cycles. How far such a trial is from the told one is what
a person's own gait varies by: the floor below which no model can be asked to go.
"""

from collections.abc import Mapping, Sequence
from typing import Any, Final

import numpy as np

from gaitval.arrays import Array
from gaitval.configuration import RecordSettings
from gaitval.datasets.subject import Subject
from gaitval.metrics.comparison import recorded_curves, rms
from gaitval.metrics.origin import curve_origin, record_origins
from gaitval.metrics.recorded import by_kind

SAME_SPEED: Final = 0.03
"""Relative difference of speed up to which two trials are repetitions of one another."""

Json = dict[str, Any]


def repetitions(subject: Subject) -> list[Subject]:
    """The person on each further trial with kinetics at the speed of the subject's own."""
    trials = [subject.on_trial(trial.name) for trial in subject.trials]
    return [
        trial
        for trial in trials
        if trial.has_kinetics
        and abs(trial.walking_speed_m_s / subject.walking_speed_m_s - 1.0) <= SAME_SPEED
    ]


def multiple_correlation(curves: Sequence[Array]) -> float | None:
    """Coefficient of multiple correlation of repeated curves (101,); None where it is not defined.

    Kadaba et al. 1989, J Orthop Res 7:849, within a day: 1 less the variance about the mean curve
    over the variance about the mean of all.
    """
    values = np.array(curves)
    count, samples = values.shape
    about_curve = np.sum((values - values.mean(axis=0)) ** 2) / (samples * (count - 1))
    about_all = np.sum((values - values.mean()) ** 2) / (samples * count - 1)
    if about_all == 0.0 or about_curve > about_all:
        return None
    return float(np.sqrt(1.0 - about_curve / about_all))


def unseen(subject: Subject, walked: Mapping[str, Any]) -> list[Json]:
    """A row for every repetition of the subject's own trial, in the units of the curves; None where
    a curve was not recorded.

    Parameters
    ----------
    walked : curves of the walk by kind and name, as in `metrics.json`.
    """
    own = by_kind(recorded_curves(subject.record())) if subject.has_kinetics else {}
    return [] if not own else [_row(subject, trial, own, walked) for trial in repetitions(subject)]


def _row(
    subject: Subject, trial: Subject, own: Mapping[str, Any], walked: Mapping[str, Any]
) -> Json:
    row: Json = {"trial": trial.trial, "speed": trial.walking_speed_m_s}
    here, there = (record_origins(each, RecordSettings()) for each in (subject, trial))
    row |= {"rmse": {}, "between": {}, "multiple_correlation": {}}
    for kind, curves in by_kind(recorded_curves(trial.record())).items():
        shown = {name for name in curves if curve_origin(kind, name, there) == "recorded"}
        both = {name for name in shown if curve_origin(kind, name, here) == "recorded"}
        pairs = {name: (own[kind][name], curve) for name, curve in curves.items()}
        means = {name: walked[kind][name]["mean"] for name in curves}
        row["rmse"][kind] = {
            name: None if means[name] is None or name not in shown else rms(means[name] - curve)
            for name, curve in curves.items()
        }
        row["between"][kind] = {
            name: rms(one - other) if name in both else None for name, (one, other) in pairs.items()
        }
        row["multiple_correlation"][kind] = {
            name: multiple_correlation(pair) if name in both else None
            for name, pair in pairs.items()
        }
    return row
