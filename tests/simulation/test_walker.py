"""A body in the world: it stands, slides, bounces and walks as mechanics says."""

import math
from dataclasses import replace

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from simulation_fixtures import (
    GRAVITY,
    JOINT_ROWS,
    PREDSIM,
    ROOT_ROWS,
    SLED_HEIGHT,
    SLED_RADIUS,
    changed,
    inverse_dynamics,
    kinematics,
    random_policy,
    random_state,
    rigid_sled,
    task_of,
)

from gaitval.configuration import ContactSettings
from gaitval.coordinates import ACTUATED, COORDINATES
from gaitval.model.parameters import PARAMETERS, apply_parameters, nominal_parameters
from gaitval.model.tree import tree_arrays
from gaitval.policy.environment import WalkingEnvironment
from gaitval.policy.rollouts import record_rollout
from gaitval.walk.contact.forces import ground_forces
from gaitval.walk.simulation.servo import reference_tables, servo_stiffness
from gaitval.walk.simulation.walker import Trajectory, Walker

NO_OFFSET, NO_FORCE = np.zeros(25), np.zeros(6)


def static_depth(load: float, radius: float, contact: ContactSettings) -> float:
    """Penetration of one sphere at rest by the hard law, m."""
    k = 0.5 * contact.stiffness ** (2 / 3)
    return (load / (4 / 3 * k * np.sqrt(radius * k))) ** (2 / 3)


# ---- Standing. ----


def test_a_standing_body_presses_with_its_weight_and_nothing_else(task, peer):
    """Straight legs, leaning 8 degrees so that the centre of mass is over the middle of the feet.

    The ground under both feet resists tilting with Σ k x², some hundred Nm/rad, about the
    m g h ≈ 530 Nm/rad that the weight tilts with: locked joints alone hardly stand, like a person
    on a mattress. So stiff joints, and ankles that press against the tilt of the pelvis. This
    comes to rest exactly: after 12 s nothing moves faster than 1e-7 m/s.
    """
    q = np.zeros(31)
    for side in "rl":
        q[COORDINATES.index(f"hip_flexion_{side}")] = np.deg2rad(-8.0)
        q[COORDINATES.index(f"ankle_angle_{side}")] = np.deg2rad(8.0)
    frames, tree = kinematics(task.model, q, np.zeros(31)), tree_arrays(task.model)
    rotation, origin = (each[tree.sphere_segment] for each in (frames.rotation, frames.origin))
    centres = np.einsum("kij,kj->ki", rotation, tree.sphere_position) + origin
    weight, radius = task.model.mass * GRAVITY, tree.sphere_radius[0]
    contact = task.configuration.contact
    q[5] = radius - centres[:, 2].min() - static_depth(weight / 12, radius, contact)
    stiff = dict.fromkeys(("hip", "knee", "ankle", "subtalar", "lumbar"), 3000.0)
    standing = task_of(task.model, task, q, servo={**stiff, "toe": 1000.0, "shoulder": 500.0})
    walker = Walker(standing)
    walker.reset(q, np.zeros(31), 0.0)
    ankles = [ACTUATED.index(f"ankle_angle_{side}") for side in "rl"]
    for _ in range(1200):
        offset = np.zeros(25)
        offset[ankles] = -3.0 * walker.state[0, 1] - walker.state[1, 1]
        walker.step(offset, NO_FORCE)

    assert np.abs(walker.state[1]).max() < 1e-7
    right, left = walker.mean_ground_reaction
    assert right[2] + left[2] == pytest.approx(weight, abs=0.1)
    assert np.abs(right[:2]).max() < 0.1
    assert np.abs(left[:2]).max() < 0.1
    assert right[2] == pytest.approx(left[2], abs=0.1)
    # At rest the knees carry what statics asks of them: no moment but gravity's.
    forces, _ = ground(walker, walker.state[:1], walker.state[1:], plain=True)[0]
    peer.set(walker.state[0])
    gravity = peer.bias_forces()
    np.testing.assert_allclose(walker.mean_moments, (gravity - forces)[JOINT_ROWS], atol=1e-3)


