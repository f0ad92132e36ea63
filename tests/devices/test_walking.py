import numpy as np
import pytest
from ground_again import engine_steps, ground_again
from scipy.spatial.transform import Rotation
from simulation_fixtures import changed

from gaitval.apps.devices.walking import (
    DeviceEnvironment,
    carried,
    moments_of_carrying,
    walk_with,
    with_devices,
)
from gaitval.coordinates import ACTUATED, COORDINATES
from gaitval.model.devices.device import Device, load_devices
from gaitval.model.devices.loads import trunk_load
from gaitval.model.devices.springs_and_motors import Spring
from gaitval.model.parameters import apply_parameters
from gaitval.policy.environment import WalkingEnvironment
from gaitval.policy.rollouts import record_rollout
from gaitval.walk.simulation.mujoco_body import mjcf

MOTOR = {"torque": 50.0, "speed": 50.0, "power": 5000.0, "bandwidth": 1000.0}


def made(**hinge):
    return Device.model_validate({"name": "d", "source": "a test", "hinges": [hinge]})


class Constant:
    """Four lines are a controller."""

    def torque(self, measured):
        return 3.0


def walked(person, devices, cycles=2.0, *, engine="compiled", own=None, start=0.0):
    environment = DeviceEnvironment(with_devices(person.task, devices, own), engine=engine)
    return walk_with(environment, person.policy, mu=person.mu, cycles=cycles, start_phase=start)


def test_a_device_that_does_nothing_changes_no_bit(person):
    light = made(joint="knee_angle", motor=MOTOR)
    with_it = walked(person, [light]).rollout
    plain = record_rollout(
        WalkingEnvironment(person.task), person.policy, mu=person.mu, start_phase=0.0, cycles=2.0
    )
    np.testing.assert_array_equal(with_it.positions, plain.positions)
    np.testing.assert_array_equal(with_it.moments, plain.moments)


def test_who_carries_a_load_gives_the_moments_that_it_needs(person):
    load = trunk_load(30.0, person.task.model.mass)
    assert carried(with_devices(person.task, [load])) == pytest.approx(0.30)
    for worn in ("foot_2kg", "hip_exo"):
        assert carried(with_devices(person.task, load_devices(worn))) == 0.0
    # As much more as the foot carries: all of a leg that stands alone, nothing of one that swings.
    moments = np.ones((3, 25))
    forces = np.zeros((3, 2, 3))
    forces[:, :, 2] = [[1.0, 0.0], [0.5, 0.5], [0.0, 1.1]]
    more = moments_of_carrying(moments, forces, 0.3) - 1.0
    for name, expected in (
        ("hip_flexion_r", [0.3, 0.15, 0.0]), ("ankle_angle_l", [0.0, 0.15, 0.3]),
        ("lumbar_extension", [0.3, 0.3, 0.3]), ("elbow_flex_r", [0.0, 0.0, 0.0]),
    ):  # fmt: skip
        np.testing.assert_allclose(more[:, ACTUATED.index(name)], expected)
    environment = DeviceEnvironment(with_devices(person.task, [load]))
    plain = WalkingEnvironment(person.task)
    fed, before = (each.walker.body.tables.moments for each in (environment, plain))
    knee = np.abs(before[:, ACTUATED.index("knee_angle_r")]).argmax()
    assert np.abs(fed[knee]).sum() > 1.1 * np.abs(before[knee]).sum()


@pytest.mark.parametrize("joint", ["hip_flexion", "knee_angle", "ankle_angle"])
def test_a_positive_torque_raises_the_coordinate_on_both_sides(person, joint):
    device = made(joint=joint, motor=MOTOR)
    pushed, plain = (
        walked(person, [device], cycles=0.08, own=own, start=0.3) for own in (Constant, None)
    )
    assert pushed.hinges == (f"{joint}_r", f"{joint}_l")
    rows = min(len(pushed.limb), len(plain.limb))
    np.testing.assert_allclose(pushed.limb[5:], 3.0, rtol=1e-3)
    change = pushed.rollout.velocities[:rows] - plain.rollout.velocities[:rows]
    for name in pushed.hinges:
        assert change[2:10, 6 + ACTUATED.index(name)].min() > 0.0


