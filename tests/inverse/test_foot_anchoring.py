"""Feet that rest are kept from sliding, and nothing else changes."""

from dataclasses import replace

import numpy as np
import pytest
from marked_walk import RATE, moving_walk, spread_markers

from gaitval.coordinates import ACTUATED, COORDINATES
from gaitval.kinetics.inverse import foot_anchoring
from gaitval.kinetics.inverse.foot_anchoring import _floor_velocity, _resting, anchored
from gaitval.kinetics.inverse.inverse_kinematics import inverse_kinematics
from gaitval.kinetics.inverse.marked_body import marker_positions

FREE = {name: (-4.0, 4.0) for name in ACTUATED}
BELT = np.array([-0.5, 0.0, 0.0])
STRIDE = 1.0
"""s; in the last 0.4 s of its own stride a foot swings 0.5 m ahead."""
SWING = 0.4


def stepping() -> np.ndarray:
    """Poses of the pelvis (the first three columns) and of the right and the left ankle (T, 9) m,
    of a person who steps along with level feet that stand quite still in between."""
    time = np.arange(240) / RATE
    pelvis = np.column_stack(
        [0.5 * time, 0.02 * np.sin(2 * np.pi * time), 0.01 * np.sin(4 * np.pi * time)]
    )
    feet = []
    for shift, y in ((0.0, -0.09), (0.5, 0.09)):
        stride = time / STRIDE + shift
        swung = np.clip((stride % 1.0 - 1.0 + SWING) / SWING, 0.0, 1.0)
        ahead = swung - np.sin(2 * np.pi * swung) / (2 * np.pi)  # a cycloid
        x = 0.5 * STRIDE * (np.floor(stride) + ahead - shift) + 0.15
        z = 0.05 * (1.0 - np.cos(2 * np.pi * swung))
        feet += [x, np.full_like(x, y), z]
    return np.column_stack([pelvis, *feet])


@pytest.fixture(scope="module")
def walk():
    """A walk whose foot markers wander by 4 mm at 1 Hz, as on skin and shoe."""
    model, _ = moving_walk()
    markers = spread_markers(model, ("pelvis", "foot_r", "foot_l"))
    path = stepping()
    leg = model["shank_r"].joint_position[2] + model["foot_r"].joint_position[2]
    measured = np.empty((len(path), len(markers), 3))
    for i, marker in enumerate(markers):
        start = 3 * ("pelvis", "foot_r", "foot_l").index(marker.segment)
        base = np.array([0.0, 0.0, 0.0 if start else -0.95 * leg])
        measured[:, i] = path[:, start : start + 3] + base + marker.position
    steps = inverse_kinematics(model, markers, measured, ranges=FREE)
    assert np.nanmax(steps.marker_errors) < 0.01  # the legs do reach that far
    markers = spread_markers(model)
    measured = marker_positions(model, markers, steps.positions)
    wander = 0.004 * np.sin(2 * np.pi * np.arange(len(path)) / RATE)
    for i, marker in enumerate(markers):
        if marker.segment.startswith(("foot", "toes")):
            measured[:, i, 0] += wander
            measured[:, i, 1] -= 0.5 * wander
    found = inverse_kinematics(model, markers, measured, ranges=FREE)
    return model, markers, measured, found


def test_resting_feet_slide_less_at_little_cost(walk):
    model, markers, measured, found = walk
    fixed = anchored(model, markers, measured, found, rate=RATE, ranges=FREE)
    np.testing.assert_array_equal(fixed.floor_velocity, np.zeros(3))
    # of the 60 % in which a foot stands, the filter takes a little at either end
    stands = stepping()[:, [5, 8]] == 0.0
    assert (fixed.resting & ~stands).mean() < 0.05
    assert (stands & ~fixed.resting).mean() < 0.10
    assert fixed.sliding_before == pytest.approx(0.002, abs=0.001)
    assert fixed.sliding_after < 0.5 * fixed.sliding_before
    assert fixed.largest_after < fixed.largest_before
    assert fixed.marker_rms_before <= fixed.marker_rms_after < fixed.marker_rms_before + 0.001
    assert fixed.kinematics.converged.all()
    assert fixed.kinematics.names == tuple(m.name for m in markers)
    assert fixed.kinematics.marker_errors.shape == found.marker_errors.shape


def on_a_belt(monkeypatch):
    """The feet move with the belt, as fast as it does to the last digit."""
    monkeypatch.setattr(foot_anchoring, "_floor_velocity", lambda _: BELT)


