"""The compiled engine against DART, and against what mechanics says of any body."""

import subprocess
import sys

import numpy as np
import pytest
from scipy.spatial.transform import Rotation
from simulation_fixtures import DartPeer, mirror_image, random_state, symmetric

from gaitval.constants import GRAVITY
from gaitval.model.body import BodyModel
from gaitval.model.parameters import apply_parameters, nominal_parameters
from gaitval.model.tree import (
    empty_frames,
    forward,
    tree_arrays,
    turned_vector,
    velocities,
)
from gaitval.policy.observation import measure_workspace, whole_body_motion
from gaitval.walk.simulation.dynamics import accelerations, dynamics_workspace, integrate
from gaitval.walk.simulation.skeleton import HumanSkeleton
from gaitval.walk.simulation.walker import Trajectory, Walker

FREE = np.zeros(25)
"""No springs, no dampers."""

DART_ROTATION = 2e-10
"""rad: DART takes exp(h ω) to the second order where h |ω| < 1e-3, so each step may turn by up to
(1e-3)³ / 6 wrongly; ours is exact."""


def other_body(model: BodyModel) -> BodyModel:
    mu = nominal_parameters()
    mu[2:5] = 0.96, 1.03, 0.97
    mu[5:] = np.linspace(-0.01, 0.01, 9)
    return apply_parameters(model, mu)


def frames_at(tree, state):
    frames = empty_frames()
    forward(tree.joint_position, state[0], frames, 14)
    velocities(state[1], frames, 14)
    return frames


def accelerated(model, state, forces, *, stiffness=FREE, damping=FREE, step=0.0):
    tree, out = tree_arrays(model), np.full(31, np.nan)
    frames = frames_at(tree, state)
    accelerations(tree, frames, state, forces, stiffness, damping, step, dynamics_workspace(), out)
    return out


# ---- One step. ----


@pytest.mark.parametrize("seed", range(6))
def test_accelerations_are_those_of_darts_own_reading_of_the_urdf(task, tmp_path, seed):
    """Relative to the largest, which the toes have: their inertia is 1e-4 kg m²."""
    model = other_body(task.model) if seed % 2 else task.model
    forces = np.random.default_rng(seed + 100).uniform(-200.0, 200.0, 31)
    state = np.array(random_state(seed))
    peer = DartPeer(model, tmp_path)
    peer.set(*state)
    expected = peer.accelerations(forces)
    seen = accelerated(model, state, forces)
    np.testing.assert_allclose(seen, expected, rtol=0, atol=1e-10 * np.abs(expected).max())
    np.testing.assert_allclose(
        seen[:6], expected[:6], rtol=0, atol=1e-9 * np.abs(expected[:6]).max()
    )


@pytest.mark.parametrize("seed", range(6))
@pytest.mark.parametrize("step", [0.0005, 0.002])
def test_a_step_with_springs_and_dampers_is_darts(task, seed, step):
    model = other_body(task.model) if seed % 2 else task.model
    random = np.random.default_rng(seed)
    stiffness, damping = random.uniform(50.0, 500.0, 25), random.uniform(1.0, 40.0, 25)
    forces = random.uniform(-200.0, 200.0, 31)
    state = np.array(random_state(seed))
    body = HumanSkeleton(model, physics_step=step)
    body.set_servo(stiffness, damping)
    body.skeleton.setPositions(state[0])
    body.skeleton.setVelocities(state[1])
    body.skeleton.setForces(forces)
    body.step()
    change = accelerated(model, state, forces, stiffness=stiffness, damping=damping, step=step)
    integrate(state, change, step)
    np.testing.assert_allclose(state[1], body.skeleton.getVelocities(), rtol=0, atol=1e-11)
    np.testing.assert_allclose(state[0], body.skeleton.getPositions(), rtol=0, atol=DART_ROTATION)