class Apart:
    """Opposite torques on both sides, which change."""

    def torque(self, measured):
        sign = 1.0 if measured.side == "right" else -1.0
        return sign * (8.0 if measured.time < 0.05 else -4.0)


@pytest.mark.parametrize("limit", [50.0, 3.0])
@pytest.mark.parametrize("joint", ["hip_flexion", "ankle_angle"])
def test_a_motor_in_a_walk_gives_its_sides_command_with_its_lag_within_its_limit(
    person, joint, limit
):
    """By its equation, written out: dτ/dt = 2πB (command - τ), |τ| at most its limit. What it gives
    acts on the limb, and muscles and motor together on the joint."""
    bandwidth = 8.0
    device = made(joint=joint, motor=MOTOR | {"torque": limit, "bandwidth": bandwidth})
    walk = walked(person, [device], cycles=0.15, own=Apart)
    step = person.task.configuration.environment.physics_step
    part = 1.0 - np.exp(-2.0 * np.pi * bandwidth * step)
    for number, (side, sign) in enumerate((("r", 1.0), ("l", -1.0))):
        assert walk.hinges[number] == f"{joint}_{side}"
        command = walk.command[:, number]
        torque = np.clip(part * command[0], -limit, limit)  # of the step to the first state
        assert (np.sign(command[:5]) == sign).all()
        assert (np.sign(command[-5:]) == -sign).all()
        for now, asked in zip(walk.motor[:, number], command, strict=True):
            torque = np.clip(torque + part * (asked - torque), -limit, limit)
            assert now == pytest.approx(torque, abs=1e-9)
        assert np.abs(walk.motor[:, number]).max() == pytest.approx(min(limit, 8.0), rel=0.1)
    np.testing.assert_array_equal(walk.limb, walk.motor)  # neither strap nor spring
    own = walk.total_moments[:, walk.joints] - walk.limb
    np.testing.assert_allclose(own, walk.rollout.moments[:, walk.joints], atol=1e-9)


def test_a_motor_at_the_back_walks(person):
    """Its segment is the trunk, which has no side."""
    device = made(joint="lumbar_extension", motor=MOTOR)
    walk = walked(person, [device], cycles=0.08, own=Constant)
    assert walk.hinges == ("lumbar_extension",)
    np.testing.assert_allclose(walk.limb[5:], 3.0, rtol=1e-3)


def test_power_is_torque_times_speed_and_totals_are_sums(person):
    walk = walked(person, load_devices("hip_exo"))
    hip = ACTUATED.index("hip_flexion_l")
    column = walk.hinges.index("hip_flexion_l")
    rate = walk.rollout.velocities[:, 6 + hip]
    np.testing.assert_array_equal(walk.power[:, column], walk.limb[:, column] * rate)
    own = walk.total_moments[:, hip] - walk.limb[:, column]
    np.testing.assert_allclose(own, walk.rollout.moments[:, hip], atol=1e-9)
    # Straps let the device's angle differ from the joint's.
    apart = walk.angle[:, column] - walk.rollout.positions[:, 6 + hip]
    assert 1e-3 < np.abs(apart).max() < 0.2


