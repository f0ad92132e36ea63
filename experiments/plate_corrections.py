"""Shipped: writes what is wrong with the force plates into gaitval/datasets/builtin.

    python -m experiments.plate_corrections

Fits the motion of every record with the shifts of the two plates as unknowns
(`gaitval.reference.plates`), pools them, because all ten people walked on the same plates, and
writes the section `[plates]` of `gaitval/datasets/builtin/*.toml`. It also writes the table of
docs/notebook/decisions.md.
"""

from concurrent.futures import ProcessPoolExecutor
from pathlib import Path

import numpy as np

from claims.marked_table import with_table
from gaitval.artefacts import write_text
from gaitval.datasets.subject_file import BUILTIN, load_subject
from gaitval.reference.plates import PlateEvidence, common_shift, plate_corrections, plate_evidence
from gaitval.scaling.scaling import scale_subject

ROOT = Path(__file__).resolve().parent.parent
FILES = ROOT / "gaitval" / "datasets" / "builtin"
PAGE = ROOT / "docs" / "notebook" / "decisions.md"


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


def main() -> None:
    """Write the files and the table."""
    with ProcessPoolExecutor(2) as pool:
        found = list(pool.map(evidence_of, BUILTIN))
    for name, correction in zip(BUILTIN, plate_corrections(found), strict=True):
        subject = load_subject(name).model_copy(update={"plates": correction})
        write_text(FILES / f"{name}.toml", subject.to_toml())
    text = table(found)
    print(text)
    page = PAGE.read_text(encoding="utf-8")
    write_text(PAGE, with_table(page, "plates", text))


if __name__ == "__main__":
    main()
