"""What the dynamic fit keeps of an estimate of kinetics, by the accuracies asked of it.

    python -m experiments.estimated_fits                # eight minutes, prints a table
    python -m experiments.estimated_fits --from PATH    # half an hour, of people elsewhere

For the ten people, of whom angles only are known: skill of the fit's kinetics against the line
through the nine others, and the 5 % point of that against what is expected of anybody; how far the
angles of hip, knee and ankle are off. Below, the set with the largest mean skill of each half of
the people whose angles are no more than `PRICE` further off, and what it is worth on the other
half. With the clones of the public recordings (`evidence/README.md`) the same for people of other
laboratories, of whom nothing of their plates is known, once with and once without what markers say
of the forces; there the skill is against what is expected of anybody.
"""

import argparse
from collections.abc import Sequence
from pathlib import Path
from typing import Final, NamedTuple, cast

import numpy as np

from evidence.fit import SKILLS, _without_markers_say, _without_plates, lower_end
from gaitval.arrays import Array
from gaitval.configuration import ContactSettings, RecordSettings
from gaitval.datasets.subject import Subject
from gaitval.datasets.subject_file import builtin_subjects
from gaitval.gait.cycle_curves import Curves, recorded_curves
from gaitval.metrics.baselines import others_line
from gaitval.metrics.comparison import rms
from gaitval.metrics.groups import GROUPS
from gaitval.metrics.record_results import Kind
from gaitval.metrics.recorded import by_kind
from gaitval.metrics.reference_curves import reference_curves
from gaitval.prediction.known import told
from gaitval.prediction.seen import at_own_contacts
from gaitval.reference.dynamic_fit import consistent_reference
from gaitval.scaling.scaling import scale_subject
from gaitval.study.estimate_stage import ESTIMATE_ACCURACY, of_known, with_kinetics

PRICE: Final = 0.05
"""Degrees."""
_WALKED: Final = ESTIMATE_ACCURACY._replace(
    frontal=np.deg2rad(3.0),
    pelvis=np.deg2rad(3.5),
    moment=0.015,
    adduction_moment=0.04,
    forward_force=0.0022,
    sideways_force=0.0016,
    vertical_force=0.0075,
    hip_centre=0.008,
)
"""The best of some twenty on these ten; docs/held-out.md has what its walks gave."""
SETS: Final = {
    "**in use**": ESTIMATE_ACCURACY,
    "hip centres 10 mm": ESTIMATE_ACCURACY._replace(hip_centre=0.01),
    "no hip centres": ESTIMATE_ACCURACY._replace(hip_centre=0.0),
    "pelvis 3.5°": ESTIMATE_ACCURACY._replace(pelvis=np.deg2rad(3.5)),
    "sagittal 2.4°": ESTIMATE_ACCURACY._replace(sagittal=np.deg2rad(2.4)),
    "moments 0.012": ESTIMATE_ACCURACY._replace(moment=0.012),
    "kinetics tight, pelvis and hip rotation loose": _WALKED,
    "the same, hip centres 10 mm": _WALKED._replace(hip_centre=0.01),
    "the same, moments 0.012": _WALKED._replace(moment=0.012),
}
"""Moments in Nm/kg."""


class Errors(NamedTuple):
    """Of one person: mean error of both sides of each of `SKILLS`, and of sagittal angles, deg."""

    kinetics: Array
    angles: float


def errors_of(subject: Subject) -> dict[str, Errors]:
    """Of one of the ten, by what is compared with the record: "line", "expected", and the fit of
    each of `SETS`.
    """
    line = others_line(subject, builtin_subjects())
    assert line is not None
    curves = {"line": line.curves} | _fits(subject, RecordSettings(use="kinematics"))
    truth = recorded_curves(subject.record())
    return {name: _errors(each, truth) for name, each in curves.items()}


