"""Fit every trial of the built-in people as if their forces were unknown, for
`gaitval.subjects.prediction`.

    python -m experiments.estimate_fits

Writes `gaitval/subjects/prediction/fits.json`: by person and trial, how the kinetics of the dynamic
fit differ from the expected ones that it began from, in units of `UNIT`. About a minute.
"""

from argparse import ArgumentParser, RawDescriptionHelpFormatter
from pathlib import Path

import numpy as np

import gaitval.subjects.prediction
from gaitval._internal.io.artefacts import write_text
from gaitval.configuration import ContactSettings, RecordSettings
from gaitval.metrics.reference_curves import reference_curves
from gaitval.scaling.scaling import scale_subject
from gaitval.subjects.prediction.deviations import UNIT, fit_of
from gaitval.subjects.prediction.known import known_record
from gaitval.subjects.subject import Subject
from gaitval.subjects.subject_file import builtin_subjects
from gaitval.walk.reference.dynamic_fit import consistent_reference

STORE = Path(gaitval.subjects.prediction.__file__).parent / "fits.json"


def whole_numbers(subject: Subject) -> list[list[list[int]]]:
    """What is stored of the trial that `subject` is on."""
    known = known_record(subject, RecordSettings(use="kinematics"), builtin_subjects())
    model = scale_subject(subject).model
    reference = consistent_reference(known.record, model, ContactSettings(), known.accuracy)
    curves = reference_curves(reference, model.mass, known.record.left_phase)
    fit = fit_of(curves, known.record, subject.leg_length_m)
    found: list[list[list[int]]] = np.rint(fit / UNIT).astype(int).tolist()
    return found


def main() -> None:
    """Command line; see the module's docstring."""
    ArgumentParser(description=__doc__, formatter_class=RawDescriptionHelpFormatter).parse_args()
    rows = []
    for subject in builtin_subjects():
        for trial in (subject.trial, *(each.name for each in subject.trials)):
            numbers = str(whole_numbers(subject.on_trial(trial))).replace(" ", "")
            rows.append(f'"{subject.identifier} {trial}": {numbers}')
            print(rows[-1][:60], flush=True)
    write_text(STORE, "{\n" + ",\n".join(rows) + "\n}\n")


if __name__ == "__main__":
    main()
