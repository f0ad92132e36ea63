"""Other trials of this person: those that repeat the walk's own, and those at other speeds.

A *repetition* is a trial at the same speed, such as the other half of a session's gait cycles. Its
distance from the given trial is the person's own variation: the floor below which no model can be
expected to go.

A trial at another speed is *held out*: predicted from the person's other trials and compared with
its record. A walk at an unrecorded speed can only be compared with the prediction that it follows;
errors of held-out trials show how good such predictions are, for groups of curves, and as a band
for every curve.
"""

from collections.abc import Iterator, Mapping, Sequence
from typing import Final, NamedTuple

import numpy as np
from scipy.ndimage import gaussian_filter1d
from scipy.special import stdtrit

from gaitval.arrays import Array
from gaitval.configuration import RecordSettings
from gaitval.errors import SubjectError
from gaitval.gait.cycle_curves import recorded_curves
from gaitval.gait.dimensionless import speed_unit
from gaitval.gait.record import GaitRecord
from gaitval.metrics.baselines import GROUPS
from gaitval.metrics.comparison import multiple_correlation, rms
from gaitval.metrics.curve_results import (
    CURVE_UNITS,
    KINDS,
    Kind,
    Kinds,
    MeanCurve,
    PredictedCurves,
    PredictionBand,
    PredictionErrors,
    StatisticalCurves,
    UnseenCorrelations,
    UnseenErrors,
    UnseenResult,
    by_kind,
)
from gaitval.metrics.origin import curve_origin, record_origins
from gaitval.metrics.results import (
    HeldOutError,
    HeldOutErrors,
    Metrics,
    WalkResult,
    WalkResults,
)
from gaitval.metrics.typed import array, number, numbers, rounded, sided
from gaitval.metrics.verdict_rows import CONFIDENCE
from gaitval.subjects.prediction.known import known_record
from gaitval.subjects.prediction.speed import trials_known
from gaitval.subjects.subject import Subject, Trial

SAME_SPEED: Final = 0.03
"""Relative difference of speed up to which two trials are repetitions of one another."""


def repetitions(subject: Subject) -> list[Subject]:
    """`subject` on each further trial with kinetics at the speed of its own."""
    trials = [subject.on_trial(trial.name) for trial in subject.trials]
    return [trial for trial in trials if trial.has_kinetics and repeats(trial, subject)]


def repeats(trial: Subject | Trial, subject: Subject) -> bool:
    """Whether a `trial` is at the speed of the own one of `subject`."""
    return abs(trial.walking_speed_m_s / subject.walking_speed_m_s - 1.0) <= SAME_SPEED


def unseen(subject: Subject, walked: Kinds[MeanCurve]) -> list[UnseenResult]:
    """A row for every repetition of the subject's own trial, with the distances of the curves
    `walked` in their units; None where a curve was not recorded.
    """
    again = repetitions(subject) if subject.has_kinetics else []
    own = by_kind(recorded_curves(subject.record())) if again else {}
    return [_row(subject, trial, own, walked) for trial in again]


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


FEWEST_TRIALS: Final = 2
"""Trials that can be held out of a person; with fewer, other people's are. With fewer of those,
nothing is said."""

FAR: Final = 0.09
"""Difference of dimensionless speed from the nearest known trial, 0.3 m/s on legs of 0.9 m, at
which the square of a prediction's error has doubled. Of the ankles of 30 people it is 0.07 (angle)
to 0.11 (moment); tests/metrics/test_other_trials.py computes it."""

_SMOOTH: Final = 3.0
"""Percent of the cycle, SD of the bell over which squared errors of a few trials are averaged."""


class HeldOut(NamedTuple):
    """A recorded trial beside its prediction from the person's others.

    Attributes
    ----------
    independent : what other errors of the person it says the same as: those of one name are one.
    away : difference of dimensionless speed from the nearest of the trials that it was predicted
        from.
    errors : (101,) predicted less recorded, by kind and curve with side, in the units of
        `CURVE_UNITS`, of what was recorded.
    """

    independent: str
    away: float
    errors: Mapping[tuple[Kind, str], Array]

    def rmse(self, group: str) -> float | None:
        """Mean over the recorded curves of one of `GROUPS`; None without any."""
        kind, names = GROUPS[group]
        found = [self.errors[kind, each] for each in sided(names) if (kind, each) in self.errors]
        return float(np.mean([rms(each) for each in found])) if found else None


