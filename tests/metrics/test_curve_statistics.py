from itertools import product

import numpy as np
import pytest
from scipy import stats
from smooth_curves import smooth_curves

from gaitval.metrics.curve_statistics import (
    ALPHA,
    one_sample_test,
    random_field_threshold,
)


def test_t_is_students():
    one, other = smooth_curves(9, 15.0, 1), smooth_curves(7, 15.0, 2) + 0.4
    assert np.allclose(one_sample_test(one, 0.2).t, stats.ttest_1samp(one, 0.2).statistic)
    pairs = one_sample_test(one[:7] - other)
    assert np.allclose(pairs.t, stats.ttest_rel(one[:7], other).statistic)


def test_few_pairs_are_permuted_completely():
    curves = smooth_curves(7, 15.0, 3) + 0.3
    found = one_sample_test(curves)
    largest = [
        np.abs(stats.ttest_1samp(np.array(signs)[:, None] * curves, 0.0).statistic).max()
        for signs in product((-1.0, 1.0), repeat=7)
    ]
    own = np.abs(found.t).max()
    assert found.exact
    assert found.permutations == 64  # flipping all signs changes no |t|
    assert found.p == pytest.approx(np.mean(np.array(largest) >= own * (1.0 - 1e-9)))
    above = np.mean(np.array(largest) > found.threshold * (1.0 + 1e-9))
    assert above <= 0.05 < above + 2.0 / 64.0


def test_nothing_is_found_where_nothing_is():
    """Of 300 groups a share alpha may be called different from zero: 5 ± 3.8 % (3 SD). Point by
    point it would be a third of them."""
    wrong = sum(bool(one_sample_test(smooth_curves(8, 15.0, i)).regions) for i in range(300))
    assert 0.012 <= wrong / 300 <= 0.088


def test_a_difference_is_found_where_it_is():
    curves = smooth_curves(15, 15.0, 5)
    curves[:, 40:61] += 3.0
    (region,) = one_sample_test(curves).regions
    assert abs(region.first - 40) <= 3
    assert abs(region.last - 60) <= 3
    assert region.p <= 0.001
    np.testing.assert_allclose(one_sample_test(-curves).t, -one_sample_test(curves).t)


def test_only_what_is_asked_is_tested():
    curves = smooth_curves(15, 15.0, 5)
    curves[:, 40:61] += 3.0
    where = np.ones(101, dtype=bool)
    where[30:71] = False
    found = one_sample_test(curves, where=where)
    assert not found.regions
    assert not found.t[30:71].any()
    assert found.threshold < one_sample_test(curves).threshold


def test_curves_without_spread_are_no_difference():
    flat = np.tile(np.linspace(0.0, 1.0, 101), (6, 1))
    found = one_sample_test(flat, flat[0])
    assert not found.t.any()
    assert found.p == 1.0
    assert found.normal_threshold is None
    assert not found.regions
    assert one_sample_test(flat, flat[0] + 1.0).regions == one_sample_test(flat, 5.0).regions


def test_too_few_pairs_cannot_be_told_apart():
    found = one_sample_test(smooth_curves(5, 15.0, 1) + 9.0 - smooth_curves(5, 15.0, 2))
    assert found.threshold is None
    assert found.p == 1.0 / 16.0
    assert not found.regions


def test_scale_and_order_change_nothing():
    curves = smooth_curves(6, 15.0, 7) + 0.5
    found, scaled = one_sample_test(curves), one_sample_test(1e4 * curves[::-1])
    assert scaled.threshold == pytest.approx(found.threshold)
    assert scaled.p == found.p


def test_a_field_of_one_point_is_students_threshold():
    residuals = smooth_curves(12, 15.0, 9)[:, :1].repeat(3, axis=1)
    where = np.array([False, True, False])
    found = random_field_threshold(residuals, 11, where=where)
    # two one-sided tests at alpha/2, each as 1 - exp(-p)
    expected = stats.t.isf(-np.log1p(-0.025), 11)
    assert found == pytest.approx(expected, rel=1e-9)
    assert random_field_threshold(residuals[:, :1], 11) == pytest.approx(expected, rel=1e-9)


def test_two_curves_have_no_normal_threshold_where_they_are_rough():
    """With one degree of freedom the density of regions is the same at every height."""
    assert random_field_threshold(smooth_curves(2, 3.0, 10), 1) is None
    assert random_field_threshold(smooth_curves(3, 3.0, 10), 2) > 10.0
    assert one_sample_test(smooth_curves(2, 3.0, 10), np.zeros(101)).normal_threshold is None


@pytest.mark.parametrize(
    ("curves", "words"),
    [
        (np.zeros(101), "at least 2 curves"),
        (np.zeros((1, 101)), "at least 2 curves"),
        (np.full((3, 101), np.nan), "curve 0 is nan at point 0"),
    ],
)
def test_what_cannot_be_tested_is_named(curves, words):
    with pytest.raises(ValueError, match=words):
        one_sample_test(curves)


def test_shapes_that_do_not_fit_are_named():
    curves = smooth_curves(4, 15.0, 1)
    with pytest.raises(ValueError, match="one value for each point"):
        one_sample_test(curves, np.zeros(50))


@pytest.mark.parametrize("width", [10.0, 25.0])
def test_spm1d_finds_the_same_thresholds(width):
    """Both draw 2000 permutations at random, which leaves each threshold an SD of about 1 %."""
    spm1d = pytest.importorskip("spm1d")
    assert spm1d.__version__ >= "0.4.55"
    one, other = smooth_curves(14, width, 11), smooth_curves(14, width, 12)
    ours = one_sample_test(one - other, permutations=2000)
    np.random.seed(0)  # noqa: NPY002 - spm1d draws from it
    permuted = spm1d.stats.nonparam.ttest_paired(one, other).inference(
        ALPHA, two_tailed=True, iterations=2000, force_iterations=True
    )
    field = spm1d.stats.ttest_paired(one, other)
    np.testing.assert_allclose(np.abs(field.z), np.abs(ours.t), rtol=1e-6, atol=1e-6)
    assert ours.threshold == pytest.approx(permuted.zstar, rel=0.05)
    threshold = field.inference(ALPHA, two_tailed=True).zstar
    assert ours.normal_threshold == pytest.approx(threshold, rel=0.002)


def test_random_signs_are_those_of_seed_zero():
    curves = smooth_curves(20, 15.0, 7)
    signs = [np.ones(20), *np.random.default_rng(0).choice((-1.0, 1.0), (199, 20))]
    flipped = [stats.ttest_1samp(each[:, None] * curves, 0.0).statistic for each in signs]
    expected = np.sort(np.abs(flipped).max(axis=1))[-11]  # which 10 of 200 exceed
    found = one_sample_test(curves, permutations=200)
    assert (found.exact, found.permutations) == (False, 200)
    assert found.threshold == pytest.approx(expected)