@pytest.mark.parametrize("angle", [0.0, 1e-9, 1e-3, 1.0, 3.1, np.pi - 1e-6])
def test_the_pelvis_turns_by_its_angular_velocity_in_world_axes(angle):
    """exp(h ω) R as SciPy has it, also across 180 degrees, where the vector changes its sign."""
    random = np.random.default_rng(3)
    for speed in (0.0, 1e-6, 0.3, 30.0, 1500.0):
        direction, omega = random.standard_normal((2, 3))
        vector = angle * direction / np.linalg.norm(direction)
        omega *= speed / np.linalg.norm(omega)
        expected = Rotation.from_rotvec(0.002 * omega) * Rotation.from_rotvec(vector)
        turned_vector(vector, omega, 0.002)
        assert np.linalg.norm(vector) <= np.pi + 1e-12
        left = Rotation.from_rotvec(vector) * expected.inv()
        assert left.magnitude() < 1e-14


@pytest.mark.parametrize("seed", range(3))
def test_a_mirrored_body_moves_as_in_a_mirror(task, seed):
    model, _ = symmetric(task.model, task.record)
    forces = np.random.default_rng(seed).uniform(-200.0, 200.0, 31)
    state = np.array(random_state(seed))
    twin, twin_forces = mirror_image(state).copy(), mirror_image(forces).copy()
    seen = accelerated(model, twin, twin_forces)
    expected = mirror_image(accelerated(model, state, forces))
    np.testing.assert_allclose(seen, expected, rtol=0, atol=1e-11 * np.abs(expected).max())


# ---- Free flight. ----


def mechanics(tree, state):
    """Momentum (3,), angular momentum (3,) about the centre of mass, energy."""
    frames = frames_at(tree, state)
    motion = np.empty((3, 3))
    whole_body_motion(tree, frames, motion, measure_workspace())
    com, com_velocity, _ = motion
    angular, energy = np.zeros(3), tree.mass.sum() * GRAVITY * com[2]
    for s in range(14):
        rotation, omega = frames.rotation[s], frames.angular[s]
        inertia = rotation @ tree.inertia[s] @ rotation.T
        arm = rotation @ tree.centre_of_mass[s]
        velocity = frames.linear[s] + np.cross(omega, arm)
        place = frames.origin[s] + arm - com
        angular += inertia @ omega + tree.mass[s] * np.cross(place, velocity - com_velocity)
        energy += 0.5 * tree.mass[s] * velocity @ velocity + 0.5 * omega @ inertia @ omega
    return tree.mass.sum() * com_velocity, angular, energy


def flown(model, state, step, seconds, moments):
    """The state after a flight under constant joint moments (25,), and their work."""
    state, forces, work = state.copy(), np.zeros(31), 0.0
    forces[6:] = moments
    for _ in range(round(seconds / step)):
        before = state[0, 6:].copy()
        integrate(state, accelerated(model, state, forces), step)
        work += moments @ (state[0, 6:] - before)
    return state, work


@pytest.fixture(scope="module")
def flights(task):
    """Errors of momentum, angular momentum and energy after 0.05 s, for three steps."""
    tree = tree_arrays(task.model)
    start = np.array(random_state(9))
    start[1] *= 0.5
    moments = np.random.default_rng(2).uniform(-1.0, 1.0, 25)
    momentum, angular, energy = mechanics(tree, start)
    errors = []
    for step in (4e-4, 2e-4, 1e-4):
        state, work = flown(task.model, start, step, 0.05, moments)
        after = mechanics(tree, state)
        fallen = momentum - [0.0, 0.0, tree.mass.sum() * GRAVITY * 0.05]
        errors.append(
            (
                np.abs(after[0] - fallen).max() / np.linalg.norm(momentum),
                np.abs(after[1] - angular).max() / np.linalg.norm(angular),
                abs(after[2] - energy - work) / abs(work),
            )
        )
    return np.array(errors)


