"""Results of the statistics of whole curves."""

import pytest

from gaitval.metrics.statistics_results import CurveStatistics, Region


def of(*regions, p=0.01):
    return CurveStatistics(
        multiple_correlation=None,
        repeatability=0.9,
        threshold=3.0,
        normal_threshold=None,
        p=p,
        regions=[Region(first=first, last=last, p=0.01) for first, last in regions],
    )


def test_the_share_counts_the_points_of_all_regions_with_their_ends():
    assert of((0, 0)).share == pytest.approx(100.0 / 101.0)
    assert of((10, 19), (90, 100)).share == pytest.approx(100.0 * 21 / 101)
    assert of().share == 0.0
    assert of((0, 100)).share == 100.0
    assert of(p=None).share is None
