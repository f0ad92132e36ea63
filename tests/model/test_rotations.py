"""The feet's angles in the convention of the record."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from gaitval.model.rotations import foot_angles

TOES, SOLE = np.array([1.0, 0.0, 0.0]), np.array([0.0, 0.0, -1.0])


def turned(axes, *angles):
    return Rotation.from_euler(axes, angles, degrees=True)


@pytest.mark.parametrize(("side", "midline"), [("right", 1.0), ("left", -1.0)])
def test_each_angle_is_positive_where_it_says(side, midline):
    """The midline is to the left (+y) of the right foot and to the right of the left one."""
    up, inward, sole_in = turned("y", -20.0), turned("z", 20.0 * midline), turned("x", 20 * midline)
    assert up.apply(TOES)[2] > 0
    assert midline * inward.apply(TOES)[1] > 0
    assert midline * sole_in.apply(SOLE)[1] > 0
    for rotation, expected in (
        (up, (20.0, 0.0, 0.0)),
        (sole_in, (0.0, 20.0, 0.0)),
        (inward, (0.0, 0.0, 20.0)),
    ):
        found = np.degrees(foot_angles(rotation.as_matrix()[None], side))
        assert np.allclose(found, expected)


@pytest.mark.parametrize("pitch", [0.0, 40.0, 80.0, 100.0])
@pytest.mark.parametrize(("side", "progression"), [("right", -12.0), ("left", 12.0)])
def test_a_foot_on_its_tips_points_where_it_pointed_flat(pitch, side, progression):
    """A foot turned to the right by 12 degrees and then tipped forward, beyond the vertical."""
    foot = (turned("y", pitch) * turned("z", -12.0)).as_matrix()[None]
    assert np.allclose(np.degrees(foot_angles(foot, side)), [[-pitch, 0.0, progression]])
