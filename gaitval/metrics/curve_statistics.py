"""Where over the gait cycle curves differ: a permutation test of the whole t-trajectory.

A t-test at each of 101 points would call one point in twenty different where nothing is. Here the
largest |t| of the whole cycle is compared with what it would be if the labels of the curves meant
nothing: signs of differences are flipped (one sample, pairs) or curves change groups (two samples),
and each time the largest |t| of the cycle is kept. The threshold is what it exceeds in a share
alpha of the permutations, so the probability of calling even one point of the cycle different by
chance is alpha at most, however the points depend on each other. Of two samples that holds however
the values are distributed; of one, and of pairs, if positive and negative differences are alike.

The threshold of random field theory is given beside it. It needs no permutations, but assumes
smooth, normally distributed curves. The two agree where that holds; on very smooth curves it is a
few per cent higher.

Sources: Nichols and Holmes 2002, Hum Brain Mapp 15:1 (the test); Pataky, Vanrenterghem and Robinson
2015, J Biomech 48:1277 (on gait curves, as statistical parametric mapping); Worsley et al. 1996,
Hum Brain Mapp 4:58 (random fields); Kiebel et al. 1999, NeuroImage 10:756 (their smoothness).
"""

import math
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from itertools import combinations
from typing import Final

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import brentq
from scipy.special import stdtr, stdtrit

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
class CurveTest:
    """Result of a test of whole curves.

    Attributes
    ----------
    t : (n,) Student's t at each point, positive where the first curves are larger; 0 outside what
        was tested.
    threshold : |t| above which a point differs at `ALPHA`; None where so few curves have too few
        permutations for any p below it.
    normal_threshold : the same by random field theory; None where that has none.
    p : of the largest |t| of the cycle.
    regions : where |t| is above the threshold, in order.
    permutations : different ones that were compared, the data as they are among them.
    exact : whether these are all that exist.
    """

    t: Array
    threshold: float | None
    normal_threshold: float | None
    p: float
    regions: tuple[Region, ...]
    permutations: int
    exact: bool


def one_sample_test(
    curves: Array,
    expected: Array | float = 0.0,
    *,
    where: NDArray[np.bool_] | None = None,
    permutations: int = PERMUTATIONS,
) -> CurveTest:
    """Where the mean of at least 2 repetitions, `curves` (N, n), differs from one known curve,
    `expected` (n,) or a constant without uncertainty: the signs of differences are flipped.

    Only the points `where` (n,) it is True are tested, all by default; `permutations`: see
    `PERMUTATIONS`; random ones are the same in every call. Raises ValueError for fewer than 2
    curves, values that are not finite, or shapes that do not fit.
    """
    values, known = _checked(curves, "curves"), np.asarray(expected, dtype=float)
    if known.shape not in ((), values.shape[1:]):
        raise ValueError(
            f"expected has shape {known.shape}, but the curves have {values.shape[1]} points: give "
            "one value for each point."
        )
    differences = values - known
    count = len(differences)
    tiny = ROUNDING * float(np.abs(values).max())
    squares = np.sum(differences**2, axis=0)
    residuals = _residuals(differences, tiny)

    # flipping signs leaves the sum of squares as it is, so one product gives all variances
    def statistic(signs: Array) -> Array:
        means = signs @ differences / count
        # mean square less squared mean, with Bessel's factor; clipped against rounding
        variances = np.clip(squares / count - means**2, 0.0, None) * count / (count - 1)
        return _t(means, np.sqrt(variances / count), tiny)

    # flipping all signs changes no |t|, so the first one is never flipped
    total = 2 ** (count - 1)

    def every() -> Array:
        # the binary digits of 0 to total - 1 are all combinations of signs
        bits = np.arange(total)[:, None] >> np.arange(count - 1) & 1
        return np.column_stack([np.ones(total), 1.0 - 2.0 * bits])

    def drawn(random: np.random.Generator, size: int) -> Array:
        return random.choice((-1.0, 1.0), (size, count))

    labelled = _Labelled(statistic, np.ones((1, count)), every, drawn, total, residuals, count - 1)
    return _tested(labelled, where, permutations)


def two_sample_test(
    first: Array,
    second: Array,
    *,
    where: NDArray[np.bool_] | None = None,
    permutations: int = PERMUTATIONS,
) -> CurveTest:
    """Where curves of two groups differ: Student's t with one variance, curves change groups.

    The hypothesis tested is that both groups are from one distribution, spread included. `first`
    (N1, n) and `second` (N2, n) have at least 2 curves each. Options (`where`, `permutations`) and
    errors (ValueError) are those of `one_sample_test`.
    """
    one, other = _checked(first, "the first curves"), _checked(second, "the second curves")
    if one.shape[1] != other.shape[1]:
        raise ValueError(
            f"the first curves have {one.shape[1]} points, the second {other.shape[1]}: bring them "
            "to the same points of the cycle."
        )
    values = np.concatenate([one, other])
    sizes = np.array([len(one), len(other)])
    tiny = ROUNDING * float(np.abs(values).max())
    values = values - values.mean(axis=0)  # keeps the sums of squares exact
    squares, whole = np.sum(values**2, axis=0), np.sum(values, axis=0)

    def statistic(members: Array) -> Array:
        sums = members @ values
        means = sums / sizes[0], (whole - sums) / sizes[1]
        within = squares - sizes[0] * means[0] ** 2 - sizes[1] * means[1] ** 2
        variances = np.clip(within, 0.0, None) / (sizes.sum() - 2)
        return _t(means[0] - means[1], np.sqrt(variances * np.sum(1.0 / sizes)), tiny)

    count = len(values)
    own = (np.arange(count) < sizes[0]).astype(float)

    def every() -> Array:
        chosen = np.array(list(combinations(range(count), int(sizes[0]))))
        members = np.zeros((len(chosen), count))
        np.put_along_axis(members, chosen, 1.0, axis=1)
        return members

    def drawn(random: np.random.Generator, size: int) -> Array:
        return random.permuted(np.tile(own, (size, 1)), axis=1)

    total = math.comb(count, int(sizes[0]))
    residuals = np.concatenate([_residuals(one, tiny), _residuals(other, tiny)])
    labelled = _Labelled(statistic, own[None], every, drawn, total, residuals, count - 2)
    return _tested(labelled, where, permutations)


