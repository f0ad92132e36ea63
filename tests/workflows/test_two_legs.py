"""A body whose left thigh is 2 cm shorter and 0.5 kg lighter, read back from every engine."""

import json
from dataclasses import replace
from pathlib import Path

import dartpy
import mujoco
import numpy as np
import opensim
import pytest
import yourdfpy
from simulation_fixtures import task_of

from gaitval.configuration import Configuration, ContactSettings
from gaitval.model.body import SEGMENTS
from gaitval.model.parameters import apply_parameters, nominal_parameters
from gaitval.model.tree import tree_arrays
from gaitval.model.urdf import model_hash, read_urdf, write_urdf
from gaitval.scaling.scaling import measurements_from, measurements_of, scale_subject
from gaitval.session.opensim.osim import BODIES, write_osim
from gaitval.subjects.subject_file import load_subject
from gaitval.walk.simulation.mujoco_body import mjcf
from gaitval.walk.simulation.skeleton import HumanSkeleton
from gaitval.walk.simulation.walker import MOVED, Walker, WalkingTask

REPORTS = Path(__file__).parents[2] / "reports"
SHORTER, LIGHTER = 0.02, 0.5  # m and kg
BUILTIN = [f"S{number:02d}" for number in range(1, 11)]


@pytest.fixture(scope="module")
def subject():
    """Subject 5 with equal legs, but for the left thigh."""
    own = load_subject("S05")
    right = measurements_of(own).modelled["right"]
    mass = scale_subject(own).model["thigh_r"].mass
    left = replace(right, thigh=right.thigh - SHORTER, thigh_mass=mass - LIGHTER)
    right = replace(right, thigh_mass=mass)
    measured = replace(measurements_of(own), right=right, left=left)
    return own.model_copy(update={"measurements": measured.to_dict()})


@pytest.fixture(scope="module")
def model(subject):
    return scale_subject(subject, symmetric=False).model


def as_planted(knees, masses):
    """Distances from hip to knee, m, and masses of the thighs, kg: right and left."""
    assert knees[0] - knees[1] == pytest.approx(SHORTER, abs=1e-9)
    assert masses[0] - masses[1] == pytest.approx(LIGHTER, abs=1e-9)
    assert min(knees) > 0.3
    assert min(masses) > 5.0


def test_the_urdf_has_it(model, tmp_path):
    write_urdf(model, tmp_path / "model.urdf")
    robot = yourdfpy.URDF.load(str(tmp_path / "model.urdf"), load_meshes=False).robot
    joints = {joint.name: joint for joint in robot.joints}
    links = {link.name: link for link in robot.links}
    as_planted(
        [-joints[f"knee_angle_{side}"].origin[2, 3] for side in "rl"],
        [links[f"thigh_{side}"].inertial.mass for side in "rl"],
    )
    drawn = [links[f"thigh_{side}"].visuals[0].geometry.cylinder.length for side in "rl"]
    assert drawn[0] - drawn[1] == pytest.approx(SHORTER, abs=1e-9)
    again = read_urdf(tmp_path / "model.urdf")
    for own, read in zip(model.segments, again.segments, strict=True):
        np.testing.assert_array_equal(read.joint_position, own.joint_position)
        np.testing.assert_array_equal(read.inertia, own.inertia)


def test_dart_has_it_from_the_model_and_from_the_urdf(model, tmp_path):
    write_urdf(model, tmp_path / "model.urdf")
    read = dartpy.utils.DartLoader().parseSkeleton(str(tmp_path / "model.urdf"))
    for skeleton in (HumanSkeleton(model, physics_step=0.001).skeleton, read):
        skeleton.setPositions(np.zeros(skeleton.getNumDofs()))
        place = {
            name: skeleton.getBodyNode(name).getWorldTransform().translation() for name in SEGMENTS
        }
        as_planted(
            [float(place[f"thigh_{side}"][2] - place[f"shank_{side}"][2]) for side in "rl"],
            [skeleton.getBodyNode(f"thigh_{side}").getMass() for side in "rl"],
        )


def test_the_compiled_engine_has_it(model):
    tree = tree_arrays(model)
    thighs, shanks = ([SEGMENTS.index(f"{name}_{s}") for s in "rl"] for name in ("thigh", "shank"))
    as_planted(-tree.joint_position[shanks, 2], tree.mass[thighs])
    inertia = tree.inertia[thighs]
    assert inertia[0, 0, 0] > 1.05 * inertia[1, 0, 0]


