"""Which curves of a person differ between two sets of gait cycles: one test of all curves at once.

Cycles change sets (a permutation test); each time the largest |t| of all points of all curves is
kept, and of their means over the cycle. A point differs where its |t| is above what only a share
`ALPHA` of the relabellings exceed anywhere, so the probability of calling even one point of one
curve of the person different by chance is `ALPHA` at most, if cycles of one session are
exchangeable: a walk that drifts within its session, as on a treadmill that a person is still
getting used to, is not.

Few cycles show their own spread badly at each point, so the variance of t is the mean of the
point's and of the whole curve's (a moderated t, in the manner of Tusher et al. 2001, PNAS 98:5116;
whatever the statistic, the permutations keep the share of false alarms).

Curves of a side that are of the same cycles are relabelled together, so it does not matter how
they depend on each other. Sources: Nichols and Holmes 2002, Hum Brain Mapp 15:1; Westfall and
Young 1993 (the largest of all curves).
"""

import math
from collections.abc import Mapping
from dataclasses import dataclass
from itertools import combinations
from typing import Final

import numpy as np

from gaitval.arrays import Array
from gaitval.metrics.curve_statistics import ALPHA, Peaks, beyond, regions_of
from gaitval.metrics.statistics_results import Region

PERMUTATIONS: Final = 2_000
"""All are tried where there are at most so many, else so many at random: the SD of an estimated p
of 0.05 is then 0.005."""

_TOGETHER: Final = 50
"""Permutations worked out at a time, so that some MB suffice."""


@dataclass(frozen=True)
class CurveDifference:
    """What the test says of one curve.

    Attributes
    ----------
    t : (n + 1,) moderated t at each point, positive where the second set is larger; the last is
        that of the mean over the cycle.
    p : of its largest |t|, among the largest of all curves.
    regions : where it differs; first and last point, and p. All of it where only its mean does.
    """

    t: Array
    p: float
    regions: tuple[Region, ...]


@dataclass(frozen=True)
class FamilyTest:
    """Result of `differing_curves`.

    Attributes
    ----------
    curves : by the names of the curves; those that could be tested.
    threshold : |t| above which a point differs; None where there are too few relabellings for any
        p below `ALPHA`: then nothing can be found.
    permutations : relabellings that were compared, the data as they are among them; 0 without a
        threshold.
    """

    curves: Mapping[str, CurveDifference]
    threshold: float | None
    permutations: int


def differing_curves(
    before: Mapping[str, Array],
    after: Mapping[str, Array],
    *,
    permutations: int = PERMUTATIONS,
) -> FamilyTest:
    """Where curves of two sets of cycles differ, with one probability of a false alarm for all.

    `before` and `after` hold (N, n) cycles of each curve, by names that end in `_r` or `_l`; a
    curve that one of them lacks, or has fewer than 2 cycles of, is not tested. Curves of one side
    with as many cycles in both sets are taken to be of the same cycles. The random relabellings
    are the same in every call.
    """
    groups: dict[tuple[str, int, int], list[str]] = {}
    for name in sorted(before.keys() & after.keys()):
        sizes = len(before[name]), len(after[name])
        if min(sizes) >= 2:
            groups.setdefault((name[-1], *sizes), []).append(name)
    labels = {key: _labels(*key[1:], permutations) for key in groups}
    # All relabellings of one group say no more than so many, whatever the others have.
    count = max((len(each) for each in labels.values()), default=0)
    largest = np.zeros(count)
    t: dict[str, Array] = {}
    for number, (key, names) in enumerate(groups.items()):
        values = np.stack([np.concatenate([before[n], after[n]]) for n in names], axis=1)
        # the mean over the cycle is one more point
        values = np.concatenate([values, values.mean(axis=-1, keepdims=True)], axis=-1)
        shape = (-1, len(names), values.shape[-1])
        parts = np.array_split(labels[key], -(-len(labels[key]) // _TOGETHER))
        found = [_moderated(values, part).reshape(shape) for part in parts]
        t |= dict(zip(names, found[0][0], strict=True))
        peaks = np.concatenate([np.abs(each).max(axis=(1, 2)) for each in found])
        # Groups are relabelled independently; the first relabelling of each is the data's own.
        order = np.random.default_rng(number).integers(len(peaks), size=count)
        order[0] = 0
        if len(peaks) == count:
            order[1:] = np.random.default_rng(number).permutation(np.arange(1, count))
        largest = np.maximum(largest, peaks[order])
    every = Peaks(np.sort(largest))
    # Two sets of as many cycles may change places, which changes no |t|.
    rarest = [(1 + (one == two)) / len(labels[side, one, two]) for side, one, two in groups]
    if min(rarest, default=1.0) > ALPHA:
        count = 0
    threshold = every.threshold() if count else None
    return FamilyTest(
        {name: _difference(values, threshold, every) for name, values in t.items()},
        threshold,
        count,
    )


def _difference(t: Array, threshold: float | None, peaks: Peaks) -> CurveDifference:
    found = beyond(t, threshold)
    above = found[:-1]
    if found[-1] and not above.any():  # all of it a little, and no point of it by itself
        above = np.ones(len(t) - 1, dtype=bool)
    return CurveDifference(t, peaks.p(float(np.abs(t).max())), regions_of(t, above, peaks.p))


def _labels(first: int, second: int, permutations: int) -> Array:
    """(k, cycles) 1 for those of the second set, else 0; the data's own labelling first."""
    count = first + second
    own = (np.arange(count) >= first).astype(float)
    if math.comb(count, second) <= permutations:
        chosen = np.array(list(combinations(range(count), second)))
        every = np.zeros((len(chosen), count))
        np.put_along_axis(every, chosen, 1.0, axis=1)
        # combinations are in order, so the last is the own one
        return every[::-1]
    random = np.random.default_rng(0)
    drawn = random.permuted(np.tile(own, (permutations - 1, 1)), axis=1)
    return np.concatenate([own[None], drawn])


def _moderated(values: Array, second: Array) -> Array:
    """t (k, curves, n) of cycles `values` (N, curves, n) for each of the labellings `second`."""
    count, curves, points = values.shape
    centred = (values - values.mean(axis=0)).reshape(count, -1)
    sizes = count - second[0].sum(), second[0].sum()
    # centred cycles sum to nothing, so the first set's sum is the second's with another sign
    sums = second @ centred
    between = sums * (1.0 / sizes[0] + 1.0 / sizes[1])
    squares = np.sum(centred**2, axis=0)
    within = squares - sums**2 * (1.0 / sizes[0] + 1.0 / sizes[1])
    within = np.clip(within, 0.0, None).reshape(-1, curves, points) / (count - 2)
    cycle = within[..., :-1]
    within[..., :-1] = 0.5 * (cycle + cycle.mean(axis=-1, keepdims=True))
    error = np.sqrt(within * (1.0 / sizes[0] + 1.0 / sizes[1]))
    # what does not move at all differs by rounding only
    still = error <= 1e-9 * np.abs(values).max(axis=(0, 2))[:, None]
    between = between.reshape(error.shape)
    return np.asarray(np.where(still, 0.0, between / np.where(still, 1.0, error)))
