"""Two halves of a session's gait cycles."""

import numpy as np
import pytest
from recorded_sessions import wbds01_t01

from gaitval.configuration import Configuration
from gaitval.coordinates import SIDES
from gaitval.session.importing.importing import work_out
from gaitval.session.measurement.halves import halves_of


@pytest.fixture(scope="module")
def found(gait_data):
    request = wbds01_t01(gait_data).model_copy(update={"consistent": False})
    return work_out(request, Configuration().processing)


def strikes(part, side):
    return [c.start for walk in part.trials for c in walk.cycles[side] if c.kinematics_valid]


@pytest.mark.parametrize("which", ["odd-even", "first-last"])
def test_every_valid_cycle_is_in_one_half(found, which):
    one, other = halves_of(found, which).values()
    for side in SIDES:
        both = sorted([*strikes(one, side), *strikes(other, side)])
        assert both == strikes(found, side)
        assert 0 <= len(strikes(one, side)) - len(strikes(other, side)) <= 1
        for part in (one, other):
            (walk,) = part.trials
            np.testing.assert_array_equal(
                np.diff([[c.start, c.end] for c in walk.cycles[side] if c.kinematics_valid])[:, 0],
                walk.gait[side].stride_time,
            )
    if which == "first-last":
        assert max(strikes(one, "right")) < min(strikes(other, "right"))


@pytest.mark.slow
def test_the_mean_of_the_halves_is_the_mean_of_the_whole(found):
    one, other = halves_of(found, "odd-even").values()
    name = "knee_angle_l"
    counts = [len(part.angles[name].curves) for part in (one, other)]
    mean = np.average([part.angles[name].mean for part in (one, other)], axis=0, weights=counts)
    np.testing.assert_allclose(mean, found.angles[name].mean, atol=1e-12)
