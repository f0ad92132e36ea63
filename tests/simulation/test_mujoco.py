"""MuJoCo, the second physics engine: the same body, and walks of the same kind."""

import numpy as np
import pytest
from simulation_fixtures import changed, mujoco_mass_matrix, random_state, task_of_subject

from gaitval.constants import GRAVITY
from gaitval.coordinates import ACTUATED
from gaitval.walk.simulation.mujoco_body import MujocoBody
from gaitval.walk.simulation.walker import Trajectory, Walker


@pytest.fixture(scope="module")
def task():
    return task_of_subject("S05")


@pytest.mark.parametrize("seed", range(3))
def test_a_state_goes_in_and_comes_out_again(task, seed):
    q, qd = random_state(seed)
    body = MujocoBody(task.model)
    body.set(q, qd)
    again, rates = body.state()
    np.testing.assert_allclose(again, q, atol=1e-9)
    np.testing.assert_allclose(rates, qd, atol=1e-9)


def test_a_force_on_the_pelvis_accelerates_the_body_as_newton_says(task):
    """Also when the pelvis is turned, because forces come in world axes."""
    q = np.zeros(31)
    q[:3] = 0.3, -0.5, 0.8
    body = MujocoBody(task.model, option='timestep="0.0001"')
    body.set(q, np.zeros(31))
    forces = np.zeros(31)
    forces[3:6] = 100.0, -50.0, task.model.mass * GRAVITY
    for _ in range(10):
        body.advance(forces)
    body.accelerations(forces)  # brings the mass matrix to the last state
    momentum = (mujoco_mass_matrix(body) @ body.state()[1])[3:6]
    np.testing.assert_allclose(momentum, [0.1, -0.05, 0.0], atol=2e-3)


def test_generalised_forces_are_in_world_axes_at_the_root_and_about_the_joints_axes(task):
    """Mass matrix times what they add to the acceleration, of a turned body in motion."""
    body = MujocoBody(task.model)
    body.set(*random_state(4))
    forces = np.random.default_rng(4).uniform(-30.0, 30.0, 31)
    added = body.accelerations(forces) - body.accelerations(np.zeros(31))
    np.testing.assert_allclose(mujoco_mass_matrix(body) @ added, forces, atol=1e-6)


@pytest.mark.parametrize("start", [0.9, 0.4])
def test_without_a_policy_it_walks_as_the_compiled_engine_does(task, start):
    """From the reference, for a fifth of a cycle, at half of the usual step, which halves what the
    engines differ by (toes, which are light, 0.7 degrees); MuJoCo has a quarter of that step.
    """
    seen, usual = {}, task.configuration.environment
    finer = {"physics_step": usual.physics_step / 2, "steps_per_action": 2 * usual.steps_per_action}
    task = changed(task, environment=finer)
    for engine in ("compiled", "mujoco"):
        walker = Walker(task, engine=engine)
        row = round(start * len(task.reference.phase))
        walker.reset(task.reference.positions[row].copy(), task.reference.velocities[row], start)
        trajectory = Trajectory(20 * walker.steps_per_action)
        for _ in range(20):
            walker.step(np.zeros(25), np.zeros(6), trajectory)
        seen[engine] = trajectory
    ours, theirs = seen["compiled"], seen["mujoco"]
    assert np.rad2deg(np.abs(ours.positions - theirs.positions)[:, 6:].max()) < 1.0
    weight = task.model.mass * GRAVITY
    difference = (ours.feet - theirs.feet)[:, :, 2] / weight
    assert np.sqrt((difference**2).mean()) < 0.04
    knee = ACTUATED.index("knee_angle_r")
    moment = (ours.moments - theirs.moments)[:, knee] / task.model.mass
    assert np.sqrt((moment**2).mean()) < 0.05
    assert np.abs(difference).max() > 1e-6  # it is another engine
