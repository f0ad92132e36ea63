import numpy as np
import pytest

from gaitval.apps.regression.agreement import bland_altman


def test_the_limits_are_those_of_bland_and_altman():
    """Their own worked numbers: with 17 differences of mean -2.1 and SD 38.8 l/min the limits are
    -79.7 and 75.5 with 2 SD (-78.1 and 73.9 with 1.96), and the interval of the bias is -22.0 to
    17.8 (Lancet 1986;327:307)."""
    z = np.random.default_rng(1).standard_normal(17)
    differences = -2.1 + 38.8 * (z - z.mean()) / z.std(ddof=1)
    first = np.linspace(200.0, 600.0, 17)
    found = bland_altman(first, first + differences)
    assert found.bias == pytest.approx(-2.1)
    assert found.deviation == pytest.approx(38.8)
    assert (found.lower, found.upper) == pytest.approx((-78.1, 73.9), abs=0.06)
    assert found.bias_interval == pytest.approx((-22.0, 17.8), abs=0.06)
    assert found.limit_error == pytest.approx(34.5, abs=0.1)  # theirs: 2.12 * 16.3
    assert np.allclose(found.differences, differences)


def test_three_people_by_hand():
    """Differences 1, 2 and 3: bias 2 and SD 1 (n - 1); Student's t of two degrees of freedom at
    97.5 % is 4.303 (any table), and the limits are 1.96 SD away, at every number of people."""
    found = bland_altman([10.0, 20.0, 40.0], [11.0, 22.0, 43.0])
    assert (found.bias, found.deviation) == pytest.approx((2.0, 1.0))
    assert (found.lower, found.upper) == pytest.approx((0.04, 3.96), abs=1e-9)
    half = 4.303 / np.sqrt(3.0)
    assert found.bias_interval == pytest.approx((2.0 - half, 2.0 + half), abs=1e-3)
    assert found.limit_error == pytest.approx(4.303 * np.sqrt(3.0 / 3.0), abs=1e-3)
    assert found.means.tolist() == [10.5, 21.0, 41.5]


def test_an_error_that_grows_is_seen():
    first = np.linspace(1.0, 2.0, 12)
    rough = first + 0.01 * np.resize([1.0, -1.0], 12)
    assert bland_altman(first, 1.2 * rough).trend_p < 0.001
    assert bland_altman(first, 1.2 * rough).trend == pytest.approx(0.2 / 1.1, abs=0.02)
    assert bland_altman(first, rough + 1.0).trend_p > 0.1
    assert bland_altman(first, first).trend_p == 1.0


@pytest.mark.parametrize(
    ("first", "second", "words"),
    [
        ([1.0, 2.0], [1.0, 2.0], "at least 3"),
        ([1.0, 2.0, 3.0], [1.0, 2.0], "same length"),
        ([1.0, 2.0, np.nan], [1.0, 2.0, 3.0], "not finite"),
    ],
)
def test_what_cannot_be_compared_is_named(first, second, words):
    with pytest.raises(ValueError, match=words):
        bland_altman(np.array(first), np.array(second))
