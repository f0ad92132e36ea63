"""Constants are those of others, who have them from elsewhere."""

import dartpy
import mujoco
import numpy as np
import pytest
import scipy.constants

from gaitval.constants import GRAVITY, POUND, STANDARD_GRAVITY


def test_weight_is_that_of_both_engines_and_measured_weight_that_of_the_kilogram_force() -> None:
    engines = (dartpy.simulation.World().getGravity(), mujoco.MjOption().gravity)
    for gravity in engines:
        np.testing.assert_array_equal(np.asarray(gravity).ravel(), [0.0, 0.0, -GRAVITY])
    assert scipy.constants.g == STANDARD_GRAVITY
    assert pytest.approx(scipy.constants.pound, rel=1e-15) == POUND
