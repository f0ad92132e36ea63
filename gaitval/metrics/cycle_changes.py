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

Looked at are each point, the mean over the cycle, and between them changes as wide as `WIDTHS`
wherever they may be. Strides differ mostly slowly over the cycle (the whole curve a little higher,
or later), so a change of a part of it is told from them best by that part less what the rest of the
curve says of it: the matched filter of a change in noise that hangs together, the change over the
covariance of the strides. That covariance is of all curves of a kind, whatever session they are of,
drawn towards white noise by the share that makes its expected squared error least: the variance of
a mean of so many curves over the square of how far it is from white. It is worked out once and does
not know which cycle is of which session, so the permutations keep the share of false alarms
whatever the filter.

Few cycles show their own spread badly at each point, so the variance of t is the mean of the
point's and of the whole curve's (a moderated t, in the manner of Tusher et al. 2001, PNAS 98:5116;
whatever the statistic, the permutations keep the share of false alarms).

Curves of a side that are of the same cycles are relabelled together, so it does not matter how
they depend on each other. Sources: Nichols and Holmes 2002, Hum Brain Mapp 15:1; Westfall and
Young 1993 (the largest of all curves).
"""

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from itertools import combinations
from typing import Final, NamedTuple

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

WIDTHS: Final = (10.0, 20.0, 40.0)
"""% of the cycle at half of its height of a change that is looked for: octaves between a point,
which curves below 10 Hz do not make narrower than 5 %, and the mean over the cycle."""
_STEP: Final = 2
"""Points between two places at which one is looked for."""

MOST_CORRELATED: Final = 0.9
"""Above it so few strides say nothing of their mean; convention."""


@dataclass(frozen=True)
class CurveDifference:
    """What the test says of one curve.

    Attributes
    ----------
    t : (n + 1,) moderated t at each point, positive where the second set is larger; the last is
        that of the mean over the cycle.
    p : of its largest |t|, whatever of it was looked at, among the largest of all curves.
    regions : where it differs; first and last point, and p. The width of what was found there, all
        of it where only its mean differs.
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
    filters = _filters(cycles)
    # All relabellings of one group say no more than so many, whatever the others have.
    count = max((len(each) for each in labels.values()), default=0)
    largest = np.zeros(count)
    looked_at: dict[str, _LookedAt] = {}
    for number, (key, names) in enumerate(groups.items()):
        values = {n: cycles[n] for n in names}
        found = [_of_labels(values, filters, part) for part in _parts(labels[key])]
        looked_at |= {n: _LookedAt(*(each[0] for each in of)) for n, of in found[0].items()}
        peaks = np.concatenate(
            [np.max([np.abs(a).max(axis=1) for of in part.values() for a in of], axis=0)
             for part in found]
        )  # fmt: skip
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
        {
            name: _difference(
                each,
                after[name].mean(axis=0) - before[name].mean(axis=0),
                filters.get(name.partition("/")[0]),
                threshold,
                every,
            )
            for name, each in looked_at.items()
        },
        threshold,
        count,
        correlation,
    )


class _LookedAt(NamedTuple):
    """t of what is looked at in a curve of n points: each point, the mean and the mean by all that
    is known of strides (2,), and changes of `_places` (m,); one of 0 where no stride differs.
    """

    points: Array
    means: Array
    changes: Array