@pytest.mark.parametrize("side", ["right", "left"])
def test_a_locked_knee_is_a_stiff_spring(person, side):
    """A prosthesis' springs are integrated implicitly, so that no stiffness is too large."""
    (device,) = load_devices("above_knee")
    locked = Spring(stiffness=20000.0, rest=0.05)
    hinges = [
        each.model_copy(update={"spring": locked}) if each.joint == "knee_angle" else each
        for each in device.hinges
    ]
    walk = walked(
        person, [device.model_copy(update={"hinges": tuple(hinges), "sides": (side,)})], cycles=0.5
    )
    knee = walk.rollout.positions[:, 6 + ACTUATED.index(f"knee_angle_{side[0]}")]
    # From the reference's angle at the start it springs back within a tenth of a second.
    settled = round(0.1 * len(knee) / walk.rollout.time[-1])
    assert np.isfinite(knee).all()
    assert np.degrees(np.abs(knee[settled:] - 0.05).max()) < 1.0


@pytest.mark.slow
@pytest.mark.parametrize("name", ["hip_exo", "below_knee"])
def test_dart_walks_alike(person, name):
    devices = load_devices(name)
    ours, theirs = (walked(person, devices, cycles=0.3, engine=e) for e in ("compiled", "dart"))
    np.testing.assert_allclose(ours.rollout.positions, theirs.rollout.positions, atol=1e-6)
    np.testing.assert_allclose(ours.limb, theirs.limb, atol=1e-4)


@pytest.mark.slow
def test_mujoco_walks_similarly(person):
    """Closely but for the toes, which are light; at half of the usual step, which halves what they
    differ by, for MuJoCo has a quarter of it.
    """
    devices, usual = load_devices("ankle_spring"), person.task.configuration.environment
    finer = {"physics_step": usual.physics_step / 2, "steps_per_action": 2 * usual.steps_per_action}
    person = person._replace(task=changed(person.task, environment=finer))
    ours, theirs = (walked(person, devices, cycles=0.2, engine=e) for e in ("compiled", "mujoco"))
    rows = min(len(ours.limb), len(theirs.limb))
    apart = np.abs(ours.rollout.positions[:rows] - theirs.rollout.positions[:rows])
    toes = [COORDINATES.index(f"mtp_angle_{side}") for side in "rl"]
    assert np.delete(apart, toes, axis=1).max() < 0.012
    assert apart.max() < 0.035


def stepped(walk, joint):
    """Angle (rad) and rate (rad/s) of a joint after the step that follows each row but the last, by
    which implicit springs and dampers act."""
    angle = walk.positions[:, 6 + ACTUATED.index(joint)]
    return angle[1:], np.diff(angle) / (walk.time[1] - walk.time[0])


def test_a_prosthesis_has_no_muscles(person):
    walk = walked(person, load_devices("below_knee"), cycles=0.5)
    for joint in ("ankle_angle", "subtalar_angle", "mtp_angle"):
        right, left = ACTUATED.index(f"{joint}_r"), ACTUATED.index(f"{joint}_l")
        assert np.abs(walk.rollout.moments[:, right]).max() == 0.0
        assert np.abs(walk.rollout.moments[:, left]).max() > 0.0
    ankle = walk.hinges.index("ankle_angle_r")
    q, qd = stepped(walk.rollout, "ankle_angle_r")
    wanted = 400.0 * (0.12 - q) - 2.0 * qd
    np.testing.assert_allclose(walk.limb[:-1, ankle], wanted, atol=1e-9)


def test_a_knee_of_a_prosthesis_obeys_its_table(person):
    """Its extension stop pushes below .05 rad, and its damper yields slowly under load."""
    walk = walked(person, load_devices("above_knee"), cycles=0.95)
    steps = WalkingEnvironment(person.task).walker.steps_per_action
    q, qd = stepped(walk.rollout, "knee_angle_r")
    q, qd = q[steps - 1 :], qd[steps - 1 :]
    limb = walk.limb[steps - 1 : -1, walk.hinges.index("knee_angle_r")]
    # The row of what it measured before each action; before the first one nothing is recorded.
    seen = np.repeat(np.arange(steps, steps + len(q), steps) - 1, steps)[: len(q)]
    load = walk.rollout.ground_reaction[seen - 1, 0, 2]  # of the last step, which led there
    stop = np.where(
        walk.rollout.positions[seen, 6 + ACTUATED.index("knee_angle_r")] <= 0.05, 300.0, 0
    )
    for loaded, damping in ((load >= 40.0, 40.5), (load < 20.0, 0.5)):
        wanted = stop * (0.05 - q) - damping * qd
        assert loaded.sum() > 50
        np.testing.assert_allclose(limb[loaded], wanted[loaded], atol=1e-9)
    assert 20 < np.count_nonzero(stop) < len(stop) - 20


