"""What the dynamic fit adds to the errors of a predicted record, by the accuracies asked of it.

    python -m experiments.predicted_fits    # ten minutes, prints a table

For every trial of people with several, predicted from their others: error of the fit over that of
the prediction without physics, of `GROUPS` and of the other angles; and the mean over `GROUPS` with
each person left out, by which a set can be chosen for that person.
"""

from collections.abc import Iterator
from typing import Final

import numpy as np

from experiments.fit_weights import Errors, group_means
from gaitval.configuration import ContactSettings, RecordSettings
from gaitval.datasets.subject import Subject
from gaitval.datasets.subject_file import builtin_subjects
from gaitval.errors import SubjectError
from gaitval.gait.accuracy import RecordAccuracy
from gaitval.gait.cycle_curves import Curves, recorded_curves
from gaitval.gait.record import GaitRecord
from gaitval.metrics.comparison import rms
from gaitval.metrics.groups import GROUPS
from gaitval.metrics.recorded import by_kind
from gaitval.metrics.reference_curves import reference_curves
from gaitval.model.body import BodyModel
from gaitval.prediction.known import PREDICTED_ACCURACY, told
from gaitval.reference.dynamic_fit import consistent_reference
from gaitval.scaling.scaling import scale_subject

_LOOSE: Final = PREDICTED_ACCURACY._replace(
    moment=0.025, forward_force=0.006, sideways_force=0.0045, vertical_force=0.007
)
SETS: Final = {
    "as it was": _LOOSE,
    "moments 0.02": _LOOSE._replace(moment=0.02),
    "moments 0.015": _LOOSE._replace(moment=0.015),
    "moments 0.01": _LOOSE._replace(moment=0.01),
    "moments 0.015, forces 0.35, 0.25, 0.8 %": PREDICTED_ACCURACY._replace(
        moment=0.015, vertical_force=0.008
    ),
    "moments 0.01, forces 0.45, 0.35, 0.6 %": PREDICTED_ACCURACY._replace(
        forward_force=0.0045, sideways_force=0.0035
    ),
    "**moments 0.01, forces 0.35, 0.25, 0.6 %**": PREDICTED_ACCURACY,
    "moments 0.007, forces 0.35, 0.25, 0.6 %": PREDICTED_ACCURACY._replace(moment=0.007),
}
"""Moments in Nm/kg; forces fore-aft, sideways, vertical in % of body weight."""


def held_out_trials() -> Iterator[tuple[Subject, str, GaitRecord]]:
    """People with several trials, the name of each that their others predict, and the record that
    they predict.
    """
    for subject in builtin_subjects():
        for name in [subject.trial, *(each.name for each in subject.trials)]:
            try:
                known = told(subject, RecordSettings(holdout=name), builtin_subjects())
            except SubjectError:  # the only trial, or too far from every other speed
                continue
            yield subject, name, known.record


def trials() -> Iterator[tuple[str, Errors, dict[str, Errors]]]:
    """Each person with a trial's errors: of the prediction, and of the fit of each of `SETS`."""
    for subject, name, known in held_out_trials():
        truth = recorded_curves(subject.on_trial(name).record())
        model = scale_subject(subject).model
        fits = {
            each: errors(_fit(known, model, accuracy), truth) for each, accuracy in SETS.items()
        }
        yield subject.identifier, errors(recorded_curves(known), truth), fits


def _fit(known: GaitRecord, model: BodyModel, accuracy: RecordAccuracy) -> Curves:
    reference = consistent_reference(known, model, ContactSettings(), accuracy)
    return reference_curves(reference, model.mass, known.left_phase)


def errors(curves: Curves, truth: Curves) -> Errors:
    """RMSE of `curves` against `truth` by group."""
    ours, theirs = by_kind(curves), by_kind(truth)
    return group_means(lambda kind, name: rms(ours[kind][name] - theirs[kind][name]))


def main() -> None:
    """Print the table; its last columns are means over `GROUPS`, each without one person."""
    rows = list(trials())
    people = sorted({person for person, _, _ in rows})

    def over(chosen: str, group: str, without: str = "") -> float:
        some = [(before, fits[chosen]) for person, before, fits in rows if person != without]
        fitted, predicted = (np.mean([each[i][group] for each in some]) for i in (1, 0))
        return float(fitted / predicted)

    groups = list(rows[0][1])
    heads = ["accuracies", *groups, *(f"without {person}" for person in people)]
    print(f"| {' | '.join(heads)} |\n|{'---|' * len(heads)}")
    for each in SETS:
        numbers = [f"{over(each, group):.2f}" for group in groups]
        for left_out in people:
            mean = np.mean([over(each, group, left_out) for group in GROUPS])
            numbers.append(f"{mean:.3f}")
        print(f"| {' | '.join([each, *numbers])} |", flush=True)


if __name__ == "__main__":
    main()
