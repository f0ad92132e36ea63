"""Results that are written as JSON: what a number may be, and how it is written."""

import math

import numpy as np
import pytest
from pydantic import ValidationError

from gaitval.metrics.typed import (
    Count,
    Flag,
    Number,
    Result,
    Share,
    Size,
    StrictPositive,
    array,
    number,
    numbers,
    tidy,
)


class Part(Result):
    """One of each kind."""

    number: Number = 0.0
    size: Size = 0.0
    share: Share = 0.0
    positive: StrictPositive = 1.0
    count: Count = 0
    flag: Flag = False


@pytest.mark.parametrize(
    ("name", "good", "bad"),
    [
        ("number", (-1e300, 0.0, 3.0), (math.nan, math.inf, "1", True, None)),
        ("size", (0.0, 0.5, 1e9), (-1e-9, math.inf, math.nan)),
        ("share", (0.0, 0.3, 1.0), (-1e-9, 1.0 + 1e-9, math.nan)),
        ("positive", (1e-300, 0.5, 7.0), (0.0, -1.0, math.inf, math.nan)),
        ("count", (0, 1, 10**9), (-1, 0.5, True)),
        ("flag", (True, False), (0, 1, "yes")),
    ],
)
def test_what_a_number_may_be(name, good, bad):
    for value in good:
        assert getattr(Part(**{name: value}), name) == value
    for value in bad:
        with pytest.raises(ValidationError):
            Part(**{name: value})


def test_a_result_is_not_changed_and_has_no_other_keys():
    part = Part(size=2.0)
    with pytest.raises(ValidationError):
        part.size = 3.0
    with pytest.raises(ValidationError):
        Part(length=1.0)


def test_numbers_are_written_to_six_digits_and_without_what_is_no_number():
    values = {
        1: [1.23456789, -0.0, math.nan, (math.inf, True, None)],
        "array": np.array([[1e-9 / 3.0, 2.0]]),
        "scalar": np.float64(2.0 / 3.0),
        "count": np.int64(3),
        "text": "as it is",
    }
    found = tidy(values)
    assert found == {
        "1": [1.23457, 0.0, None, [None, True, None]],
        "array": [[3.33333e-10, 2.0]],
        "scalar": 0.666667,
        "count": 3,
        "text": "as it is",
    }
    assert math.copysign(1.0, found["1"][1]) == 1.0
    assert type(found["count"]) is int


def test_a_curve_goes_to_a_file_and_back():
    curve = np.array([0.5, np.nan, -2.0])
    stored = numbers(curve)
    assert stored == [0.5, None, -2.0]
    np.testing.assert_array_equal(array(stored), curve)
    assert number(math.nan) is None
    assert number(0.25) == 0.25
