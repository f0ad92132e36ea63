"""Ground with a slope and a cross-slope, by what mechanics says of any body on an inclined plane,
and by two other engines."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.spatial.transform import Rotation
from simulation_fixtures import (
    PREDSIM,
    SLED_HEIGHT,
    SLED_RADIUS,
    mirror_image,
    random_state,
    rigid_sled,
    symmetric,
    task_of,
)

from gaitval.constants import GRAVITY
from gaitval.kinetics.inverse.newton_euler import empty_dynamics, newton_euler
from gaitval.metrics.torques import mechanical_energy
from gaitval.model.body import BodyModel
from gaitval.model.ground import LEVEL, Ground
from gaitval.model.parameters import PARAMETERS, nominal_parameters
from gaitval.model.tree import empty_frames, forward, tree_arrays, velocities
from gaitval.walk.contact.law import contact_law
from gaitval.walk.simulation.dynamics import accelerations, dynamics_workspace, integrate
from gaitval.walk.simulation.mujoco_body import MujocoBody
from gaitval.walk.simulation.rollout import Rollout
from gaitval.walk.simulation.skeleton import HumanSkeleton
from gaitval.walk.simulation.walker import Trajectory, Walker

SLOPES = (
    Ground(5.0), Ground(-10.0), Ground(0.0, 5.0), Ground(0.0, -10.0), Ground(8.0, -4.0)
)  # fmt: skip
FREE = np.zeros(25)
SLED = rigid_sled(60.0)


def on(model: BodyModel, ground: Ground) -> BodyModel:
    return replace(model, ground=ground)


def accelerated(model, state, forces):
    tree, frames, out = tree_arrays(model), empty_frames(), np.full(31, np.nan)
    forward(tree.joint_position, state[0], frames, 14)
    velocities(state[1], frames, 14)
    accelerations(tree, frames, state, forces, FREE, FREE, 0.0, dynamics_workspace(), out)
    return out


# ---- The direction of gravity. ----


@pytest.mark.parametrize("ground", SLOPES, ids=str)
def test_the_ground_s_axes_are_those_of_a_plane_that_rises_as_said(ground):
    """Of the plane z = a x + b y in a room whose z is up: its normal, and the way ahead in it."""
    a, b = ground.slope / 100.0, ground.cross_slope / 100.0
    normal = np.array([-a, -b, 1.0]) / np.sqrt(1.0 + a * a + b * b)
    turn = ground.from_level
    np.testing.assert_allclose(turn @ normal, [0.0, 0.0, 1.0], atol=1e-15)
    np.testing.assert_allclose(turn @ turn.T, np.eye(3), atol=1e-15)
    ahead = turn.T @ [1.0, 0.0, 0.0]
    assert ahead[2] / ahead[0] == pytest.approx(a)
    assert ahead[1] == 0.0
    assert ahead[0] > 0.0
    np.testing.assert_allclose(ground.gravity, turn @ [0.0, 0.0, -GRAVITY], atol=1e-14)
    assert ground.steepness == pytest.approx(np.tan(np.arccos(ground.up[2])))


def test_level_ground_has_gravity_to_the_last_bit():
    """Also its zeros are positive, so that what is added to them keeps its sign."""
    assert LEVEL.gravity.tobytes() == np.array([0.0, 0.0, -GRAVITY]).tobytes()
    assert LEVEL.up.tobytes() == np.array([0.0, 0.0, 1.0]).tobytes()


# ---- The equations of motion. ----


@pytest.mark.parametrize("ground", SLOPES, ids=str)
def test_a_body_on_a_slope_is_the_turned_body_on_level_ground(task, ground):
    """In the room's axes: the pelvis turned and displaced, gravity along -z."""
    state, forces = np.array(random_state(1)), np.zeros(31)
    back = Rotation.from_matrix(ground.from_level.T)
    room = state.copy()
    room[0, :3] = (back * Rotation.from_rotvec(state[0, :3])).as_rotvec()
    for part in (room[0, 3:6], room[1, :3], room[1, 3:6]):
        part[:] = back.apply(part)
    here, there = (
        accelerated(on(task.model, ground), state, forces),
        accelerated(task.model, room, forces),
    )
    there[:3], there[3:6] = back.inv().apply(there[:3]), back.inv().apply(there[3:6])
    np.testing.assert_allclose(here, there, atol=1e-9 * np.abs(there).max())


