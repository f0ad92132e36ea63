"""What the user says of the force plates."""

from dataclasses import replace

import numpy as np
import pytest

from gaitval.errors import RecordError
from gaitval.mocap.recording import Plate, Recording
from gaitval.session.stated_plates import with_stated_plates

CENTRE = np.array([0.25, 0.75, 0.0])
MIRROR = np.array([1.0, -1.0, 1.0])


def step(side: float) -> Plate:
    """A stance `side` m left of the middle of a plate that is right, walking along x."""
    share = np.linspace(0.0, 1.0, 60)
    vertical = 700.0 * np.sin(np.pi * share)
    force = np.column_stack(
        [-150.0 * np.cos(np.pi * share), 40.0 * np.sin(np.pi * share), vertical]
    )
    place = CENTRE + np.column_stack([0.2 * share - 0.1, np.full(60, side), np.zeros(60)])
    place[vertical < 20.0] = np.nan
    turning = np.where(vertical < 20.0, 0.0, 4.0 * np.sin(2 * np.pi * share))
    free = np.column_stack([np.zeros((60, 2)), turning])
    corners = CENTRE + 0.25 * np.array([[1, 1, 0], [-1, 1, 0], [-1, -1, 0], [1, -1, 0]])
    return Plate("1", corners, force, place, free)


def misread(plate: Plate, *, mirrored: bool) -> Plate:
    """The `plate` as a file with the wrong sign of y shows it: of this channel alone, or of a plate
    whose moment about the vertical is `mirrored` as well.
    """
    arm = plate.centre_of_pressure - CENTRE
    whole = (plate.free_moment + np.cross(arm, plate.force))[:, 2]
    force = plate.force * MIRROR
    free = plate.free_moment.copy()
    rest = np.cross(arm, force)[:, 2]
    free[:, 2] = np.nan_to_num((-whole if mirrored else whole) - rest)
    return replace(plate, force=force, free_moment=free)


@pytest.mark.parametrize("mirrored", [True, False])
@pytest.mark.parametrize("side", [-0.08, 0.08])
def test_a_force_with_the_wrong_sign_is_turned_and_the_free_moment_follows(side, mirrored):
    true = step(side)
    read = misread(true, mirrored=mirrored)
    assert not np.allclose(read.free_moment, true.free_moment, atol=1.0)
    recording = Recording("walk.c3d", "laboratory", (), np.empty((6, 0, 3)), 100.0, plates=(read,))
    (found,) = with_stated_plates(recording, [("1", "y")]).plates
    assert np.allclose(found.force, true.force)
    assert np.allclose(found.free_moment, true.free_moment, atol=1e-9)
    assert np.array_equal(found.centre_of_pressure, true.centre_of_pressure, equal_nan=True)


def test_without_corners_the_free_moment_is_reversed():
    plate = replace(step(0.08), corners=np.full((4, 3), np.nan))
    recording = Recording("walk.mot", "laboratory", (), np.empty((6, 0, 3)), 100.0, plates=(plate,))
    (found,) = with_stated_plates(recording, [("1", "y")]).plates
    assert np.array_equal(found.free_moment, -plate.free_moment)


def test_a_plate_that_is_not_there_is_named():
    recording = Recording(
        "walk.c3d", "laboratory", (), np.empty((6, 0, 3)), 100.0, plates=(step(0.0),)
    )
    with pytest.raises(RecordError, match=r"--plate 3=y: there is no such plate"):
        with_stated_plates(recording, [("3", "y")])


def test_a_plate_that_is_said_to_be_of_both_feet_is_refused():
    recording = Recording("a.c3d", "laboratory", (), np.empty((6, 0, 3)), 100.0, plates=(step(0),))
    with pytest.raises(RecordError, match="--plate 1=right and --plate 1=left"):
        with_stated_plates(recording, [("1", "left"), ("1", "right")])
    found = with_stated_plates(recording, [("1", "left"), ("1", "left")])
    assert found.plates[0].foot == "left"


def test_an_axis_that_is_said_twice_is_turned_once():
    recording = Recording(
        "walk.c3d", "laboratory", (), np.empty((6, 0, 3)), 100.0, plates=(step(0.1),)
    )
    once, twice = (
        with_stated_plates(recording, [("1", "y")] * times).plates[0].force for times in (1, 2)
    )
    assert np.array_equal(once, twice)
    assert not np.array_equal(once, recording.plates[0].force)