def test_mujoco_has_it(model):
    found = mujoco.MjModel.from_xml_string(mjcf(model))
    as_planted(
        [-found.body(f"shank_{side}").pos[2] for side in "rl"],
        [found.body(f"thigh_{side}").mass[0] for side in "rl"],
    )


def test_opensim_has_it(model, tmp_path):
    write_osim(tmp_path / "model.osim", model, (), ContactSettings(), 0.8)
    read = opensim.Model(str(tmp_path / "model.osim"))
    state = read.initSystem()
    bodies = read.getBodySet()
    place = {
        name: bodies.get(BODIES[name]).getPositionInGround(state).to_numpy() for name in SEGMENTS
    }
    as_planted(
        [float(np.linalg.norm(place[f"thigh_{s}"] - place[f"shank_{s}"])) for s in "rl"],
        [bodies.get(BODIES[f"thigh_{s}"]).getMass() for s in "rl"],
    )


def test_lengths_are_averaged_but_not_masses_that_somebody_gave(subject, model):
    """A marker's error makes lengths differ; a mass of one side is somebody's word."""
    assert model_hash(scale_subject(subject).model) == model_hash(model)
    measured = measurements_of(subject)
    legs = {side: replace(getattr(measured, side), thigh_mass=None) for side in ("right", "left")}
    lengths = replace(measured, **legs).to_dict()
    averaged = scale_subject(subject.model_copy(update={"measurements": lengths})).model
    assert averaged["thigh_r"].mass == averaged["thigh_l"].mass
    knees = [averaged[f"shank_{side}"].joint_position[2] for side in "rl"]
    assert knees[0] == knees[1]
    own = [model[f"shank_{side}"].joint_position[2] for side in "rl"]
    assert knees[0] == pytest.approx(np.mean(own), abs=1e-9)


def test_mu_stretches_both_legs_by_the_same_factor(model):
    mu = nominal_parameters()
    mu[4], mu[6] = 1.05, 0.01
    changed = apply_parameters(model, mu)
    for side in "rl":
        before, after = (m[f"shank_{side}"].joint_position[2] for m in (model, changed))
        assert after == pytest.approx(1.05 * before)
    aside = [changed[f"foot_{s}"].joint_position[1] for s in "rl"]
    assert aside == pytest.approx([0.01, -0.01])  # mirrored


@pytest.mark.parametrize(
    "engine",
    ["compiled", *(pytest.param(name, marks=pytest.mark.slow) for name in ("dart", "mujoco"))],
)
def test_the_longer_leg_lands_first(model, task, engine):
    """In the neutral pose just above the ground the right foot, on the longer leg, lands first."""
    q = np.zeros(31)
    soles = [s.position[2] - s.radius for s in model.spheres if s.segment == "foot_r"]
    leg = model.leg_length + SHORTER / 2  # the right one
    q[5] = leg - min(soles)
    walker = Walker(task_of(model, task, q), engine=engine)
    walker.reset(q, np.zeros(31), 0.0)
    for _ in range(5):
        walker.step(np.zeros(25), np.zeros(6))
    right, left = walker.mean_ground_reaction[:, 2]
    assert right > 50.0
    assert left < 10.0  # the smooth force above the ground


def test_each_foots_contact_lags_by_its_own_mass(task, model):
    feet = [replace(s, mass=2.0 * s.mass) if s.name == "foot_l" else s for s in model.segments]
    walker = Walker(task_of(replace(model, segments=tuple(feet)), task, np.zeros(31)))
    masses = np.array([model[f"foot_{s}"].mass for s in "rl"]) * [1.0, 2.0]
    masses += [model[f"toes_{s}"].mass for s in "rl"]
    np.testing.assert_allclose(walker.lag, walker.physics_step / (MOVED * masses), rtol=1e-15)


@pytest.mark.parametrize("identifier", BUILTIN)
def test_the_built_in_bodies_are_those_of_the_stored_policies(identifier):
    """The default setting averages: their numbers have not moved by a bit that counts."""
    stored = json.loads((REPORTS / identifier / "baseline/policy/policy.json").read_text())
    assert Configuration().scaling.symmetric
    assert model_hash(scale_subject(load_subject(identifier)).model) == stored["model_hash"]


def test_measurements_of_a_subject_keep_both_legs(subject):
    again = measurements_from(subject.measurements)
    assert again.right.thigh - again.left.thigh == pytest.approx(SHORTER)


@pytest.mark.slow
def test_the_reference_of_two_legs_stands_on_both(subject, model):
    task = WalkingTask.of(model, subject.record(), Configuration())
    assert task.model["shank_r"].joint_position[2] < task.model["shank_l"].joint_position[2]
    assert np.isfinite(task.reference.positions).all()