def test_clutches_and_stance_dampers_act_when_their_tables_say(person):
    """Too weak to change the walk, whose phase is then that of the reference."""
    spring = {"stiffness": 1e-3, "rest": 3.0}
    device = Device.model_validate(
        {
            "name": "d",
            "source": "a test",
            "hinges": [
                {"joint": "hip_flexion", "spring": spring,
                 "clutch": {"while": "phase", "phases": [0.9, 0.2]}},
                {"joint": "knee_angle", "stance_damper": {"damping": 1e-3, "until": 0.3}},
                {"joint": "ankle_angle", "spring": spring, "clutch": {"while": "loaded"}},
            ],
        }
    )  # fmt: skip
    walk = walked(person, [device], cycles=3.0)
    late = walk.rollout.phase > 1.5
    phase = walk.rollout.phase[late] % 1.0
    # A twentieth of a cycle around each change is left out: the walker's steps are not exact.
    for joint, on, off in (
        ("hip_flexion_r", (phase > 0.95) | (phase < 0.15), (phase > 0.25) & (phase < 0.85)),
        ("knee_angle_r", (phase > 0.05) & (phase < 0.25), (phase > 0.35) & (phase < 0.95)),
        ("ankle_angle_r", (phase > 0.05) & (phase < 0.55), (phase > 0.70) & (phase < 0.95)),
    ):
        torque = walk.limb[late, walk.hinges.index(joint)]
        assert (torque[on] != 0.0).all()
        assert (torque[off] == 0.0).all()


def test_a_controller_measures_the_torque_and_the_angle_of_its_device(person):
    seen = []

    class Curious:
        def torque(self, measured):
            if measured.side == "right":
                seen.append((measured.torque, measured.angle, measured.speed))
            return 10.0

    task = with_devices(person.task, load_devices("ankle_exo"), Curious)
    environment = DeviceEnvironment(task)
    walk_with(environment, person.policy, mu=person.mu, cycles=0.3)
    steps = WalkingEnvironment(person.task).walker.steps_per_action
    last = slice(steps - 1, -1, steps)  # of each action but the last
    hinge = [fit.name for fit in environment.walker.fitted].index("ankle_angle_r")
    logged = environment.walker.logged()[last, hinge][:, [0, 3, 4]]  # limb, angle and speed
    np.testing.assert_array_equal(np.array(seen[1:]), logged)


def test_a_controller_sees_its_own_side_and_must_give_a_number(person):
    seen = []

    class Curious:
        def torque(self, measured):
            seen.append((measured.side, measured.loaded, measured.phase))
            return float("nan") if len(seen) > 200 else 0.0

    with pytest.raises(ValueError, match="Return a finite number"):
        walked(person, load_devices("ankle_exo"), own=Curious)
    sides = {side: [s for s in seen if s[0] == side] for side in ("right", "left")}
    assert len(sides["right"]) - len(sides["left"]) in (0, 1)
    # The walk starts at the right heel strike: the right foot is on the ground, the left one soon
    # is not.
    assert sides["right"][10][1]
    assert not sides["left"][40][1]
    assert np.isnan(sides["left"][10][2])
    assert not np.isnan(sides["left"][99][2])


def test_the_same_walk_twice_is_the_same(person):
    devices = load_devices("hip_exo")
    environment = DeviceEnvironment(with_devices(person.task, devices))
    first, second = (
        walk_with(environment, person.policy, mu=person.mu, cycles=1.5) for _ in range(2)
    )
    np.testing.assert_array_equal(first.limb, second.limb)