def _checked(curves: Array, name: str) -> Array:
    values = np.asarray(curves, dtype=float)
    if values.ndim != 2 or len(values) < 2:
        raise ValueError(
            f"{name} have the shape {values.shape}: give at least 2 curves, one in each row."
        )
    if not np.isfinite(values).all():
        row, column = np.argwhere(~np.isfinite(values))[0]
        raise ValueError(f"{name}: curve {row} is {values[row, column]} at point {column}.")
    return values


def _t(difference: Array, error: Array, tiny: float) -> Array:
    """Difference over its standard error; 0 where both are no more than rounding."""
    unlike = np.abs(difference) > tiny
    return np.where(unlike, difference / np.maximum(error, tiny or 1.0), 0.0)


def _residuals(curves: Array, tiny: float) -> Array:
    """Of curves from their mean; 0 where they are no more than rounding."""
    found = curves - curves.mean(axis=0)
    return np.where(np.abs(found) > tiny, found, 0.0)


def _batches(count: int) -> Iterator[int]:
    while count > 0:
        yield min(TOGETHER, count)
        count -= TOGETHER


@dataclass(frozen=True)
class _Labelled:
    """Curves with their labels, and how these may be changed.

    Attributes
    ----------
    statistic : t (k, n) of k labellings.
    own : (1, ...) labelling of the data.
    every : all labellings, the own one among them.
    drawn : so many random ones.
    total : how many there are.
    residuals : (N, n) of the curves from the means that are compared.
    freedom : degrees of freedom of t.
    """

    statistic: Callable[[Array], Array]
    own: Array
    every: Callable[[], Array]
    drawn: Callable[[np.random.Generator, int], Array]
    total: int
    residuals: Array
    freedom: int


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


def _tested(data: _Labelled, where: NDArray[np.bool_] | None, permutations: int) -> CurveTest:
    """The largest |t| of the data as labelled, among those of the other labellings."""
    t = data.statistic(data.own)[0]
    tested = np.ones(len(t), dtype=bool) if where is None else np.asarray(where, dtype=bool)
    t = np.where(tested, t, 0.0)
    peak = float(np.abs(t).max())
    exact = data.total <= permutations
    random, sizes = np.random.default_rng(0), _batches(permutations - 1)
    relabelled = [data.every()] if exact else (data.drawn(random, size) for size in sizes)
    parts = [np.max(np.abs(data.statistic(each)) * tested, axis=1) for each in relabelled]
    # the own labelling is one of all, and must be added to random ones, so that no p is 0
    peaks = Peaks(np.sort(np.concatenate(parts if exact else [*parts, [peak]])))
    threshold = peaks.threshold()
    regions = regions_of(t, beyond(t, threshold), peaks.p)
    normal = random_field_threshold(data.residuals, data.freedom, where=tested)
    return CurveTest(t, threshold, normal, peaks.p(peak), regions, len(peaks.ordered), exact)


def random_field_threshold(
    residuals: Array, freedom: int, *, where: NDArray[np.bool_] | None = None
) -> float | None:
    """|t| that smooth normal curves exceed anywhere with probability `ALPHA`, on both sides; None
    where the residuals are zero, or no height is so rare: with one degree of freedom the density of
    regions does not fall with it.

    By the expected Euler characteristic of a field of Student's t of so many degrees of `freedom`
    over the points `where` (n,) it is True, all by default; its smoothness is estimated from the
    gradients of the normalised `residuals` (N, n) of curves from the means that are compared.
    """
    tested = np.ones(residuals.shape[1], dtype=bool) if where is None else where
    squares = np.sum(residuals**2, axis=0)
    known = tested & (squares > 0.0)
    if not known.any():
        return None
    firsts, ends = runs(tested)
    resels = 0.0
    if len(squares) > 1:  # a single point has no width
        slopes = np.sum(np.gradient(residuals, axis=1)[:, known] ** 2, axis=0)
        # 1 / FWHM of the smoothness at each point, from the variance of the gradients of the
        # normalised residuals (Kiebel et al. 1999)
        resels_per_point = np.sqrt(slopes / squares[known] / (4.0 * math.log(2.0))).mean()
        resels = float(np.sum(ends - firsts - 1) * resels_per_point)

    # expected number of regions above a height: Euler characteristic of the tested intervals times
    # P(t > height), and their length in resels times the 1-D density of a t field (Worsley et al.
    # 1996)
    def excess(height: float) -> float:
        density = math.sqrt(4.0 * math.log(2.0)) / (2.0 * math.pi)
        density *= (1.0 + height**2 / freedom) ** (-0.5 * (freedom - 1))
        expected = len(firsts) * stdtr(freedom, -height) + resels * density
        # 1 - exp(-expected) is the probability of any region if their number is Poisson; half of
        # ALPHA falls on each side
        return float(-math.expm1(-expected) - 0.5 * ALPHA)

    highest = -float(stdtrit(freedom, 1e-15))
    return float(brentq(excess, 0.0, highest)) if excess(highest) < 0.0 else None
