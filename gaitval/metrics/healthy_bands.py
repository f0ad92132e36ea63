"""Healthy people's curves: mean and standard deviation between them, and who is beside whom."""

from functools import cache
from typing import Final

import numpy as np

from gaitval._internal.io.text_tables import shipped_table
from gaitval.arrays import Array
from gaitval.datasets.plausible import ADULT
from gaitval.gait.sampling import SAMPLES
from gaitval.metrics.record_results import KINDS, Kind
from gaitval.metrics.statistics_results import AgeGroup

BAND: Final = 2.0
"""Standard deviations between healthy people on both sides of their mean; 95 % of them."""

HealthyBands = dict[Kind, dict[str, tuple[Array, Array]]]
"""Mean and standard deviation, (101,) each, by kind and curve."""


@cache
def healthy_bands() -> HealthyBands:
    """Angles and moments of typically developing children: `healthy_bands.csv`."""
    return _read_bands("healthy_bands.csv")


@cache
def adult_bands() -> HealthyBands:
    """Angles of 42 adults: `adult_bands.csv`. No moments of as many adults may be shipped."""
    return _read_bands("adult_bands.csv")


def bands_beside(age_years: float | None) -> tuple[HealthyBands, dict[str, AgeGroup]]:
    """The bands for a person of `age_years` (unknown: an adult), and whose they are by kind of
    curve.
    """
    grown = age_years is None or age_years >= ADULT
    bands = {**healthy_bands(), **(adult_bands() if grown else {})}
    people: dict[str, AgeGroup] = {
        kind: "adults" if grown and kind in adult_bands() else "children" for kind in bands
    }
    return bands, people


def _read_bands(name: str) -> HealthyBands:
    header, rows = shipped_table("gaitval.metrics", name)
    table = np.array([cells for _, cells in rows], dtype=float)
    at, found = np.arange(SAMPLES), dict[Kind, dict[str, tuple[Array, Array]]]()
    for column in range(1, len(header), 2):
        # a pair of columns for each curve, mean and SD: the header is kind/name/which
        kind, name, _ = header[column].split("/")
        mean, spread = (np.interp(at, table[:, 0], table[:, column + i]) for i in (0, 1))
        found.setdefault(KINDS[KINDS.index(kind)], {})[name] = mean, spread
    return found
