"""Healthy people's gait at a person's speed and age, with the standard deviation between them.

Of adults: straight lines on dimensionless speed and age, in `norms.csv`; experiments/norms.py makes
it and says of whom. Of children: curves at free speed (`healthy_bands`), and no
parameters. Beyond the speeds of those people the line is read at the nearest of them.
"""

from collections.abc import Mapping
from functools import cache
from typing import Final, NamedTuple

import numpy as np

from gaitval._internal.io.text_tables import shipped_table
from gaitval.arrays import Array
from gaitval.constants import GRAVITY
from gaitval.gait.dimensionless import speed_unit
from gaitval.gait.sampling import SAMPLES
from gaitval.metrics.curve_results import KINDS, Kind
from gaitval.metrics.unrecorded import STEP_WIDTH
from gaitval.subjects.plausible import ADULT
from gaitval.subjects.subject import Subject

MIDDLE: Final[Mapping[str, float]] = {"speed": 0.4, "age": 40.0}
"""At which the means of the file stand: dimensionless, and years. An adult whose age is not known
is taken to be as old."""


class Norm(NamedTuple):
    """Mean and standard deviation between `people`; (101,) of a curve, () of a parameter.

    Attributes
    ----------
    beyond : whether the person's speed is outside theirs.
    """

    mean: Array
    sd: Array
    people: int
    beyond: bool = False


@cache
def _table() -> dict[str, Array]:
    """Rows of the file (n, 8) by curve: mean, slopes, SD, people, slowest and fastest."""
    found: dict[str, list[list[str]]] = {}
    for _, (name, _, *values) in shipped_table("gaitval.metrics", "norms.csv").rows:
        found.setdefault(name, []).append(values)
    return {name: np.array(rows, dtype=float) for name, rows in found.items()}


def norms(subject: Subject) -> dict[str, Norm]:
    """`norms_at` of a `subject`."""
    return norms_at(subject.walking_speed_m_s, subject.leg_length_m, subject.age_years)


def norms_at(walking_speed: float, leg_length: float, age_years: float | None) -> dict[str, Norm]:
    """Norms by name at a `walking_speed` (m/s) of people of this `leg_length` (m) and `age_years`:
    curves "angles/knee_angle" (deg), "moments/…" (Nm/kg), "power/…" (W/kg), "forces/…" (% of body
    weight), and parameters "parameter/cadence" in the units of `SpatiotemporalResult`.
    """
    if age_years is not None and age_years < ADULT:
        return {
            f"{kind}/{name}": Norm(mean, sd, 0)
            for kind, curves in healthy_bands().items()
            for name, (mean, sd) in curves.items()
        }
    scale = speed_unit(leg_length)
    speed, leg = walking_speed / scale, leg_length
    older = 0.0 if age_years is None else age_years - MIDDLE["age"]
    units = {
        "parameter/cadence": 60.0 * GRAVITY / scale,
        "parameter/step_length": leg,
        "parameter/walking_speed": scale,
    }
    found = {}
    for name, rows in _table().items():
        mean, slope, square, age, sd, people, slowest, fastest = rows.T
        away = float(np.clip(speed, slowest[0], fastest[0])) - MIDDLE["speed"]
        unit = units.get(name, 100.0 if name.startswith("forces/") else 1.0)
        beyond = not slowest[0] <= speed <= fastest[0]
        value = unit * (mean + slope * away + square * away**2 + age * older)
        found[name] = Norm(np.squeeze(value), np.squeeze(unit * sd), int(people[0]), beyond)
    time = found["parameter/cadence"]
    # a stride is two steps; to first order in the spread
    stride = 120.0 / time.mean
    found["parameter/stride_time"] = time._replace(mean=stride, sd=stride * time.sd / time.mean)
    width, spread = (np.array(leg * each) for each in STEP_WIDTH)
    found["parameter/step_width"] = Norm(width, spread, 0)
    return found


HealthyBands = dict[Kind, dict[str, tuple[Array, Array]]]
"""Mean and standard deviation, (101,) each, by kind and curve."""


@cache
def healthy_bands() -> HealthyBands:
    """Angles and moments of typically developing children: `healthy_bands.csv`."""
    header, rows = shipped_table("gaitval.metrics", "healthy_bands.csv")
    table = np.array([cells for _, cells in rows], dtype=float)
    at, found = np.arange(SAMPLES), dict[Kind, dict[str, tuple[Array, Array]]]()
    for column in range(1, len(header), 2):
        # a pair of columns for each curve, mean and SD: the header is kind/name/which
        kind, name, _ = header[column].split("/")
        mean, spread = (np.interp(at, table[:, 0], table[:, column + i]) for i in (0, 1))
        found.setdefault(KINDS[KINDS.index(kind)], {})[name] = mean, spread
    return found
