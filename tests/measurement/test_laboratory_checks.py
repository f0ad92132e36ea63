"""Cameras that are not level."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from gaitval.coordinates import Side
from gaitval.findings import look
from gaitval.findings.laboratory import Laboratory, floor_slope
from gaitval.mocap.recording import Event, Recording

RATE = 100.0
LANDMARKS = {f"{side}.{at}": f"{side}{at}" for side in "RL" for at in ("Heel", "MT1", "MT5")}
STRIDE, STEP = 1.2, 0.6
"""m and s."""


def walk(belt: float = 0.0) -> tuple[Recording, list[Event]]:
    """Feet that stand flat for a step, and swing for another; on a belt they are carried back."""
    time = np.arange(round(4.8 * RATE)) / RATE
    markers, events = [], []
    for side, first in (("R", 0.0), ("L", STEP)):
        into = (time - first) / (2 * STEP)
        count, share = np.floor(into), into % 1.0
        swing = np.clip(2.0 * share - 1.0, 0.0, 1.0)
        forward = STRIDE * (count + swing) - belt * time
        up = 0.1 * np.sin(np.pi * swing)
        for at, ahead, high in (("Heel", 0.0, 0.04), ("MT1", 0.18, 0.02), ("MT5", 0.15, 0.02)):
            across = (-0.1 if side == "R" else 0.1) + (0.03 if at == "MT1" else 0.0)
            markers.append(
                np.stack([forward + ahead, np.full_like(time, across), high + up], axis=1)
            )
        for n in range(-1, 5):
            strike = first + 2 * STEP * n
            whose: Side = "right" if side == "R" else "left"
            events.append(Event(strike, whose, "heel_strike"))
            events.append(Event(strike + STEP, whose, "toe_off"))
    events = sorted((e for e in events if 0 <= e.time <= time[-1]), key=lambda e: e.time)
    names = tuple(LANDMARKS.values())
    return Recording("walk.c3d", "project", names, np.stack(markers, axis=1), RATE), events


@pytest.mark.parametrize("belt", [0.0, STRIDE / (2 * STEP)])
@pytest.mark.parametrize("degrees", [0.0, 1.6, -1.6])
def test_cameras_that_are_not_level_are_named(belt, degrees):
    """Turned about the left, the way ahead falls."""
    recording, events = walk(belt)
    turn = Rotation.from_rotvec([0.0, np.radians(degrees), 0.0]).as_matrix()
    tilted = replace(recording, markers=recording.markers @ turn.T)
    slope = floor_slope(tilted, events, LANDMARKS, belt)
    assert slope is not None
    assert np.degrees(slope.value) == pytest.approx(-degrees, abs=0.05)
    flags = look(Laboratory(slope, belt, belt)).flags
    assert len(flags) == (degrees != 0.0)
    for flag in flags:
        assert flag.value == pytest.approx(1.6, abs=0.05)
        assert "1.6 ±" in flag.message
        assert ("falls" if degrees > 0.0 else "rises") in flag.message


def test_a_stance_that_was_cut_off_hides_no_tilt():
    """Its foot, which is no longer down, moves otherwise than the belt."""
    belt = STRIDE / (2 * STEP)
    recording, events = walk(belt)
    turn = Rotation.from_rotvec([0.0, np.radians(1.6), 0.0]).as_matrix()
    markers = recording.markers.copy()
    last = recording.time > 3.6
    markers[last, 1] += (recording.time[last, None] - 3.6) * [0.3, 0.0, -0.4]
    tilted = replace(recording, markers=markers @ turn.T)
    slope = floor_slope(tilted, events, LANDMARKS, belt)
    assert slope is not None
    assert np.degrees(slope.value) == pytest.approx(-1.6, abs=0.1)
    assert look(Laboratory(slope, belt, belt)).flags


def test_one_place_shows_no_slope():
    recording, events = walk()
    assert floor_slope(recording, events[:2], LANDMARKS, 0.0) is None
