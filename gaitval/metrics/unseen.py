"""The walk against trials at the same speed that were held out from the run.

Such a trial may be the other half of a session's gait cycles. Its distance from the given trial is
the person's own variation: the floor below which no model can be expected to go.
"""

from collections.abc import Mapping, Sequence

import numpy as np

from gaitval.arrays import Array
from gaitval.configuration import RecordSettings
from gaitval.datasets.subject import Subject
from gaitval.gait.cycle_curves import recorded_curves
from gaitval.metrics.comparison import rms
from gaitval.metrics.origin import curve_origin, record_origins
from gaitval.metrics.record_results import (
    KINDS,
    Kind,
    Kinds,
    PredictionErrors,
    UnseenCorrelations,
    UnseenErrors,
    UnseenResult,
)
from gaitval.metrics.recorded import by_kind
from gaitval.metrics.repetitions import repetitions
from gaitval.metrics.typed import array, number
from gaitval.metrics.walk_results import MeanCurve


def multiple_correlation(curves: Sequence[Array]) -> float | None:
    """Coefficient of multiple correlation of repeated `curves` (101,); None where it is not
    defined.

    Kadaba et al. 1989, J Orthop Res 7:849, within a day: 1 less the variance about the mean curve
    over the variance about the grand mean, and its square root.
    """
    values = np.array(curves)
    count, samples = values.shape
    # over the degrees of freedom: a mean per point is estimated, and then one grand mean
    about_curve = np.sum((values - values.mean(axis=0)) ** 2) / (samples * (count - 1))
    about_all = np.sum((values - values.mean()) ** 2) / (samples * count - 1)
    if about_all == 0.0 or about_curve > about_all:
        return None
    return float(np.sqrt(1.0 - about_curve / about_all))


def unseen(subject: Subject, walked: Kinds[MeanCurve]) -> list[UnseenResult]:
    """A row for every repetition of the subject's own trial, with the distances of the curves
    `walked` in their units; None where a curve was not recorded.
    """
    own = by_kind(recorded_curves(subject.record())) if subject.has_kinetics else {}
    return [] if not own else [_row(subject, trial, own, walked) for trial in repetitions(subject)]


def _row(
    subject: Subject,
    trial: Subject,
    own: Mapping[Kind, Mapping[str, Array]],
    walked: Kinds[MeanCurve],
) -> UnseenResult:
    here, there = (record_origins(each, RecordSettings()) for each in (subject, trial))
    errors: dict[Kind, dict[str, float | None]] = {kind: {} for kind in KINDS}
    between: dict[Kind, dict[str, float | None]] = {kind: {} for kind in KINDS}
    alike: dict[Kind, dict[str, float | None]] = {kind: {} for kind in KINDS}
    for kind, curves in by_kind(recorded_curves(trial.record())).items():
        for name, curve in curves.items():
            shown = curve_origin(kind, name, there) == "recorded"
            both = shown and curve_origin(kind, name, here) == "recorded"
            mean, first = walked.of(kind)[name].mean, own[kind][name]
            errors[kind][name] = number(rms(array(mean) - curve)) if mean and shown else None
            between[kind][name] = number(rms(first - curve)) if both else None
            alike[kind][name] = multiple_correlation((first, curve)) if both else None
    return UnseenResult(
        trial=trial.trial,
        speed=trial.walking_speed_m_s,
        rmse=UnseenErrors(**errors),
        between=PredictionErrors(**between),
        multiple_correlation=UnseenCorrelations(**alike),
    )
