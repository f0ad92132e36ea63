"""The standing trial: part of it, on a step, on the toes, and none at all."""

from dataclasses import replace

import numpy as np
import pytest
from made_up_session import made_up_session
from scipy.spatial.transform import Rotation

from gaitval.configuration import Configuration
from gaitval.coordinates import COORDINATES
from gaitval.errors import RecordError
from gaitval.mocap.reading import read_recording
from gaitval.mocap.recording import Recording
from gaitval.session.importing.importing import work_out
from gaitval.session.read import read_session
from gaitval.session.request import Request
from gaitval.session.standing import standing_places, without_seldom
from gaitval.session.standing_pose import (
    LENGTHS_OF_WALK,
    on_floor,
    standing_in_walk,
    with_level_feet,
)
from gaitval.subjects.sample import copy_sample

SAGITTAL = [
    f"{name}_{side}" for name in ("hip_flexion", "knee_angle", "ankle_angle") for side in "rl"
]


@pytest.fixture(scope="module")
def made_up(tmp_path_factory):
    return made_up_session(tmp_path_factory.mktemp("lab"), noise=0.0)


@pytest.fixture(scope="module")
def processing():
    return Configuration().processing


@pytest.fixture(scope="module")
def stood(made_up, processing):
    return work_out(made_up.request, processing)


@pytest.fixture(scope="module")
def without(made_up, processing):
    request = made_up.request
    changed = {"static": request.trials[0], "knee_width": 0.1, "ankle_width": 0.07}
    return work_out(request.model_copy(update=changed), processing)


@pytest.mark.slow
def test_a_walk_without_a_standing_trial_gives_the_same_body_and_angles(stood, without):
    for side in ("right", "left"):
        one, other = (getattr(found.body.chosen, side) for found in (stood, without))
        assert other.thigh == pytest.approx(one.thigh, abs=0.02)
        assert other.shank == pytest.approx(one.shank, abs=0.02)
    apart = np.degrees(without.trials[0].positions - stood.trials[0].positions)
    for name in SAGITTAL:
        assert abs(np.median(apart[:, COORDINATES.index(name)])) < 5.0
    assert any("no standing trial" in message for _, message in without.decisions)
    assert any("no standing trial" in warning.message for _, warning in without.warnings)


@pytest.mark.slow
def test_a_pose_put_together_stands_on_both_feet(without):
    places = standing_places(without.session.standing)
    assert places["L.Ankle"][1] - places["R.Ankle"][1] > 0.1
    assert abs(places["L.Ankle"][2] - places["R.Ankle"][2]) < 0.02
    assert abs(places["L.Heel"][2] - places["L.MT5"][2]) < 0.06


def trial(markers):
    names = tuple(markers)
    frames = np.array([[markers[name] for name in names]] * 200, dtype=float)
    return Recording("stand.trc", "project", names, frames, 100.0, start=0.0)


def test_a_window_of_the_standing_trial(made_up):
    recording = read_recording(made_up.standing)
    part = recording.between((0.2, 0.5), "static_time")
    assert part.time[0] == pytest.approx(0.2)
    assert part.time[-1] == pytest.approx(0.5)
    with pytest.raises(RecordError, match=r"static_time 90:91: the trial goes from 0 to"):
        recording.between((90.0, 91.0), "static_time")


def test_a_window_without_a_standing_trial_is_refused(made_up, processing):
    changed = {"static": made_up.request.trials[0], "static_time": (0.0, 1.0)}
    request = made_up.request.model_copy(update=changed)
    with pytest.raises(RecordError, match="no standing trial to cut"):
        work_out(request, processing)


@pytest.mark.slow
def test_standing_on_a_step_is_standing_on_the_floor(made_up, stood, processing):
    """A person 30 mm higher, given with floor, has the same body."""
    step = on_floor(stood.session.standing, -0.03)
    np.testing.assert_allclose(
        on_floor(step, 0.03).markers, stood.session.standing.markers, atol=1e-15
    )
    message = work_out(made_up.request.model_copy(update={"floor": 0.01}), processing)
    lower = stood.body.chosen.right.ankle_height - message.body.chosen.right.ankle_height
    assert lower == pytest.approx(0.01, abs=0.003)


