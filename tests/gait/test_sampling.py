"""Values between samples, and gaps bridged."""

import numpy as np
import pytest

from gaitval.gait.sampling import bridged, interpolated


def test_between_samples_values_change_evenly_and_beyond_the_ends_not_at_all():
    values = np.array([1.0, 3.0, 2.0])
    at = np.array([-5.0, 0.0, 0.25, 1.0, 1.5, 2.0, 9.0])
    np.testing.assert_allclose(interpolated(values, at), [1.0, 1.0, 1.5, 3.0, 2.5, 2.0, 2.0])
    assert interpolated(values, np.array(0.5)) == 2.0


def test_every_shape_of_samples_and_values():
    values = np.arange(12.0).reshape(4, 3)
    found = interpolated(values, np.array([[0.5, 3.0], [1.0, 2.25]]))
    assert found.shape == (2, 2, 3)
    np.testing.assert_allclose(found[0, 0], values[:2].mean(axis=0))
    np.testing.assert_allclose(found[1, 1], 0.75 * values[2] + 0.25 * values[3])
    np.testing.assert_array_equal(interpolated(values[:1], np.array([0.0, 3.0])), values[[0, 0]])


@pytest.mark.parametrize("gap", [0, 2])
def test_a_neighbour_without_weight_may_be_missing_where_it_is_said(gap):
    values = np.array([1.0, 2.0, 3.0])
    values[gap] = np.nan
    assert interpolated(values, np.array([1.0]), lone=True) == [2.0]
    assert np.isnan(interpolated(values, np.array([0.5 + gap / 2.0]), lone=True)).all()
    assert np.isnan(interpolated(values, np.array([float(gap)]), lone=True)).all()
    if gap == 2:
        assert np.isnan(interpolated(values, np.array([1.0]))).all()


def test_gaps_are_bridged_evenly_and_the_ends_held():
    values = np.array([[0.0, 9.0], [2.0, 9.0], [0.0, 9.0], [0.0, 9.0], [8.0, 3.0], [0.0, 0.0]])
    known = np.array([False, True, False, False, True, False])
    found = bridged(values, known)
    np.testing.assert_allclose(found[:, 0], [2.0, 2.0, 4.0, 6.0, 8.0, 8.0])
    np.testing.assert_allclose(found[:, 1], [9.0, 9.0, 7.0, 5.0, 3.0, 3.0])
