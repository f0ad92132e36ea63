"""Where a series of figures took a step: a test against the scatter on both sides of it.

A step is looked for in the whole series and in its halves, quarters and so on, each overlapping the
next by half (seeded intervals, Kovács et al. 2023, Biometrika 110: 249-256), so that a loss that
was repaired later is found too. In each interval, at every place that leaves `SIDE` values on both
sides, the means before and after are compared by Student's t with the pooled scatter. The place
with the least chance is the candidate. The chance of it where there is no step is at most that of
its t, times the number of places that were tried (Bonferroni's inequality), times the number of
series that are looked at together. A step is reported if that is below `CHANCE`; the parts before
and after are then searched in the same way (binary segmentation, Scott & Knott 1974, Biometrics 30:
507-512).

The chance holds for values that scatter independently and normally about their mean.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from itertools import pairwise
from typing import Final

import numpy as np
from scipy.special import stdtr

from gaitval.arrays import Array

CHANCE: Final = 0.05
"""Of a false alarm in all series that are looked at together."""
SIDE: Final = 2
"""Fewest values on each side: one alone cannot be distinguished from an outlier."""
LEAST: Final = 6
"""Fewest values that are searched: with fewer the scatter has less than four degrees of freedom."""

_LAST_DIGIT: Final = 1e-5
"""Relative, the least scatter that is believed: stored figures have six digits, and equal ones may
differ in the last."""


@dataclass(frozen=True)
class Step:
    """A step in a series.

    Attributes
    ----------
    index : of the first value after it.
    before, after : means of the values between the steps next to it.
    chance : at most the chance of such a step where there is none, over all series.
    """

    index: int
    before: float
    after: float
    chance: float


def steps(values: Sequence[float], series: int = 1) -> list[Step]:
    """The steps of a series of finite `values` in the order of time; none if it has fewer than
    `LEAST`. `series` is how many series are looked at together.
    """
    data = np.asarray(values, dtype=float)
    found = _search(data, 0, series)
    edges = [0, *(index for index, _ in found), len(data)]
    means = [float(data[a:b].mean()) for a, b in pairwise(edges) if b > a]
    return [Step(index, means[i], means[i + 1], chance) for i, (index, chance) in enumerate(found)]


def _search(data: Array, offset: int, series: int) -> list[tuple[int, float]]:
    """Index and chance of the steps in a part of a series that starts at `offset`, in order."""
    intervals = list(_intervals(len(data)))
    if not intervals:
        return []
    chance, index = min(
        (chance, begin + place)
        for begin, end in intervals
        for place, chance in [_likeliest(data[begin:end])]
    )
    # Bonferroni: every place that was tried, in every interval and series.
    chance *= series * sum(end - begin - 2 * SIDE + 1 for begin, end in intervals)
    if chance >= CHANCE:
        return []
    return [
        *_search(data[:index], offset, series),
        (offset + index, chance),
        *_search(data[index:], offset + index, series),
    ]


def _intervals(count: int) -> Iterator[tuple[int, int]]:
    """Start and end of the parts of a series that are searched for one step each."""
    parts = 1
    while (length := -(-count // parts)) >= LEAST:
        starts = {round(each) for each in np.linspace(0, count - length, 2 * parts - 1)}
        yield from ((start, start + length) for start in sorted(starts))
        parts *= 2


def _likeliest(data: Array) -> tuple[int, float]:
    """The place of the largest |t|, and the chance of that t at one place."""
    count = len(data)
    places = np.arange(SIDE, count - SIDE + 1)
    # about the middle, so that the squares keep their digits
    centred = data - data.mean()
    total, squares = np.cumsum(centred), np.cumsum(centred**2)
    first, last = total[places - 1], total[-1] - total[places - 1]
    rest = count - places
    # Squares within both parts: all, less those of the two means.
    within = squares[-1] - first**2 / places - last**2 / rest
    least = (_LAST_DIGIT * np.abs(data).max()) ** 2
    scatter = np.sqrt(np.maximum(within / (count - 2), least))
    difference = np.abs(last / rest - first / places)
    with np.errstate(invalid="ignore"):  # a series of zeros: no difference over no scatter
        size = np.nan_to_num(difference / (scatter * np.sqrt(1.0 / places + 1.0 / rest)))
    best = int(np.argmax(size))
    return int(places[best]), float(2.0 * stdtr(count - 2, -size[best]))
