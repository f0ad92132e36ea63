"""Where feet are on plates: distances, edges, and both on one, at points of known places."""

from dataclasses import replace

import numpy as np
import pytest
from synthetic_recording import BELTS, LANDMARKS, STANCE, STRIDE, strikes, walk

from gaitval.coordinates import SIDES
from gaitval.gait.feet_on_plates import (
    Feet,
    distances_to_feet,
    feet_of,
    over_plate,
    reaches,
    shared_by_both,
)
from gaitval.mocap.recording import Plate

TURN = np.radians(30.0)
ACROSS = np.array([[np.cos(TURN), -np.sin(TURN)], [np.sin(TURN), np.cos(TURN)]])
"""A plate that lies askew: its own first and second axis in the laboratory."""
MIDDLE = np.array([2.0, -1.0, 0.1])
FORWARD, SIDEWAYS = 0.3, 0.2
"""Half its length and width, m."""


def plate(samples=4):
    signs = np.array([[1, 1], [-1, 1], [-1, -1], [1, -1]])
    flat = (signs * [FORWARD, SIDEWAYS]) @ ACROSS.T
    corners = np.column_stack([flat, np.zeros(4)]) + MIDDLE
    none = np.zeros((samples, 3))
    return Plate("1", corners, none, np.full((samples, 3), np.nan), none)


def on_plate(*points):
    """Points (n, 3) of the laboratory from places along the plate's own axes and heights."""
    places = np.array(points, dtype=float)
    return np.column_stack([places[:, :2] @ ACROSS.T, places[:, 2]]) + MIDDLE


def test_points_over_a_plate_whatever_their_height():
    points = on_plate(
        [0.29, 0.19, 0.0], [0.31, 0.0, 0.0], [0.0, 0.21, 0.0], [-0.29, -0.19, 1.0],
        [0.0, -0.21, 0.0], [-0.31, 0.0, 0.0],
    )  # fmt: skip
    points = np.concatenate([points, [[np.nan, 0.0, 0.0]]])[None]
    inside = [[True, False, False, True, False, False, False]]
    assert over_plate(plate(), points).tolist() == inside
    assert over_plate(plate(), points, margin=0.02).tolist() == [[True] * 6 + [False]]
    assert over_plate(plate(), points, margin=-0.02).tolist() == [[False] * 7]


def test_a_foot_may_touch_a_plate_within_2_cm_or_if_part_of_it_is_not_seen():
    near, far, hidden = on_plate([0.315, 0.0, 0.0], [0.325, 0.0, 0.0], [5.0, 0.0, 0.0])
    outline = np.stack([[near, far], [far, far], [far, hidden + np.nan], [far, hidden]])
    assert reaches(plate(), outline).tolist() == [True, False, True, False]
    unknown = replace(plate(), corners=np.full((4, 3), np.nan))
    assert reaches(unknown, outline).tolist() == [True] * 4


SQUARE = np.array([[0.0, 0.0, 0.0], [0.2, 0.0, 0.0], [0.2, 0.1, 0.0], [0.0, 0.1, 0.0]])


@pytest.mark.parametrize(
    ("point", "distance"),
    [((0.1, 0.05), 0.0), ((0.01, 0.09), 0.0), ((0.19, 0.01), 0.0), ((0.25, 0.05), 0.05),
     ((0.1, -0.03), 0.03), ((0.23, 0.14), 0.05), ((-0.06, -0.08), 0.1), ((0.1, 0.17), 0.07)],
)  # fmt: skip
def test_the_distance_to_a_foot_is_that_to_its_outline(point, distance):
    """Points within, beside an edge and beyond a corner of a foot of 20 by 10 cm."""
    pressed = replace(plate(5), centre_of_pressure=np.tile([*point, 0.0], (5, 1)))
    right = np.tile(SQUARE, (5, 1, 1))
    left = right + np.array([0.0, 1.0, 0.0])
    feet = Feet((right, left), (np.ones((5, 4), bool),) * 2, np.ones((5, 2), bool))
    found = distances_to_feet(pressed, feet, 1, 4)
    assert found.shape == (3, 2)
    np.testing.assert_allclose(found[:, 0], distance, atol=1e-9)
    outside = np.hypot(max(-point[0], point[0] - 0.2, 0.0), 1.0 - point[1])
    np.testing.assert_allclose(found[:, 1], outside, atol=1e-9)


