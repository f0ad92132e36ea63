"""The model that is written for OpenSim against OpenSim's own reading of it."""

from dataclasses import replace
from pathlib import Path
from xml.etree import ElementTree

import numpy as np
import opensim
import pytest
from opensim_motion import from_opensim
from opensim_peer import OpenSimModel
from scipy.spatial.transform import Rotation
from simulation_fixtures import random_state

from gaitval.configuration import ContactSettings
from gaitval.coordinates import ACTUATED, COORDINATES
from gaitval.errors import ModelError
from gaitval.mocap.recording import Recording
from gaitval.mocap.trc import read_trc
from gaitval.model.body import SEGMENTS
from gaitval.model.markers import ModelMarker
from gaitval.model.rotations import pelvis_angles
from gaitval.model.tree import (
    empty_frames,
    forward,
    segment_frames,
    tree_arrays,
    velocities,
    whole_body_centre_of_mass,
)
from gaitval.session.opensim.coordinates import OPENSIM_COORDINATES, TO_OPENSIM, to_opensim
from gaitval.session.opensim.motion import write_markers
from gaitval.session.opensim.osim import write_osim
from gaitval.walk.contact.forces import ground_forces
from gaitval.walk.contact.law import contact_law

MARKERS = tuple(
    ModelMarker(f"M.{segment}", segment, np.array([0.01, -0.02, 0.03]) * (i + 1))
    for i, segment in enumerate(SEGMENTS)
)
FRICTION = 0.7


@pytest.fixture(scope="module")
def model(task):
    return task.model


@pytest.fixture(scope="module")
def written(model, tmp_path_factory) -> Path:
    path = tmp_path_factory.mktemp("opensim") / "model.osim"
    write_osim(path, model, MARKERS, ContactSettings(), FRICTION, locked={"mtp_angle_r": 0.1})
    return path


@pytest.fixture(scope="module")
def peer(written) -> OpenSimModel:
    return OpenSimModel(written)


def lowest_points(model, q: np.ndarray) -> np.ndarray:
    """Height (K,) m of the lowest point of every sphere."""
    tree = tree_arrays(model)
    frames = segment_frames(model, q[None])[0][tree.sphere_segment]
    centres = np.einsum("kij,kj->ki", frames[:, :3, :3], tree.sphere_position) + frames[:, :3, 3]
    return centres[:, 2] - tree.sphere_radius


def near_ground(model, seed: int, depth: float) -> tuple[np.ndarray, np.ndarray]:
    """A state with one of the spheres `depth` m inside the ground and moving slowly."""
    q, qd = random_state(seed)
    q[:3] *= 0.1
    q[6:] *= 0.1
    q[5] -= lowest_points(model, q)[seed] + depth
    return q, 0.1 * qd


# ---- Bodies, joints and coordinates. ----


@pytest.mark.parametrize("seed", range(30))
def test_every_body_is_where_it_is_here(model, peer, seed):
    q, _ = random_state(seed)
    peer.pose(q)
    np.testing.assert_allclose(peer.frames(), segment_frames(model, q[None])[0], atol=1e-12)


@pytest.mark.parametrize("name", ACTUATED)
def test_a_coordinate_turns_the_same_bodies_the_same_way(model, peer, name):
    q = np.zeros(31)
    q[COORDINATES.index(name)] = 0.5
    peer.pose(q)
    seen = peer.frames()
    assert np.abs(seen - segment_frames(model, np.zeros((1, 31)))[0]).max() > 0.05
    np.testing.assert_allclose(seen, segment_frames(model, q[None])[0], atol=1e-12)


def test_markers_are_where_they_are_here(model, peer):
    q, _ = random_state(1)
    peer.pose(q)
    frames = segment_frames(model, q[None])[0]
    expected = [frames[SEGMENTS.index(m.segment)] @ np.append(m.position, 1.0) for m in MARKERS]
    np.testing.assert_allclose(peer.markers(), np.array(expected)[:, :3], atol=1e-12)


