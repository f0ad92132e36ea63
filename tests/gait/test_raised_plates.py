"""Plates that are above both feet all the time are no floor."""

from dataclasses import replace

import numpy as np
import pytest
from synthetic_recording import BELTS, LANDMARKS, walk

from gaitval.gait.raised_plates import without_raised
from gaitval.mocap.recording import Plate

SURFACE = np.array([[0.6, 1.0, 0.0], [0.6, -1.0, 0.0], [0.5, -1.0, 0.0], [0.5, 1.0, 0.0]])
WALK = walk(plates=BELTS, belt=1.2)


def raised(height: float, *, corners: bool) -> Plate:
    count = len(WALK.force_time)
    force = np.zeros((count, 3)) + [-40.0, 5.0, 0.0] + np.sin(np.arange(count) / 50.0)[:, None]
    point = np.tile([0.55, 0.1, height], (count, 1))
    placed = SURFACE + np.array([0.0, 0.0, height]) if corners else np.full((4, 3), np.nan)
    return Plate("rail", placed, force, point, np.zeros_like(force))


@pytest.mark.parametrize("corners", [True, False])
@pytest.mark.parametrize(("height", "left_out"), [(0.9, True), (0.5, True), (0.17, False)])
def test_what_no_foot_reaches_is_a_rail_or_a_seat(height, left_out, corners):
    """A step of a staircase is lower."""
    given = replace(WALK, plates=(*WALK.plates, raised(height, corners=corners)))
    found, flags = without_raised(given, LANDMARKS)
    assert [plate.name for plate in found.plates] == [
        *(plate.name for plate in WALK.plates),
        *([] if left_out else ["rail"]),
    ]
    assert [flag.plate for flag in flags] == (["rail"] if left_out else [])
    assert all("aid = 'rail'" in flag.message for flag in flags)
    assert without_raised(given, LANDMARKS, aid="rail")[1] == ()


@pytest.mark.parametrize(("height", "up"), [(0.0, 0.0), (0.17, 300.0)])
def test_what_lies_on_the_floor_or_carries_somebody_is_a_plate(height, up):
    """A dead vertical channel is said of a plate; a step carries whoever climbs it."""
    plate = raised(height, corners=False)
    plate.force[:, 2] += up
    found, flags = without_raised(replace(WALK, plates=(plate,)), LANDMARKS)
    assert (len(found.plates), len(flags)) == (1, 0)


def test_the_plates_of_a_treadmill_stay():
    found, flags = without_raised(WALK, LANDMARKS)
    assert found.plates == WALK.plates
    assert not flags


def test_a_plate_whose_place_nothing_tells_stays():
    still = replace(raised(0.9, corners=False), force=np.zeros((len(WALK.force_time), 3)))
    given = replace(WALK, plates=(still,))
    assert without_raised(given, LANDMARKS)[0].plates == (still,)
