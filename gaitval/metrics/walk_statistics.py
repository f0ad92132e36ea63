"""Statistics of whole curves for `metrics.json`: where the walk differs from the record, how
similar they are, and how far both are from healthy gait.

The record is a mean curve without its strides, so the only scatter known to the test is that of the
walk's cycles. A region is where the walk, repeated, would differ again; it does not show whether
the person, walking again, would. Successive cycles are slightly correlated, which makes regions
slightly too wide.
"""

from collections.abc import Mapping, Sequence

import numpy as np

from gaitval.arrays import Array, Flags
from gaitval.gait.cycle_curves import Curves
from gaitval.gait.healthy_controls import PROFILE_ANGLES, load_controls
from gaitval.gait.mean_curves import TOLERANCES
from gaitval.gait.record import GaitRecord
from gaitval.gait.sampling import SAMPLES
from gaitval.metrics.curve_results import (
    BandPeople,
    BandShares,
    CurveStatistics,
    GaitProfiles,
    Kind,
    StatisticsOfCurves,
    WalkStatistics,
    by_kind,
)
from gaitval.metrics.curve_statistics import ALPHA, PERMUTATIONS, one_sample_test
from gaitval.metrics.gait_profile import gait_profile
from gaitval.metrics.norms import BAND, HealthyBands, bands_beside
from gaitval.metrics.origin import Origins, curve_origin
from gaitval.metrics.typed import number, sided


def walk_statistics(
    curves: Curves,
    progression: Mapping[str, Array],
    record: GaitRecord,
    recorded: Mapping[Kind, Mapping[str, Array]],
    origins: Origins,
    *,
    age_years: float | None = None,
) -> WalkStatistics | None:
    """The statistics of a walk's cycles against `record`; None with fewer than two cycles.

    Parameters
    ----------
    curves : of the walk, (n, 101) each.
    progression : of its feet, see `foot_progression`.
    recorded : curves of the record by kind and name, in their units.
    origins : where they come from; nothing is tested against what was not recorded.
    age_years : of the person, to choose the bands (`bands_beside`).
    """
    cycles = by_kind(curves)
    if min(len(curve) for kind in cycles.values() for curve in kind.values()) < 2:
        return None
    found = {
        str(kind): {
            name: _of_curve(curve, recorded[kind][name], _tested(kind, name, curves, recorded))
            if curve_origin(kind, name, origins) == "recorded"
            else _untested(curve)
            for name, curve in each.items()
        }
        for kind, each in cycles.items()
    }
    walked = {
        kind: {name: curve.mean(axis=0) for name, curve in each.items()}
        for kind, each in cycles.items()
    }
    bands, people = bands_beside(age_years)
    return WalkStatistics(
        alpha=ALPHA,
        permutations=PERMUTATIONS,
        curves=StatisticsOfCurves(**found),
        profiles=_profiles(walked["angles"], progression, record, origins),
        bands=_bands(walked, recorded, origins, bands),
        band_people=BandPeople(**people),
    )


def _tested(
    kind: Kind, name: str, curves: Curves, recorded: Mapping[Kind, Mapping[str, Array]]
) -> Flags:
    """Points at which a curve is tested: of forces those where walk or record is in stance."""
    # in swing both forces are all but zero, so there is nothing to test
    if kind != "forces":
        return np.ones(SAMPLES, dtype=bool)
    vertical = f"vertical_{name[-1]}"
    on_ground: Flags = curves.forces[vertical].mean(axis=0) > TOLERANCES.stance_threshold
    recorded_on: Flags = recorded["forces"][vertical] > 100.0 * TOLERANCES.stance_threshold
    return on_ground | recorded_on


def _of_curve(cycles: Array, expected: Array, where: Flags) -> CurveStatistics:
    test = one_sample_test(cycles, expected, where=where)
    return CurveStatistics(
        multiple_correlation=multiple_correlation([expected, cycles.mean(axis=0)]),
        repeatability=multiple_correlation(list(cycles)),
        threshold=number(test.threshold),
        normal_threshold=number(test.normal_threshold),
        p=number(test.p),
        regions=list(test.regions),
    )


def multiple_correlation(curves: Sequence[Array]) -> float | None:
    """Coefficient of multiple correlation of repeated `curves` (101,); None where it is not
    defined.

    Kadaba et al. 1989, J Orthop Res 7:849, within a day: 1 less the variance about the mean curve
    over the variance about the grand mean, and its square root.
    """
    values = np.array(curves)
    count, samples = values.shape
    # over the degrees of freedom: a mean per point is estimated, and then one grand mean
    about_curve = np.sum((values - values.mean(axis=0)) ** 2) / (samples * (count - 1))
    about_all = np.sum((values - values.mean()) ** 2) / (samples * count - 1)
    if about_all == 0.0 or about_curve > about_all:
        return None
    return float(np.sqrt(1.0 - about_curve / about_all))


def _untested(cycles: Array) -> CurveStatistics:
    """What is said of a curve that was not recorded: how the walk repeats itself."""
    return CurveStatistics(
        multiple_correlation=None,
        repeatability=multiple_correlation(list(cycles)),
        threshold=None,
        normal_threshold=None,
        p=None,
        regions=[],
    )


def _profiles(
    walked: Mapping[str, Array],
    progression: Mapping[str, Array],
    record: GaitRecord,
    origins: Origins,
) -> GaitProfiles:
    phase, controls = np.linspace(0.0, 1.0, SAMPLES), load_controls().curves
    of_record = {name: np.degrees(curve(phase)) for name, curve in record.angles.items()}
    turned = {name: np.degrees(curve.mean(axis=0)) for name, curve in progression.items()}
    both = {name: curve for name, curve in {**walked, **turned}.items() if name in of_record}
    variables = [name for name in PROFILE_ANGLES if f"{name}_r" in both and f"{name}_l" in both]
    # scored on the same variables, else the two totals could not be compared
    same = {name: of_record[name] for name in both}
    recorded = set(origins["angles"].values()) == {"recorded"}
    return GaitProfiles(
        variables=variables,
        record=gait_profile(same, controls) if recorded else None,
        walk=gait_profile(both, controls),
    )


def _bands(
    walked: Mapping[Kind, Mapping[str, Array]],
    recorded: Mapping[Kind, Mapping[str, Array]],
    origins: Origins,
    bands: HealthyBands,
) -> dict[str, dict[str, BandShares]]:
    found: dict[str, dict[str, BandShares]] = {}
    for kind, each in bands.items():
        found[kind] = {}
        for name, (mean, spread) in each.items():
            for key in sided([name]):
                here, there = (
                    float(np.mean(np.abs(curves[kind][key] - mean) <= BAND * spread))
                    for curves in (recorded, walked)
                )
                known = curve_origin(kind, key, origins) == "recorded"
                found[kind][key] = BandShares(record=here if known else None, walk=there)
    return found
