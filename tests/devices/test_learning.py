import numpy as np
import pytest

from gaitval.configuration import Configuration
from gaitval_devices.device import load_devices
from gaitval_devices.learning import adapt, adaptation_settings, varied
from gaitval_devices.walking import DeviceEnvironment, walk_with, with_devices


def test_a_varied_device_differs_a_little_and_is_still_a_device():
    (device,) = load_devices("ankle_spring")
    random = np.random.default_rng(0)
    masses = [varied(device, random).mass / device.mass for _ in range(200)]
    assert 0.9 <= min(masses) < 0.92
    assert 1.08 < max(masses) <= 1.1
    changed = varied(device, random).hinges[0].spring.stiffness
    assert changed != 180.0
    assert 162.0 <= changed <= 198.0


def test_an_adaptation_costs_effort_and_does_not_imitate_moments():
    usual = Configuration()
    reward = adaptation_settings(usual, 4.0).reward
    assert reward.torque == pytest.approx(4.0 * usual.reward.torque)
    assert reward.joint_moments == 0.0
    assert reward.joint_positions == usual.reward.joint_positions


@pytest.mark.slow
def test_a_device_that_makes_fall_is_learned(person):
    """A prosthesis, with which the person stumbles at once, is walked with."""
    task = with_devices(person.task, load_devices("below_knee"))
    environment = DeviceEnvironment(task)
    before = walk_with(environment, person.policy, mu=person.mu, cycles=6.0)
    assert before.rollout.fell[0]
    policy = adapt(task, person.policy, samples=200_000, seed=1)
    after = walk_with(environment, policy, mu=person.mu, cycles=6.0)
    assert after.rollout.phase[-1] > before.rollout.phase[-1] + 1.0
    assert policy.about["devices"] == "below_knee"


def test_the_same_seed_learns_the_same(person):
    task = with_devices(person.task, load_devices("ankle_exo"))
    found = [adapt(task, person.policy, samples=4096, seed=3) for _ in range(2)]
    assert found[0].key == found[1].key
    assert found[0].key != person.policy.key
