"""Faults of measurements that were silent: each is said, and sound ones are not."""

import numpy as np
import pytest

from gaitval.findings import look
from gaitval.findings.markers import AsRead, fall_of_markers
from gaitval.findings.plates import Plates
from gaitval.gait.filters import low_pass
from gaitval.mocap.recording import Plate, Recording


def channel_warnings(plate, rate):
    return look(Plates((plate,), rate, {}, {})).flags


def unloaded_warnings(plate, rate):
    flags = look(Plates((plate,), rate, {plate.name: 1}, {})).flags
    return [each for each in flags if each.check == "unloaded plate"]


def smoothed_warnings(walk):
    return [each for each in look(AsRead(walk, {})).flags if each.check == "smoothed markers"]


def checks(warnings):
    return [each.check for each in warnings]


def plate(least: float) -> Plate:
    """Four stances on a plate at 500 Hz, with forces below `least` N set to zero."""
    time = np.arange(3000) / 500.0
    up = 700.0 * np.clip(np.sin(np.pi * (time % 1.5) / 0.7), 0.0, None) * (time % 1.5 < 0.7)
    force = np.stack([0.2 * up * np.sin(6 * time), 0.05 * up, up], axis=1)
    force[up < least] = 0.0
    point = np.tile([0.5, 0.1, 0.0], (len(time), 1)) + np.sin(time)[:, None] * [0.1, 0.05, 0.0]
    corners = np.full((4, 3), np.nan)
    return Plate("1", corners, force, point, np.zeros_like(force))


@pytest.mark.parametrize(
    ("first", "last", "message"),
    [(0.0, 60.0, True), (-40.0, -40.0, True), (0.0, 8.0, False), (0.0, 0.0, False)],
)
def test_a_plate_that_shows_a_force_between_the_steps_is_said(first, last, message):
    one = plate(0.0)
    one.force[:, 2] += np.linspace(first, last, len(one.force))
    found = [*unloaded_warnings(one, 500.0)]
    assert checks(found) == ["unloaded plate"] * message
    assert all((", and drifts" in str(each)) == (first != last) for each in found)


@pytest.mark.parametrize("seconds", [0.0, 0.04, 0.3])
def test_a_gap_that_was_filled_by_a_straight_line_is_said(seconds):
    time = np.arange(400) / 100.0
    markers = np.random.default_rng(0).normal(0.0, 1e-4, (400, 5, 3)) + np.arange(5)[:, None]
    markers[..., 0] += np.sin(6 * time)[:, None] * 0.2 + time[:, None]
    count = round(100 * seconds)
    line = np.linspace(0.0, 1.0, count + 2)[:, None]
    ends = markers[100, 2], markers[101 + count, 2]
    markers[100 : 102 + count, 2] = ends[0] + line * (ends[1] - ends[0])
    recording = Recording("a", "laboratory", tuple("abcde"), markers, 100.0)
    warnings = [each for each in look(AsRead(recording, {})).flags if each.check == "filled gap"]
    assert [each.where for each in warnings] == (["c"] if seconds > 0.1 else [])


@pytest.mark.parametrize(
    ("cutoff", "rate", "message"),
    [(None, 100.0, False), (6.0, 100.0, False), (3.0, 100.0, True), (1.5, 200.0, True),
     (1.5, 40.0, False)],
)  # fmt: skip
def test_markers_that_were_low_passed_are_said(cutoff, rate, message):
    """Harmonics of a stride of 1 s that fall as people's do: by 2.4 octaves from 4 to 8 Hz."""
    time = np.arange(round(4.0 * rate)) / rate
    order = np.arange(1, 19)[:, None, None]
    phase = np.random.default_rng(2).uniform(0.0, 6.3, (18, 1, 9))
    path = (order**-3.75 * np.sin(2.0 * np.pi * order * time[:, None] + phase)).sum(axis=0)
    if cutoff is not None:
        path = low_pass(path, rate=rate, cutoff_hz=cutoff)
    markers = path.reshape(len(time), 3, 3)
    walk = Recording("walk", "laboratory", ("a", "b", "c"), markers, rate)
    found = [*smoothed_warnings(walk)]
    assert checks(found) == ["smoothed markers"] * message
    if cutoff is None:
        assert fall_of_markers(walk) == pytest.approx(-2.4, abs=0.3)
    markers[5, :, :] = np.nan
    assert np.isnan(fall_of_markers(walk))
