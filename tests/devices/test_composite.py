import numpy as np
import pytest

from gaitval.model.devices.composite import fitted, parallel_axes, part_place, united
from gaitval.model.devices.device import Device, Part, load_devices
from gaitval.scaling.scaling import scale_subject
from gaitval.subjects.subject_file import load_subject


@pytest.fixture(scope="module")
def model():
    return scale_subject(load_subject("S05")).model


def test_two_halves_of_a_rod_are_the_rod():
    # A rod along z: m l²/12 about its middle.
    mass, length = 3.0, 0.8

    def rod(m, part):
        moment = m * part**2 / 12
        return np.diag([moment, moment, 0.0])

    halves = [np.array([0.0, 0.0, side * length / 4]) for side in (-1, 1)]
    found, centre, inertia = united([mass / 2] * 2, halves, [rod(mass / 2, length / 2)] * 2)
    assert found == pytest.approx(mass)
    np.testing.assert_allclose(centre, 0.0, atol=1e-15)
    np.testing.assert_allclose(inertia, rod(mass, length), atol=1e-15)


def test_parallel_axes_are_steiners():
    # A point mass at distance r has m r² about every axis across, none about its own.
    np.testing.assert_allclose(parallel_axes(np.array([0.0, 0.0, 0.3])), np.diag([0.09, 0.09, 0.0]))


def test_a_device_without_stumps_adds_its_mass_and_nothing_else(model):
    for name in ("hip_exo", "foot_4kg", "backpack"):
        (device,) = load_devices(name)
        body = fitted(model, [device])
        assert body.mass == pytest.approx(model.mass + device.mass, abs=1e-12)
        for before, after in zip(model.segments, body.segments, strict=True):
            np.testing.assert_array_equal(before.joint_position, after.joint_position)


def test_a_point_mass_moves_the_centre_as_theory_says(model):
    part = Part(name="load", segment="shank", mass=2.0, along=1.0)
    device = Device(name="load", source="a test", sides=("right",), parts=(part,))
    shank, loaded = model["shank_r"], fitted(model, [device])["shank_r"]
    place = model["foot_r"].joint_position  # the ankle
    expected = (shank.mass * shank.centre_of_mass + 2.0 * place) / (shank.mass + 2.0)
    np.testing.assert_allclose(loaded.centre_of_mass, expected, atol=1e-15)

    # About the knee the inertia grows by m r² about the axes across the shank.
    def about_knee(segment):
        return segment.inertia + segment.mass * parallel_axes(segment.centre_of_mass)

    gained = about_knee(loaded) - about_knee(shank)
    np.testing.assert_allclose(gained, 2.0 * parallel_axes(place), atol=1e-13)
    assert fitted(model, [device])["shank_l"] is model["shank_l"]


@pytest.mark.parametrize(
    ("segment", "next_joint"),
    [("thigh_l", "shank_l"), ("shank_r", "foot_r"), ("upper_arm_l", "forearm_l")],
)
def test_a_part_lies_along_its_segment_and_beside_it(model, segment, next_joint):
    """Three quarters of the way from a joint to the next one, 2 cm ahead and 5 cm outside."""
    part = Part(name="p", segment=segment[:-2], mass=1.0, along=0.75, centre=(0.02, -0.05, 0.0))
    outside = 0.05 if segment.endswith("_l") else -0.05
    expected = 0.75 * model[next_joint].joint_position + [0.02, outside, 0.0]
    np.testing.assert_allclose(part_place(part, model[segment], model)[0], expected)


def test_a_part_at_the_height_of_the_shoulders_is_between_them(model):
    part = Part(name="p", segment="torso", mass=1.0, along=1.0)
    shoulders = [model[f"upper_arm_{side}"].joint_position for side in "rl"]
    found, _ = part_place(part, model["torso"], model)
    np.testing.assert_allclose(found, np.mean(shoulders, axis=0), atol=1e-12)


def test_both_sides_mirror_each_other(model):
    part = Part(
        name="p",
        segment="thigh",
        mass=1.0,
        centre=(0.02, -0.07, 0.01),
        inertia=(0.003, 0.002, 0.002, 0.0005, 0.0002, -0.0004),
    )
    right, left = (part_place(part, model[f"thigh_{s}"], model) for s in "rl")
    mirror = np.diag([1.0, -1.0, 1.0])
    np.testing.assert_array_equal(mirror @ right[0], left[0])
    np.testing.assert_array_equal(mirror @ right[1] @ mirror, left[1])
    assert right[0][1] < 0.0 < left[0][1]  # both on the outside


def test_a_stump_of_a_uniform_limb_has_its_inertia(model):
    (device,) = load_devices("below_knee")
    bare = fitted(model, [device.model_copy(update={"parts": ()})])
    whole, rest = model["shank_r"], bare["shank_r"]
    assert rest.mass == pytest.approx(0.55 * whole.mass)
    np.testing.assert_allclose(rest.inertia, 0.55**3 * whole.inertia)
    np.testing.assert_allclose(rest.centre_of_mass, 0.55 * whole.centre_of_mass)
    assert bare["shank_l"] is whole or bare["shank_l"].mass == model["shank_l"].mass
