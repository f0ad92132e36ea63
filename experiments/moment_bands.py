"""Shipped: writes gaitval/apps/judge/schwartz2008.csv, from normative/Schwartz2008.json.

    python -m experiments.moment_bands ../shared/data/normative/Schwartz2008.json [--check]

Net joint moments of 83 typically developing children at five walking speeds, mean ± SD (Schwartz,
Rozumalski and Trost 2008, J Biomech 41:1639), in the project's signs and units. The figures are
shared under CC BY-SA 4.0, and so is the file that this writes.
"""

import argparse
import json
import sys
from pathlib import Path
from typing import Any

from gaitval._internal.io.text_tables import csv_text

OUT = Path(__file__).resolve().parent.parent / "gaitval/apps/judge/schwartz2008.csv"

SPEEDS = {
    "very slow": "VerySlow",
    "slow": "Slow",
    "free": "Free",
    "fast": "Fast",
    "very fast": "VeryFast",
}
CURVES = {
    "hip_flexion": ("HipMoment", "X"),
    "hip_adduction": ("HipMoment", "Y"),
    "knee_angle": ("KneeMoment", "X"),
    "ankle_angle": ("AnkleMoment", "X"),
}
"""Theirs are positive for extensors, plantarflexors and abductors, ours where a moment increases
flexion, dorsiflexion and adduction: the opposite."""
MILLI = 1e-3
"""Theirs are Nmm/kg: the ankle's reach 1465."""
HEADER = """\
# Joint moments, mean - SD and mean + SD of typically developing children at five speeds, Nm/kg,
# at 0, 2, ... 100 % of the gait cycle; positive where they increase the coordinate.
# Source: Schwartz MH, Rozumalski A, Trost JP. J Biomech 2008;41:1639-1650, electronic supplement.
# Licence of this file: CC BY-SA 4.0 (https://creativecommons.org/licenses/by-sa/4.0/); changed:
# units and signs. Written by experiments/moment_bands.py.
"""


def table(data: dict[str, Any]) -> str:
    """The file's text."""
    lines: list[list[object]] = [["speed", "curve", "bound", *range(0, 101, 2)]]
    for speed, group in SPEEDS.items():
        for curve, (moment, axis) in CURVES.items():
            rows = data["Schwartz2008"][group][moment][axis]
            if [row[0] for row in rows] != list(range(0, 101, 2)):
                raise SystemExit(f"{group} {moment} {axis}: not at 0, 2, ... 100 %")
            for bound, column in (("low", 2), ("high", 1)):
                values = [f"{-MILLI * row[column] + 0.0:.4f}" for row in rows]
                lines.append([speed, curve, bound, *values])
    return HEADER + csv_text(lines)


def main() -> None:
    """The command."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("json", type=Path)
    parser.add_argument("--check", action="store_true", help="write nothing, fail if out of date")
    arguments = parser.parse_args()
    text = table(json.loads(arguments.json.read_text()))
    if not arguments.check:
        OUT.write_text(text, encoding="utf-8", newline="\n")
    elif not OUT.is_file() or OUT.read_text(encoding="utf-8") != text:
        sys.exit(f"{OUT} is out of date: run python -m experiments.moment_bands {arguments.json}")


if __name__ == "__main__":
    main()