@pytest.mark.parametrize("ground", SLOPES, ids=str)
def test_three_engines_agree_on_what_a_slope_accelerates(task, ground):
    model, forces = on(task.model, ground), np.random.default_rng(7).uniform(-50.0, 50.0, 31)
    state = np.array(random_state(2))
    ours = accelerated(model, state, forces)
    dart = HumanSkeleton(task.model, physics_step=0.001)
    dart.configure(model)  # a walker's body changes on the same ground
    dart.set(*state)
    dart.skeleton.setForces(forces)
    dart.skeleton.computeForwardDynamics()
    largest = np.abs(ours).max()
    np.testing.assert_allclose(ours, dart.skeleton.getAccelerations(), atol=1e-9 * largest)
    mujoco = MujocoBody(model)
    mujoco.set(*state)
    np.testing.assert_allclose(ours, mujoco.accelerations(forces), atol=1e-7 * largest)
    level = accelerated(task.model, state, forces)
    # of the whole body, gravity's change and nothing else
    np.testing.assert_allclose(
        ours[3:6] - level[3:6], ground.gravity - LEVEL.gravity, atol=1e-9 * largest
    )


@pytest.mark.parametrize("ground", SLOPES, ids=str)
def test_newton_and_euler_undo_the_engine(task, ground):
    """The forces that a motion needs on a slope are those that make it there."""
    model, forces = on(task.model, ground), np.random.default_rng(8).uniform(-50.0, 50.0, 31)
    q, qd = random_state(3)
    qdd, out = accelerated(model, np.array([q, qd]), forces), np.empty(31)
    feet = np.zeros((2, 3)), np.full((2, 3), np.nan), np.zeros((2, 3))
    newton_euler(tree_arrays(model), q, qd, qdd, *feet, empty_dynamics(), out)
    np.testing.assert_allclose(out, forces, atol=1e-7)


def test_a_mirrored_body_on_a_mirrored_slope_moves_as_in_a_mirror(task):
    model, _ = symmetric(task.model, task.record)
    ground, state = Ground(6.0, 9.0), np.array(random_state(5))
    forces = np.random.default_rng(5).uniform(-50.0, 50.0, 31)
    seen = accelerated(on(model, ground), state, forces)
    image = accelerated(on(model, ground.mirrored()), mirror_image(state), mirror_image(forces))
    np.testing.assert_allclose(mirror_image(seen), image, atol=1e-9 * np.abs(seen).max())
    unmirrored = accelerated(on(model, ground), mirror_image(state), mirror_image(forces))
    assert np.abs(unmirrored[4] - image[4]) > 1.0


