"""The lengths of a body: what moves with them, by geometry, and what stays."""

import numpy as np
import pytest
from marked_walk import moving_walk
from scipy.spatial.transform import Rotation

from gaitval.errors import ScalingError
from gaitval.kinetics.inverse.segment_lengths import (
    LENGTH_SD,
    joint_shifts,
    length_precision,
    lengths_of,
    skin_shifts,
    with_lengths,
)
from gaitval.model.body import SEGMENTS
from gaitval.model.markers import ModelMarker


@pytest.mark.parametrize("side", ["r", "l"])
def test_skin_stays_where_it_is_when_the_standing_trials_joints_move(side):
    """The places that standing gives on a body with other joints, by geometry: the thigh's frame
    has its origin at the hip and its z from the knee, and the skin does not move."""
    model, _ = moving_walk()
    hip = model[f"thigh_{side}"].joint_position
    knee = hip + model[f"shank_{side}"].joint_position
    down = np.linspace(0.0, 1.0, 5)[:, None]
    skin = hip + down * (knee - hip)  # along the thigh, seen from the pelvis as it was
    markers = [ModelMarker(f"{i}", f"thigh_{side}", at - hip) for i, at in enumerate(skin)]
    markers.append(ModelMarker("asis", "pelvis", np.array([0.08, 0.1, 0.07])))
    names = list(LENGTH_SD)
    coupling = skin_shifts(model, markers)
    outwards = -1.0 if side == "r" else 1.0
    for change in (
        {"hip_up": 0.01, "thigh": 0.01},
        {"hip_forward": 0.01},
        {"hip_half_width": 0.01},
    ):
        lengths = np.array([change.get(name, 0.0) for name in names])
        moved = np.array(
            [
                change.get("hip_forward", 0.0),
                outwards * change.get("hip_half_width", 0.0),
                change.get("hip_up", 0.0),
            ]
        )
        z = hip + moved - knee
        turn, _ = Rotation.align_vectors(z[None] / np.linalg.norm(z), [[0.0, 0.0, 1.0]])
        places = turn.inv().apply(skin - hip - moved)
        expected = places - np.array([m.position for m in markers[:-1]])
        # to first order in 10 mm over the length of the thigh
        np.testing.assert_allclose(coupling[:-1] @ lengths, expected, atol=0.0003)
        # the pelvis's origin is between the hips, in the middle of the body
        np.testing.assert_allclose(
            coupling[-1] @ lengths, -moved * np.array([1.0, 0.0, 1.0]), atol=1e-12
        )
    longer = np.array([0.01 * (name == "thigh") for name in names])
    # A thigh that is longer at the knee takes the skin there along.
    np.testing.assert_allclose((coupling[:-1] @ longer)[:, 2], -0.01 * down[:, 0], atol=1e-12)


def test_the_skin_of_shank_arm_and_trunk_goes_with_their_joints():
    model, _ = moving_walk()
    ends = {"shank_r": ("foot_r", "shank"), "upper_arm_l": ("forearm_l", "upper_arm")}
    for segment, (below, length) in ends.items():
        end = ModelMarker("end", segment, model[below].joint_position)
        (row,) = skin_shifts(model, [end])
        step = row @ np.array([0.01 * (name == length) for name in LENGTH_SD])
        np.testing.assert_allclose(step, [0.0, 0.0, -0.01], atol=1e-12)
    (row,) = skin_shifts(model, [ModelMarker("c7", "torso", np.array([-0.1, 0.0, 0.4]))])
    lumbar = {"lumbar_forward": 0.01, "lumbar_up": 0.02}
    step = row @ np.array([lumbar.get(name, 0.0) for name in LENGTH_SD])
    np.testing.assert_allclose(step, [-0.01, 0.0, -0.02], atol=1e-12)


