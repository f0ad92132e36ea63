"""Events of a file against those found: their mean and deviation, and the other foot's, by hand."""

import numpy as np
import pytest

from gaitval.gait.stored_events import stored_events
from gaitval.mocap.recording import Event


def heel_strikes(side, *times):
    return [Event(time=each, side=side, kind="heel_strike") for each in times]


def test_times_are_found_less_stored_and_their_deviation_that_of_a_sample():
    """Found 1, 2 and 6 hundredths late: mean 3, SD the root of 7 hundredths."""
    stored = [*heel_strikes("right", 1.0, 2.0, 3.0), *heel_strikes("left", 3.5)]
    found = heel_strikes("right", 1.01, 2.02, 3.06, 3.5)
    (compared,) = stored_events(stored, found)
    assert (compared.kind, compared.stored, compared.matched) == ("heel_strike", 4, 3)
    assert compared.other_foot == 1
    assert compared.mean_s == pytest.approx(0.03)
    assert compared.sd_s == pytest.approx(0.01 * np.sqrt(7.0))
    (alone,) = stored_events(stored[:1], found)
    assert alone.mean_s == pytest.approx(0.01)
    assert np.isnan(alone.sd_s)