def prediction_errors(
    subject: Subject, settings: RecordSettings, others: Sequence[Subject]
) -> HeldOutErrors | None:
    """Mean RMSE by group of curves between recorded trials and their predictions; None where no
    trial can be held out from as far as the speed of `settings` is from what is known.

    Every trial of `subject` is predicted from the same person's trials at other speeds and from how
    other people change with speed (`gaitval.subjects.prediction.speed.at_speed`; no walker has a
    part in it). Errors that say the same count once: two speeds are one difference, whichever of
    them is predicted from the other, and so are trials at one speed. With fewer than
    `FEWEST_TRIALS` such errors of the person, those of all `others` are taken. The predictions know
    the same quantities as the run (`use` of `settings`). For a speed beyond the person's trials
    only trials beyond the others of theirs count, at least as far.
    """
    known = [each.walking_speed_m_s for each in trials_known(subject, settings.holdout or None)]
    least = beyond(settings.speed, known) if settings.speed else 0.0
    own = list(_of_person(subject, settings, others, least))
    found, people = own, 1
    if _independent(own) < FEWEST_TRIALS:
        theirs = [list(_of_person(each, settings, others, least)) for each in others]
        whole = [row for each in theirs for row in each]
        if _independent(whole) >= FEWEST_TRIALS:
            found, people = whole, sum(map(bool, theirs))
    if not found or (found is not own and _independent(found) < FEWEST_TRIALS):
        return None
    groups = []
    for group, (kind, _) in GROUPS.items():
        values = _once(found, group)
        if values:
            spread = float(np.std(values, ddof=1)) if len(values) > 1 else None
            groups.append(
                HeldOutError(
                    group=group,
                    unit=CURVE_UNITS[kind],
                    mean=float(np.mean(values)),
                    sd=spread,
                )
            )
    return HeldOutErrors(trials=_independent(found), people=people, own=found is own, groups=groups)


def _independent(rows: Sequence[HeldOut]) -> int:
    return len({row.independent for row in rows})


def _once(rows: Sequence[HeldOut], group: str) -> list[float]:
    """RMSE of a group; the mean of those that say the same."""
    values: dict[str, list[float]] = {}
    for row in rows:
        if (error := row.rmse(group)) is not None:
            values.setdefault(row.independent, []).append(error)
    return [float(np.mean(each)) for each in values.values()]


def beyond(speed: float, known: Sequence[float]) -> float:
    """How far a `speed` is outside the `known` ones, as a fraction of the nearest; 0 between."""
    return max(0.0, 1.0 - speed / min(known), speed / max(known) - 1.0)


def held_out_trials(people: Sequence[Subject], settings: RecordSettings) -> Iterator[HeldOut]:
    """Every trial of all `people` that can be predicted from the person's others, with the
    quantities that `settings` use.
    """
    for person in people:
        yield from _of_person(person, settings, people, 0.0)


def _of_person(
    person: Subject, settings: RecordSettings, others: Sequence[Subject], least: float
) -> Iterator[HeldOut]:
    """Every trial that can be predicted from the person's others at other speeds, and is at least
    so far `beyond` them.
    """
    names = (person.trial, *(trial.name for trial in person.trials))
    speeds = _speeds(person, names)
    unit = speed_unit(person.leg_length_m)
    for name in names:
        # a repetition would show how alike two walks at one speed are, not how good a prediction is
        chosen = person.on_trial(name)
        kept = tuple(each for each in chosen.trials if speeds[each.name] != speeds[name])
        chosen = chosen.model_copy(update={"trials": kept})
        rest = [trial.walking_speed_m_s for trial in kept]
        if not (chosen.has_kinetics and rest) or beyond(chosen.walking_speed_m_s, rest) < least:
            continue
        try:
            guess = known_record(
                chosen, RecordSettings(use=settings.use, holdout=name), others, forced=True
            ).record
        except SubjectError:  # it is the only trial, or the others do not allow a prediction
            continue
        # curves that were mirrored or expected are no evidence: only recorded ones are scored
        predicted = by_kind(recorded_curves(guess))
        recorded = by_kind(recorded_curves(chosen.record()))
        origins = record_origins(chosen, RecordSettings())
        # from one speed to another and back is one difference
        same = "" if len(set(speeds.values())) == 2 else str(speeds[name])
        yield HeldOut(
            independent=f"{person.identifier} {same}",
            away=min(abs(chosen.walking_speed_m_s - each) for each in rest) / unit,
            errors={
                (kind, each): predicted[kind][each] - recorded[kind][each]
                for kind in KINDS
                for each in predicted[kind]
                if each in recorded[kind] and curve_origin(kind, each, origins) == "recorded"
            },
        )


def _speeds(person: Subject, names: Sequence[str]) -> dict[str, int]:
    """The number of the speed of each trial, from the slowest on; repetitions have the same."""
    walked = {name: person.on_trial(name).walking_speed_m_s for name in names}
    found: dict[str, int] = {}
    first, number = 0.0, -1
    for name in sorted(names, key=walked.__getitem__):
        if walked[name] > (1.0 + SAME_SPEED) * first:
            first, number = walked[name], number + 1
        found[name] = number
    return found


