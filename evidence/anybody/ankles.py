"""The ankle moments to expect of amputees before any walk, against measured ones.

Moments and people are those of `evidence/anybody/patients.py`, whose rows are of the walks.
"""

from argparse import Namespace

import numpy as np

import evidence
from evidence import DATA
from evidence.anybody.patients import HEALTHY, SPEEDS, ankle_errors, tables
from gaitval.coordinates import SIDES

MEASURES = {
    "*": {
        "code": (
            "evidence/anybody/patients.py:ankle_errors,true_moments,tables,SPEEDS",
            "gaitval/apps/patients/estimates.py",
            "gaitval/apps/patients/one_stride.py",
            "gaitval/apps/patients/passive_foot.py",
            "gaitval/apps/patients/prosthesis.py",
            "gaitval/apps/patients/records.py",
            "gaitval/apps/patients/rolling_foot.py",
            "gaitval/apps/patients/sound_side.py",
            "gaitval/apps/patients/told.py",
        ),
        "data": ("gaitval/apps/patients/sound_sides.csv",),
    },
}
"""What the rows depend on; see evidence/stale.py."""


@evidence.measurement(DATA)
def ankles(arguments: Namespace) -> list[evidence.Row]:
    """Amputees' ankle moments to expect before they are walked, a prosthetic foot's as springs'."""
    from gaitval.apps.patients.cohort import found_patients
    from gaitval.apps.patients.passive_foot import expected_ankles
    from gaitval.apps.patients.told import expected_record
    from gaitval.datasets.subject_file import builtin_subjects

    strides, people = tables(arguments.data)
    others, phase = builtin_subjects(), np.linspace(0.0, 1.0, 101)
    found = []
    for each in found_patients(strides, people, SPEEDS, [HEALTHY]):
        if each.person.amputation is None:
            continue
        usual = expected_record(each.subject, others).moments
        names = {side: f"ankle_angle_{side[0]}" for side in SIDES}
        moments = expected_ankles(each, others)
        found.append(
            {
                "name": each.subject.identifier,
                "prosthesis": each.person.amputation,
                "moments": {names[side]: moments[side](phase) for side in SIDES},
                "expected": {name: usual[name](phase) for name in names.values()},
            }
        )
    rows = []
    for kind, errors in ankle_errors(found, arguments.data).items():
        print(kind, errors.round(3).tolist())
        own, usual_error = errors.mean(axis=0)
        what = f"amputees' ankle moment before the walk, {kind} side"
        rows += [
            evidence.Row(f"{what}, RMS", float(own), "Nm/kg", "<=", 0.12, 0.18, len(errors)),
            evidence.Row(f"{what}, skill against healthy people's", float(1.0 - own / usual_error),
                         "1", ">=", 0.4, 0.2, len(errors)),
        ]  # fmt: skip
    return rows
