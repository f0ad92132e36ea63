"""Shipped: writes what is wrong with the force plates into gaitval/subjects/builtin.

    python -m experiments.plate_corrections

Fits the motion of every record with the shifts of the two plates as unknowns, pools them, because
all ten people walked on the same plates, and writes the section `[plates]` of
`gaitval/subjects/builtin/*.toml`. It also prints the shifts, and with `--effects`, which fits
nothing, writes the table of docs/paper.md: what the stored corrections change.

The scale follows from each record's mean vertical force. Where each plate's centre of pressure must
lie follows from the motion: the sole is on the ground where the foot is, and the force through it
must carry the whole body and turn it as it turns. So the fit of `dynamic_fit`, whose forces act
where the contact spheres are, is solved with the two shifts as further unknowns. Where its moments
differ from the recorded ones by the vertical force times a length, that length is the shift, and
the normal equations say how certain it is. Plates stay where they are, so several records of one
laboratory are evidence for the same two shifts.
"""

import argparse
from collections.abc import Callable, Sequence
from concurrent.futures import ProcessPoolExecutor
from pathlib import Path
from typing import NamedTuple

import numpy as np

from claims.marked_table import with_table
from gaitval._internal.io.artefacts import write_text
from gaitval.arrays import Array
from gaitval.configuration import ContactSettings
from gaitval.coordinates import SIDES
from gaitval.gait.cycle_curves import recorded_curves
from gaitval.gait.plate_correction import PlateCorrection, corrected
from gaitval.gait.record import GaitRecord
from gaitval.model.body import BodyModel
from gaitval.quantities.joint_power import joint_power
from gaitval.scaling.scaling import scale_subject
from gaitval.subjects.subject_file import BUILTIN, load_subject
from gaitval.walk.reference.dynamic_fit import INFERENCE, solve
from gaitval.walk.reference.motion import build_reference

ROOT = Path(__file__).resolve().parent.parent
FILES = ROOT / "gaitval" / "subjects" / "builtin"
EFFECTS = ROOT / "docs" / "paper.md"


SHIFT_SD = 0.03
"""m, of a shift before a record is seen; convention. A plate that is further away than two of these
misses the foot, which an import sees (`gait.feet_on_plates`)."""

SCALE_SD = 0.005
"""Of the mean vertical force: body mass changes by this within a day and with clothing;
convention."""

CLEAR = 2.0
"""Standard deviations from which a fault is corrected."""


class PlateEvidence(NamedTuple):
    """What one record says about its plates.

    Attributes
    ----------
    mean_force : mean vertical force of both feet, body weights; 1 in every periodic motion.
    shift : (2,) m, by which the centre of pressure of the right and the left plate is too far
        forward.
    covariance : (2, 2) m², of `shift`, which was 0 +- `SHIFT_SD` beforehand.
    """

    mean_force: float
    shift: Array
    covariance: Array


def plate_evidence(record: GaitRecord, model: BodyModel) -> PlateEvidence:
    """What a `record` as measured, not corrected, with moments and forces of both sides, says about
    its plates; `model` is the scaled body. The contact law is the default configuration's.
    """
    contact = ContactSettings()
    phase = np.arange(1000) / 1000
    # Over a whole cycle the mean vertical force of both feet is one body weight, or the body would
    # rise or fall.
    mean = sum(float(record.ground_reaction(side, phase)[:, 2].mean()) for side in SIDES)
    # The scale first: a wrong scale also changes the moments, and would look like a shift.
    record = corrected(record, PlateCorrection(scale=1.0 / mean))
    reference = build_reference(record, model, contact)
    solution = solve(reference, record, model, contact, INFERENCE, shift_sd=SHIFT_SD)
    return PlateEvidence(mean, solution.common[:2], solution.covariance[:2, :2])


def common_shift(evidence: Sequence[PlateEvidence]) -> tuple[Array, Array]:
    """The shift (2,) m of the right and left plate, forward, that all records of a laboratory
    share, and its covariance (2, 2) m²; from the `evidence` of each record, with the prior 0 ±
    `SHIFT_SD` in it.
    """
    before = np.eye(2) / SHIFT_SD**2
    precision, information = before.copy(), np.zeros(2)
    for each in evidence:
        own = np.linalg.inv(each.covariance)
        precision += own - before  # what was known beforehand counts once
        information += own @ each.shift
    covariance = np.linalg.inv(precision)
    return np.asarray(covariance @ information), np.asarray(covariance, dtype=float)


