"""The rate of samples, from times that are rounded."""

from pathlib import Path

import numpy as np
import pytest

from gaitval.errors import RecordError
from gaitval.mocap.text_table import sample_rate, with_gaps


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