def ground(walker, positions, velocities, *, plain=False):
    """Generalised forces (31,) and feet (2, 6) of the ground at each of the states; the plain law,
    or one step after the other as in the walker."""
    memory, results = np.zeros((12, 3)), []
    lag = np.zeros(2) if plain else walker.lag
    # as a walker is placed: carried from the first step on
    start = positions[0], velocities[0], np.zeros(2), memory, np.zeros(31), np.zeros((2, 6))
    ground_forces(walker.tree, walker.law, *start)
    for q, qd in zip(positions, velocities, strict=True):
        generalised, feet = np.zeros(31), np.zeros((2, 6))
        ground_forces(walker.tree, walker.law, q, qd, lag, memory, generalised, feet)
        results.append((generalised, feet))
    return results


# ---- A sled: sliding and bouncing. ----

SLED = rigid_sled(60.0)
SLED_WEIGHT = SLED.mass * GRAVITY


def sled(task, q, *, contact=None, step=0.001, steps=1):
    environment = {"physics_step": step, "steps_per_action": steps}
    contact = PREDSIM.model_dump() | (contact or {})
    return Walker(task_of(SLED, task, q, contact=contact, environment=environment))


def resting(task, **contact):
    """A sled at rest on the ground."""
    q = np.zeros(31)
    q[5] = SLED_HEIGHT - static_depth(SLED_WEIGHT / 12, SLED_RADIUS, PREDSIM)
    walker = sled(task, q, contact=contact, steps=50)
    walker.reset(q, np.zeros(31), 0.0)
    for _ in range(40):
        walker.step(NO_OFFSET, NO_FORCE)
    assert walker.mean_ground_reaction[:, 2].sum() == pytest.approx(SLED_WEIGHT, abs=1e-3)
    return walker


@pytest.mark.parametrize("friction", [0.6, 0.8, 1.0])
@pytest.mark.parametrize("direction", [0.0, 2.2])
def test_a_sled_is_slowed_by_friction_times_load(task, friction, direction):
    """Far above the transition velocity (0.2 m/s), without viscous friction: the force is
    σ N against the motion, so the sled loses σ g of speed every second, then stops."""
    walker = resting(task, viscous_friction=0.0, dynamic_to_static=1.0)
    mu = nominal_parameters()
    mu[PARAMETERS.index("friction")] = friction
    walker.set_parameters(mu)
    ahead = np.array([np.cos(direction), np.sin(direction)])
    start = np.zeros(31)
    start[3:5] = 2.0 * ahead
    walker.reset(walker.state[0].copy(), start, 0.0)
    recording = Trajectory(50)
    walker.step(NO_OFFSET, NO_FORCE, recording)

    force = recording.feet[3:, :, :3].sum(axis=1)  # the first steps come from no force
    speed = recording.velocities[:, 3:5] @ ahead
    assert speed.min() > 1.0
    # Smoothing leaves cf / (2 v²) < 1e-5 of the friction. The plate tilts a little under it, and
    # turns when it slides askew: its spheres do not all slip in the same direction.
    coefficient = np.linalg.norm(force[:, :2], axis=1) / force[:, 2]
    np.testing.assert_allclose(coefficient, friction, rtol=2e-4)
    assert (force[:, :2] @ ahead / np.linalg.norm(force[:, :2], axis=1)).max() < -0.9999
    assert 2.0 - speed[-1] == pytest.approx(friction * GRAVITY * 0.05, rel=0.02)
    for _ in range(30):
        walker.step(NO_OFFSET, NO_FORCE)
    assert np.linalg.norm(walker.state[1, 3:5]) < 1e-6


def bounce_speed(dissipation: float, speed: float, height: float) -> float:
    """Speed with which a body on twelve spheres passes `height` upwards after it passed it
    downwards with `speed`; the published law integrated by an adaptive method, not by ours."""
    k = 0.5 * PREDSIM.stiffness ** (2 / 3)

    def acceleration(z, v):
        x, rate = -z, -v
        fh = 4 / 3 * k * np.sqrt(SLED_RADIUS * k) * (x * x + 1e-5) ** 0.75
        fh *= 0.5 + 0.5 * np.tanh(300.0 * x)
        fn = fh * (1 + 1.5 * dissipation * rate)
        fn *= 0.5 + 0.5 * np.tanh(50.0 * (rate + 2 / (3 * dissipation)))
        return 12 * fn / SLED.mass - GRAVITY

    def passes(t, y):
        return y[0] - height

    passes.terminal, passes.direction = True, 1.0
    solution = solve_ivp(
        lambda t, y: (y[1], acceleration(*y)),
        (0.0, 2.0),
        (height, -speed),
        rtol=1e-11,
        atol=1e-13,
        events=passes,
    )
    return float(solution.y[1, -1])


