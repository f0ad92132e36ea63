"""Markers that are not on the body are named and left out, and no others."""

import numpy as np
import pytest

from gaitval.errors import RecordWarning
from gaitval.mocap.lost_markers import leave_out_lost, without_fill_values
from gaitval.mocap.reading import read_recording
from gaitval.mocap.recording import Recording
from gaitval.mocap.trc_writing import write_trc

RATE = 100.0
PLACES = {
    "heel": (0.0, 0.0, 0.03), "mt1": (0.2, 0.05, 0.03), "mt5": (0.17, -0.05, 0.03),
    "shank1": (0.05, 0.0, 0.3), "shank2": (0.05, 0.05, 0.25), "shank3": (0.0, 0.0, 0.2),
}  # fmt: skip
SEGMENTS = {name: "shank_r" if "shank" in name else "foot_r" for name in PLACES}


def walked(seconds: float = 4.0, *, belt: bool = False, noise: float = 2e-4) -> Recording:
    """A foot and a shank that swing forward once a second, the foot bending at its heads."""
    time = np.arange(int(seconds * RATE)) / RATE
    swing = np.clip((time % 1.0 - 0.6) / 0.4, 0, 1)
    ahead = np.floor(time) + 0.5 * (1 - np.cos(np.pi * swing))
    ahead = 1.2 * (ahead - time if belt else ahead)
    pitch = 0.6 * np.sin(np.pi * swing)
    markers = np.empty((len(time), len(PLACES), 3))
    for i, place in enumerate(PLACES.values()):
        x, y, z = place
        markers[:, i, 0] = ahead + x * np.cos(pitch) + z * np.sin(pitch)
        markers[:, i, 1] = y
        markers[:, i, 2] = z * np.cos(pitch) - x * np.sin(pitch) + 0.15 * np.sin(np.pi * swing)
    markers += np.random.default_rng(0).normal(0.0, noise, markers.shape)
    return Recording("walk.trc", "project", tuple(PLACES), markers, RATE)


def found_in(recording: Recording, segments=SEGMENTS):
    markers = recording.markers.copy()
    return leave_out_lost(recording, markers, segments), markers


@pytest.mark.parametrize("belt", [True, False])
@pytest.mark.parametrize("noise", [0.0, 2e-4, 2e-3])
def test_a_sound_walk_loses_nothing(belt, noise):
    findings, _ = found_in(walked(belt=belt, noise=noise))
    assert findings == []


LOST = {
    "held": lambda path, at, others: path.__setitem__(slice(at, None), path[at - 1]),
    "on the floor": lambda path, at, others: path.__setitem__(
        slice(at, None),
        np.array([path[at - 1, 0], 0.3, 0.01])
        + np.random.default_rng(1).normal(0, 2e-4, (len(path) - at, 3)),
    ),
    "another's place": lambda path, at, others: path.__setitem__(slice(at, None), others[at:]),
    "a reflection": lambda path, at, others: path.__setitem__(
        slice(at, None), path[at:] + np.array([0.4, 0.3, 0.6])
    ),
    "far away": lambda path, at, others: path.__setitem__(slice(at, None), (17.0, 3.0, 0.0)),
}


@pytest.mark.parametrize("what", LOST)
@pytest.mark.parametrize("belt", [True, False])
@pytest.mark.parametrize("at", [210, 300])
def test_a_lost_marker_is_named_and_left_out_from_there_on(what, belt, at):
    recording = walked(belt=belt)
    heel, shank = (recording.names.index(name) for name in ("heel", "shank1"))
    LOST[what](recording.markers[:, heel], at, recording.markers[:, shank])
    (found,), markers = found_in(recording)
    assert found.names == ("heel",)
    assert found.kind == "lost"
    # In stance a marker that stays where it is, is in its place still.
    assert at - 2 <= found.first <= at + 80
    assert found.last == len(markers) - 1
    assert np.isnan(markers[found.first :, heel]).all()
    rest = np.arange(len(PLACES)) != heel
    np.testing.assert_array_equal(markers[:, rest], recording.markers[:, rest])


