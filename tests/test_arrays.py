"""What is computed of arrays everywhere, by hand."""

import numpy as np

from gaitval.arrays import runs, sample_deviation


def test_the_deviation_is_that_of_a_sample_row_by_row():
    """Of 1, 2 and 6 about 3: squares 4, 1 and 9, over two degrees of freedom, 7."""
    values = np.array([[1.0, 5.0], [2.0, 5.0], [6.0, 5.0]])
    np.testing.assert_allclose(sample_deviation(values), [np.sqrt(7.0), 0.0])
    assert sample_deviation(values[:1]) is None
    assert sample_deviation(values[:0]) is None


def test_runs_end_after_their_last_sample():
    first, last = runs(np.array([1, 1, 0, 0, 1, 0, 1], dtype=bool))
    assert (first.tolist(), last.tolist()) == ([0, 4, 6], [2, 5, 7])
