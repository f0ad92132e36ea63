"""Shipped: gaitval/identification/offsets.json, of what ten records say with shared errors.

    python -m experiments.ten_bodies

First without an offset, also of their further trials; from these the offsets that
`gaitval.identification.offsets` ships, of all and of all but one, and then again, each with the
offset of the others. Writes `reports/identification/ten_shared.json` after every record;
interrupted, the same command resumes. Nothing of a stored run is changed.
"""

import time
from argparse import ArgumentParser, RawDescriptionHelpFormatter
from pathlib import Path
from typing import Any

import numpy as np

from experiments.bodies import as_scaled, fit_of
from gaitval._internal.io.artefacts import read_json, versions, write_json
from gaitval.arrays import Array
from gaitval.identification.body_words import sentences
from gaitval.identification.offsets import MOVED, OFFSETS, estimated
from gaitval.identification.shared_errors import identified
from gaitval.scaling.scaling import scale_subject
from gaitval.subjects.subject import Subject
from gaitval.subjects.subject_file import builtin_subjects

ROOT = Path(__file__).resolve().parent.parent
STORE = ROOT / "reports" / "identification" / "ten_shared.json"
SHIPPED = ROOT / "gaitval" / "identification" / "offsets.json"


def one(subject: Subject, offset: Array | None = None) -> dict[str, Any]:
    """What is found of one record."""
    began = time.process_time()
    fit = fit_of(subject)
    found = identified(fit, as_scaled(fit, subject), offset)
    return {
        "name": subject.identifier,
        "person": f"{subject.laboratory} {subject.person}",
        "trial": subject.trial,
        "shift": found.shift.tolist(),
        "joint": found.joint.tolist(),
        "prior_mean": found.posterior.prior_mean.tolist(),
        "prior_sd": found.posterior.prior_sd.tolist(),
        "shared": found.values.tolist(),
        "shared_sd": found.sd.tolist(),
        "leg_difference": [found.legs.found, found.legs.found_sd, found.legs.prior_sd],
        "left": found.left,
        "said": sentences(found, scale_subject(subject).model),
        "processor_seconds": time.process_time() - began,
    }


def offset_from(people: list[dict[str, Any]]) -> Array:
    """The offset of these people together."""
    return estimated(*([np.array(each[key]) for each in people] for key in ("shift", "joint")))


def named(offset: Array) -> dict[str, float]:
    """An offset for a file."""
    return {name: round(float(offset[OFFSETS.index(name)]), 3) for name in MOVED}


def main() -> None:
    """Every record that is not stored yet."""
    ArgumentParser(description=__doc__, formatter_class=RawDescriptionHelpFormatter).parse_args()
    subjects = builtin_subjects()
    trials = [each.on_trial(trial.name) for each in subjects for trial in each.trials]
    stored: dict[str, Any] = {"alone": [], "trials": [], "people": []}
    if STORE.exists():
        stored |= read_json(STORE)

    def fill(kind: str, records: list[Subject], offsets: list[Array] | None = None) -> None:
        for index in range(len(stored[kind]), len(records)):
            found = one(records[index], None if offsets is None else offsets[index])
            stored[kind].append(found)
            write_json(STORE, stored | {"versions": versions()})
            print(kind, found["name"], found["trial"], found["said"], flush=True)

    fill("alone", subjects)
    fill("trials", trials)
    alone = stored["alone"]
    others = [[other for other in alone if other is not each] for each in alone]
    fill("people", subjects, [offset_from(each) for each in others])
    write_json(
        SHIPPED,
        {
            "of all": named(offset_from(alone)),
            "without": {
                each["person"]: named(offset_from(rest))
                for each, rest in zip(alone, others, strict=True)
            },
        },
    )  # fmt: skip


if __name__ == "__main__":
    main()
