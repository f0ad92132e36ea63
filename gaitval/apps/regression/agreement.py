"""Agreement of two ways to measure the same people: Bland and Altman's limits.

Bland and Altman 1986, Lancet 327:307; intervals of the limits: the same, with Student's t. A
correlation says whether people are ordered alike; it does not say whether numbers may replace each
other.
"""

import math
from dataclasses import dataclass

import numpy as np
from scipy import stats

from gaitval.arrays import Array


@dataclass(frozen=True)
class Agreement:
    """Agreement of paired values, all in their unit.

    Attributes
    ----------
    means, differences : (N,) mean of each pair, and second less first.
    bias : mean difference.
    bias_interval : its 95 % confidence interval.
    deviation : standard deviation of the differences.
    lower, upper : 95 % limits of agreement, bias -+ 1.96 SD.
    limit_error : half width of the 95 % confidence interval of each limit.
    trend : slope of the differences over the means, with its p; not 0 where the difference grows
        with the size of what is measured.
    trend_p : see `trend`.
    """

    means: Array
    differences: Array
    bias: float
    bias_interval: tuple[float, float]
    deviation: float
    lower: float
    upper: float
    limit_error: float
    trend: float
    trend_p: float


def bland_altman(first: Array, second: Array) -> Agreement:
    """Limits of agreement of paired values `first` and `second`, (N,) each: the same quantity of N
    people, such as recorded and simulated. Give one pair a person, since two sides of a person are
    not independent. Raises ValueError for fewer than 3 pairs, other shapes, or values not finite.
    """
    one, other = np.asarray(first, dtype=float), np.asarray(second, dtype=float)
    if one.shape != other.shape or one.ndim != 1 or len(one) < 3:
        raise ValueError(
            f"the values have shapes {one.shape} and {other.shape}: give two lists of the same "
            "length, a pair for each of at least 3 people."
        )
    if not (np.isfinite(one).all() and np.isfinite(other).all()):
        raise ValueError("a value is not finite: leave out people without both values.")
    means, differences = 0.5 * (one + other), other - one
    count, bias = len(one), float(differences.mean())
    deviation = float(differences.std(ddof=1))
    t = float(stats.t.ppf(0.975, count - 1))
    # standard errors: s / √n of the bias, and about √(3 / n) s of a limit (Bland and Altman 1986)
    half, span = t * deviation / math.sqrt(count), 1.96 * deviation
    trend, trend_p = 0.0, 1.0
    # a regression on one mean, or of equal differences, has no p
    if np.ptp(means) > 0.0 and deviation > 0.0:
        line = stats.linregress(means, differences)
        trend, trend_p = float(line.slope), float(line.pvalue)
    return Agreement(
        means=means,
        differences=differences,
        bias=bias,
        bias_interval=(bias - half, bias + half),
        deviation=deviation,
        lower=bias - span,
        upper=bias + span,
        limit_error=t * deviation * math.sqrt(3.0 / count),
        trend=trend,
        trend_p=trend_p,
    )