@pytest.mark.parametrize("ground", SLOPES, ids=str)
def test_a_body_in_the_air_keeps_its_energy(task, ground):
    """Half a metre of fall, in steps of which half the error is left when they are half as long."""
    model = on(task.model, ground)

    def change(step: float) -> float:
        state = np.zeros((2, 31))
        state[1, 3:6] = 1.0, 0.5, 0.5
        tree, frames, work, out = (
            tree_arrays(model), empty_frames(), dynamics_workspace(), np.empty(31)
        )  # fmt: skip
        kept = [state.copy()]
        for _ in range(round(0.3 / step)):
            forward(tree.joint_position, state[0], frames, 14)
            velocities(state[1], frames, 14)
            accelerations(tree, frames, state, np.zeros(31), FREE, FREE, step, work, out)
            integrate(state, out, step)
            kept.append(state.copy())
        path = np.array(kept)
        rows = len(path)
        nothing = {name: np.zeros(1) for name in ("start_phase", "fell")}
        walk = Rollout(
            time=step * np.arange(rows), phase=np.zeros(rows), positions=path[:, 0],
            velocities=path[:, 1], moments=np.zeros((rows, 25)), mu=nominal_parameters(),
            ground_reaction=np.zeros((rows, 2, 3)), centre_of_pressure=np.zeros((rows, 2, 3)),
            free_moment=np.zeros((rows, 2)), centre_of_mass=path[:, 0, 3:6],
            root_force=np.zeros((rows, 6)), **nothing,
        )  # fmt: skip
        return mechanical_energy(walk, model, rows - 1) - mechanical_energy(walk, model, 0)

    coarse, fine = change(0.001), change(0.0005)
    assert fine == pytest.approx(0.5 * coarse, rel=0.05)
    fallen = model.mass * GRAVITY * 0.2
    assert abs(fine) < 0.005 * fallen


# ---- A block on a slope. ----


def sled_on(task, ground: Ground, friction: float, steps: int, **contact: float) -> Walker:
    q = np.zeros(31)
    q[5] = SLED_HEIGHT
    settings = PREDSIM.model_dump() | {"viscous_friction": 0.0} | contact
    environment = {"physics_step": 0.001, "steps_per_action": steps}
    model = on(SLED, ground)
    walker = Walker(task_of(model, task, q, contact=settings, environment=environment))
    mu = nominal_parameters()
    mu[PARAMETERS.index("friction")] = friction
    walker.set_parameters(mu)
    law, weight = contact_law(walker.task.configuration.contact, friction), SLED.mass * GRAVITY
    depths = np.linspace(0.0, 0.01, 10001)
    carried = 12.0 * law.static_force(np.full_like(depths, SLED_RADIUS), depths)
    q[5] -= float(np.interp(weight * ground.up[2], carried, depths))
    walker.reset(q, np.zeros(31), 0.0)
    return walker


@pytest.mark.parametrize("ground", [Ground(60.0), Ground(-60.0), Ground(0.0, 60.0)], ids=str)
def test_a_block_slides_down_with_what_friction_leaves_of_gravity(task, ground):
    """a = g (sin θ - μ cos θ), down the steepest way."""
    friction, walker = 0.3, sled_on(task, ground, 0.3, 200)
    recording = Trajectory(600)
    for _ in range(3):
        walker.step(np.zeros(25), np.zeros(6), recording)
    angle = np.arctan(ground.steepness)
    wanted = GRAVITY * (np.sin(angle) - friction * np.cos(angle))
    down = ground.gravity * [1.0, 1.0, 0.0]
    down /= np.linalg.norm(down)
    speed = recording.velocities[:, 3:6] @ down
    # above the transition velocity, where the force of friction is its coefficient's
    assert speed[-1] - speed[300] == pytest.approx(wanted * 0.299, rel=0.01)
    force = recording.feet[300:, :, :3].sum(axis=1)
    np.testing.assert_allclose(force[:, 2].mean(), SLED.mass * GRAVITY * np.cos(angle), rtol=0.01)


@pytest.mark.parametrize("ground", [Ground(20.0), Ground(-20.0), Ground(0.0, -20.0)], ids=str)
def test_a_block_that_friction_holds_only_creeps(task, ground):
    """The ground carries W cos θ along its normal and W sin θ against the slope, at a slip far
    below that at which friction is exhausted."""
    walker = sled_on(task, ground, 0.8, 500)
    recording = Trajectory(1000)
    for _ in range(2):
        walker.step(np.zeros(25), np.zeros(6), recording)
    force = recording.feet[-100:, :, :3].sum(axis=1).mean(axis=0)
    np.testing.assert_allclose(force, -SLED.mass * ground.gravity, atol=0.002 * SLED.mass * GRAVITY)
    creep = np.linalg.norm(walker.state[1, 3:6])
    assert creep < 0.5 * PREDSIM.transition_velocity
