"""How wrong gaitval's predictions of a gait at another speed are: recorded trials are held out.

A walk at an unrecorded speed can only be compared with the prediction that it follows. Recorded
trials show how good such predictions are: each is held out, predicted from the person's other
trials and compared with its record.
"""

from collections.abc import Sequence
from typing import Final

import numpy as np

from gaitval.configuration import RecordSettings
from gaitval.datasets.subject import Subject
from gaitval.errors import SubjectError
from gaitval.gait.cycle_curves import recorded_curves
from gaitval.metrics.comparison import rms
from gaitval.metrics.groups import GROUPS
from gaitval.metrics.origin import curve_origin, record_origins
from gaitval.metrics.recorded import CURVE_UNITS, by_kind
from gaitval.metrics.repetitions import repeats
from gaitval.metrics.results import HeldOutError, HeldOutErrors
from gaitval.metrics.typed import sided
from gaitval.prediction.known import known_record
from gaitval.prediction.speed import trials_known

FEWEST_TRIALS: Final = 2
"""Trials that can be held out of a person; with fewer, other people's are. With fewer of those,
nothing is said."""


def prediction_errors(
    subject: Subject, settings: RecordSettings, others: Sequence[Subject]
) -> HeldOutErrors | None:
    """Mean RMSE by group of curves between recorded trials and their predictions; None where no
    trial can be held out from as far as the speed of `settings` is from what is known.

    Every trial of `subject` is predicted from the same person's trials at other speeds and from how
    other people change with speed (`gaitval.prediction.speed.at_speed`; no walker has a part in
    it). With fewer than `FEWEST_TRIALS` such trials of the person, those of all `others` are taken.
    The predictions know the same quantities as the run (`use` of `settings`). For a speed beyond
    the person's trials only trials beyond the others of theirs count, at least as far.
    """
    known = [each.walking_speed_m_s for each in trials_known(subject, settings.holdout or None)]
    least = beyond(settings.speed, known) if settings.speed else 0.0
    own = _of_person(subject, settings, others, least)
    rows, people = own, 1
    if len(own) < FEWEST_TRIALS:
        found = [_of_person(person, settings, others, least) for person in others]
        rows, people = [row for each in found for row in each], sum(map(bool, found))
    if len(rows) < FEWEST_TRIALS:
        return None
    return HeldOutErrors(
        trials=len(rows),
        people=people,
        own=rows is own,
        groups=[
            HeldOutError(
                group=group,
                unit=CURVE_UNITS[kind],
                mean=float(np.mean(values)),
                sd=float(np.std(values, ddof=1)) if len(values) > 1 else None,
            )
            for group, (kind, _) in GROUPS.items()
            if (values := [row[group] for row in rows if group in row])
        ],
    )


def beyond(speed: float, known: Sequence[float]) -> float:
    """How far a `speed` is outside the `known` ones, as a fraction of the nearest; 0 between."""
    return max(0.0, 1.0 - speed / min(known), speed / max(known) - 1.0)


def _of_person(
    person: Subject, settings: RecordSettings, others: Sequence[Subject], least: float
) -> list[dict[str, float]]:
    """Mean RMSE of each group for every trial that can be predicted from the person's others at
    other speeds, and is at least so far `beyond` them.
    """
    rows = []
    for name in (person.trial, *(trial.name for trial in person.trials)):
        chosen = person.on_trial(name)
        # a repetition would show how alike two walks at one speed are, not how good a prediction is
        kept = tuple(each for each in chosen.trials if not repeats(each, chosen))
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
        row = {}
        for group, (kind, names) in GROUPS.items():
            curves = sided(names)
            known = [each for each in curves if curve_origin(kind, each, origins) == "recorded"]
            if known:
                errors = [rms(predicted[kind][each] - recorded[kind][each]) for each in known]
                row[group] = float(np.mean(errors))
        rows.append(row)
    return rows
