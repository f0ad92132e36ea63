"""Shipped: writes gaitval/metrics/norms.csv, healthy adults' gait by speed and age.

    python -m experiments.norms ../shared/data          # the file
    python -m experiments.norms ../shared/data --check  # fails if the file is another

A straight line on dimensionless speed (Hof 1996) and age through healthy adults, by least squares,
at every percent of the cycle, and the standard deviation between people that it leaves:

* angles: `gps/strides.csv`, a stride a side of 41 people over ground at their own speed (WBDS);
* cadence and step length: `wbds/h2a_allspeeds_43subs.csv`, 43 people at six speeds of a
  treadmill, with the square of the speed; own speed over ground (41 people) on age alone;
* moments, power, ground reaction, stance and double support: both sides of the ten built-in
  people, on speed alone, with the forces of each scaled so that their mean carries the body.
"""

from collections.abc import Iterator, Sequence
from pathlib import Path

import numpy as np
import pandas as pd

from experiments.gps_controls import strides
from experiments.shipped import parser_of, ship
from gaitval._internal.io.text_tables import csv_text
from gaitval.constants import GRAVITY
from gaitval.coordinates import SIDES
from gaitval.gait.cycle_curves import recorded_curves
from gaitval.quantities.joint_power import JOINTS, joint_power
from gaitval.subjects.prediction.speed_line import dimensionless_speed
from gaitval.subjects.subject import Subject
from gaitval.subjects.subject_file import load_subject

FILE = Path(__file__).resolve().parent.parent / "gaitval" / "metrics" / "norms.csv"
SPEED, AGE = 0.4, 40.0
"""At which the means of the file stand: dimensionless, and years."""
BUILT_IN = tuple(f"S{number:02d}" for number in range(1, 11))
MOMENTS = ("hip_flexion", "hip_adduction", "knee_angle", "ankle_angle")

HEADER = """\
# Healthy adults' gait by speed and age: mean at a dimensionless speed of {speed} and {age:.0f}
# years, its change with one unit of dimensionless speed, with the square of that, and with one
# year; the standard deviation between people; how many people, and their slowest and fastest speed.
# Angles in deg, moments in Nm/kg, power in W/kg, forces in body weights, at % of the gait cycle;
# parameters by leg length and gravity without dimension, stance and double support as fractions of
# the cycle.
# Names and signs of gaitval.gait.record.GaitRecord. Made by experiments/norms.py from: Fukuchi CA,
# Fukuchi RK, Duarte M (2018) A public dataset of overground and treadmill walking kinematics and
# kinetics in healthy individuals. PeerJ 6:e4640, https://doi.org/10.6084/m9.figshare.5722711.
# Licence of the data and of this file: CC BY 4.0, https://creativecommons.org/licenses/by/4.0/. Its
# authors do not endorse this project. Cadence and step length: table of BMClab, MIT.
"""


def fitted(
    values: np.ndarray,
    speed: np.ndarray,
    age: np.ndarray | None = None,
    *,
    square: bool = False,
    person: np.ndarray | None = None,
) -> tuple[np.ndarray, ...]:
    """Mean, slope on speed, on its square and on age, and SD, of values (n,) or (n, 101). Rows of
    one `person` count together in the SD's degrees of freedom.
    """
    away = speed - SPEED
    columns = [np.ones(len(speed)), away]
    columns += [away**2] if square else []
    columns += [age - AGE] if age is not None else []
    design = np.column_stack(columns)
    found, *_ = np.linalg.lstsq(design, values, rcond=None)
    left = values - design @ found
    people = len(values) if person is None else len(np.unique(person))
    # as many degrees of freedom as people: trials of one person are alike
    sd = np.sqrt((left**2).mean(axis=0) * people / (people - design.shape[1]))
    zero = np.zeros(values.shape[1:])
    rest = list(found[2:])
    squared = rest.pop(0) if square else zero
    return found[0], found[1], squared, rest.pop(0) if age is not None else zero, sd


def rows(data: Path) -> Iterator[list[str]]:
    """Of the file, below its header."""
    table = pd.read_csv(data / "wbds" / "h2a_allspeeds_43subs.csv")
    # without person 37, whom this table lacks
    people = pd.read_csv(data / "wbds" / "WBDS_subjects_merged.csv").set_index("Subject")
    own = people.OG_comf / np.sqrt(GRAVITY * people.LegLen)
    healthy = strides(data).xs("control")
    for name, curves in healthy.groupby(level="angle", sort=True):
        number = curves.index.get_level_values("subject").str.removeprefix("WBDS").astype(int)
        each, number = curves[number.isin(people.index)], number[number.isin(people.index)]
        speed, age = own.loc[number].to_numpy(), people.Age.loc[number].to_numpy(dtype=float)
        found = fitted(each.to_numpy(), speed, age, person=number.to_numpy())
        yield from _lines(f"angles/{name}", found, speed, 2, number.nunique())
    yield from _of_built_in()
    yield from _parameters(table, people, own)


