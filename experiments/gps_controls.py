"""Shipped: writes gaitval/gait/gps_controls.csv, the healthy people of the Gait Profile Score.

    python -m experiments.gps_controls ../shared/data          # the file
    python -m experiments.gps_controls ../shared/data --check  # fails if the file is another

Reads `gps/strides.csv` of the data folder: a stride a side of 42 healthy adults (WBDS), and of
three groups with a gait disorder. Shipped is what is computed of the 42: their mean curves, rounded
to 0.1 degree, and mean and standard deviation of their scores.
"""

from collections.abc import Mapping
from pathlib import Path

import numpy as np
import pandas as pd

from experiments.shipped import parser_of, ship
from gaitval._internal.io.text_tables import csv_text
from gaitval.apps.patients.strides import AXES
from gaitval.gait.healthy_controls import PROFILE_ANGLES, load_controls
from gaitval.gait.record import HARMONICS, periodic_through
from gaitval.metrics.curve_results import GaitProfile
from gaitval.metrics.gait_profile import gait_profile
from gaitval.subjects.subject_file import builtin_subjects

FILE = Path(__file__).resolve().parent.parent / "gaitval" / "gait" / "gps_controls.csv"

STATED = {
    "control": (4.9, 1.3),
    "parkinson_off": (7.3, 2.6),
    "parkinson_on": (7.0, 2.8),
    "transfemoral_amputee": (9.9, 1.9),
}
"""Mean and standard deviation of the score in each group, deg, as the data's README states them."""

HEADER = """\
# Sagittal, frontal and transverse angles of {people} healthy adults, walking over ground at their
# own speed: the mean of one stride a side, right and left together, in degrees, rounded to {step};
# and mean and standard deviation between them of their own scores of one side, of the side's score
# (side) and of both sides' (total). Names and signs of
# gaitval.gait.record.GaitRecord. Made by experiments/gps_controls.py from: Fukuchi CA, Fukuchi RK,
# Duarte M (2018) A public dataset of overground and treadmill walking kinematics and kinetics in
# healthy individuals. PeerJ 6:e4640, https://doi.org/10.6084/m9.figshare.5722711. Licence of the
# data and of this file: CC BY 4.0, https://creativecommons.org/licenses/by/4.0/. Its authors do not
# endorse this project.
"""
STEP = 0.1


def strides(data: Path) -> pd.DataFrame:
    """Index group, subject, side (r, l) and angle; columns 0 to 100."""
    table = pd.read_csv(data / "gps" / "strides.csv")
    table["angle"] = table["angle"].map(AXES)
    table["side"] = table["side"].str.lower()
    table = table.set_index(["group", "subject", "side", "angle"]).drop(columns="trial")
    table.columns = pd.RangeIndex(101)
    return table


def profiles(
    table: pd.DataFrame, controls: Mapping[str, np.ndarray]
) -> dict[str, list[GaitProfile]]:
    """The profile of every subject, by group."""
    found: dict[str, list[GaitProfile]] = {}
    for (group, _), rows in table.groupby(level=["group", "subject"]):
        angles = {
            f"{angle}_{side}": values.to_numpy() for (_, _, side, angle), values in rows.iterrows()
        }
        found.setdefault(str(group), []).append(gait_profile(angles, controls))
    return found


def controls_file(data: Path) -> str:
    """The contents of the shipped file."""
    table = strides(data)
    healthy = table.xs("control")
    rounded = (healthy.groupby(level="angle").mean() / STEP).round() * STEP
    curves = {name: rounded.loc[name].to_numpy() for name in PROFILE_ANGLES}
    own = profiles(table, curves)["control"]
    rows: list[list[object]] = [["percent", *PROFILE_ANGLES, "side", "total"]]
    for percent in range(101):
        values = (f"{curves[name][percent]:.1f}" for name in PROFILE_ANGLES)
        rows.append([percent, *values, 0, 0])
    # (people, sides, scores)
    scores = np.array(
        [
            [
                [
                    *(each.scores[f"{name}_{side[0]}"] for name in PROFILE_ANGLES),
                    of_side,
                    each.total,
                ]
                for side, of_side in (("right", each.right), ("left", each.left))
            ]
            for each in own
        ]
    )
    # between people, of one side
    spread = np.sqrt(scores.var(axis=0, ddof=1).mean(axis=0))
    rows.append(["score", *(f"{value:.2f}" for value in scores.mean(axis=(0, 1)))])
    rows.append(["sd", *(f"{value:.2f}" for value in spread)])
    rows.append(["people", *[len(own)] * (len(PROFILE_ANGLES) + 2)])
    return HEADER.format(people=len(own), step=STEP) + csv_text(rows)


def differences(data: Path) -> dict[str, tuple[float, float]]:
    """By group, how far mean and SD of the score are from what the data's README states, deg."""
    found = profiles(strides(data), load_controls().curves)
    result = {}
    for group, stated in STATED.items():
        totals = np.array([each.total for each in found[group]])
        result[group] = (
            abs(float(totals.mean()) - stated[0]),
            abs(float(totals.std(ddof=1)) - stated[1]),
        )
    return result


def swing_delays(data: Path) -> np.ndarray:
    """How much later, % of the cycle, the knee of the built-in people is bent furthest on the
    treadmill than over ground: means of both sides.
    """
    healthy, percent = strides(data).xs("control"), np.linspace(0.0, 1.0, 1001)
    later = []
    for subject in builtin_subjects():
        of_side = []
        for side in "rl":
            over_ground = healthy.loc[(subject.person, side, "knee_angle")].to_numpy().ravel()
            curves = (
                periodic_through(over_ground[:-1], HARMONICS.harmonics_cap)(percent),
                subject.record().angles[f"knee_angle_{side}"](percent),
            )
            ground, belt = (100.0 * percent[int(np.argmax(curve))] for curve in curves)
            of_side.append(belt - ground)
        later.append(np.mean(of_side))
    return np.array(later)


def main() -> None:
    """Command line; see the module's docstring."""
    parser = parser_of(__doc__)
    parser.add_argument("--swing", action="store_true", help="over ground and on a belt")
    arguments = parser.parse_args()
    if arguments.swing:
        later = swing_delays(arguments.data)
        print(f"later on the treadmill, median: {np.median(later):.1f} % of the cycle; "
              f"{np.sum(later > 0)} of {len(later)} people later")  # fmt: skip
        return
    ship({FILE: controls_file}, arguments, "gps_controls")


if __name__ == "__main__":
    main()
