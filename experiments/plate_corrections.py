"""Shipped: writes what is wrong with the force plates into gaitval/datasets/builtin.

    python -m experiments.plate_corrections

Fits the motion of every record with the shifts of the two plates as unknowns
(`gaitval.reference.plates`), pools them, because all ten people walked on the same plates, and
writes the section `[plates]` of `gaitval/datasets/builtin/*.toml`. It also prints the shifts, and
with `--effects`, which fits nothing, writes the table of docs/paper.md: what the stored corrections
change.
"""

import argparse
from collections.abc import Callable
from concurrent.futures import ProcessPoolExecutor
from pathlib import Path

import numpy as np

from claims.marked_table import with_table
from gaitval.arrays import Array
from gaitval.artefacts import write_text
from gaitval.datasets.subject_file import BUILTIN, load_subject
from gaitval.gait.cycle_curves import recorded_curves
from gaitval.gait.record import GaitRecord
from gaitval.quantities.joint_power import joint_power
from gaitval.reference.plates import PlateEvidence, common_shift, plate_corrections, plate_evidence
from gaitval.scaling.scaling import scale_subject

ROOT = Path(__file__).resolve().parent.parent
FILES = ROOT / "gaitval" / "datasets" / "builtin"
EFFECTS = ROOT / "docs" / "paper.md"


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
