"""The walk against trials at the same speed that were held out from the run.

Such a trial may be the other half of a session's gait cycles. Its distance from the given trial is
the person's own variation: the floor below which no model can be expected to go.
"""

from collections.abc import Mapping

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
from gaitval.metrics.walk_statistics import multiple_correlation


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