def _of_built_in() -> Iterator[list[str]]:
    subjects = [load_subject(name) for name in BUILT_IN]
    speed = np.repeat([dimensionless_speed(each) for each in subjects], len(SIDES))
    person = np.repeat(np.arange(len(subjects)), len(SIDES))
    found = [_kinetics(each) for each in subjects]
    for name in found[0]:
        # the band stands behind curves of one side: what sides differ by is in its SD
        values = np.concatenate([each[name] for each in found])
        kept = fitted(values, speed, person=person)
        yield from _lines(name, kept, speed, 4, len(subjects))


def _kinetics(subject: Subject) -> dict[str, np.ndarray]:
    """Of both sides (2, ...), with forces whose mean carries the body."""
    record = subject.record()
    curves = recorded_curves(record)
    vertical = sum(curves.forces[f"vertical_{side[0]}"][:-1].mean() for side in SIDES)
    for kind in (curves.moments, curves.forces):
        for name in kind:
            kind[name] = kind[name] / vertical
    power = joint_power(curves, dict.fromkeys("rl", record.stride_time))
    every = {
        **{f"moments/{name}": (curves.moments, name) for name in MOMENTS},
        **{f"forces/{name}": (curves.forces, name) for name in ("forward", "medial", "vertical")},
        **{f"power/{name}": (power.curves, name) for name in JOINTS},
    }
    found = {
        key: np.array([kind[f"{name}_{side[0]}"] for side in SIDES], dtype=float)
        for key, (kind, name) in every.items()
    }
    stance = np.array([record.stance_fraction[side] for side in SIDES])
    found["parameter/stance_fraction"] = stance
    found["parameter/double_support_fraction"] = np.repeat(stance.sum() - 1.0, len(SIDES))
    return found


def _parameters(table: pd.DataFrame, people: pd.DataFrame, own: pd.Series) -> Iterator[list[str]]:
    scale = np.sqrt(GRAVITY * table.LegLength)
    speed, age = (table.Speed / scale).to_numpy(), table.Age.to_numpy(dtype=float)
    person = table.Subject.to_numpy()
    steps_per_second = table.Cadence / 60.0
    values = {
        "cadence": steps_per_second * np.sqrt(table.LegLength / GRAVITY),
        "step_length": table.StepLength / table.LegLength,
    }
    for name, each in values.items():
        found = fitted(each.to_numpy(), speed, age, square=True, person=person)
        yield from _lines(f"parameter/{name}", found, speed, 4, len(np.unique(person)))
    own = own.dropna()
    ages = people.Age.loc[own.index].to_numpy(dtype=float)
    mean, slope = np.polyfit(ages - AGE, own.to_numpy(), 1)[::-1]
    left = own.to_numpy() - mean - slope * (ages - AGE)
    sd = np.sqrt((left**2).sum() / (len(left) - 2))
    found = tuple(np.array(each) for each in (mean, 0.0, 0.0, slope, sd))
    yield from _lines("parameter/walking_speed", found, own.to_numpy(), 4)


def _lines(
    name: str, found: Sequence[np.ndarray], speed: np.ndarray, digits: int, people: int = 0
) -> Iterator[list[str]]:
    ends = [str(people or len(speed)), f"{speed.min():.3f}", f"{speed.max():.3f}"]
    for at, values in enumerate(np.column_stack([np.atleast_1d(each) for each in found])):
        # a year changes little
        texts = [f"{value:.{digits + 2 * (i == 3)}f}" for i, value in enumerate(values)]
        yield [name, str(at), *texts, *ends]


def norms_file(data: Path) -> str:
    """The contents of the shipped file."""
    names = "curve", "percent", "mean", "speed", "speed2", "age", "sd", "people"
    return HEADER.format(speed=SPEED, age=AGE) + csv_text(
        [(*names, "slowest", "fastest"), *rows(data)]
    )


def main() -> None:
    """Command line; see the module's docstring."""
    ship({FILE: norms_file}, parser_of(__doc__).parse_args(), "norms")


if __name__ == "__main__":
    main()
