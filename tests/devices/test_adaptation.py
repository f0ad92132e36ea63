from dataclasses import replace

import numpy as np
import pytest

from gaitval.apps.devices.adaptation import kinematics_kept, walk_without
from gaitval.apps.devices.curves import walk_curves
from gaitval.apps.devices.device_walk import DeviceWalk
from gaitval.apps.devices.page import strap_loads
from gaitval.apps.devices.study import DeviceOutcome
from gaitval.apps.devices.walking import DeviceEnvironment, walk_with, with_devices
from gaitval.coordinates import ACTUATED
from gaitval.errors import RecordError
from gaitval.gait.filters import low_pass_simulated
from gaitval.metrics.cycles import find_cycles
from gaitval.metrics.walk_muscles import CUTOFF, walk_motion
from gaitval.model.body import SEGMENTS
from gaitval.model.devices.composite import fitted
from gaitval.model.devices.device import Device, load_devices
from gaitval.model.parameters import apply_parameters, nominal_parameters
from gaitval.model.tree import ROOT_DOFS, segment_frames

CYCLES = 8.0


@pytest.fixture(scope="module")
def plain(person):
    return walk_without(with_devices(person.task, []), person.policy, person.mu, CYCLES)


def kept(person, plain, devices):
    environment = DeviceEnvironment(with_devices(person.task, devices))
    return kinematics_kept(environment, plain.rollout)


def test_what_a_spring_gives_is_what_the_muscles_need_not(person, plain):
    """A device without mass: muscles and device together give what the muscles gave alone."""
    (device,) = load_devices("ankle_spring")
    weightless = device.model_copy(update={"parts": ()})
    found = kept(person, plain, [weightless])
    ankle = ACTUATED.index("ankle_angle_r")
    column = found.walk.hinges.index("ankle_angle_r")
    total = found.own[:, ankle] + found.walk.limb[:, column]
    np.testing.assert_allclose(total, plain.rollout.moments[:, ankle], atol=1e-9)
    assert found.walk.limb[:, column].min() < -20.0
    assert found.walk.limb[:, column].max() < 1.0  # it pulls the foot down only
    np.testing.assert_array_equal(found.walk.rollout.positions, plain.rollout.positions)


def apart(walk: DeviceWalk) -> list[float]:
    """Degrees, as the report has them."""
    return [each["apart"] for each in strap_loads(DeviceOutcome("", walk, None, 0.0, False, None))]


def test_a_prosthesis_led_along_its_own_walk_gives_what_it_gave(person):
    environment = DeviceEnvironment(with_devices(person.task, load_devices("below_knee")))
    walk = walk_with(environment, person.policy, mu=person.mu, cycles=0.6)
    led = kinematics_kept(environment, walk.rollout).walk
    # what acts after the last row is not known
    np.testing.assert_allclose(led.limb[:-1], walk.limb[:-1], atol=1e-9)
    assert apart(led) == apart(walk) == [0.0, 0.0, 0.0]


def test_what_has_neither_strap_nor_socket_turns_with_the_joint(person, plain):
    hinge = {"joint": "knee_angle", "damping": 1.0}
    device = Device.model_validate({"name": "d", "source": "a test", "hinges": [hinge]})
    environment = DeviceEnvironment(with_devices(person.task, [device]))
    walk = walk_with(environment, person.policy, mu=person.mu, cycles=0.3)
    assert apart(walk) == apart(kept(person, plain, [device]).walk) == [0.0, 0.0]


def test_muscles_swing_what_is_tied_to_the_leg(person, plain):
    """The moments that muscles share are those of the body with its loads."""
    devices = load_devices("foot_4kg")
    found = kept(person, plain, devices)
    rollout = found.walk.rollout
    cycles = find_cycles(rollout, person.task.configuration)
    body = apply_parameters(person.task.model, person.mu)
    laden = apply_parameters(fitted(person.task.model, devices), person.mu)
    step = float(rollout.time[1] - rollout.time[0])
    wanted = low_pass_simulated(found.own, step=step, frequency=CUTOFF)
    hip = ACTUATED.index("hip_flexion_r")
    off = {}
    for name, worn in (("laden", laden), ("bare", None)):
        motion = walk_motion(rollout, cycles, body, height=1.53, laden=worn)
        expected = np.interp(motion.dynamics.time, rollout.time, wanted[:, hip])
        middle = slice(50, -50)
        off[name] = np.abs(motion.dynamics.moments[middle, hip] - expected[middle]).mean()
    assert off["laden"] < 0.3 * off["bare"]


def test_who_carries_a_load_has_another_centre_of_mass(person):
    devices, mu = load_devices("foot_4kg"), nominal_parameters()
    (part,) = devices[0].parts
    task = with_devices(person.task, devices)
    plain = walk_without(task, person.policy, mu, 0.3).rollout
    found = kinematics_kept(DeviceEnvironment(task), plain).walk.rollout.centre_of_mass
    body = person.task.model
    total = body.mass * plain.centre_of_mass
    frames = segment_frames(body, plain.positions)
    for side in "rl":  # in the middle plane of each foot
        foot = frames[:, SEGMENTS.index(f"foot_{side}")]
        total += part.mass * (foot[:, :3, 3] + foot[:, :3, :3] @ np.array(part.centre))
    np.testing.assert_allclose(found, total / (body.mass + 2 * part.mass), atol=1e-12)