def simulated_bounce(task, dissipation, speed, height, step):
    q, qd = np.zeros(31), np.zeros(31)
    q[5], qd[5] = SLED_HEIGHT + height, -speed
    walker = sled(task, q, contact={"dissipation": dissipation}, step=step)
    walker.reset(q, qd, 0.0)
    for _ in range(round(0.5 / step)):
        walker.step(NO_OFFSET, NO_FORCE)
        above = walker.state[0, 5] - SLED_HEIGHT - height
        if above > 0.0 and walker.state[1, 5] > 0.0:
            # Energy carries the speed at the end of the step back to `height`.
            return np.sqrt(walker.state[1, 5] ** 2 + 2 * GRAVITY * above)
    raise AssertionError("the sled did not come up again")


@pytest.mark.parametrize(("dissipation", "speed"), [(0.05, 0.5), (0.3, 1.0), (0.05, 4.0)])
def test_a_bounce_loses_the_energy_that_the_dissipation_says(task, dissipation, speed):
    """Semi-implicit Euler is of first order: the error halves with the step and is below 1 %
    of the speed at a fifth of the default step."""
    height = 0.0199  # contact begins just below
    theory = bounce_speed(dissipation, speed, height)
    assert theory < 0.9 * speed
    errors = [
        simulated_bounce(task, dissipation, speed, height, step) / theory - 1.0
        for step in (4e-4, 2e-4)
    ]
    assert abs(errors[1]) < 0.01
    assert errors[0] / errors[1] == pytest.approx(2.0, abs=0.2)


def test_restitution_is_one_less_dissipation_times_speed(task):
    """Hunt and Crossley (1975): e = 1 - c v for a small loss; terms of (c v)² and gravity,
    m g against an impact of 4 m/s, leave less than 0.01."""
    for dissipation in (0.005, 0.0125):
        restitution = simulated_bounce(task, dissipation, 4.0, 0.0199, 1e-4) / 4.0
        assert restitution == pytest.approx(1.0 - dissipation * 4.0, abs=0.01)


def test_the_published_dissipation_lets_a_dropped_body_settle(task):
    """With c = 2 s/m a foot does not bounce: after half a second the weight rests."""
    q = np.zeros(31)
    q[5] = SLED_HEIGHT + 0.05
    walker = sled(task, q, steps=50)
    walker.reset(q, np.zeros(31), 0.0)
    for _ in range(20):
        walker.step(NO_OFFSET, NO_FORCE)
    assert walker.mean_ground_reaction[:, 2].sum() == pytest.approx(SLED_WEIGHT, rel=0.01)


# ---- A recorded walk: the equations of motion hold at every step. ----


@pytest.fixture(scope="module")
def recorded(task):
    """0.6 s of a walk with restless actions and one push: states before and after every step."""
    environment = WalkingEnvironment(task)
    options = {"phase": 0.2, "mu": nominal_parameters(), "push": (0.25, 300.0, 0.5), "noise": 0.0}
    environment.reset(seed=1, options=options)
    start = environment.walker.state.copy()
    recording = Trajectory(60 * environment.walker.steps_per_action)
    random = np.random.default_rng(0)
    for _ in range(60):
        environment.step(random.normal(0.0, 0.3, 26), recording)
    assert recording.rows == len(recording.phase)
    positions = np.vstack([start[0], recording.positions])
    velocities = np.vstack([start[1], recording.velocities])
    return environment.walker, recording, positions, velocities


def test_the_recorded_foot_forces_are_those_of_the_state_before_the_step(recorded):
    walker, recording, q, qd = recorded
    for t, (_, feet) in enumerate(ground(walker, q[:-1], qd[:-1])):
        np.testing.assert_allclose(recording.feet[t], feet, atol=1e-9)
    assert recording.feet[:, 0, 2].max() > 0.5 * walker.weight
    assert recording.feet[:, 1, 2].max() > 0.5 * walker.weight


