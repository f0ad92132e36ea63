import numpy as np

from gaitval.apps.devices.tracking import lagged, torque_errors
from gaitval.apps.devices.walking import DeviceEnvironment, walk_with, with_devices
from gaitval.model.devices.device import load_devices
from gaitval.model.devices.springs_and_motors import Motor


def test_a_lag_is_of_first_order():
    motor = Motor(torque=50.0, speed=10.0, power=100.0, bandwidth=2.0)
    time = 0.001 * np.arange(1, 1001)
    expected = 5.0 * (1.0 - np.exp(-2 * np.pi * 2.0 * time))
    np.testing.assert_allclose(lagged(np.full(1000, 5.0), motor, 0.001), expected, rtol=1e-12)


def test_devices_give_what_they_are_asked_for(person):
    (device,) = load_devices("ankle_exo")
    environment = DeviceEnvironment(with_devices(person.task, [device]))
    walk = walk_with(environment, person.policy, mu=person.mu, cycles=4.0)
    errors = torque_errors(walk, device)
    assert set(errors) == {"ankle_angle_r", "ankle_angle_l"}
    assert max(errors.values()) < 0.05
    weak = device.hinges[0].motor.model_copy(update={"power": 20.0})
    hinge = device.hinges[0].model_copy(update={"motor": weak})
    weaker = device.model_copy(update={"hinges": (hinge,)})
    environment = DeviceEnvironment(with_devices(person.task, [weaker]))
    walk = walk_with(environment, person.policy, mu=person.mu, cycles=4.0)
    assert max(torque_errors(walk, weaker).values()) > 2.0 * max(errors.values())
