"""Markers that are loose or wrongly filled in are said; sound ones are not."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.interpolate import CubicSpline

from gaitval.findings import look
from gaitval.findings.markers import AsRead, Walking
from gaitval.mocap.recording import Recording


def filled_warnings(recording, segments):
    return [each for each in look(AsRead(recording, segments)).flags if each.check == "filled gap"]


def loose_warnings(recording, segments):
    return look(Walking(recording, segments)).flags


SET = {"a": "foot_r", "b": "foot_r", "c": "foot_r", "d": "torso", "e": "torso"}


def foot():
    """Three markers of a foot and two of the trunk, with the noise of cameras, at 100 Hz."""
    time = np.arange(400) / 100.0
    markers = np.random.default_rng(3).normal(0.0, 1e-4, (400, 5, 3))
    markers += np.array([[0.0, 0, 0], [0.2, 0, 0], [0.1, 0.1, 0], [0, 0, 1.0], [0, 0.3, 1.0]])
    markers[..., 0] += (1.2 * time + 0.2 * np.sin(6 * time))[:, None]
    markers[..., 2] += 0.1 * np.clip(np.sin(6 * time), 0.0, None)[:, None]
    return Recording("walk", "project", tuple("abcde"), markers, 100.0)


@pytest.mark.parametrize(("size", "number", "found"), [
    (0.006, 1, ["b"]), (0.001, 1, []), (0.02, 3, []),
])  # fmt: skip
def test_a_marker_that_shakes_on_its_segment(size, number, found):
    recording = foot()
    shake = size * np.sin(2 * np.pi * 9.0 * recording.time)
    recording.markers[:, number] += shake[:, None] * [1.0, 0.5, 0.5]
    assert [flag.where for flag in loose_warnings(recording, SET)] == found


def test_a_marker_that_the_cameras_scatter_shakes():
    recording = foot()
    recording.markers[:, 1] += np.random.default_rng(1).normal(0.0, 0.006, (400, 3))
    assert [flag.where for flag in loose_warnings(recording, SET)] == ["b"]


def test_of_two_markers_either_may_shake():
    recording = foot()
    recording.markers[:, 1, 0] += 0.006 * np.sin(2 * np.pi * 9.0 * recording.time)
    alone = replace(recording, names=("a", "b"), markers=recording.markers[:, :2])
    assert [flag.where for flag in loose_warnings(alone, SET)] == ["a or b"]


def filled(frames, number=1):
    """A gap of a marker, filled by a cubic spline of the path before and after it."""
    recording = foot()
    time = np.arange(400)
    known = np.r_[105:110, 110 + frames : 115 + frames]
    spline = CubicSpline(known, recording.markers[known, number])
    recording.markers[110 : 110 + frames, number] = spline(time[110 : 110 + frames])
    return recording


@pytest.mark.parametrize(("frames", "found"), [(40, ["b"]), (20, []), (8, [])])
def test_a_spline_that_left_its_segment(frames, found):
    """A short one is near the path that it replaces."""
    assert [flag.where for flag in filled_warnings(filled(frames), SET)] == found


def test_the_only_marker_of_a_segment_is_said_if_its_fill_is_long():
    assert [f.where for f in filled_warnings(filled(40, 3), SET | {"d": "pelvis"})] == ["d"]
    assert not [*filled_warnings(filled(20, 3), SET | {"d": "pelvis"})]
    pair = {"d": "pelvis", "e": "pelvis"}
    assert [f.where for f in filled_warnings(filled(40, 3), SET | pair)] == ["d"]


def test_paths_that_were_seen_are_no_fills():
    recording = foot()
    recording.markers[100:150] = recording.markers[100]  # at rest
    assert not [*filled_warnings(recording, SET)]
