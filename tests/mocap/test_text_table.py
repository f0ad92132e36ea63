"""The rate of samples, from times that are rounded."""

from pathlib import Path

import numpy as np
import pytest

from gaitval.errors import RecordError
from gaitval.mocap.text_table import numbers_of, sample_rate, with_gaps


class TestSampleRate:
    def test_times_rounded_to_milliseconds(self):
        assert sample_rate(Path("a"), np.round(np.arange(374) / 150, 3)) == 150.0

    def test_a_rate_that_is_no_whole_number_stays(self):
        found = sample_rate(Path("a"), np.arange(500) / 119.88)
        assert found == pytest.approx(119.88, rel=1e-9)

    def test_a_rate_nearly_whole_stays_where_the_times_show_it(self):
        found = sample_rate(Path("a"), np.arange(100) / 99.999)
        assert found == pytest.approx(99.999, rel=1e-9)

    @pytest.mark.parametrize("place", [3, 250, 496])
    def test_one_missing_sample_is_found(self, place):
        with pytest.raises(RecordError, match="not evenly spaced"):
            sample_rate(Path("a"), np.delete(np.arange(500) / 100, place))


def test_a_marker_that_lacks_a_coordinate_was_not_seen():
    markers = np.array([[[0.0, 1.0, 2.0], [0.0, 0.0, 0.0], [1.0, np.nan, 2.0]]])
    seen = np.isfinite(with_gaps(markers)).all(axis=2)
    assert seen.tolist() == [[True, False, False]]
    assert np.isnan(with_gaps(markers)[~seen]).all()


def test_gaps_are_read_whoever_wrote_them():
    rows = ["1e3\t -.5 ", "\t2", "NULL\t1.#QNAN", "nan(ind)\tNaN"]
    found = numbers_of(Path("a"), rows, 1, 2, "\t")
    np.testing.assert_array_equal(found[:2], [[1e3, -0.5], [np.nan, 2.0]])
    assert np.isnan(found[2:]).all()


@pytest.mark.parametrize("field", ["1_0", "\u0661", "1,5", "x"])
def test_what_only_python_takes_for_a_number_is_damage(field):
    with pytest.raises(RecordError, match=f"line 8: '{field}' is not a number"):
        numbers_of(Path("a"), ["1\t2", f"3\t{field}"], 7, 2, "\t")