def plate_corrections(evidence: Sequence[PlateEvidence]) -> list[PlateCorrection | None]:
    """How to correct each record of one laboratory, in the order of the `evidence` of each; None
    where no fault is clear.

    A scale is a record's own. The two shifts, which all records share, are corrected together, if
    one of them or their difference is `CLEAR` standard deviations from zero.
    """
    shift, covariance = common_shift(evidence)
    sd = np.sqrt(np.diag(covariance))
    apart = np.sqrt(np.array([1.0, -1.0]) @ covariance @ np.array([1.0, -1.0]))
    shifted = max(*(np.abs(shift) / sd), abs(shift[0] - shift[1]) / apart) > CLEAR
    found: list[PlateCorrection | None] = []
    for each in evidence:
        scaled = abs(each.mean_force - 1.0) > CLEAR * SCALE_SD
        correction = PlateCorrection(
            scale=1.0 / each.mean_force if scaled else 1.0,
            scale_sd=SCALE_SD if scaled else 0.0,
            shift_right=float(shift[0]) if shifted else 0.0,
            shift_right_sd=float(sd[0]) if shifted else 0.0,
            shift_left=float(shift[1]) if shifted else 0.0,
            shift_left_sd=float(sd[1]) if shifted else 0.0,
        )
        found.append(correction if scaled or shifted else None)
    return found


def evidence_of(name: str) -> PlateEvidence:
    """What the record of a built-in subject says about its plates."""
    subject = load_subject(name)
    return plate_evidence(subject.measured(), scale_subject(subject).model)


def table(found: list[PlateEvidence]) -> str:
    """The shifts by record and all together."""
    lines = [
        "| record | mean vertical force, BW | right too far forward, cm | left | difference |",
        "|---|---|---|---|---|",
    ]
    shift, covariance = common_shift(found)
    rows = [
        *((name, f"{each.mean_force:.3f}", each.shift, each.covariance)
          for name, each in zip(BUILTIN, found, strict=True)),
        ("all together", "", shift, covariance),
    ]  # fmt: skip
    for name, force, each, spread in rows:
        numbers = [each[0], each[1], each[0] - each[1]]
        across = spread[0, 0] + spread[1, 1] - 2.0 * spread[0, 1]
        sd = np.sqrt([spread[0, 0], spread[1, 1], across])
        cells = (f"{100 * n:.1f} ± {100 * s:.1f}" for n, s in zip(numbers, sd, strict=True))
        lines.append(f"| {name} | {force} | " + " | ".join(cells) + " |")
    return "\n".join(lines)


def _of_legs(record: GaitRecord, name: str) -> tuple[Array, Array]:
    """A moment of both legs, each over its own cycle, Nm/kg."""
    phase = np.arange(100) / 100
    right, left = (record.moments[f"{name}_{side}"](phase) for side in "rl")
    return right, left


def _apart(record: GaitRecord, name: str) -> float:
    """RMS difference of a moment between the legs, Nm/kg."""
    right, left = _of_legs(record, name)
    return float(np.sqrt(np.mean((right - left) ** 2)))


def _push_off_apart(record: GaitRecord) -> float:
    """Difference of the ankles' positive work, % of its mean."""
    found = joint_power(recorded_curves(record), dict.fromkeys("rl", record.stride_time))
    assert found is not None
    right, left = (float(found.figures["generated"][f"ankle_angle_{s}"] or 0.0) for s in "rl")
    return 200.0 * abs(right - left) / (right + left)


def effects() -> str:
    """What is corrected in the stored records by how much, and what it changes: means of the ten
    (least to most).
    """
    subjects = [load_subject(name) for name in BUILTIN]
    before = [each.measured() for each in subjects]
    after = [each.record() for each in subjects]
    plates = [each.plates for each in subjects if each.plates is not None]

    def spread(values: list[float], digits: int) -> str:
        low, high = f"{min(values):.{digits}f}", f"{max(values):.{digits}f}"
        mean = f"{np.mean(values):.{digits}f}"
        return mean if low == high else f"{mean} ({low} to {high})"

    def both(of: Callable[[GaitRecord], float], digits: int) -> str:
        one, other = (spread([of(each) for each in group], digits) for group in (before, after))
        return f"{one} | {other}"

    shift = [100.0 * (each.shift_right - each.shift_left) for each in plates]
    rows = [
        "| | as measured | corrected |",
        "|---|---|---|",
        f"| forces are multiplied by | 1 | {spread([each.scale for each in plates], 3)} |",
        f"| right plate back and left forward, together, cm | 0 | {spread(shift, 1)} |",
    ]
    for name, label in (("hip_flexion", "hip"), ("knee_angle", "knee"), ("ankle_angle", "ankle")):
        apart = both(lambda record, name=name: _apart(record, name), 2)
        rows.append(f"| {label} moment, right from left, RMS, Nm/kg | {apart} |")
    pushing = both(_push_off_apart, 0)
    rows.append(f"| positive ankle work, right from left, % | {pushing} |")
    return "\n".join(rows)


def main() -> None:
    """Write the files, or the table of effects."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--effects", action="store_true", help="only the table of effects")
    if parser.parse_args().effects:
        page = EFFECTS.read_text(encoding="utf-8")
        write_text(EFFECTS, with_table(page, "plates", effects()))
        return
    with ProcessPoolExecutor(2) as pool:
        found = list(pool.map(evidence_of, BUILTIN))
    for name, correction in zip(BUILTIN, plate_corrections(found), strict=True):
        subject = load_subject(name).model_copy(update={"plates": correction})
        write_text(FILES / f"{name}.toml", subject.to_toml())
    print(table(found))


if __name__ == "__main__":
    main()
