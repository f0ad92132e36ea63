"""Lengths of a leg as sums of parameters, and what joint centres cannot tell of these."""

import numpy as np
import pytest

from gaitval.coordinates import COORDINATES
from gaitval.identification.combinations import lengths
from gaitval.identification.prior import prior_sd
from gaitval.identification.verdicts import IDENTIFIED
from gaitval.model.body import SEGMENTS
from gaitval.model.parameters import PARAMETERS, apply_parameters, nominal_parameters
from gaitval.model.tree import ROOT_DOFS, segment_frames
from gaitval.scaling.scaling import scale_subject
from gaitval.subjects.subject_file import load_subject

SUBJECT = load_subject("S05")
MODEL = scale_subject(SUBJECT).model


def test_lengths_are_the_slopes_of_distances_in_the_body():
    """Of straight legs, mean of both sides, by every parameter."""

    def heights(mu):
        frames = segment_frames(apply_parameters(MODEL, mu), np.zeros((1, len(COORDINATES))))[0]
        return [
            np.mean([frames[SEGMENTS.index(f"{name}_{side}"), 2, 3] for side in "rl"])
            for name in ("thigh", "shank", "foot")
        ]

    nominal, step = nominal_parameters(), 1e-3
    slopes = np.array(
        [
            (np.array(heights(nominal + each)) - heights(nominal - each)) / (2.0 * step)
            for each in step * np.eye(len(PARAMETERS))
        ]
    )
    hip, knee, ankle = slopes.T
    reach, thigh, shank = lengths(MODEL)[1:]
    for found, slope in ((reach, hip - ankle), (thigh, hip - knee), (shank, knee - ankle)):
        np.testing.assert_allclose(found.weights, slope, atol=1e-9)


def places(mu, poses):
    """Of all joints and of the sole in these poses, m, in one row."""
    body = apply_parameters(MODEL, mu)
    frames = segment_frames(body, poses)[:, :, :3]
    ground = [
        frames[:, SEGMENTS.index(each.segment)] @ np.append(each.position, 1.0)
        for each in body.spheres
    ]
    return np.concatenate([frames[..., 3].ravel(), np.ravel(ground)])


@pytest.mark.parametrize("scaled_by", ["markers", "stature"])
def test_places_of_joints_in_any_pose_tell_all_lengths_and_offsets_but_two_sums(scaled_by):
    subject = SUBJECT if scaled_by == "markers" else SUBJECT.model_copy(update={"markers": {}})
    poses = np.zeros((20, len(COORDINATES)))
    poses[:, ROOT_DOFS:] = np.random.default_rng(0).uniform(-0.5, 0.5, poses[:, ROOT_DOFS:].shape)
    mu, step = nominal_parameters(), 1e-4
    slopes = np.stack([(places(mu + each, poses) - places(mu - each, poses)) / (2 * step)
                       for each in step * np.eye(len(mu))], axis=1)  # fmt: skip
    sizes = prior_sd(subject)
    _, values, rows = np.linalg.svd(slopes * sizes)
    # damping, friction, and what a thigh and a shank are longer while knee and ankle are higher
    unseen = rows[values < 1e-6 * values[0]]
    left = dict(zip(PARAMETERS, np.sqrt(np.sum(unseen**2, axis=0)), strict=True))
    assert len(unseen) == 4
    pairs = {"damping", "friction", "thigh_length", "knee_z", "shank_length", "ankle_z"}
    assert {name for name, each in left.items() if each > 1e-6} == pairs
    # so however well joints are found, neither of a pair is identified
    assert min(left[name] for name in pairs) > IDENTIFIED
