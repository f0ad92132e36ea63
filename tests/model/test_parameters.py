from dataclasses import replace

import numpy as np
import pytest

from gaitval.configuration import RandomisationSettings
from gaitval.errors import ModelError
from gaitval.model.body import SEGMENTS, Segment
from gaitval.model.parameters import (
    PARAMETERS,
    apply_parameters,
    nominal_parameters,
    parameter_bounds,
)
from gaitval.model.tree import segment_frames
from gaitval.model.urdf import model_hash
from gaitval.scaling.scaling import scale_subject
from gaitval.subjects.subject_file import load_subject

MIRROR = np.array([1.0, -1.0, 1.0])


@pytest.fixture(scope="module")
def model():
    return scale_subject(load_subject("S05")).model


def mu(**values):
    """Nominal mu with some elements changed."""
    changed = nominal_parameters()
    for name, value in values.items():
        changed[PARAMETERS.index(name)] = value
    return changed


def test_mu_has_the_papers_fourteen_elements_in_its_order():
    assert len(PARAMETERS) == len(set(PARAMETERS)) == 14
    assert PARAMETERS[:5] == ("damping", "friction", "foot_length", "shank_length", "thigh_length")
    assert [name.split("_")[0] for name in PARAMETERS[5::3]] == ["ankle", "hip", "knee"]


def test_a_leg_is_as_long_as_its_hip_is_above_its_ankle(model):
    """Of straight legs that differ, the mean of both."""
    segments = [
        replace(each, joint_position=1.1 * each.joint_position) if each.name == "foot_l" else each
        for each in model.segments
    ]
    uneven = replace(model, segments=tuple(segments))
    frames = segment_frames(uneven, np.zeros((1, 31)))[0]
    high, low = (
        np.mean([frames[SEGMENTS.index(f"{name}_{side}"), 2, 3] for side in "rl"])
        for name in ("thigh", "foot")
    )
    assert uneven.leg_length == pytest.approx(high - low)
    assert uneven.leg_length > model.leg_length


def test_nominal_mu_changes_nothing(model):
    same = apply_parameters(model, nominal_parameters())
    for before, after in zip(model.segments, same.segments, strict=True):
        np.testing.assert_array_equal(before.joint_position, after.joint_position)
        np.testing.assert_array_equal(before.centre_of_mass, after.centre_of_mass)
        np.testing.assert_array_equal(before.inertia, after.inertia)
    for before, after in zip(model.spheres, same.spheres, strict=True):
        np.testing.assert_array_equal(before.position, after.position)


def test_nominal_mu_lies_within_the_bounds():
    low, high = parameter_bounds(RandomisationSettings())
    assert low.shape == high.shape == (14,)
    assert np.all(low < nominal_parameters())
    assert np.all(nominal_parameters() < high)


def test_damping_and_friction_do_not_change_the_body(model):
    assert model_hash(apply_parameters(model, mu(damping=1.5, friction=0.6))) == model_hash(model)


@pytest.mark.parametrize(("name", "child"), [("thigh", "shank"), ("shank", "foot")])
def test_length_factor_moves_the_next_joint_and_keeps_mass(model, name, child):
    longer = apply_parameters(model, mu(**{f"{name}_length": 1.03}))
    assert longer.mass == pytest.approx(model.mass, abs=1e-12)
    for side in "rl":
        before, after = model[f"{child}_{side}"], longer[f"{child}_{side}"]
        np.testing.assert_allclose(
            after.joint_position, before.joint_position * [1, 1, 1.03], atol=1e-15
        )
        assert longer[f"{name}_{side}"].centre_of_mass[2] == pytest.approx(
            1.03 * model[f"{name}_{side}"].centre_of_mass[2]
        )
        np.testing.assert_array_equal(after.inertia, before.inertia)


def test_foot_length_stretches_foot_toes_and_spheres_forwards(model):
    longer = apply_parameters(model, mu(foot_length=1.05))
    for before, after in zip(model.spheres, longer.spheres, strict=True):
        np.testing.assert_allclose(after.position, before.position * [1.05, 1, 1], atol=1e-15)
    np.testing.assert_allclose(
        longer["toes_l"].joint_position, model["toes_l"].joint_position * [1.05, 1, 1]
    )
    assert longer["foot_r"].centre_of_mass[0] == pytest.approx(
        1.05 * model["foot_r"].centre_of_mass[0]
    )
    assert longer["foot_r"].centre_of_mass[2] == model["foot_r"].centre_of_mass[2]


def test_stretched_inertia_is_that_of_stretched_points(model):
    # A cloud of points with any second moments; every point moves with the stretch.
    points = np.random.default_rng(0).normal(size=(40, 3)) * [0.03, 0.04, 0.15]
    points -= points.mean(axis=0)

    def inertia(cloud):
        return sum(np.eye(3) * (p @ p) - np.outer(p, p) for p in cloud) / len(cloud)

    index = [segment.name for segment in model.segments].index("thigh_r")
    segments = list(model.segments)
    segments[index] = Segment(
        "thigh_r", np.zeros(3), 1.0, np.array([0.0, 0.0, -0.1]), inertia(points)
    )
    stretched = apply_parameters(replace(model, segments=tuple(segments)), mu(thigh_length=1.2))
    np.testing.assert_allclose(
        stretched["thigh_r"].inertia, inertia(points * [1, 1, 1.2]), rtol=1e-12, atol=1e-15
    )


@pytest.mark.parametrize(
    ("joint", "segment"), [("hip", "thigh"), ("knee", "shank"), ("ankle", "foot")]
)
def test_offsets_move_one_joint_mirrored_left_to_right(model, joint, segment):
    offset = np.array([0.004, 0.006, -0.003])
    moved = apply_parameters(
        model, mu(**{f"{joint}_{axis}": v for axis, v in zip("xyz", offset, strict=True)})
    )
    for after, before in zip(moved.segments, model.segments, strict=True):
        expected = np.zeros(3)
        if after.name[:-2] == segment:
            expected = offset * (MIRROR if after.name.endswith("l") else 1)
        np.testing.assert_allclose(
            after.joint_position - before.joint_position, expected, atol=1e-15
        )
        np.testing.assert_array_equal(after.inertia, before.inertia)


def test_knee_offset_adds_to_the_thigh_length(model):
    changed = apply_parameters(model, mu(thigh_length=1.02, knee_z=-0.005))
    assert changed["shank_r"].joint_position[2] == pytest.approx(
        1.02 * model["shank_r"].joint_position[2] - 0.005
    )


def test_the_given_model_is_left_alone(model):
    before = model_hash(model)
    apply_parameters(model, mu(thigh_length=1.03, hip_y=0.01, foot_length=0.95))
    assert model_hash(model) == before


@pytest.mark.parametrize(
    ("bad", "message"),
    [
        (np.zeros(13), "shape"),
        (mu(friction=np.nan), "finite"),
        (mu(shank_length=0.0), "positive"),
    ],
)
def test_bad_mu_is_refused(model, bad, message):
    with pytest.raises(ModelError, match=message):
        apply_parameters(model, bad)