def test_an_added_mass_needs_its_weight_from_the_ground(person, plain):
    found = kept(person, plain, load_devices("backpack"))
    more = found.walk.rollout.ground_reaction - plain.rollout.ground_reaction
    rows = slice(600, 2200)  # whole steps, without the ends
    assert more[rows, :, 2].sum(axis=1).mean() == pytest.approx(6.0 * 9.81, rel=0.05)
    # a foot in the air carries nothing of it
    swing = np.abs(plain.rollout.ground_reaction[..., 2]) < 0.05  # N, what the smooth law leaves
    assert swing[rows].any(axis=0).all()
    assert np.abs(more[swing]).max() < 0.05


def test_the_ankle_carries_the_further_force_of_the_ground(person, plain):
    """Of a load at the back, whose foot is as before: moment of that force about the ankle."""
    walk = kept(person, plain, load_devices("backpack")).walk.rollout
    more = walk.ground_reaction[:, 0] - plain.rollout.ground_reaction[:, 0]
    frames = segment_frames(apply_parameters(person.task.model, person.mu), walk.positions)
    shank, foot = (frames[:, SEGMENTS.index(f"{name}_r")] for name in ("shank", "foot"))
    arm = np.nan_to_num(walk.centre_of_pressure[:, 0]) - foot[:, :3, 3]
    # Dorsiflexion turns about the shank's -y, and the muscles hold what the ground does.
    needed = np.einsum("ti,ti->t", shank[:, :3, 1], np.cross(arm, more))
    ankle = ACTUATED.index("ankle_angle_r")
    change = walk.moments[:, ankle] - plain.rollout.moments[:, ankle]
    np.testing.assert_allclose(change, needed, atol=1e-6)
    assert np.abs(needed).max() > 5.0


def test_an_inertia_at_the_foot_needs_more_moment_in_swing(person, plain):
    found = kept(person, plain, load_devices("foot_4kg"))
    hip = ACTUATED.index("hip_flexion_r")
    off = plain.rollout.ground_reaction[600:2200, 0, 2] < 5.0
    before = np.abs(plain.rollout.moments[600:2200, hip][off]).max()
    assert np.abs(found.own[600:2200, hip][off]).max() > 1.2 * before


def test_curves_are_means_of_whole_cycles(person, plain):
    curves = walk_curves(plain, person.task.configuration, person.task.model.mass)
    rollout, cycles = plain.rollout, find_cycles(plain.rollout, person.task.configuration)
    assert curves.cycles["right"] >= 2
    stride = person.task.reference.stride_time
    assert curves.stride_time["left"] == pytest.approx(stride, rel=0.05)
    assert 0.5 < curves.stance["right"] < 0.75
    assert 0.9 < curves.forces["right"].max() < 1.4
    threshold = person.task.configuration.contact.event_threshold
    for column, side in enumerate(("right", "left")):
        loaded = rollout.ground_reaction[:, column, 2] > threshold
        shares = [
            loaded[a:b].mean() for a, b in zip(cycles.starts[side], cycles.ends[side], strict=True)
        ]
        assert curves.stance[side] == pytest.approx(np.mean(shares), abs=0.005)
        net = curves.work["ankle_angle", side] - curves.negative_work["ankle_angle", side]
        ankle = ACTUATED.index(f"ankle_angle_{side[0]}")
        rows = slice(cycles.starts[side][0], cycles.ends[side][-1])
        power = (rollout.moments[rows, ankle] * rollout.velocities[rows, ROOT_DOFS + ankle]).sum()
        mass, step = person.task.model.mass, rollout.time[1] - rollout.time[0]
        # what the report shows is low-passed at 10 Hz, which leaves 2 % of the work out
        within = 0.02 * curves.work["ankle_angle", side]
        assert net == pytest.approx(power * step / mass / curves.cycles[side], abs=within)
        assert np.abs(curves.device["hip_flexion", side]).max() == 0.0


def test_unlike_strides_do_not_cancel_in_their_work(person, plain):
    """Power that is up in one stride and down in the next does work in both."""
    cycles = find_cycles(plain.rollout, person.task.configuration)
    knee, mass = ACTUATED.index("knee_angle_r"), person.task.model.mass
    rates = plain.rollout.velocities[:, ROOT_DOFS + knee]
    moments, squares = np.zeros_like(plain.rollout.moments), 0.0
    for sign, number in ((1.0, 0), (-1.0, 1)):
        rows = slice(cycles.starts["right"][number], cycles.ends["right"][number])
        moments[rows, knee] = sign * rates[rows]
        squares += np.sum(rates[rows] ** 2)
    rollout = replace(plain.rollout, moments=moments)
    curves = walk_curves(replace(plain, rollout=rollout), person.task.configuration, mass)
    step = rollout.time[1] - rollout.time[0]
    for work in (curves.work, curves.negative_work):
        assert work["knee_angle", "right"] * cycles.count("right") == pytest.approx(
            squares / 2 * step / mass, rel=0.1
        )


def test_no_curves_without_a_cycle(person):
    short = walk_without(with_devices(person.task, []), person.policy, person.mu, 0.3)
    with pytest.raises(RecordError, match="no complete gait cycle"):
        walk_curves(short, person.task.configuration, person.task.model.mass)


def test_devices_add_up(person, plain):
    """Two devices at one joint, of which one takes what the other gives."""

    def spring(name, rest):
        hinge = {"joint": "knee_angle", "spring": {"stiffness": 40.0, "rest": rest}}
        return Device.model_validate({"name": name, "source": "a test", "hinges": [hinge]})

    found = kept(person, plain, [spring("a", 0.5), spring("b", -0.5)])
    knee = ACTUATED.index("knee_angle_l")
    angle = plain.rollout.positions[:, 6 + knee]
    change = found.own[:-1, knee] - plain.rollout.moments[:-1, knee]
    np.testing.assert_allclose(change, 80.0 * angle[:-1], atol=1e-9)