def test_the_impulse_of_all_forces_is_the_change_of_momentum(recorded, peer):
    """Over the whole walk, with the velocities that came out: semi-implicit Euler leaves an
    error of the first order in its step, below 1e-3 of the impulse of the weight."""
    walker, recording, q, qd = recorded
    mass, momentum = walker.task.model.mass, []
    for t in (0, -1):
        peer.set(q[t], qd[t])
        momentum.append(mass * peer.skeleton.getCOMLinearVelocity())
    force = recording.feet[:, :, :3].sum(axis=(0, 1)) + recording.root_force[:, 3:].sum(axis=0)
    impulse = walker.physics_step * force
    seconds = walker.physics_step * recording.rows
    impulse[2] -= walker.weight * seconds
    np.testing.assert_allclose(
        momentum[1] - momentum[0], impulse, atol=1e-3 * walker.weight * seconds
    )


def test_recorded_moments_are_those_of_inverse_dynamics(recorded, peer):
    """M (q̇⁺ - q̇)/h + c(q, q̇) - Jᵀ f of every step: in the joints it is the recorded moment,
    implicit springs, dampers, feed-forward and all; at the pelvis nothing but the push, so no
    hidden hand holds it (its moment rows are the balance of angular momentum)."""
    walker, recording, q, qd = recorded
    for t, (contact, _) in enumerate(ground(walker, q[:-1], qd[:-1])):
        acted = inverse_dynamics(peer, q[t], qd[t], qd[t + 1], walker.physics_step) - contact
        scale = np.abs(recording.moments[t]).max()
        np.testing.assert_allclose(acted[JOINT_ROWS], recording.moments[t], atol=1e-8 * scale)
        np.testing.assert_allclose(acted[ROOT_ROWS], recording.root_force[t], atol=1e-8 * scale)


def test_a_push_gives_its_force_times_fifty_milliseconds(recorded):
    walker, recording, _, _ = recorded
    impulse = walker.physics_step * recording.root_force.sum(axis=0)
    expected = 300.0 * 0.05 * np.array([np.cos(0.5), np.sin(0.5)])
    np.testing.assert_allclose(impulse, [0.0, 0.0, 0.0, *expected, 0.0], rtol=1e-12)
    # It starts with the first action after phase 0.25 and takes whole actions.
    pushed = np.flatnonzero(recording.root_force[:, 3])
    began = 0.2 + (pushed[0] * walker.physics_step) / walker.task.reference.stride_time
    assert 0.25 <= began < 0.25 + walker.action_seconds / walker.task.reference.stride_time
    assert len(pushed) == math.ceil(0.05 / walker.action_seconds) * walker.steps_per_action


@pytest.mark.parametrize("engine", ["compiled", "dart"])
@pytest.mark.parametrize("push", [None, (0.7, 1.0, 0.5)], ids=["no push", "1 N"])
def test_nothing_but_gravity_and_ground_acts_on_a_walk(task, peer, monkeypatch, engine, push):
    """Balance of linear and angular momentum of the whole body at every step of a walk as it is
    recorded for validation, in DART's own reading of the URDF: what changes them beyond gravity
    and the recorded feet is nothing without a push, and a push of 1 N is seen as that."""
    kept = []

    class Kept(Trajectory):
        def __init__(self, steps):
            super().__init__(steps)
            kept.append(self)

    monkeypatch.setattr("gaitval.policy.rollouts.Trajectory", Kept)
    rollout = record_rollout(
        WalkingEnvironment(task, engine=engine),
        random_policy(task, scale=0.1),
        mu=nominal_parameters(),
        start_phase=0.6,
        cycles=0.4,
        push=push,
    )
    (recording,) = kept
    assert recording.rows - 1 == len(rollout.time) > 200
    weight = task.model.mass * GRAVITY
    largest = np.zeros(2)
    for t in range(1, recording.rows):
        q, qd, after = recording.positions[t - 1], *recording.velocities[t - 1 : t + 1]
        changed_by = inverse_dynamics(
            peer, q, qd, after, task.configuration.environment.physics_step
        )
        force, moment = recording.feet[t, :, :3].sum(axis=0), recording.feet[t, :, 3:].sum(axis=0)
        about_pelvis = moment - np.cross(q[3:6], force)
        external = changed_by[ROOT_ROWS] - [*about_pelvis, *force]
        np.testing.assert_allclose(external, rollout.root_force[t - 1], atol=1e-8 * weight)
        largest = np.maximum(largest, [np.abs(external[:3]).max(), np.linalg.norm(external[3:])])
    expected = 0.0 if push is None else push[1]
    np.testing.assert_allclose(largest, [0.0, expected], atol=1e-8 * weight)
    assert rollout.root_force.any() == (push is not None)