def _parts(labels: Array) -> list[Array]:
    return np.array_split(labels, -(-len(labels) // TOGETHER))


def _places(points: int) -> list[tuple[float, float]]:
    """Middle and width of each change that is looked for, % of a cycle of so many points."""
    middles = np.linspace(0.0, 100.0, points)[::_STEP]
    return [(float(middle), width) for width in WIDTHS for middle in middles]


def _reach(points: int, middle: float, width: float) -> Array:
    """(n,) of a change of height one: half of it `width` / 2 from its `middle`, none at `width`."""
    away = np.abs(np.linspace(0.0, 100.0, points) - middle) / width
    return np.asarray(0.5 * (1.0 + np.cos(np.pi * np.minimum(away, 1.0))))


def _filters(cycles: Mapping[str, Array]) -> dict[str, Array]:
    """By kind of curve, (m + 1, n) what changes are looked for with: those of `_places`, and of the
    whole cycle. None of a kind whose curves do not differ from stride to stride.
    """
    found = {}
    for kind in dict.fromkeys(name.partition("/")[0] for name in cycles):
        deviations = []
        for name, values in cycles.items():
            own = values - values.mean(axis=0)
            size = float(np.sqrt(np.mean(own**2)))
            if name.partition("/")[0] == kind and size > ROUNDING * float(np.abs(values).max()):
                deviations.append(own / size)
        if not deviations:
            continue
        points = deviations[0].shape[1]
        changes = [*(_reach(points, *each) for each in _places(points)), np.ones(points)]
        covariance = _covariance(deviations)
        filters = np.linalg.solve(covariance, np.transpose(changes)).T
        # each of the same standard deviation in such strides
        spread = np.sqrt(np.einsum("ij,jk,ik->i", filters, covariance, filters))
        found[kind] = filters / spread[:, None]
    return found


def _covariance(deviations: Sequence[Array]) -> Array:
    """(n, n) of the `deviations` (N, n) of several curves, drawn towards that of white noise."""
    own = [each.T @ each / len(each) for each in deviations]
    mean = np.mean(own, axis=0)
    white = np.trace(mean) / len(mean) * np.eye(len(mean))
    apart = float(np.sum((mean - white) ** 2))
    between = sum(float(np.sum((each - mean) ** 2)) for each in own) / len(own) ** 2
    cycles = np.concatenate(deviations)
    # of single cycles: the sum of |z z' - C|^2, without the n by n matrix of each
    within = float(np.sum(np.sum(cycles**2, axis=1) ** 2)) / len(cycles) - float(np.sum(mean**2))
    share = min(1.0, max(between, within / len(cycles)) / apart) if apart > 0.0 else 1.0
    return np.asarray((1.0 - share) * mean + share * white)


def _of_labels(
    values: Mapping[str, Array], filters: Mapping[str, Array], second: Array
) -> dict[str, tuple[Array, Array, Array]]:
    """What `_LookedAt` has of each curve, (k, n), (k, 2) and (k, m), for each of k labellings."""
    found: dict[str, tuple[Array, Array, Array]] = {}
    for kind in dict.fromkeys(name.partition("/")[0] for name in values):
        names = [name for name in values if name.partition("/")[0] == kind]
        curves = np.stack([values[name] for name in names], axis=1)
        points = _t(curves, second, moderated=True)
        means = [curves.mean(axis=-1, keepdims=True)]
        changes = np.zeros((len(second), len(names), 1))
        if kind in filters:
            filtered = curves @ filters[kind].T
            changes = _t(filtered[..., :-1], second, moderated=True)
            means.append(filtered[..., -1:])
        of_means = _t(np.concatenate(means, axis=-1), second, moderated=False)
        found |= {
            name: (points[:, i], of_means[:, i], changes[:, i]) for i, name in enumerate(names)
        }
    return found


def _difference(
    found: _LookedAt,
    difference: Array,
    filters: Array | None,
    threshold: float | None,
    peaks: Peaks,
) -> CurveDifference:
    count = len(found.points)
    size = np.abs(found.points)
    above = beyond(found.points, threshold)
    shown = above.copy()
    percent = np.linspace(0.0, 100.0, count)
    for middle, width, height in _changes(found.changes, difference, filters, threshold):
        away = np.abs(percent - middle)
        if not shown[away <= width].any():  # else its points say where it is
            there = away <= 0.5 * width
            above |= there
            size[there] = np.maximum(size[there], abs(height))
    whole = float(np.abs(found.means).max())
    if beyond(found.means, threshold).any() and (whole >= size.max() or not above.any()):
        above[:] = True  # all of it a little
        size = np.maximum(size, whole)
    largest = max(float(np.abs(each).max()) for each in found)
    t = np.append(found.points, found.means[0])
    return CurveDifference(t, peaks.p(largest), regions_of(size, above, peaks.p))


def _changes(
    t: Array, difference: Array, filters: Array | None, threshold: float | None
) -> Iterator[tuple[float, float, float]]:
    """Middle, width and t of the changes beyond the `threshold`, the largest first: each is taken
    away from the `difference` (n,) of the means before the next, because a filter looks at the rest
    of the curve, too, and sees it there.
    """
    if filters is None or threshold is None:
        return
    places = _places(len(difference))
    left, seen = difference.copy(), filters[:-1] @ difference
    error = np.where(t == 0.0, np.inf, seen / np.where(t == 0.0, 1.0, t))
    now = t
    for _ in places:
        number = int(np.argmax(np.abs(now)))
        if not beyond(now[number : number + 1], threshold)[0]:
            return
        yield (*places[number], float(now[number]))
        change = _reach(len(difference), *places[number])
        left -= float(filters[number] @ left) / float(filters[number] @ change) * change
        now = (filters[:-1] @ left) / error


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