def test_a_device_makes_nobody_stronger(person):
    """Muscles are those of the person alone, however much is carried."""
    laden = with_devices(person.task, load_devices("backpack"))
    assert laden.model.mass > person.task.model.mass + 5.0
    gains = DeviceEnvironment(laden).walker.gains
    np.testing.assert_array_equal(gains, WalkingEnvironment(person.task).walker.gains)


@pytest.mark.slow
def test_the_ground_acts_under_the_feet_of_a_walker_that_was_moved(person):
    """The contact law at the recorded states, which knows nothing of the move."""
    task = with_devices(person.task, load_devices("backpack"))
    environment = DeviceEnvironment(task)
    found = walk_with(environment, person.policy, mu=person.mu, cycles=2.5).rollout
    assert np.hypot(*environment.shift) > 0.01
    feet, _ = ground_again(found, task, found.velocities)
    loaded = feet[..., 2] > 100.0
    loaded[:50] = False
    place = np.stack([-feet[..., 4], feet[..., 3]], axis=-1)[loaded] / feet[loaded][:, 2:3]
    # The walker is moved between actions, by less than a millimetre each time.
    np.testing.assert_allclose(found.centre_of_pressure[loaded][:, :2], place, atol=1.5e-3)


@pytest.mark.parametrize("name", ["hip_exo", "above_knee"])
def test_work_of_muscles_device_and_ground_is_the_change_of_energy(person, name):
    """Kinetic and potential energy of the laden body in MuJoCo."""
    mujoco = pytest.importorskip("mujoco")
    task = with_devices(person.task, load_devices(name))
    environment = DeviceEnvironment(task)
    with engine_steps() as steps:
        walk = walk_with(environment, person.policy, mu=person.mu, cycles=0.7)
    ((_, positions, velocities, *_),) = steps
    model = mujoco.MjModel.from_xml_string(mjcf(apply_parameters(task.model, person.mu)))
    model.opt.enableflags |= mujoco.mjtEnableBit.mjENBL_ENERGY
    data = mujoco.MjData(model)
    places = [model.joint(each).qposadr[0] for each in ACTUATED]
    rates = [model.joint(each).dofadr[0] for each in ACTUATED]
    energy = []
    for q, v in zip(positions, velocities, strict=True):
        turn = Rotation.from_rotvec(q[:3])
        data.qpos[:3], data.qpos[3:7] = q[3:6], turn.as_quat(scalar_first=True)
        data.qpos[places] = q[6:]
        data.qvel[:3], data.qvel[3:6], data.qvel[rates] = v[3:6], turn.inv().apply(v[:3]), v[6:]
        mujoco.mj_forward(model, data)
        energy.append(data.energy.sum())
    _, acting = ground_again(walk.rollout, task, velocities[:-1])
    acting[:, 6:] += walk.total_moments
    step = walk.rollout.time[1] - walk.rollout.time[0]
    power = (acting * 0.5 * (velocities[1:] + velocities[:-1])).sum(axis=1)[50:]
    balance = np.cumsum(power) * step - (np.array(energy[51:]) - energy[50])
    device = np.abs(walk.power[50:]).sum() * step
    assert np.abs(balance).max() < 0.01 * np.abs(power).sum() * step
    assert np.abs(balance).max() < 0.2 * device


def test_a_command_acts_after_the_delay_of_the_motor(person):
    late = made(joint="knee_angle", motor=MOTOR | {"delay": 0.05})
    walk = walked(person, [late], cycles=0.15, own=Constant)
    time = walk.rollout.time
    action = WalkingEnvironment(person.task).walker.action_seconds
    first = np.ceil(0.05 / action) * action  # an action's command is held throughout it
    np.testing.assert_array_equal(walk.command[time < first - 1e-6], 0.0)
    np.testing.assert_array_equal(walk.command[time > first - 1e-6], 3.0)
