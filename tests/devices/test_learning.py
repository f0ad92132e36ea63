from dataclasses import replace

import numpy as np
import pytest

from gaitval.apps.devices import learning
from gaitval.apps.devices.learning import adapt, adaptation_settings, varied
from gaitval.apps.devices.walking import DeviceEnvironment, with_devices
from gaitval.configuration import Configuration
from gaitval.model.devices.device import load_devices


def test_a_varied_device_differs_a_little_and_is_still_a_device():
    (device,) = load_devices("ankle_spring")
    random = np.random.default_rng(0)
    masses = [varied(device, random).mass / device.mass for _ in range(200)]
    assert 0.9 <= min(masses) < 0.92
    assert 1.08 < max(masses) <= 1.1
    changed = varied(device, random).hinges[0].spring.stiffness
    assert changed != 180.0
    assert 162.0 <= changed <= 198.0


def test_a_part_that_is_heavier_has_more_inertia_by_the_same_factor():
    (device,) = load_devices("backpack")
    changed = varied(device, np.random.default_rng(3))
    for before, after in zip(device.parts, changed.parts, strict=True):
        factor = after.mass / before.mass
        assert factor != 1.0
        assert any(before.inertia)
        np.testing.assert_allclose(after.inertia, factor * np.array(before.inertia))


def few(task, **training):
    """The task, with other settings of its training."""
    changed = task.configuration.training.model_copy(update=training)
    configuration = task.configuration.model_copy(update={"training": changed})
    return replace(task, configuration=configuration)


@pytest.mark.slow
def test_every_environment_of_an_adaptation_begins_and_is_disturbed_otherwise(person, monkeypatch):
    """The first wears the device of the table; no seed is used twice."""
    began = []

    class Stopped(Exception):
        pass

    def stopping(environments, *_):
        began.append(environments)
        raise Stopped

    monkeypatch.setattr(learning, "_walk", stopping)
    task = few(with_devices(person.task, load_devices("hip_exo")), environments=4)
    with pytest.raises(Stopped):
        adapt(task, person.policy, samples=1)
    (environments,) = began
    assert len({each.start_phase for each in environments}) == len(environments) == 4
    assert len({each.walker.noise_seed for each in environments}) == 4
    fitted = [each.walker.task.devices for each in environments]
    assert fitted[0] == task.devices
    assert all(each != task.devices for each in fitted[1:])


def test_an_adaptation_costs_effort_and_does_not_imitate_moments():
    usual = Configuration()
    reward = adaptation_settings(usual, 4.0).reward
    assert reward.torque == pytest.approx(4.0 * usual.reward.torque)
    assert reward.joint_moments == 0.0
    assert reward.joint_positions == usual.reward.joint_positions


def walked(task, policy, starts):
    """Gait cycles until the walker falls or the time is over, without noise, from each start."""
    environment, cycles = DeviceEnvironment(task), []  # one that is centred on no policy
    environment.difficulty = 0.0
    for start in range(starts):
        seen, _ = environment.reset(seed=start)
        begin, ended = environment.walker.phase, False
        while not ended:
            seen, _, fell, over, _ = environment.step(policy.act(seen[None])[0])
            ended = fell or over
        cycles.append(environment.walker.phase - begin)
    return np.array(cycles)


@pytest.mark.slow
def test_a_device_that_makes_fall_is_learned(person):
    """A prosthesis, with which the person often stumbles, is walked with.

    Where a single walk ends after so short a training is decided by rounding, which differs from
    processor to processor. So the same starts are walked before and after, and the mean gain must
    be clear of its standard error; a training that learns nothing gains 0 from every start.
    """
    task = with_devices(person.task, load_devices("below_knee"))
    policy = adapt(task, person.policy, samples=200_000, seed=1)
    first, then = (walked(task, each, starts=20) for each in (person.policy, policy))
    assert (first < 4.0).sum() > 4  # many a start ends in a fall without it
    gained = then - first
    assert gained.mean() > 3.0 * gained.std(ddof=1) / np.sqrt(len(gained))
    assert policy.about["devices"] == "below_knee"


@pytest.mark.slow
def test_the_same_seed_learns_the_same(person):
    exo = with_devices(person.task, load_devices("ankle_exo"))
    task = few(exo, environments=4, rollout_steps=64, batch_size=128)  # two rounds
    found = [adapt(task, person.policy, samples=512, seed=3) for _ in range(2)]
    assert found[0].key == found[1].key
    assert found[0].key != person.policy.key
