"""Where over the gait cycle curves differ: what permutation tests of the whole t-trajectory share.

A t-test at each of 101 points would call one point in twenty different where nothing is. So the
largest |t| of the whole cycle is compared with what it would be if the labels of the curves meant
nothing. The threshold is what it exceeds in a share alpha of the permutations, so the probability
of calling even one point of the cycle different by chance is alpha at most, however the points
depend on each other.

Sources: Nichols and Holmes 2002, Hum Brain Mapp 15:1 (the test); Pataky, Vanrenterghem and Robinson
2015, J Biomech 48:1277 (on gait curves, as statistical parametric mapping).
"""

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import Final

import numpy as np

from gaitval.arrays import Array, Flags, runs
from gaitval.metrics.curve_results import Region

ALPHA: Final = 0.05
"""Probability of calling any point of a cycle different where nothing is; convention."""

PERMUTATIONS: Final = 2_000
"""All are tried where there are at most so many, else so many at random: the SD of an estimated p
of 0.05 is then 0.005."""

ROUNDING: Final = 1e-9
"""Share of the largest value of the curves below which a spread or a difference is rounding."""

TOGETHER: Final = 500
"""Permutations worked out at a time, so that some MB suffice."""


@dataclass(frozen=True)
class Peaks:
    """The largest |t| of every labelling of the data, (k,), `ordered` by size."""

    ordered: Array

    def p(self, size: float) -> float:
        """Share of the labellings that come to a |t| of this `size`."""
        # equal labellings differ by rounding
        reached = np.searchsorted(self.ordered, size * (1.0 - 1e-9), side="left")
        return float((len(self.ordered) - reached) / len(self.ordered))

    def threshold(self) -> float | None:
        """|t| that a share of `ALPHA` of the labellings exceeds; None if they are too few."""
        # the largest share of labellings up to ALPHA; 1e-9, since 0.05 x 20 may be just below 1
        allowed = math.floor(ALPHA * len(self.ordered) + 1e-9)
        return float(self.ordered[-1 - allowed]) if allowed >= 1 else None


def beyond(t: Array, threshold: float | None) -> Flags:
    """Where |t| exceeds a `threshold` by more than rounding; nowhere without one."""
    if threshold is None:
        return np.zeros(len(t), dtype=bool)
    return np.asarray(np.abs(t) > threshold * (1.0 + 1e-9))


def regions_of(t: Array, above: Flags, p: Callable[[float], float]) -> tuple[Region, ...]:
    """The runs of points `above`, each with the `p` of its largest |t|."""
    return tuple(
        Region(first=int(first), last=int(end) - 1, p=p(float(np.abs(t[first:end]).max())))
        for first, end in zip(*runs(above), strict=True)
    )
