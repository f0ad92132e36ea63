"""Whether a person stands: nine frames of ten about the median place, by hand."""

import numpy as np
import pytest

from gaitval.errors import RecordError
from gaitval.mocap.recording import Recording
from gaitval.session.standing import LARGEST_SWAY, check_stands, standing_places

LANDMARKS = {"R.Heel": "RHEE", "R.Knee": "RKNE"}


def moved(share: float, by: float, name: str = "RHEE") -> Recording:
    """A marker that is `by` m away in a `share` of 100 frames."""
    markers = np.tile([1.0, 2.0, 0.1], (100, 1, 1))
    markers[: round(100 * share), 0, 0] += by
    return Recording("stand.c3d", "project", (name,), markers, 100.0)


@pytest.mark.parametrize(
    ("share", "by", "stands"),
    [(0.08, 0.5, True), (0.12, 0.5, False), (0.45, 0.99 * LARGEST_SWAY, True),
     (0.45, 1.01 * LARGEST_SWAY, False)],
)  # fmt: skip
def test_a_tenth_of_the_frames_may_be_anywhere(share, by, stands):
    if stands:
        check_stands(moved(share, by), LANDMARKS)
        return
    with pytest.raises(RecordError, match=rf"RHEE is more than\s+{100 * by:.0f} cm"):
        check_stands(moved(share, by), LANDMARKS)


def test_knees_may_bend_and_a_place_is_a_median():
    check_stands(moved(0.4, 0.3, "RKNE"), LANDMARKS)
    np.testing.assert_array_equal(standing_places(moved(0.4, 0.3))["RHEE"], [1.0, 2.0, 0.1])