@pytest.mark.parametrize("seed", range(5))
def test_masses_and_inertia_are_those_of_here(model, peer, seed):
    """The kinetic energy of any motion is the mass matrix; so it also shows the speeds' signs."""
    q, qd = random_state(seed)
    peer.pose(q, qd)
    tree = tree_arrays(model)
    frames = empty_frames()
    rotation, angular, linear = frames.rotation, frames.angular, frames.linear
    forward(tree.joint_position, q, frames, 14)
    velocities(qd, frames, 14)
    arm = np.einsum("sij,sj->si", rotation, tree.centre_of_mass)
    speed = linear + np.cross(angular, arm)
    local = np.einsum("sji,sj->si", rotation, angular)
    energy = 0.5 * np.einsum("s,si,si->", tree.mass, speed, speed)
    energy += 0.5 * np.einsum("si,sij,sj->", local, tree.inertia, local)
    assert peer.model.calcKineticEnergy(peer.state) == pytest.approx(energy, rel=1e-10)
    assert peer.model.getTotalMass(peer.state) == pytest.approx(model.mass, rel=1e-12)
    centre = peer.model.calcMassCenterPosition(peer.state).to_numpy() @ TO_OPENSIM
    expected = whole_body_centre_of_mass(tree, frames)
    np.testing.assert_allclose(centre, expected, atol=1e-12)


def test_the_file_says_which_way_is_down_and_what_is_held(written, peer):
    np.testing.assert_array_equal(peer.model.getGravity().to_numpy(), [0.0, -9.81, 0.0])
    coordinates = {
        element.attrib["name"]: element
        for element in ElementTree.parse(written).getroot().iter("Coordinate")
    }
    assert tuple(coordinates) == tuple(
        peer.coordinates.get(i).getName() for i in range(peer.coordinates.getSize())
    )
    assert set(coordinates) == set(OPENSIM_COORDINATES)
    for name, element in coordinates.items():
        fixed = name == "mtp_angle_r"
        assert element.findtext("locked") == str(fixed).lower()
        assert float(element.findtext("default_value")) == (0.1 if fixed else 0.0)
        assert element.findtext("clamped") == str(name in ACTUATED).lower()
        low, high = map(float, element.findtext("range").split())
        assert low < 0.0 < high


# ---- Pelvis angles. ----


@pytest.mark.parametrize("seed", range(10))
def test_opensims_coordinates_and_back(seed):
    q, _ = random_state(seed)
    np.testing.assert_allclose(from_opensim(to_opensim(q[None]))[0], q, atol=1e-12)


def test_pelvis_angles_are_the_records_with_opensims_signs():
    """Tilt backward, right side down, turned to the left are positive in OpenSim."""
    q = np.array([random_state(seed)[0] for seed in range(20)]) * 0.3
    frames = Rotation.from_rotvec(q[:, :3]).as_matrix()
    angles = pelvis_angles(frames)
    np.testing.assert_allclose(to_opensim(q)[:, :3], angles * [-1.0, -1.0, 1.0], atol=1e-12)


def test_a_walk_in_a_circle_has_no_jump():
    turn = np.linspace(0.0, 4 * np.pi, 200)
    q = np.zeros((200, 31))
    q[:, 2] = np.mod(turn + np.pi, 2 * np.pi) - np.pi
    np.testing.assert_allclose(to_opensim(q)[:, 2], turn, atol=1e-9)


# ---- Contact. ----


@pytest.fixture(scope="module")
def contact() -> ContactSettings:
    """Dynamic friction unlike static friction, unlike the default."""
    return ContactSettings(dynamic_to_static=0.6, viscous_friction=0.4, transition_velocity=0.15)


@pytest.fixture(scope="module")
def standing(model, contact, tmp_path_factory) -> OpenSimModel:
    path = tmp_path_factory.mktemp("contact") / "model.osim"
    write_osim(path, model, (), contact, FRICTION)
    return OpenSimModel(path, contact=True)


