"""Which curves of a person differ between two sets of gait cycles: one test of all curves at once.

Cycles change sets (a permutation test); each time the largest |t| of all that is looked at in all
curves is kept. What is looked at differs where its |t| is above what only a share `ALPHA` of the
relabellings exceed anywhere, so the probability of calling even one curve of the person different
by chance is `ALPHA` at most, if what changes sets is exchangeable.

Strides are not: one that is long is followed by long ones (Hausdorff et al. 1995, J Appl Physiol
78:349; Dingwell and Cusumano 2010, Gait Posture 32:348). So their correlation with the next one is
estimated, one number of all curves of both sessions, and what changes sets is what each stride
brings new: the stride less the part of the one before that lasts, which has the same mean and, in
a first-order autoregression, is independent from stride to stride (Cochrane and Orcutt 1949, J Am
Stat Assoc 44:32). Strides with a longer memory, or curves of which some last and some do not, are
called changed more often than `ALPHA` (docs/how-to/change.md has how often).

Looked at are each point and the mean over the cycle.

Few cycles show their own spread badly at each point, so the variance of t is the mean of the
point's and of the whole curve's (a moderated t, in the manner of Tusher et al. 2001, PNAS 98:5116;
whatever the statistic, the permutations keep the share of false alarms).

Curves of a side that are of the same cycles are relabelled together, so it does not matter how
they depend on each other. Sources: Nichols and Holmes 2002, Hum Brain Mapp 15:1; Westfall and
Young 1993 (the largest of all curves).
"""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from itertools import combinations
from typing import Final

import numpy as np
from scipy.integrate import quad
from scipy.optimize import brentq

from gaitval.arrays import Array
from gaitval.metrics.curve_results import Region
from gaitval.metrics.curve_statistics import (
    ALPHA,
    PERMUTATIONS,
    ROUNDING,
    TOGETHER,
    Peaks,
    beyond,
    regions_of,
)

MOST_CORRELATED: Final = 0.9
"""Above it so few strides say nothing of their mean; convention."""


@dataclass(frozen=True)
class CurveDifference:
    """What the test says of one curve.

    Attributes
    ----------
    t : (n + 1,) moderated t at each point, positive where the second set is larger; the last is
        that of the mean over the cycle.
    p : of its largest |t| among the largest of all curves.
    regions : where it differs; first and last point, and p. All of it where only its mean differs.
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
    correlation : of a stride with the next one, 0 to `MOST_CORRELATED`.
    """

    curves: Mapping[str, CurveDifference]
    threshold: float | None
    permutations: int
    correlation: float


def stride_correlation(sessions: Sequence[Mapping[str, Array]]) -> float:
    """Correlation of a stride with the next one, of all curves of all `sessions` together: (N, n)
    strides in the order in which they were walked, by curve.

    Deviations are from the mean of few strides, which makes their correlation smaller than that of
    the strides. So it is what would make the products of neighbours over the squares as large, on
    the average of curves of as many independent numbers as these. At least 0, as strides that
    alternate tell more of their mean, not less; at most `MOST_CORRELATED`.
    """
    many = [each for curves in sessions for each in curves.values() if len(each) > 2]
    own = [values - values.mean(axis=0) for values in many]
    moving = [each for each, values in zip(own, many, strict=True)
              if np.abs(each).max() > ROUNDING * np.abs(values).max()]  # fmt: skip
    if not moving:
        return 0.0
    seen = np.mean([np.sum(each[1:] * each[:-1]) / np.sum(each**2) for each in moving])
    sizes = [len(each) for each in moving]
    numbers = float(np.mean([_independent_numbers(each) for each in moving]))

    def missed(correlation: float) -> float:
        expected = {n: _expected_ratio(n, numbers, correlation) for n in set(sizes)}
        return float(np.mean([expected[n] for n in sizes]) - seen)

    if missed(0.0) >= 0.0:
        return 0.0
    if missed(MOST_CORRELATED) <= 0.0:
        return MOST_CORRELATED
    return float(brentq(missed, 0.0, MOST_CORRELATED, xtol=1e-6))


def _independent_numbers(deviations: Array) -> float:
    """Of how many independent numbers of one size curves with these `deviations` (N, n) seem to be;
    less than N.
    """
    products = deviations @ deviations.T
    return float(np.trace(products) ** 2 / np.sum(products**2))