@pytest.mark.parametrize(("kind", "bound"), [(0, 2e-3), (1, 2e-3), (2, 0.1)])
def test_flight_keeps_momentum_and_energy_to_the_order_of_the_step(flights, kind, bound):
    """Gravity changes the momentum by its impulse, joint moments the energy by their work.
    Semi-implicit Euler is of first order: half the step, half the error."""
    errors = flights[:, kind]
    assert errors[2] < bound
    assert errors[0] / errors[1] == pytest.approx(2.0, abs=0.2)
    assert errors[1] / errors[2] == pytest.approx(2.0, abs=0.1)


# ---- Walks. ----


def walked(task, engine, row, actions):
    """An open-loop walk with a restless servo and a push, other passive damping and friction."""
    walker = Walker(task, engine=engine)
    mu = nominal_parameters()
    mu[:2] = 0.9, 0.7
    walker.set_parameters(mu)
    walker.reset(task.reference.positions[row], task.reference.velocities[row], row / 1024)
    recording = Trajectory(actions * walker.steps_per_action)
    random = np.random.default_rng(row)
    for action in range(actions):
        push = np.array([0.0, 0.0, 0.0, 50.0, 80.0, 0.0]) if action == 3 else np.zeros(6)
        pace = random.uniform(0.7, 1.3)
        walker.step(random.normal(0.0, 0.03, 25), push, recording, pace=pace)
    return walker, recording


@pytest.mark.parametrize("row", [0, 600])
def test_both_engines_walk_the_same_walk(task, row):
    """500 steps through heel strikes and toe-offs, from both halves of the cycle. What DART
    leaves out of the pelvis's rotation (2e-10 a step) is all that lies between them, and an
    unstable walk makes it grow: to 1e-8 here, of which the test allows a hundred times."""
    actions = 100
    ours, seen = walked(task, "compiled", row, actions)
    darts, expected = walked(task, "dart", row, actions)
    assert seen.rows == expected.rows == actions * ours.steps_per_action
    np.testing.assert_array_equal(seen.phase, expected.phase)
    np.testing.assert_array_equal(seen.root_force, expected.root_force)
    np.testing.assert_allclose(seen.positions, expected.positions, rtol=0, atol=1e-6)
    np.testing.assert_allclose(seen.velocities, expected.velocities, rtol=0, atol=1e-4)
    np.testing.assert_allclose(seen.moments, expected.moments, rtol=0, atol=1e-3)
    np.testing.assert_allclose(seen.feet, expected.feet, rtol=0, atol=1e-5 * ours.weight)
    for side in (0, 1):
        loaded = seen.feet[:, side, 2] > 0.5 * ours.weight
        assert loaded.any()
        assert not loaded.all()
    for name in ("mean_ground_reaction", "mean_moments", "mean_square_moments"):
        ours_mean, darts_mean = getattr(ours, name), getattr(darts, name)
        np.testing.assert_allclose(ours_mean, darts_mean, rtol=1e-4, atol=1e-3)


def test_where_dart_takes_the_whole_exponential_the_engines_agree_to_rounding(task):
    """In the first 30 steps from where it turns fastest the pelvis has h |ω| > 1e-3."""
    row = int(np.argmax(np.linalg.norm(task.reference.velocities[:, :3], axis=1)))
    _, seen = walked(task, "compiled", row, 2)
    _, expected = walked(task, "dart", row, 2)
    np.testing.assert_allclose(seen.positions, expected.positions, rtol=0, atol=1e-13)
    np.testing.assert_allclose(seen.velocities, expected.velocities, rtol=0, atol=1e-11)


def test_the_compiled_engine_does_without_dart():
    """So that the processes of a training start fast."""
    code = (
        "import sys, gaitval.walk.simulation.walker, gaitval.policy.environment; "
        "sys.exit('dartpy' in sys.modules)"
    )
    assert subprocess.run([sys.executable, "-c", code], check=False).returncode == 0