@pytest.mark.parametrize("depth", np.linspace(-0.015, 0.03, 10))
@pytest.mark.parametrize("seed", range(6))
def test_the_ground_pushes_and_holds_a_sphere_as_here(model, contact, standing, seed, depth):
    q, qd = near_ground(model, seed, depth)
    standing.pose(q, qd)
    tree = tree_arrays(model)
    ours, feet = np.zeros((12, 3)), np.zeros((2, 6))
    law = contact_law(contact, FRICTION)
    ground_forces(tree, law, q, qd, np.zeros(2), ours, np.zeros(31), feet)
    theirs = standing.sphere_forces()
    # Here the force ends 2 cm above the ground, where 2e-4 of it are left.
    near = lowest_points(model, q) < 0.02
    assert ours[seed, 2] != 0.0
    for force, expected in zip(ours[near], theirs[near, 0], strict=True):
        friction = np.linalg.norm(expected[:2])
        assert force[2] == pytest.approx(expected[2], rel=1e-6, abs=1e-12)
        np.testing.assert_allclose(force[:2], expected[:2], atol=1e-6 * friction)
    # The moments of all spheres of a foot, about the world's origin, see where the forces act.
    theirs *= near[:, None, None]
    origins = segment_frames(model, q[None])[0][tree.sphere_segment, :3, 3]
    theirs[:, 1] += np.cross(origins, theirs[:, 0])
    total = theirs.reshape(2, 6, 6).sum(axis=1)
    size = np.linalg.norm(total[:, :3])
    np.testing.assert_allclose(feet, total, atol=1e-6 * size)


def test_contact_does_not_act_until_it_is_switched_on(written):
    """OpenSim's inverse dynamics would add it to the measured ground reaction."""
    forces = list(ElementTree.parse(written).getroot().iter("SmoothSphereHalfSpaceForce"))
    assert [force.findtext("appliesForce") for force in forces] == ["false"] * 12


# ---- The file. ----


def test_equal_models_give_equal_bytes(model, written):
    other = written.with_name("again.osim")
    write_osim(other, model, MARKERS, ContactSettings(), FRICTION, locked={"mtp_angle_r": 0.1})
    assert other.read_bytes() == written.read_bytes()


def test_opensim_changes_nothing_when_it_writes_the_model_itself(written, peer):
    """What it does not understand would be missing in its own file."""
    again = written.with_name("reprinted.osim")
    opensim.Model(str(written)).printToXML(str(again))
    ours, theirs = ElementTree.parse(written).getroot(), ElementTree.parse(again).getroot()
    assert ours.attrib["Version"] == theirs.attrib["Version"]
    for tag in ("Body", "CustomJoint", "Coordinate", "Marker", "ContactSphere", "Ellipsoid"):
        names = [element.attrib["name"] for element in ours.iter(tag)]
        assert names == [element.attrib["name"] for element in theirs.iter(tag)]
        assert names


def test_a_name_of_a_person_becomes_one_that_opensim_takes(model, tmp_path):
    path = tmp_path / "model.osim"
    write_osim(path, replace(model, name="Zoë O'Neil <2>/b"), (), ContactSettings(), FRICTION)
    assert opensim.Model(str(path)).getName() == "Zoë_O_Neil__2__b"


@pytest.mark.parametrize(
    ("markers", "fixed", "message"),
    [
        ([ModelMarker("HEEL", "foot_r", np.zeros(3))] * 2, {}, "HEEL: appears 2 times"),
        (
            [ModelMarker(name, "foot_r", np.zeros(3)) for name in ("R HEEL", "R_HEEL")],
            {},
            "R_HEEL: appears 2 times",
        ),
        ([ModelMarker("HEEL", "calcn_r", np.zeros(3))], {}, "unknown segment calcn_r.*foot_r"),
        ([], {"mtp_angle": 0.0}, "mtp_angle: unknown.*mtp_angle_r"),
    ],
)
def test_what_opensim_could_not_read_is_not_written(model, tmp_path, markers, fixed, message):
    path = tmp_path / "model.osim"
    with pytest.raises(ModelError, match=message):
        write_osim(path, model, markers, ContactSettings(), FRICTION, locked=fixed)
    assert not path.exists()


def test_names_that_opensim_cannot_read_are_written_as_it_can_and_in_both_files(model, tmp_path):
    """A drafted marker set has the laboratory's names."""
    names = ("R HEEL", "a/b\\c*d+e", "x\x1by", "Fuß", "")
    written = ["R_HEEL", "a_b_c_d_e", "x_y", "Fuß", "_"]
    markers = [ModelMarker(name, "foot_r", np.zeros(3)) for name in names]
    write_osim(tmp_path / "model.osim", model, markers, ContactSettings(), FRICTION)
    found = ElementTree.parse(tmp_path / "model.osim").iter("Marker")
    assert [each.get("name") for each in found] == written
    seen = Recording("here", "project", names, np.zeros((2, len(names), 3)), 100.0)
    write_markers(tmp_path / "walk.trc", seen)
    assert read_trc(tmp_path / "walk.trc").names == tuple(written)