def test_a_marker_that_comes_back_is_left_out_until_then():
    recording = walked(belt=True)
    heel = recording.names.index("heel")
    recording.markers[165:190, heel] = recording.markers[164, heel]
    (found,), markers = found_in(recording)
    assert 164 <= found.first <= 172
    assert 188 <= found.last <= 192
    assert np.isfinite(markers[195:, heel]).all()


def test_one_marker_beside_it_is_enough_with_the_steadiest_of_another_segment():
    recording = walked(belt=True)
    names = ["heel", "mt1", "shank1", "shank2", "shank3"]
    fewer = recording.with_markers(names, recording.columns(names))
    fewer.markers[200:, 0] = fewer.markers[199, 0]
    (found,), _ = found_in(fewer)
    assert found.names == ("heel",)
    assert found_in(recording.with_markers(names, recording.columns(names)))[0] == []


@pytest.mark.parametrize("value", [9.999, -0.001, 32.767, 9999.0])
def test_fill_values_are_gaps(tmp_path, value):
    recording = walked()
    recording.markers[100:112, 0] = value
    with pytest.warns(RecordWarning, match="heel: in 12 frames"):
        filled = without_fill_values(recording)
    assert np.isnan(filled.markers[100:112, 0]).all()
    assert np.isfinite(np.delete(filled.markers[:, 0], np.arange(100, 112), axis=0)).all()
    if value < 100.0:
        write_trc(tmp_path / "a.trc", recording)
        with pytest.warns(RecordWarning, match="read as gaps"):
            read = read_recording(tmp_path / "a.trc")
        assert np.isnan(read.markers[100:112, 0]).all()


def test_a_place_on_the_diagonal_is_no_fill_value():
    recording = walked()
    recording.markers[50, 0] = 0.1
    assert without_fill_values(recording) is recording


def test_a_foot_marker_that_dangles_is_lost():
    """It hangs a decimetre off its place and swings with the foot; a thigh's skin moves more."""
    recording = walked(belt=True)
    heel = recording.names.index("heel")
    time = np.arange(200) / RATE
    recording.markers[200:, heel] += np.stack(
        [-0.1 + 0.03 * np.sin(9 * time), 0.09 * np.sin(14 * time), 0.0 * time - 0.02], axis=1
    )
    (found,), _ = found_in(recording)
    assert found.names == ("heel",)
    assert 200 <= found.first <= 230
    assert found.last == len(recording.markers) - 1


def test_a_fall_is_left_out_from_its_beginning():
    """On its way down the knee marker passes by other markers of the leg."""
    walk = walked()
    markers = walk.markers.copy()
    number = walk.names.index("shank1")
    fall = np.maximum(markers[200, number, 2] - 4.9 * (np.arange(200) / RATE) ** 2, 0.01)
    markers[200:, number, :2] = markers[200, number, :2]
    markers[200:, number, 2] = fall + np.random.default_rng(2).normal(0, 2e-4, 200)
    (found,), kept = found_in(Recording("walk.trc", "project", walk.names, markers, RATE))
    assert found.names == ("shank1",)
    assert 196 <= found.first <= 210
    assert np.isnan(kept[210:, number]).all()


@pytest.mark.parametrize("belt", [True, False])
@pytest.mark.parametrize("what", ["held", "on the floor", "far away"])
def test_the_only_marker_of_a_segment_is_judged_by_the_steadiest_of_others(what, belt):
    """As that of the toes, which have one."""
    recording = walked(belt=belt)
    segments = SEGMENTS | {"mt5": "toes_r"}
    assert found_in(recording, segments)[0] == []
    toe, shank = (recording.names.index(name) for name in ("mt5", "shank1"))
    LOST[what](recording.markers[:, toe], 210, recording.markers[:, shank])
    findings, markers = found_in(recording, segments)
    assert {found.names for found in findings} == {("mt5",)}
    assert np.isnan(markers[215:, toe]).all()
    assert np.isfinite(markers[:150, toe]).all()
