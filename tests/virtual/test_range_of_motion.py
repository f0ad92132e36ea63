"""Functional hips of virtual people err as those of living people do, and are of their own body."""

import numpy as np

from gaitval.coordinates import SIDES
from gaitval.datasets.subject_file import load_subject
from gaitval.model.parameters import PARAMETERS, apply_parameters, nominal_parameters
from gaitval.scaling.scaling import scale_subject
from gaitval_virtual import range_of_motion
from gaitval_virtual.range_of_motion import functional_hips

MODEL = scale_subject(load_subject("S05")).model


def errors(body, seed):
    """(2, 4) m: centre and distance to the ankle less the truth."""
    found = functional_hips(body, np.random.default_rng(seed))
    rows = []
    for side in SIDES:
        joints = [body[f"{name}_{side[0]}"].joint_position for name in ("thigh", "shank", "foot")]
        longer = found[side].to_ankle + joints[1][2] + joints[2][2]
        rows.append([*(found[side].found.centre - joints[0]), longer])
    return np.array(rows)


def test_without_skin_and_camera_the_joints_of_another_body_are_found(monkeypatch):
    for name, value in (("_SKIN", {"pelvis": 0.0, "thigh": 0.0}), ("CAMERA_NOISE", 0.0),
                        ("_MALLEOLI", 0.0)):  # fmt: skip
        monkeypatch.setattr(range_of_motion, name, value)
    mu = nominal_parameters()
    mu[PARAMETERS.index("thigh_length")] = 1.05
    mu[PARAMETERS.index("hip_x")] = 0.01
    assert np.abs(errors(apply_parameters(MODEL, mu), 0)).max() < 1e-6


def test_centres_miss_by_13_mm_in_space_as_in_living_people():
    missed = np.concatenate([errors(MODEL, seed) for seed in range(60)])
    assert 0.011 < np.sqrt(np.mean(np.sum(missed[:, :3] ** 2, axis=1))) < 0.016
    assert 0.007 < missed[:, 3].std() < 0.013
