"""What the model markers change with, against differences of forward kinematics."""

import numpy as np
import pytest
from marked_walk import moving_walk, spread_markers

from gaitval.inverse.marked_body import place
from gaitval.inverse.model_fit_solver import _derivatives
from gaitval.inverse.pose_solver import moved
from gaitval.inverse.segment_lengths import LENGTH_SD, joint_shifts
from gaitval.model.body import SEGMENTS
from gaitval.model.tree import segment_frames, tree_arrays


@pytest.mark.parametrize("seed", range(2))
def test_the_derivatives_are_those_of_the_model_markers(seed):
    random = np.random.default_rng(seed)
    model, _ = moving_walk()
    markers = spread_markers(model)
    tree = tree_arrays(model)
    shifts = joint_shifts()
    segment = np.array([SEGMENTS.index(m.segment) for m in markers])
    places = np.array([m.position for m in markers])
    pose = random.uniform(-0.9, 0.9, (1, 31))

    def points(pose, lengths):
        out = np.empty((1, len(markers), 3))
        place(tree.joint_position + shifts @ lengths, segment, places, pose, out)
        return out

    zero = np.zeros(len(LENGTH_SD))
    at = points(pose, zero)
    by_place = np.empty((1, len(markers), 3, 3))
    by_pose = np.zeros((1, len(markers), 3, 31))
    by_length = np.zeros((1, len(markers), 3, len(LENGTH_SD)))
    _derivatives(tree.joint_position, shifts, segment, pose, at, by_place, by_pose, by_length)
    h = 1e-6
    wide = np.full(31, np.inf)
    for j in range(31):
        ends = np.empty((2, 1, 31))
        for end, sign in zip(ends, (1, -1), strict=True):
            moved(pose[0], sign * h * np.eye(31)[j], -wide, wide, end[0])
        numeric = (points(ends[0], zero) - points(ends[1], zero)) / (2 * h)
        np.testing.assert_allclose(by_pose[..., j], numeric, atol=1e-8)
    for k in range(len(LENGTH_SD)):
        step = h * np.eye(len(LENGTH_SD))[k]
        numeric = (points(pose, step) - points(pose, -step)) / (2 * h)
        np.testing.assert_allclose(by_length[..., k], numeric, atol=1e-8)
    frames = segment_frames(model, pose)[:, segment]
    np.testing.assert_allclose(by_place, frames[..., :3, :3], atol=1e-12)