def predicted_curves(
    subject: Subject,
    settings: RecordSettings,
    others: Sequence[Subject],
    walked: GaitRecord | None = None,
) -> PredictedCurves:
    """The curves that are predicted for the speed of `settings`, without a model, with a band for
    each where at least `FEWEST_TRIALS` trials of this person and of `others` can be held out.
    Nothing of a trial that `settings` hold out is read. On a slope or with a load they are those of
    `walked`, without a band: nobody's trials say how far they are off.
    """
    if walked is not None:
        return PredictedCurves(curves=_stored(by_kind(recorded_curves(walked))))
    known = trials_known(subject, settings.holdout or None)
    person = known[0].model_copy(
        update={"trials": tuple(t for t in known[0].trials if t.name != settings.holdout)}
    )
    # what others do has no part of the held-out trial, either
    people = [person, *(each for each in others if not subject.is_person_of(each))]
    record = known_record(subject, settings, others, forced=True).record
    curves = by_kind(recorded_curves(record))
    away = min(abs(record.speed - each.walking_speed_m_s) for each in known)
    away /= speed_unit(person.leg_length_m)
    return PredictedCurves(
        curves=_stored(curves),
        band=_band(people, settings, away, curves),
    )


def with_predicted(metrics: Metrics, curves: PredictedCurves) -> Metrics:
    """`metrics` with the predicted `curves`; of a speed that nobody recorded, what the walk is
    compared with is called predicted.
    """
    update: dict[str, object] = {"predicted": rounded(curves)}
    if not metrics.is_recorded_at_all:
        update["walks"] = WalkResults(
            **{
                name: None if walk is None else _unrecorded(walk)
                for name, walk in (
                    ("nominal", metrics.walks.nominal),
                    ("identified", metrics.walks.identified),
                )
            }
        )
    return metrics.model_copy(update=update)


def _unrecorded(walk: WalkResult) -> WalkResult:
    rows = [
        row.model_copy(update={"recorded": None, "predicted": row.recorded})
        for row in walk.spatiotemporal
    ]
    return walk.model_copy(update={"spatiotemporal": rows})


def _band(
    people: Sequence[Subject],
    settings: RecordSettings,
    away: float,
    curves: Mapping[Kind, Mapping[str, Array]],
) -> PredictionBand | None:
    """Of `curves` that are a dimensionless speed `away` from the nearest known trial."""
    rows = list(held_out_trials(people, settings))
    if _independent(rows) < FEWEST_TRIALS:
        return None
    widths, unknown = half_widths(rows, away), np.full(101, np.nan)
    return PredictionBand(
        share=CONFIDENCE,
        trials=_independent(rows),
        people=len({row.independent.partition(" ")[0] for row in rows}),
        away=away,
        half_width=_stored(
            {
                kind: {name: widths.get((kind, name[:-2]), unknown) for name in each}
                for kind, each in curves.items()
            }
        ),
    )


def _stored(curves: Mapping[Kind, Mapping[str, Array]]) -> StatisticalCurves:
    return StatisticalCurves(
        **{kind: {n: numbers(each) for n, each in curves[kind].items()} for kind in KINDS}
    )


def half_widths(rows: Sequence[HeldOut], away: float) -> dict[tuple[Kind, str], Array]:
    """(101,) half width of the band of `CONFIDENCE` by kind and curve without side, in the units of
    `CURVE_UNITS`, of a prediction that is a dimensionless speed `away` from the nearest known
    trial, from trials that were held out: `rows`. A curve that none of them has is left out.

    Squares of errors are taken to grow with distance as 1 + (away / `FAR`)², and are averaged at
    each percent of the cycle over trials and sides and over neighbouring percents. With few trials
    the band is wider than the normal distribution's, by Student's t with a degree of freedom for
    each side.
    """
    counts = {row.independent: 0 for row in rows}
    for row in rows:
        counts[row.independent] += 1
    squares: dict[tuple[Kind, str], list[tuple[float, Array]]] = {}
    for row in rows:
        for (kind, name), error in row.errors.items():
            square = error**2 / _growth(row.away)
            weight = 1.0 / counts[row.independent]
            squares.setdefault((kind, name[:-2]), []).append((weight, square))
    found = {}
    for key, each in squares.items():
        weights = np.array([weight for weight, _ in each])
        mean = weights @ np.array([square for _, square in each]) / weights.sum()
        # the last sample is the first of the next cycle
        smooth = gaussian_filter1d(mean[:-1], _SMOOTH, mode="wrap")
        wide = stdtrit(weights.sum(), 0.5 + 0.5 * CONFIDENCE)
        found[key] = wide * np.sqrt(np.append(smooth, smooth[0]) * _growth(away))
    return found


def _growth(away: float) -> float:
    return 1.0 + (away / FAR) ** 2
