"""Shipped: writes gaitval/metrics/healthy_cases.csv, the group that one person is held against.

    python -m experiments.healthy_cases ../shared/data          # the file
    python -m experiments.healthy_cases ../shared/data --check  # fails if the file is another

Reads `gps/strides.csv` of the data folder: a stride a side of 42 healthy adults (WBDS). Shipped is
what is computed of them: mean and standard deviation between people of one side, and the largest
modified t of each of them against the other 41 (`gaitval.metrics.single_case`).
"""

from pathlib import Path

import numpy as np

from experiments.gps_controls import strides
from experiments.shipped import parser_of, ship
from gaitval._internal.io.text_tables import csv_text
from gaitval.arrays import Array
from gaitval.gait.healthy_controls import PROFILE_ANGLES
from gaitval.metrics.single_case import FILE as NAME
from gaitval.metrics.single_case import group_of, modified_t

FILE = Path(__file__).resolve().parent.parent / "gaitval" / "metrics" / NAME

HEADER = """\
# Nine angles of {people} healthy adults, walking over ground at their own speed: mean of both sides
# and standard deviation between people of one side, of one stride a side, deg, at % of the gait
# cycle; and in the column score the largest modified t (Crawford and Howell 1998) of each of them
# against the others, the largest first. Names and signs of gaitval.gait.record.GaitRecord. Made by
# experiments/healthy_cases.py from: Fukuchi CA, Fukuchi RK, Duarte M (2018) A public dataset of
# overground and treadmill walking kinematics and kinetics in healthy individuals. PeerJ 6:e4640,
# https://doi.org/10.6084/m9.figshare.5722711. Licence of the data and of this file: CC BY 4.0,
# https://creativecommons.org/licenses/by/4.0/. Its authors do not endorse this project.
"""


def left_out_scores(curves: Array) -> Array:
    """(people,) largest |t| of each of the people of `curves` (people, sides, curves, points)
    against the others.
    """
    found = np.empty(len(curves))
    for i, person in enumerate(curves):
        others = np.delete(curves, i, axis=0)
        found[i] = np.abs(modified_t(person, *group_of(others), len(others))).max()
    return found


def curves_of(data: Path, group: str = "control") -> Array:
    """(people, 2 sides, 9 angles, 101) deg of a `group` of `gps/strides.csv`."""
    table = strides(data).xs(group)
    people = sorted({*table.index.get_level_values("subject")})
    return np.array(
        [
            [
                [
                    np.asarray(table.loc[(person, side, name)], dtype=float).reshape(-1, 101)[0]
                    for name in PROFILE_ANGLES
                ]
                for side in "rl"
            ]
            for person in people
        ]
    )


def cases_file(data: Path) -> str:
    """The contents of the shipped file."""
    curves = curves_of(data)
    mean, sd = group_of(curves)
    scores = np.sort(left_out_scores(curves))[::-1]
    header = [f"{name}/{which}" for name in PROFILE_ANGLES for which in ("mean", "sd")]
    rows: list[list[object]] = [["percent", *header, "score"]]
    for at in range(101):
        values = [f"{each[i, at]:.2f}" for i in range(len(mean)) for each in (mean, sd)]
        rows.append([at, *values, f"{scores[at]:.3f}" if at < len(scores) else ""])
    return HEADER.format(people=len(curves)) + csv_text(rows)


def main() -> None:
    """Command line; see the module's docstring."""
    ship({FILE: cases_file}, parser_of(__doc__).parse_args(), "healthy_cases")


if __name__ == "__main__":
    main()
