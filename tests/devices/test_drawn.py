"""What is drawn of devices is where their tables have it, on both sides, and as large."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from gaitval.datasets.subject_file import load_subject
from gaitval.errors import ConfigurationError
from gaitval.model.body import SEGMENTS
from gaitval.model.devices.composite import part_place
from gaitval.model.devices.device import (
    Device,
    Part,
    load_devices,
    shipped_device,
    shipped_names,
    write_devices,
)
from gaitval.model.devices.drawn import DEVICES_FILE, devices_in, drawn, shapes, solid
from gaitval.model.urdf import write_urdf
from gaitval.scaling.scaling import scale_subject

KEYS = {"segment", "kind", "position", "size", "turned"}
LENGTHS = {"box": 3, "sphere": 1, "cylinder": 2}


@pytest.fixture(scope="module")
def model():
    return scale_subject(load_subject("5")).model


def inertia_of(shape, mass):
    """kg m², of a solid of even density, in the axes of its segment."""
    size = np.array(shape["size"])
    if shape["kind"] == "sphere":
        own = np.full(3, 0.4 * size[0] ** 2)
    elif shape["kind"] == "cylinder":
        radius, length = size
        own = np.array([(3 * radius**2 + length**2) / 12] * 2 + [0.5 * radius**2])
    else:
        own = (np.sum(size**2) - size**2) / 12
    turn = Rotation.from_quat(shape.get("turned", [0, 0, 0, 1])).as_matrix()
    return mass * turn @ np.diag(own) @ turn.T


@pytest.mark.parametrize("name", shipped_names())
def test_every_shipped_device_is_drawn_as_the_replay_expects(model, name):
    found = shapes(model, [shipped_device(name)])
    assert found
    for shape in found:
        assert shape["segment"] in SEGMENTS
        assert set(shape) <= KEYS
        if shape["kind"] == "skin":
            continue
        assert len(shape["size"]) == LENGTHS[shape["kind"]]
        assert np.isfinite(shape["position"]).all()
        assert min(shape["size"]) > 0.0
        assert max(shape["size"]) < 0.6
        assert np.linalg.norm(shape.get("turned", [1.0])) == pytest.approx(1.0)


@pytest.mark.parametrize("name", ["hip_exo", "knee_exo", "ankle_spring", "foot_4kg"])
def test_each_part_is_at_its_place_on_both_sides_as_mirror_images(model, name):
    device = shipped_device(name)
    found = shapes(model, [device])
    for part in device.parts:
        for segment in device.places(part.segment):
            place, _ = part_place(part, model[segment], model)
            at = [each for each in found if each["segment"] == segment and "position" in each]
            assert any(np.allclose(each["position"], place, atol=1e-12) for each in at)
    for right in found:
        if not right["segment"].endswith("_r"):
            continue
        mirror = np.array(right["position"]) * [1, -1, 1]
        assert any(
            left["segment"] == right["segment"][:-1] + "l"
            and left["kind"] == right["kind"]
            and np.allclose(left["position"], mirror, atol=2e-3)  # the legs differ by less
            and np.allclose(left["size"], right["size"], atol=2e-3)
            for left in found
        )


def test_a_solid_has_the_mass_and_the_inertia_of_its_part(model):
    turned = Rotation.from_euler("xyz", [0.4, -0.3, 0.7]).as_matrix()
    tensor = turned @ np.diag([0.02, 0.03, 0.04]) @ turned.T
    oblique = (*np.diag(tensor), tensor[0, 1], tensor[0, 2], tensor[1, 2])
    for inertia, kind in (
        ((0.18, 0.15, 0.09, 0, 0, 0), "box"),
        ((0.006, 0.006, 0.001, 0, 0, 0), "cylinder"),
        ((0.006, 0.006, 0.006, 0, 0, 0), "sphere"),
        (tuple(float(each) for each in oblique), "box"),
    ):
        part = Part(name="p", segment="shank", mass=2.0, centre=(0.1, -0.05, 0.02), inertia=inertia)
        for segment in ("shank_r", "shank_l"):
            shape = solid(part, segment, model, socket=True)
            _, expected = part_place(part, model[segment], model)
            assert shape["kind"] == kind
            np.testing.assert_allclose(inertia_of(shape, part.mass), expected, atol=1e-9)


def test_a_frame_is_drawn_no_lighter_than_water(model):
    (frame,) = (each for each in shipped_device("ankle_spring").parts if each.segment == "shank")
    radius, length = solid(frame, "shank_l", model)["size"]
    assert frame.mass / (np.pi * radius**2 * length) == pytest.approx(1000.0)


def test_a_hinge_is_beside_its_joint_and_rods_lead_to_the_parts(model):
    found = shapes(model, [shipped_device("hip_exo")])
    for side, sign in (("r", -1.0), ("l", 1.0)):
        discs = [e for e in found if e["segment"] == f"thigh_{side}" and e["size"] == [0.045, 0.03]]
        (disc,) = discs
        np.testing.assert_allclose(disc["position"], [0.0, sign * 0.10, 0.0])
    rods = [each for each in found if each["kind"] == "cylinder" and each["size"][0] == 0.009]
    assert sorted(each["segment"] for each in rods) == ["pelvis", "pelvis", "thigh_l", "thigh_r"]


def test_what_was_amputated_is_painted_as_the_device(model):
    skins = {
        name: [e["segment"] for e in shapes(model, [shipped_device(name)]) if e["kind"] == "skin"]
        for name in ("below_knee", "above_knee", "afo")
    }
    assert skins == {
        "below_knee": ["foot_r", "toes_r"],
        "above_knee": ["shank_r", "foot_r", "toes_r"],
        "afo": [],
    }


def test_the_door_finds_the_devices_of_a_run(model, tmp_path):
    assert drawn(tmp_path) == []
    devices = load_devices("below_knee")
    write_urdf(model, tmp_path / "model.urdf")
    write_devices(tmp_path / DEVICES_FILE, devices)
    assert devices_in(tmp_path) == devices
    assert len(drawn(tmp_path)) == len(shapes(model, devices))
    (tmp_path / DEVICES_FILE).rename(tmp_path / "subject.toml")
    assert drawn(tmp_path) == []  # the main job walks without what its subject's file names
    (tmp_path / DEVICES_FILE).write_text("[[devices]]\nname = 1\n", encoding="utf-8")
    with pytest.raises(ConfigurationError, match="not a device"):
        drawn(tmp_path)


@pytest.mark.parametrize("name", shipped_names())
def test_devices_written_are_read_as_they_were(name, tmp_path):
    devices: tuple[Device, ...] = load_devices(name)
    write_devices(tmp_path / "again.toml", devices)
    assert load_devices(str(tmp_path / "again.toml")) == devices