def test_recorded_forces_tend_to_the_published_law_as_the_step_shrinks(task):
    """Linearly implicit contact lags behind the law by a share that falls with the step: half
    the step, at most 0.55 of the distance. In the first 0.3 s from a reset, where the forces
    start from none, it is 7 % of the body weight, root mean square, at the default step."""
    distances = []
    for step in (0.002, 0.001, 0.0005):
        steps, squares = round(0.03 / step), []
        finer = changed(task, environment={"physics_step": step, "steps_per_action": steps})
        walker = Walker(finer)
        for row in (0, 200, 400, 600, 800):
            start = np.array([task.reference.positions[row], task.reference.velocities[row]])
            walker.reset(*start, row / 1024)
            recording = Trajectory(10 * steps)
            for _ in range(10):
                walker.step(NO_OFFSET, NO_FORCE, recording)
            q = np.vstack([start[:1], recording.positions[:-1]])
            qd = np.vstack([start[1:], recording.velocities[:-1]])
            law = np.array([feet for _, feet in ground(walker, q, qd, plain=True)])
            squares.append(np.mean(((recording.feet - law)[..., :3] / walker.weight) ** 2))
        distances.append(np.sqrt(np.mean(squares)))
    assert distances[0] < 0.1
    assert distances[1] < 0.55 * distances[0]
    assert distances[2] < 0.55 * distances[1]


# ---- The servo. ----


def test_the_servo_is_the_stated_law(task):
    """τ = k (q̂ + a - q) + d (q̂̇ - q̇) + τ_ff - β q̇ with the state after the step, k, d and β
    as configured, the reference and its moments read at the phase before the step."""
    damping = 0.7
    mu = nominal_parameters()
    mu[PARAMETERS.index("damping")] = damping
    single = changed(task, environment={"steps_per_action": 1}, servo={"feed_forward": 0.6})
    walker = Walker(single)
    walker.set_parameters(mu)
    row = 300
    reference = task.reference
    q, qd = reference.positions[row].copy(), reference.velocities[row].copy()
    q[6:] += 0.05
    walker.reset(q, qd, reference.phase[row])
    offset = np.linspace(-0.2, 0.2, 25)
    walker.step(offset, NO_FORCE)

    servo = single.configuration.servo
    k = servo_stiffness(servo, task.model.mass)
    after_q, after_qd = walker.state[:, 6:]
    expected = (
        k * (reference.positions[row, 6:] + offset - after_q)
        + servo.damping_time * k * (reference.velocities[row, 6:] - after_qd)
        + reference_tables(reference, 0.6).moments[row]
        - damping * after_qd
    )
    np.testing.assert_allclose(walker.mean_moments, expected, atol=1e-9)
    np.testing.assert_allclose(walker.mean_square_moments, expected**2, atol=1e-6)


def test_targets_move_without_steps(task):
    """The offset goes from the last action's to this one's in equal parts, so joint moments do
    not jump by more than the body's motion explains when the action changes."""
    walker = Walker(task)
    row = 100
    walker.reset(task.reference.positions[row], task.reference.velocities[row], row / 1024)
    recording = Trajectory(3 * walker.steps_per_action)
    for sign in (0.0, 1.0, -1.0):
        walker.step(np.full(25, 0.2 * sign), NO_FORCE, recording)
        np.testing.assert_array_equal(walker.offset, np.full(25, 0.2 * sign))
    torso = ACTUATED.index("lumbar_extension")
    jumps = np.abs(np.diff(recording.moments[:, torso]))
    part = walker.gains[0, torso] * 0.4 / walker.steps_per_action
    assert jumps.max() < 2.0 * part


# ---- Determinism, parameters, bookkeeping. ----


def run(walker, q, qd, actions=5):
    walker.reset(q, qd, 0.3)
    recording = Trajectory(actions * walker.steps_per_action)
    for i in range(actions):
        walker.step(np.full(25, 0.01 * i), NO_FORCE, recording)
    return recording


