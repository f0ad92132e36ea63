"""Units by which people of every size compare."""

import pytest

from gaitval.constants import GRAVITY
from gaitval.gait.dimensionless import speed_unit, time_unit


@pytest.mark.parametrize("leg", [0.5, 0.9, 1.0])
def test_the_leg_is_passed_in_one_unit_of_time_and_falls_half_of_it(leg: float) -> None:
    assert speed_unit(leg) * time_unit(leg) == pytest.approx(leg)
    assert 0.5 * GRAVITY * time_unit(leg) ** 2 == pytest.approx(0.5 * leg)