def test_with_lengths_gives_those_lengths_and_keeps_mass_and_symmetry():
    model, _ = moving_walk()
    lengths = {k: v + 0.01 * (i + 1) for i, (k, v) in enumerate(lengths_of(model).items())}
    lengths["hip_forward"], lengths["hip_up"] = 0.0, 0.0
    changed = with_lengths(model, lengths)
    for name, value in lengths_of(changed).items():
        assert value == pytest.approx(lengths[name], abs=1e-12), name
    assert changed.mass == pytest.approx(model.mass, rel=1e-12)
    mirror = np.array([1.0, -1.0, 1.0])
    for name in SEGMENTS:
        if name.endswith("_r"):
            right, left = changed[name], changed[f"{name[:-1]}l"]
            np.testing.assert_allclose(right.joint_position, mirror * left.joint_position)
            np.testing.assert_allclose(right.centre_of_mass, mirror * left.centre_of_mass)
    for name, length in (("thigh_r", "thigh"), ("shank_l", "shank"), ("upper_arm_r", "upper_arm")):
        ratio = lengths[length] / lengths_of(model)[length]
        assert changed[name].centre_of_mass[2] == pytest.approx(
            ratio * model[name].centre_of_mass[2]
        )
        # a thin rod's inertia grows with the square of its length
        assert changed[name].inertia[1, 1] > 1.5 * (ratio - 1) * model[name].inertia[1, 1]
    same = with_lengths(model, {})
    for segment in same.segments:
        np.testing.assert_allclose(segment.inertia, model[segment.name].inertia)


def test_moving_the_hips_in_the_pelvis_leaves_the_rest_of_the_pelvis_and_trunk_in_place():
    model, _ = moving_walk()
    hips = np.array([0.007, 0.0, -0.004])
    moved = with_lengths(model, {"hip_forward": hips[0], "hip_up": hips[2]})
    # The pelvis's origin is between the hips; put it where they are now.
    for name in ("pelvis", "torso"):
        attribute = "centre_of_mass" if name == "pelvis" else "joint_position"
        np.testing.assert_allclose(
            getattr(moved[name], attribute) + hips, getattr(model[name], attribute), atol=1e-12
        )
    np.testing.assert_array_equal(moved["thigh_r"].joint_position, model["thigh_r"].joint_position)


def test_lengths_that_leave_no_body_are_refused():
    model, _ = moving_walk()
    with pytest.raises(ScalingError, match="above zero"):
        with_lengths(model, {"thigh": -0.4})


@pytest.mark.parametrize("name", LENGTH_SD)
def test_joints_move_with_each_length_as_they_say(name):
    """Against the body that is built with it, by differences."""
    model, _ = moving_walk()
    at = lengths_of(model) | {"hip_forward": 0.0, "hip_up": 0.0}
    ends = [with_lengths(model, at | {name: at[name] + sign * 1e-4}) for sign in (1.0, -1.0)]
    moved = np.array(
        [(ends[0][each].joint_position - ends[1][each].joint_position) / 2e-4 for each in SEGMENTS]
    )
    expected = joint_shifts()[:, :, list(LENGTH_SD).index(name)]
    np.testing.assert_allclose(moved[1:], expected[1:], atol=1e-9)
    for side in "rl":
        places = [each[f"upper_arm_{side}"].centre_of_mass for each in ends]
        np.testing.assert_allclose(places[0][:2], places[1][:2], atol=1e-12)


def test_the_prior_of_a_higher_hip_keeps_the_knee():
    """Thigh and height of the hip go together: the variance of the thigh is that of both."""
    names = list(LENGTH_SD)
    thigh, hip = names.index("thigh"), names.index("hip_up")
    covariance = np.linalg.inv(length_precision(np.zeros(len(names))))
    sd = np.array([*LENGTH_SD.values()])
    expected = np.diag(sd**2)
    expected[thigh, thigh] += sd[hip] ** 2
    expected[thigh, hip] = expected[hip, thigh] = sd[hip] ** 2
    np.testing.assert_allclose(covariance, expected, atol=1e-12)
    given = np.full(len(names), 0.02)
    assert np.linalg.inv(length_precision(given))[hip, hip] == pytest.approx(0.02**2)
