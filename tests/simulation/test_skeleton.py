"""The compound-joint skeleton against DART's own URDF loader and against MuJoCo."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation
from simulation_fixtures import DartPeer, mujoco_mass_matrix, random_state

from gaitval.constants import GRAVITY
from gaitval.coordinates import COORDINATES
from gaitval.model.parameters import apply_parameters, nominal_parameters
from gaitval.model.tree import segment_frames, tree_arrays
from gaitval.walk.simulation.skeleton import HumanSkeleton

STEP = 0.001

# Both sides are the same recursion over a few dozen bodies with other intermediate frames.
# Entries of the mass matrix reach 100 kg m², bias forces 1e4 Nm at these speeds; forward
# dynamics divides by the smallest inertia (toes, 1e-4 kg m²).
RELATIVE = 1e-10


def close(seen, expected):
    np.testing.assert_allclose(seen, expected, rtol=0, atol=RELATIVE * np.abs(expected).max())


@pytest.fixture(scope="module")
def human(task):
    return HumanSkeleton(task.model, physics_step=STEP).skeleton


def place(human, q, qd):
    human.setPositions(q)
    human.setVelocities(qd)


def test_coordinates_have_the_projects_order(human):
    assert tuple(human.getDof(i).getName() for i in range(31)) == COORDINATES


@pytest.mark.parametrize("seed", range(6))
def test_mass_matrix_and_bias_forces_are_those_of_the_loaded_urdf(human, peer, seed):
    q, qd = random_state(seed)
    place(human, q, qd)
    peer.set(q, qd)
    close(human.getMassMatrix(), peer.mass_matrix())
    close(human.getCoriolisAndGravityForces(), peer.bias_forces())


@pytest.mark.parametrize("seed", range(6))
def test_forward_dynamics_is_that_of_the_loaded_urdf(human, peer, seed):
    q, qd = random_state(seed)
    forces = np.random.default_rng(seed + 100).uniform(-200.0, 200.0, 31)
    place(human, q, qd)
    human.setForces(forces)
    human.computeForwardDynamics()
    peer.set(q, qd)
    expected = peer.accelerations(forces)
    # Also against the equations of motion, which neither recursion forms.
    equations = np.linalg.solve(peer.mass_matrix(), forces - peer.bias_forces())
    close(human.getAccelerations(), expected)
    close(human.getAccelerations(), equations)


def test_points_of_the_feet_move_alike(human, peer):
    q, qd = random_state(11)
    place(human, q, qd)
    peer.set(q, qd)
    for name in ("toes_r", "toes_l", "forearm_r", "forearm_l"):
        ours, theirs = human.getBodyNode(name), peer.body(name)
        np.testing.assert_allclose(
            ours.getWorldTransform().matrix(), theirs.getWorldTransform().matrix(), atol=1e-12
        )
        np.testing.assert_allclose(
            ours.getSpatialVelocity(), theirs.getSpatialVelocity(), atol=1e-12
        )


def test_another_model_can_be_put_on(task, tmp_path):
    """`configure` leaves nothing of the model before: it equals a skeleton built anew."""
    mu = nominal_parameters()
    mu[2:] *= 1.02
    mu[5:] = np.linspace(-0.01, 0.01, 9)
    other = apply_parameters(task.model, mu)
    body = HumanSkeleton(task.model, physics_step=STEP)
    body.configure(other)
    q, qd = random_state(5)
    place(body.skeleton, q, qd)
    peer = DartPeer(other, tmp_path)
    peer.set(q, qd)
    close(body.skeleton.getMassMatrix(), peer.mass_matrix())
    close(body.skeleton.getCoriolisAndGravityForces(), peer.bias_forces())


def test_a_step_is_semi_implicit_euler_with_implicit_springs_and_dampers(task, peer):
    """(M + h D + h² K) q̇⁺ = M q̇ + h (f - c - K q),  q⁺ = q + h q̇⁺ for the joints; the pelvis
    turns by its new angular velocity."""
    random = np.random.default_rng(7)
    stiffness, damping = random.uniform(50.0, 500.0, 25), random.uniform(1.0, 40.0, 25)
    body = HumanSkeleton(task.model, physics_step=STEP)
    body.set_servo(stiffness, damping)
    q, qd = random_state(7)
    forces = random.uniform(-100.0, 100.0, 31)
    place(body.skeleton, q, qd)
    body.skeleton.setForces(forces)
    body.step()

    k, d = np.zeros(31), np.zeros(31)
    k[6:], d[6:] = stiffness, damping
    peer.set(q, qd)
    mass = peer.mass_matrix()
    change = np.linalg.solve(
        mass + np.diag(STEP * d + STEP**2 * k),
        STEP * (forces - peer.bias_forces() - k * (q + STEP * qd) - d * qd),
    )
    after = qd + change
    np.testing.assert_allclose(body.skeleton.getVelocities(), after, atol=1e-9)
    seen = body.skeleton.getPositions()
    np.testing.assert_allclose(seen[3:], (q + STEP * after)[3:], atol=1e-12)
    turned = Rotation.from_rotvec(STEP * after[:3]) * Rotation.from_rotvec(q[:3])
    np.testing.assert_allclose(
        Rotation.from_rotvec(seen[:3]).as_matrix(), turned.as_matrix(), atol=1e-9
    )


def test_a_free_fall_loses_no_momentum_of_its_own(task):
    """Without ground: the centre of mass falls with g and the angular momentum about it stays,
    up to the first order of the step."""
    body = HumanSkeleton(task.model, physics_step=1e-4)
    q, qd = random_state(9)
    place(body.skeleton, q, qd)
    velocity = body.skeleton.getCOMLinearVelocity()

    def angular_momentum():
        com, com_velocity = body.skeleton.getCOM(), body.skeleton.getCOMLinearVelocity()
        total = np.zeros(3)
        for node in body.skeleton.getBodyNodes():
            rotation = node.getWorldTransform().rotation()
            inertia = rotation @ node.getInertia().getMoment() @ rotation.T
            arm = rotation @ node.getLocalCOM() + node.getWorldTransform().translation() - com
            speed = node.getCOMLinearVelocity() - com_velocity
            total += inertia @ node.getAngularVelocity() + node.getMass() * np.cross(arm, speed)
        return total

    before = angular_momentum()
    for _ in range(1000):
        body.skeleton.setForces(np.zeros(31))
        body.step()
    fallen = velocity - [0.0, 0.0, 0.1 * GRAVITY]
    np.testing.assert_allclose(body.skeleton.getCOMLinearVelocity(), fallen, atol=0.01)
    np.testing.assert_allclose(angular_momentum(), before, atol=0.01 * np.linalg.norm(before))


# ---- MuJoCo: another engine, fed from the same body model. ----


@pytest.mark.parametrize("seed", range(4))
def test_mujoco_agrees_on_mass_matrix_and_acceleration(task, human, seed):
    pytest.importorskip("mujoco")
    from gaitval.walk.simulation.mujoco_body import MujocoBody

    q, qd = random_state(seed)
    forces = np.random.default_rng(seed + 100).uniform(-200.0, 200.0, 31)
    place(human, q, qd)
    human.setForces(forces)
    human.computeForwardDynamics()
    peer = MujocoBody(task.model)
    peer.set(q, qd)
    close(peer.accelerations(forces), human.getAccelerations())
    close(mujoco_mass_matrix(peer), human.getMassMatrix())


def test_mujocos_body_of_the_benchmark_is_the_same_with_twelve_spheres_on_the_ground(task, human):
    """benchmarks/test_physics_step.py compares the engines on it."""
    mujoco = pytest.importorskip("mujoco")
    from gaitval.walk.simulation.mujoco_body import MujocoBody

    peer = MujocoBody(task.model, floor=True)
    q, qd = random_state(0)
    peer.set(q, qd)
    peer.accelerations(np.zeros(31))
    place(human, q, qd)
    close(mujoco_mass_matrix(peer), human.getMassMatrix())
    assert peer.model.nv == human.getNumDofs() == 31
    assert peer.model.body_mass.sum() == pytest.approx(task.model.mass, rel=1e-12)
    kinds = list(peer.model.geom_type)
    assert kinds.count(mujoco.mjtGeom.mjGEOM_SPHERE) == len(task.model.spheres) == 12
    assert kinds.count(mujoco.mjtGeom.mjGEOM_PLANE) == 1
    # It stands on them: where our spheres touch the ground, so do MuJoCo's.
    q = task.reference.positions[0]
    tree, frames = tree_arrays(task.model), segment_frames(task.model, q[None])[0]
    poses = frames[tree.sphere_segment]
    heights = np.einsum("kj,kj->k", poses[:, 2, :3], tree.sphere_position) + poses[:, 2, 3]
    peer.set(q, np.zeros(31))
    peer.accelerations(np.zeros(31))
    assert peer.data.ncon == (heights < tree.sphere_radius).sum() > 0
