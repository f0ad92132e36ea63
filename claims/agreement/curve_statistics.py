"""The whole-cycle tests beside spm1d on the same data.

Thresholds of `gaitval.metrics.curve_statistics`, by permutation and by random field theory, beside
those that spm1d finds in the same two ways, on smooth random curves and on strides of the data
folder: knee and hip of healthy adults and of people with an above-knee prosthesis (two samples),
and of people with Parkinson's disease off and on medication (pairs). Printed beside: how far the
two ways are apart. spm1d (GPL) is a tool of development only.
"""

from collections.abc import Iterator
from pathlib import Path
from typing import NamedTuple

import numpy as np
from scipy.ndimage import gaussian_filter1d

import claims
from claims import Claim
from experiments.gps_controls import strides
from gaitval.arrays import Array
from gaitval.metrics.curve_statistics import ALPHA, one_sample_test, two_sample_test

PERMUTATIONS = 10_000


class CurveCase(NamedTuple):
    """Curves (N, 101) that are compared."""

    name: str
    first: Array
    second: Array
    paired: bool


class Thresholds(NamedTuple):
    """Of |t|, by permutation and by random field theory."""

    permuted: float
    field: float


def smooth_curves(count: int, width: float, seed: int) -> Array:
    """Gaussian curves (count, 101) with a full width at half maximum, %, of their kernel."""
    noise = np.random.default_rng(seed).standard_normal((count, 301))
    curves = gaussian_filter1d(noise, width / np.sqrt(8.0 * np.log(2.0)), axis=1)[:, 100:201]
    return curves / curves.std()


def random_cases() -> Iterator[CurveCase]:
    """Smooth random curves."""
    for width in (10.0, 20.0, 30.0):
        one, other = smooth_curves(16, width, 1), smooth_curves(16, width, 2)
        yield CurveCase(f"random, width {width:g} %, two samples", one, other, False)
        yield CurveCase(f"random, width {width:g} %, pairs", one, other, True)


def recorded_cases(data: Path) -> Iterator[CurveCase]:
    """Strides of people."""
    table = strides(data)
    for angle in ("knee_angle", "hip_flexion"):
        rows = table.xs((angle, "r"), level=("angle", "side"))
        groups = {name: rows.loc[name].sort_index() for name in rows.index.unique(level="group")}
        healthy, amputees = groups["control"], groups["transfemoral_amputee"]
        yield CurveCase(f"{angle}, amputees", healthy.to_numpy(), amputees.to_numpy(), False)
        off, on = groups["parkinson_off"], groups["parkinson_on"]
        people = [[str(name).split("_")[0] for name in each.index] for each in (off, on)]
        assert people[0] == people[1]
        yield CurveCase(f"{angle}, off and on medication", off.to_numpy(), on.to_numpy(), True)


def thresholds(case: CurveCase, permutations: int = PERMUTATIONS) -> tuple[Thresholds, Thresholds]:
    """Ours and spm1d's."""
    import spm1d

    pair = (case.first, case.second)
    if case.paired:
        ours = one_sample_test(case.first - case.second, permutations=permutations)
    else:
        ours = two_sample_test(*pair, permutations=permutations)
    np.random.seed(0)  # noqa: NPY002 - spm1d draws from it
    theirs = spm1d.stats.nonparam.ttest_paired if case.paired else spm1d.stats.nonparam.ttest2
    permuted = theirs(*pair).inference(
        ALPHA, two_tailed=True, iterations=permutations, force_iterations=True
    )
    field = (spm1d.stats.ttest_paired if case.paired else spm1d.stats.ttest2)(*pair)
    largest = float(np.abs(np.asarray(field.z) - ours.t).max() / np.abs(ours.t).max())
    assert largest < 1e-6, f"{case.name}: the t-trajectories differ by {largest}"
    assert ours.threshold is not None
    assert ours.normal_threshold is not None
    return (
        Thresholds(ours.threshold, ours.normal_threshold),
        Thresholds(permuted.zstar, field.inference(ALPHA, two_tailed=True).zstar),
    )


@claims.measured("data")
def bands(given: claims.Given) -> Claim:
    """Thresholds of the whole-cycle tests beside spm1d's."""
    off = []
    for case in (*random_cases(), *recorded_cases(given.data)):
        ours, theirs = thresholds(case)
        off.append([100.0 * abs(a / b - 1.0) for a, b in zip(ours, theirs, strict=True)])
        apart = 100.0 * (ours.field / ours.permuted - 1.0)
        print(
            f"{case.name}: permuted {ours.permuted:.3f}, spm1d {theirs.permuted:.3f} "
            f"({off[-1][0]:.2f} %); field theory {ours.field:.3f}, spm1d {theirs.field:.3f} "
            f"({off[-1][1]:.2f} %), {apart:+.1f} % from permuted"
        )
    worst = float(np.max(off))
    return Claim("SPM bands against spm1d on the same data", worst, "%", np.size(off))
