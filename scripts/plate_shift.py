"""Write the table in docs/decisions.md of how far apart the force plates of the records are.

    python scripts/plate_shift.py
    python scripts/plate_shift.py SUBJECT.toml     # of another subject: only printed

If the force under one foot is further forward by d, the sagittal moments of that leg's hip, knee
and ankle all change by d times the vertical force: hip extension, knee flexion and ankle
plantarflexion increase. So the difference between right and left, divided by the mean vertical
force of both, is given as a length, for each joint and for the three together (least squares), from
`STANCE`. It also contains real differences between the person's legs.
"""

import sys
from pathlib import Path

import numpy as np
from marked_table import with_table
from numpy.typing import NDArray

from gaitval.constants import STANDARD_GRAVITY
from gaitval.datasets.subject_file import BUILTIN, load_subject
from gaitval.gait.record import GaitRecord

PAGE = Path(__file__).parent.parent / "docs" / "decisions.md"
STANCE = np.arange(10, 51) / 100
"""Phases of each side's own cycle at which a foot carries the body."""
SIGNS = {"hip_flexion": -1.0, "knee_angle": 1.0, "ankle_angle": -1.0}
"""Signs of what a force further forward adds to each moment."""


def shifts(record: GaitRecord) -> NDArray[np.float64]:
    """(4,) cm, how much further forward the force is under the right foot, according to the moments
    of hip, knee, ankle, and all three.
    """
    force = STANDARD_GRAVITY * np.mean(
        [record.ground_reaction(side, STANCE)[:, 2] for side in ("right", "left")], axis=0
    )
    products = [
        sign * (record.moments[f"{name}_r"](STANCE) - record.moments[f"{name}_l"](STANCE)) @ force
        for name, sign in SIGNS.items()
    ]
    return 100 * np.array([*products, np.mean(products)]) / (force @ force)


def table() -> str:
    """The table of all built-in subjects."""
    found = np.array([shifts(load_subject(name).record()) for name in BUILTIN])
    rows = [
        *zip(BUILTIN, found, strict=True),
        ("mean", found.mean(axis=0)),
        ("standard deviation", found.std(axis=0, ddof=1)),
    ]
    lines = [
        "| right further forward than left, cm, by | hip | knee | ankle | all three |",
        "|---|---|---|---|---|",
    ]
    for name, values in rows:
        lines.append(f"| {name} | " + " | ".join(f"{value:.1f}" for value in values) + " |")
    return "\n".join(lines)


def main() -> None:
    """Write the table, or print the figures of one subject."""
    if len(sys.argv) > 1:
        print(*(f"{value:.1f}" for value in shifts(load_subject(sys.argv[1]).record())))
        return
    text = table()
    PAGE.write_text(with_table(PAGE.read_text(encoding="utf-8"), "plates", text), encoding="utf-8")
    print(text)


if __name__ == "__main__":
    main()