@pytest.mark.parametrize("pace", [0.5, 1.3])
def test_a_pace_scales_phase_and_reference_velocity(task, pace):
    """What the servo commands, found back from the moment that acted and the state after the step,
    differs between two paces by the damping times the difference of the velocities asked for."""
    walker = Walker(task)
    row = 307
    commands = []
    for each in (1.0, pace):
        walker.reset(task.reference.positions[row], task.reference.velocities[row], row / 1024)
        recording = Trajectory(walker.steps_per_action)
        walker.step(NO_OFFSET, NO_FORCE, recording, pace=each)
        passive = walker.mu[PARAMETERS.index("damping")]
        stiffness, damping = walker.gains
        commands.append(
            recording.moments[0]
            + stiffness * recording.positions[0, 6:]
            + (damping + passive) * recording.velocities[0, 6:]
        )
        assert recording.phase[-1] - row / 1024 == pytest.approx(
            each * walker.action_seconds / task.reference.stride_time, rel=1e-9
        )
    expected = walker.gains[1] * (pace - 1.0) * task.reference.velocities[row, 6:]
    np.testing.assert_allclose(commands[1] - commands[0], expected, atol=1e-8)
    assert np.abs(expected).max() > 1.0


def test_the_same_start_gives_the_same_walk_bit_for_bit(task):
    """In a new walker, and in one that has already walked something else."""
    row = 307
    q, qd = task.reference.positions[row], task.reference.velocities[row]
    first = run(Walker(task), q, qd)
    used = Walker(task)
    run(used, *random_state(0))
    for second in (run(Walker(task), q, qd), run(used, q, qd)):
        np.testing.assert_array_equal(first.positions, second.positions)
        np.testing.assert_array_equal(first.feet, second.feet)
        np.testing.assert_array_equal(first.moments, second.moments)


def test_parameters_change_the_body_completely_and_back(task):
    row = 307
    q, qd = task.reference.positions[row], task.reference.velocities[row]
    mu = nominal_parameters()
    mu[2:5] = 0.97, 1.02, 1.03
    mu[5:] = np.linspace(-0.01, 0.01, 9)
    walker = Walker(task)
    nominal = run(walker, q, qd)
    walker.set_parameters(mu)
    moved = run(walker, q, qd)
    built = Walker(replace(task, model=apply_parameters(task.model, mu)))
    np.testing.assert_array_equal(run(built, q, qd).positions, moved.positions)
    assert np.abs(moved.positions - nominal.positions).max() > 1e-4
    walker.set_parameters(nominal_parameters())
    np.testing.assert_array_equal(run(walker, q, qd).positions, nominal.positions)


@pytest.mark.parametrize("name", ["damping", "friction"])
def test_damping_and_friction_reach_the_simulation(task, name):
    row = 307
    q, qd = task.reference.positions[row], task.reference.velocities[row]
    walker = Walker(task)
    before = run(walker, q, qd)
    mu = nominal_parameters()
    mu[PARAMETERS.index(name)] *= 0.5
    walker.set_parameters(mu)
    assert np.abs(run(walker, q, qd).positions - before.positions).max() > 1e-7


def test_phase_counts_cycles_in_the_records_time(task):
    walker = Walker(task)
    walker.reset(task.reference.positions[0], task.reference.velocities[0], 0.9)
    seconds = 0.0
    for _ in range(10):
        walker.step(NO_OFFSET, NO_FORCE)
        seconds += walker.action_seconds
    assert walker.phase == pytest.approx(0.9 + seconds / task.reference.stride_time, rel=1e-12)


def test_a_reset_forgets_what_the_last_walk_carried(task):
    walker = Walker(task)
    walker.set_parameters(nominal_parameters())
    reference = task.reference
    start = reference.positions[0], reference.velocities[0], float(reference.phase[0])
    walker.reset(*start)
    walker.step(np.full(25, 0.1), NO_FORCE)
    of_action = ("mean_ground_reaction", "mean_moments", "mean_square_moments", "offset")
    assert all(np.abs(getattr(walker, name)).max() > 0.0 for name in of_action)
    walker.reset(*start)
    for name in of_action:
        np.testing.assert_array_equal(getattr(walker, name), 0.0, err_msg=name)