def test_a_belt_is_found_and_its_motion_is_no_sliding(walk, monkeypatch):
    """The same walk on a treadmill: everything moves backwards with the belt."""
    model, markers, measured, found = walk
    travel = np.outer(np.arange(len(measured)) / RATE, BELT)
    on_belt = measured + travel[:, None]
    poses = inverse_kinematics(model, markers, on_belt, ranges=FREE)
    overground = anchored(model, markers, measured, found, rate=RATE, ranges=FREE)
    guessed = anchored(model, markers, on_belt, poses, rate=RATE, ranges=FREE)
    np.testing.assert_allclose(guessed.floor_velocity, BELT, atol=0.05)
    on_a_belt(monkeypatch)
    given = anchored(model, markers, on_belt, poses, rate=RATE, ranges=FREE)
    np.testing.assert_array_equal(given.resting, overground.resting)
    assert given.sliding_before == pytest.approx(overground.sliding_before, abs=1e-7)
    assert given.sliding_after == pytest.approx(overground.sliding_after, abs=1e-7)
    np.testing.assert_allclose(
        given.kinematics.positions[:, 6:], overground.kinematics.positions[:, 6:], atol=1e-6
    )


def test_a_belt_may_run_aside_but_never_up():
    """Feet that hardly sink or rise, 5 cm/s, move with the floor along it."""
    level = np.tile([-1.2, 0.15, 0.05], (50, 3, 1))
    np.testing.assert_array_equal(_floor_velocity((level, level)), [-1.2, 0.15, 0.0])
    aside = np.tile([0.0, 0.15, 0.09], (50, 3, 1))
    np.testing.assert_array_equal(_floor_velocity((aside, aside)), [0.0, 0.15, 0.0])
    still = np.tile([0.07, 0.06, 0.09], (50, 3, 1))  # 9 cm/s along the floor
    np.testing.assert_array_equal(_floor_velocity((still, still)), 0.0)
    turning = level + np.array([[0.2], [-0.2], [0.0]]) * [1.0, 0.0, 0.0]
    np.testing.assert_array_equal(_floor_velocity((turning, turning)), 0.0)


def test_a_foot_that_is_slow_for_less_than_a_tenth_of_a_second_does_not_rest():
    moving = np.ones((60, 2, 3))
    moving[5:14] = 0.0  # 0.09 s at 100 Hz
    moving[30:40] = 0.0
    resting = _resting((moving, np.ones((60, 2, 3))), np.zeros(3), 100.0)
    np.testing.assert_array_equal(np.flatnonzero(resting[:, 0]), np.arange(30, 40))
    assert not resting[:, 1].any()


def test_feet_that_never_rest_leave_the_motion_as_it_was(walk, monkeypatch):
    model, markers, measured, _ = walk
    time = np.arange(len(measured)) / RATE
    skating = measured + np.outer(0.5 * np.sin(2 * np.pi * time), [0.0, 1.0, 0.0])[:, None]
    poses = inverse_kinematics(model, markers, skating, ranges=FREE)
    on_a_belt(monkeypatch)
    fixed = anchored(model, markers, skating, poses, rate=RATE, ranges=FREE)
    assert not fixed.resting.any()
    assert np.isnan(fixed.sliding_before)
    assert np.isnan(fixed.sliding_after)
    np.testing.assert_allclose(fixed.kinematics.positions, poses.positions, atol=1e-7)


def test_the_motion_does_not_jump_where_an_anchor_begins_or_ends(walk):
    model, markers, measured, found = walk
    fixed = anchored(model, markers, measured, found, rate=RATE, ranges=FREE)
    change = fixed.kinematics.positions - found.positions
    edge = np.flatnonzero(np.abs(np.diff(fixed.resting.astype(int), axis=0)).any(axis=1))
    at_edges = np.abs(np.diff(change, axis=0))[edge, 6:].max()
    # A raised cosine of six frames begins with 7 %.
    assert at_edges < 0.1 * np.abs(change[:, 6:]).max()


def test_an_angle_that_no_marker_shows_is_not_made_by_the_anchors(walk):
    model, markers, measured, found = walk
    column = COORDINATES.index("subtalar_angle_r")
    determined, positions = found.determined.copy(), found.positions.copy()
    determined[:, column], positions[:, column] = False, 0.1
    blind = replace(found, determined=determined, positions=positions)
    fixed = anchored(model, markers, measured, blind, rate=RATE, ranges=FREE).kinematics
    assert not fixed.determined[:, column].any()
    np.testing.assert_allclose(fixed.positions[:, column], 0.1)
    assert fixed.determined[:, COORDINATES.index("subtalar_angle_l")].all()
