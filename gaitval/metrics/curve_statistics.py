"""Where over the gait cycle curves differ: a permutation test of the whole t-trajectory.

A t-test at each of 101 points would call one point in twenty different where nothing is. Here the
largest |t| of the whole cycle is compared with what it would be if the labels of the curves meant
nothing: signs of differences are flipped, and each time the largest |t| of the cycle is kept. The
threshold is what it exceeds in a share alpha of the permutations, so the probability of calling
even one point of the cycle different by chance is alpha at most, however the points depend on each
other, if positive and negative differences are alike.

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
    values, known = _checked(curves), np.asarray(expected, dtype=float)
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

    tested = np.ones(values.shape[1], dtype=bool) if where is None else where
    t = np.where(tested, statistic(np.ones((1, count)))[0], 0.0)
    peak = float(np.abs(t).max())
    exact = 2 ** (count - 1) <= permutations
    signs = _every_sign(count) if exact else _random_signs(count, permutations - 1)
    parts = [np.max(np.abs(statistic(each)) * tested, axis=1) for each in signs]
    # the signs of the data are among all, and must be added to random ones, so that no p is 0
    peaks = Peaks(np.sort(np.concatenate(parts if exact else [*parts, [peak]])))
    threshold = peaks.threshold()
    regions = regions_of(t, beyond(t, threshold), peaks.p)
    normal = random_field_threshold(residuals, count - 1, where=tested)
    return CurveTest(t, threshold, normal, peaks.p(peak), regions, len(peaks.ordered), exact)


def _every_sign(count: int) -> Iterator[Array]:
    """All signs of so many curves at once; flipping all changes no |t|, so the first is kept."""
    total = 2 ** (count - 1)
    # the binary digits of 0 to total - 1 are all combinations of signs
    bits = np.arange(total)[:, None] >> np.arange(count - 1) & 1
    yield np.column_stack([np.ones(total), 1.0 - 2.0 * bits])


def _random_signs(count: int, draws: int) -> Iterator[Array]:
    """So many draws of signs of `count` curves, `TOGETHER` at a time; the same in every call."""
    random = np.random.default_rng(0)
    for begun in range(0, draws, TOGETHER):
        yield random.choice((-1.0, 1.0), (min(TOGETHER, draws - begun), count))


def _checked(curves: Array) -> Array:
    values = np.asarray(curves, dtype=float)
    if values.ndim != 2 or len(values) < 2:
        raise ValueError(
            f"curves have the shape {values.shape}: give at least 2 curves, one in each row."
        )
    if not np.isfinite(values).all():
        row, column = np.argwhere(~np.isfinite(values))[0]
        raise ValueError(f"curve {row} is {values[row, column]} at point {column}.")
    return values


def _t(difference: Array, error: Array, tiny: float) -> Array:
    """Difference over its standard error; 0 where both are no more than rounding."""
    unlike = np.abs(difference) > tiny
    return np.where(unlike, difference / np.maximum(error, tiny or 1.0), 0.0)


def _residuals(curves: Array, tiny: float) -> Array:
    """Of curves from their mean; 0 where they are no more than rounding."""
    found = curves - curves.mean(axis=0)
    return np.where(np.abs(found) > tiny, found, 0.0)


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