def errors_elsewhere(known: Subject, kinetics: Array) -> dict[str, Errors]:
    """Of somebody imported without plates, whose `kinetics` (2, 7, n) they measured: "line" and
    "expected" are what is expected of anybody. The angles' errors are from those that are known.
    """
    curves = _fits(known, RecordSettings())
    record = told(known, RecordSettings(), builtin_subjects()).record
    measured = recorded_curves(with_kinetics(record, known, kinetics))
    found = {name: _errors(each, measured) for name, each in curves.items()}
    return {"line": found["expected"]} | found


def _fits(subject: Subject, settings: RecordSettings) -> dict[str, Curves]:
    """What is expected of a `subject`, and the fit of each of `SETS` to the estimate."""
    model, contact = scale_subject(subject).model, ContactSettings()
    usual = told(subject, settings, builtin_subjects())
    known = at_own_contacts(usual.record, subject)
    asked = with_kinetics(known, subject, of_known(usual, subject, model, contact).kinetics)
    curves = {"expected": recorded_curves(usual.record)}
    for name, accuracy in SETS.items():
        reference = consistent_reference(asked, model, contact, accuracy)
        curves[name] = reference_curves(reference, model.mass, known.left_phase)
    return curves


def _errors(curves: Curves, truth: Curves) -> Errors:
    ours, theirs = by_kind(curves), by_kind(truth)

    def error(kind: Kind, name: str) -> float:
        both = (f"{name}_r", f"{name}_l")
        return float(np.mean([rms(ours[kind][each] - theirs[kind][each]) for each in both]))

    angles, names = GROUPS["sagittal angles"]
    return Errors(
        np.array([error(cast("Kind", kind), name) for kind, name in SKILLS]),
        float(np.mean([error(angles, each) for each in names])),
    )


def skills(people: Sequence[dict[str, Errors]], name: str) -> Array:
    """Of the fits of the set `name` against the line through others, for each of `SKILLS`."""
    ours, line = (np.mean([each[w].kinetics for each in people], axis=0) for w in (name, "line"))
    return np.asarray(1.0 - ours / line)


def angles(people: Sequence[dict[str, Errors]], name: str) -> float:
    """Mean error of the sagittal angles of the fits of the set `name`, degrees."""
    return float(np.mean([each[name].angles for each in people]))


def table(people: Sequence[dict[str, Errors]]) -> None:
    """Print a row for each of `SETS`."""
    print(
        "| accuracies | skill and 5 % point of " + ", ".join(n for _, n in SKILLS) + " | mean | ° |"
    )
    print("|---|---|---|---|")
    for name in SETS:
        pairs = []
        for i, skill in enumerate(skills(people, name)):
            ours, usual = (np.array([e[w].kinetics[i] for e in people]) for w in (name, "expected"))
            pairs.append(f"{skill:.3f} {lower_end(ours, usual):.3f}")
        mean = skills(people, name).mean()
        print(f"| {name} | {'; '.join(pairs)} | {mean:.4f} | {angles(people, name):.2f} |")


def main() -> None:
    """Print the tables."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--from", type=Path, dest="clones", help="folder of the clones, OWNER+NAME")
    clones = parser.parse_args().clones
    if clones is not None:
        found = list(_without_plates(clones))
        for which, changed in (("markers say", None), ("nothing said", _without_markers_say)):
            print(f"{len(found)} people, {which}")
            table([errors_elsewhere(changed(k) if changed else k, t) for _, k, t in found])
        return
    people = [errors_of(subject) for subject in builtin_subjects()]
    table(people)
    halves = {"first five": people[:5], "last five": people[5:]}
    halves |= {"odd numbers": people[::2], "even numbers": people[1::2]}
    pairs_of = [("first five", "last five"), ("odd numbers", "even numbers")]
    for one, other in [*pairs_of, *(pair[::-1] for pair in pairs_of)]:
        most = angles(halves[one], "**in use**") + PRICE
        allowed = [name for name in SETS if angles(halves[one], name) <= most]
        best = max(allowed, key=lambda name: float(skills(halves[one], name).mean()))
        was, now = (skills(halves[other], name).mean() for name in ("**in use**", best))
        gain = f"{was:.4f} in use, {now:.4f} with it"
        print(f"chosen by the {one}: {best}; the {other}: {gain}")


if __name__ == "__main__":
    main()