@pytest.mark.parametrize("lift", [-15.0, 25.0])
def test_feet_that_are_not_flat_are_put_flat(lift):
    """Heel and forefoot come to one height; lengths within the foot and all else stay."""
    feet = {}
    for side, y in (("R", -0.1), ("L", 0.1)):
        ankle = np.array([0.0, y, 0.12])
        tilt = Rotation.from_euler("y", lift, degrees=True)
        for name, at in (
            ("Heel", [-0.06, 0, -0.08]),
            ("MT1", [0.13, 0, -0.08]),
            ("MT5", [0.1, 0, -0.08]),
        ):
            feet[f"{side}.{name}"] = ankle + tilt.apply(at)
        feet[f"{side}.Ankle"] = ankle
        feet[f"{side}.Knee"] = ankle + np.array([0.0, 0.0, 0.4])
    before = trial(feet)
    after = with_level_feet(before, {name: name for name in feet})
    for side in "RL":
        heights = [after.marker(f"{side}.{name}")[0, 2] for name in ("Heel", "MT1", "MT5")]
        np.testing.assert_allclose(heights, 0.04, atol=1e-3)
        for name in ("Ankle", "Knee"):
            np.testing.assert_array_equal(
                after.marker(f"{side}.{name}"), before.marker(f"{side}.{name}")
            )
        lengths = [
            np.linalg.norm(each.marker(f"{side}.Heel") - each.marker(f"{side}.MT1"), axis=1)
            for each in (before, after)
        ]
        np.testing.assert_allclose(*lengths, atol=1e-12)


@pytest.fixture(scope="module")
def sample(tmp_path_factory, processing):
    tmp_path = tmp_path_factory.mktemp("sample")
    copy_sample(tmp_path)
    request = Request(
        static=tmp_path / "standing.c3d",
        trials=(tmp_path / "walking.c3d",),
        identifier="sample",
        mass=64.95,
        height=1.53,
        sex="F",
    )
    return read_session(request, processing)


def test_a_walk_without_a_whole_stance_gives_a_standing_pose(sample):
    session, walk, marker_set = sample, sample.walking[0], sample.marker_set
    second = round(walk.marker_rate)
    short = replace(walk, markers=walk.markers[2 * second : round(2.9 * second)])
    names = [marker_set.landmarks[f"R.{part}"] for part in ("ASIS", "Knee", "Ankle")]
    lengths = []
    for pose in (session.standing, standing_in_walk(short, marker_set)):
        hip, knee, ankle = (np.median(pose.marker(name), axis=0) for name in names)
        lengths.append((np.linalg.norm(hip - knee), np.linalg.norm(knee - ankle)))
    np.testing.assert_allclose(*lengths, atol=LENGTHS_OF_WALK)


def test_the_pose_of_a_mirrored_walk_is_the_mirrored_pose(sample):
    walk, marker_set = sample.walking[0], sample.marker_set
    sides = {"R": "L", "L": "R"}
    other = [sides.get(name[0], name[0]) + name[1:] for name in walk.names]
    mirrored = replace(walk, names=tuple(other), markers=walk.markers * [1.0, -1.0, 1.0])
    pose, image = (standing_in_walk(each, marker_set) for each in (walk, mirrored))
    for name, of_image in zip(walk.names, other, strict=True):
        there = image.marker(of_image) * [1.0, -1.0, 1.0]
        np.testing.assert_allclose(there, pose.marker(name), atol=1e-6, err_msg=name)


def test_a_marker_that_one_frame_of_twenty_shows_is_left_out_and_said(made_up):
    standing = read_recording(made_up.standing)
    whole = np.tile(standing.markers[:1], (20, 1, 1))
    markers, (ghost, seen) = whole.copy(), (standing.names.index(n) for n in ("R.Heel", "L.Heel"))
    markers[1:, ghost] = np.nan
    markers[2:, seen] = np.nan
    found, (flags, looked) = without_seldom(replace(standing, markers=markers))
    assert [(flag.where, flag.value, flag.limit) for flag in flags] == [("R.Heel", 0.05, 0.1)]
    assert "only 1 of the 20 frames" in flags[0].message
    assert [(row.where, row.kept) for row in looked] == [("R.Heel", False)]
    assert np.isnan(found.marker("R.Heel")).all()
    np.testing.assert_array_equal(found.marker("L.Heel")[:2], whole[:2, seen])