def _expected_ratio(count: int, numbers: float, correlation: float) -> float:
    """Expected value of products of neighbours over squares, both summed over so many `numbers`, of
    deviations from the mean of `count` values of a first-order autoregression: that of a ratio of
    quadratic forms of normal values (Magnus 1986, Ann Econ Stat 4:95).
    """
    apart = np.abs(np.subtract.outer(np.arange(count), np.arange(count)))
    own = np.linalg.cholesky(correlation**apart)
    own -= own.mean(axis=0)
    size, turn = np.linalg.eigh(own.T @ own)
    products = np.einsum("ji,jk,ki->i", turn, own[1:].T @ own[:-1], turn)

    def share(at: float) -> float:
        grown = 1.0 + 2.0 * at * size
        return float(numbers * np.sum(products / grown) * np.prod(grown) ** (-0.5 * numbers))

    return float(quad(share, 0.0, np.inf)[0])


def new_in_strides(strides: Array, correlation: float) -> Array:
    """(N - 1, n) what each of (N, n) `strides` brings new, about the same mean as theirs; the
    strides themselves if they do not hang together.
    """
    if correlation == 0.0:
        return strides
    return np.asarray((strides[1:] - correlation * strides[:-1]) / (1.0 - correlation))


def differing_curves(
    before: Mapping[str, Array],
    after: Mapping[str, Array],
    *,
    permutations: int = PERMUTATIONS,
) -> FamilyTest:
    """Where curves of two sets of cycles differ, with one probability of a false alarm for all.

    `before` and `after` hold (N, n) cycles of each curve in the order in which they were walked, by
    names that end in `_r` or `_l`; a curve that one of them lacks, or has fewer than 3 cycles of,
    is not tested. Curves of one side with as many cycles in both sets are taken to be of the same
    cycles. The random relabellings are the same in every call.
    """
    both = sorted(before.keys() & after.keys())
    known = [name for name in both if min(len(before[name]), len(after[name])) > 2]
    correlation = stride_correlation([{name: s[name] for name in known} for s in (before, after)])
    before, after = (
        {name: new_in_strides(s[name], correlation) for name in known} for s in (before, after)
    )
    groups: dict[tuple[str, int, int], list[str]] = {}
    for name in known:
        key = name[-1], len(before[name]), len(after[name])
        groups.setdefault(key, []).append(name)
    labels = {key: _labels(*key[1:], permutations) for key in groups}
    cycles = {n: np.concatenate([before[n], after[n]]) for names in groups.values() for n in names}
    # All relabellings of one group say no more than so many, whatever the others have.
    count = max((len(each) for each in labels.values()), default=0)
    largest = np.zeros(count)
    t: dict[str, Array] = {}
    for number, (key, names) in enumerate(groups.items()):
        stacked = np.stack([cycles[name] for name in names], axis=1)
        found = [_of_labels(stacked, part) for part in _parts(labels[key])]
        t |= dict(zip(names, found[0][0], strict=True))
        peaks = np.concatenate([np.abs(part).max(axis=(1, 2)) for part in found])
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
    curves = {name: _difference(each, threshold, every) for name, each in t.items()}
    return FamilyTest(curves, threshold, count, correlation)


def _parts(labels: Array) -> list[Array]:
    return np.array_split(labels, -(-len(labels) // TOGETHER))


def _of_labels(curves: Array, second: Array) -> Array:
    """t (k, curves, n + 1) of points and mean of `curves` (N, curves, n), for each of k labellings
    `second`.
    """
    points = _t(curves, second, moderated=True)
    means = _t(curves.mean(axis=-1, keepdims=True), second, moderated=False)
    return np.concatenate([points, means], axis=-1)


def _difference(t: Array, threshold: float | None, peaks: Peaks) -> CurveDifference:
    size, above = np.abs(t), beyond(t, threshold)
    if above[-1] and not above[:-1].any():
        above[:] = True  # all of it a little
        size[:-1] = size[-1]
    return CurveDifference(t, peaks.p(size.max()), regions_of(size[:-1], above[:-1], peaks.p))


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


def _t(values: Array, second: Array, *, moderated: bool) -> Array:
    """t (k, curves, n) of numbers of cycles, `values` (N, curves, n), for each of the labellings
    `second` (k, N); `moderated`, their variance is the mean of each number's and the curve's.
    """
    count, curves, points = values.shape
    centred = (values - values.mean(axis=0)).reshape(count, -1)
    sizes = count - second[0].sum(), second[0].sum()
    # centred cycles sum to nothing, so the first set's sum is the second's with another sign
    sums = second @ centred
    both = 1.0 / sizes[0] + 1.0 / sizes[1]
    squares = np.sum(centred**2, axis=0)
    within = np.clip(squares - sums**2 * both, 0.0, None) / (count - 2)
    within = within.reshape(-1, curves, points)
    if moderated:
        within = 0.5 * (within + within.mean(axis=-1, keepdims=True))
    error = np.sqrt(within * both)
    # what does not move at all differs by rounding only
    still = error <= ROUNDING * np.abs(values).max(axis=(0, 2))[:, None]
    between = (sums * both).reshape(error.shape)
    return np.asarray(np.where(still, 0.0, between / np.where(still, 1.0, error)))