def test_markers_in_a_gap_or_in_one_place_leave_the_others():
    pressed = replace(plate(1), centre_of_pressure=np.array([[0.1, -0.03, 0.0]]))
    hidden, doubled = SQUARE.copy(), SQUARE.copy()
    hidden[3] = np.nan
    doubled[3] = doubled[2]
    none = np.full_like(SQUARE, np.nan)
    seen = (np.ones((1, 4), bool),) * 2
    feet = Feet((hidden[None], doubled[None]), seen, np.ones((1, 2), bool))
    np.testing.assert_allclose(distances_to_feet(pressed, feet, 0, 1), [[0.03, 0.03]], atol=1e-9)
    feet = Feet((none[None], doubled[None]), seen, np.ones((1, 2), bool))
    assert np.isnan(distances_to_feet(pressed, feet, 0, 1)).tolist() == [[True, False]]


@pytest.mark.parametrize(("samples", "shared"), [(14, False), (16, True)])
def test_both_feet_are_on_a_plate_from_30_ms_on(samples, shared):
    """At 500 Hz; a foot that is there but not on the ground, or beside it, does not count."""
    on, off = on_plate([0.0, 0.0, 0.0])[0], on_plate([0.0, 0.3, 0.0])[0]
    right = np.tile(on, (60, 2, 1))
    left = np.tile(off, (60, 2, 1))
    left[20 : 20 + samples, 1] = on
    low = np.ones((60, 2), bool)
    feet = Feet((right, left), (low, low), np.ones((60, 2), bool))
    expected = np.zeros(60, bool)
    expected[20 : 20 + samples] = shared
    np.testing.assert_array_equal(shared_by_both(plate(60), feet, 500.0), expected)
    lifted = Feet((right, left), (low, ~low), np.ones((60, 2), bool))
    assert not shared_by_both(plate(60), lifted, 500.0).any()
    unknown = replace(plate(60), corners=np.full((4, 3), np.nan))
    assert shared_by_both(unknown, feet, 500.0).tolist() == [False] * 60


def test_feet_stand_and_are_low_when_the_walk_says_so():
    """A marker is low within 3 cm of its usual lowest height, in stance only."""
    recording = walk(plates=BELTS, belt=1.2, duration=4.0)
    feet = feet_of(recording, LANDMARKS)
    time = recording.force_time
    for column, side in enumerate(SIDES):
        expected = np.zeros(len(time), bool)
        near = np.zeros(len(time), bool)
        for strike in (strikes(side, 5.0) - STRIDE).tolist() + strikes(side, 5.0).tolist():
            expected |= (time >= strike) & (time < strike + STANCE * STRIDE)
            for edge in (strike, strike + STANCE * STRIDE):
                near |= np.abs(time - edge) < 0.06
        near |= (time < 0.5) | (time > 3.5)
        np.testing.assert_array_equal(feet.stance[~near, column], expected[~near])
        assert feet.low[column][expected & ~near].any(axis=1).all(), "the heel may rise"
        assert not feet.low[column][~expected & ~near].any()
        names = [recording.names.index(f"{side[0].upper()}.{each}") for each in ("Heel", "MT1")]
        for name in names:
            shown = np.interp(time, recording.time, recording.markers[:, name, 0])
            away = np.abs(feet.outlines[column][:, :, 0] - shown[:, None]).min(axis=1)
            assert away.max() < 1e-9
