"""One person against the 42 healthy adults, at every point of every angle, with one threshold.

At each point the modified t of Crawford and Howell 1998 (Clin Neuropsychol 12:482) is the person's
difference from the group's mean over its standard deviation times sqrt(1 + 1/n): it takes the group
for a sample, not for everybody. The largest |t| of nine angles, both sides and 101 points is then
compared with those that the 42 themselves have, each against the other 41: a person is out of the
ordinary where |t| is above the second largest of the 42, which one in 21 healthy adults reaches
anywhere (2 of 43 ranks), whatever the distribution of the curves. `experiments/healthy_cases.py`
measures the share of false alarms, with each of the 42 left out of threshold and group.

The group walked over ground at its own comfortable speed, and its angles are by Visual3D's model:
another speed and another laboratory's markers move curves too.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cache
from typing import Final

import numpy as np

from gaitval._internal.io.text_tables import shipped_table
from gaitval.arrays import Array
from gaitval.gait.healthy_controls import PROFILE_ANGLES
from gaitval.metrics.curve_results import Region
from gaitval.metrics.curve_statistics import regions_of

FILE: Final = "healthy_cases.csv"
RANK: Final = 2
"""The threshold is this largest of the controls' own scores: 2 of 43 is 4.7 %."""


@dataclass(frozen=True)
class Cases:
    """The healthy adults as a group.

    Attributes
    ----------
    mean, sd : (101,) deg by name of `PROFILE_ANGLES`; between people, of one side.
    scores : largest |t| of each of them against the others, the largest first.
    people : how many.
    """

    mean: Mapping[str, Array]
    sd: Mapping[str, Array]
    scores: tuple[float, ...]
    people: int

    @property
    def threshold(self) -> float:
        """|t| above which a point is out of the ordinary."""
        return self.scores[RANK - 1]


@dataclass(frozen=True)
class CaseResult:
    """A person against the group.

    Attributes
    ----------
    t : (101,) modified t by curve and side, "knee_angle_r"; positive above the group's mean.
    regions : where |t| is above `threshold`, by curve; those that are nowhere above have none.
    p : share of people, the person among them, whose largest |t| is at least the person's.
    threshold : of |t|, for all curves together.
    people : of the group.
    """

    t: Mapping[str, Array]
    regions: Mapping[str, tuple[Region, ...]]
    p: float
    threshold: float
    people: int


def modified_t(person: Array, mean: Array, sd: Array, people: int) -> Array:
    """t of Crawford and Howell, with `people` − 1 degrees of freedom, of a `person` against a group
    of so many `people` with this `mean` and sample standard deviation `sd`, point by point.
    """
    return np.asarray((person - mean) / (sd * np.sqrt((people + 1.0) / people)))


def group_of(curves: Array) -> tuple[Array, Array]:
    """Mean and standard deviation between people of one side of `curves` (people, sides, ...)."""
    mean = curves.mean(axis=(0, 1))
    return mean, np.sqrt(curves.var(axis=0, ddof=1).mean(axis=0))


def compare_with_group(angles: Mapping[str, Array]) -> CaseResult | None:
    """A person's mean `angles` (101,) deg, by name of `PROFILE_ANGLES` with `_r` or `_l`, against
    the 42 healthy adults. Curves that are missing are left out, and the
    threshold stays that of all: fewer false alarms. None if there is none.
    """
    group = load_cases()
    t = {
        f"{name}_{side}": modified_t(
            np.asarray(angles[f"{name}_{side}"], dtype=float),
            group.mean[name],
            group.sd[name],
            group.people,
        )
        for name in PROFILE_ANGLES
        for side in "rl"
        if f"{name}_{side}" in angles
        and bool(np.isfinite(np.asarray(angles[f"{name}_{side}"], dtype=float)).all())
    }
    if not t:
        return None

    def share(size: float) -> float:
        return (1 + sum(each >= size for each in group.scores)) / (1 + group.people)

    regions = {
        name: regions_of(values, above, share)
        for name, values in t.items()
        if (above := np.abs(values) > group.threshold).any()
    }
    largest = max(float(np.abs(values).max()) for values in t.values())
    return CaseResult(t, regions, share(largest), group.threshold, group.people)


@cache
def load_cases() -> Cases:
    """The 42 adults of `healthy_cases.csv`."""
    rows = shipped_table("gaitval.metrics", FILE).by_name()
    mean, sd = (
        {name: np.array([float(row[f"{name}/{which}"]) for row in rows]) for name in PROFILE_ANGLES}
        for which in ("mean", "sd")
    )
    scores = tuple(float(row["score"]) for row in rows if row["score"])
    return Cases(mean, sd, scores, len(scores))
