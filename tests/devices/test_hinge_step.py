import numpy as np
import pytest

from gaitval_devices import hinge_step as column
from gaitval_devices.device import Clutch, Hinge, Motor, Socket, Spring, Strap
from gaitval_devices.hinge_step import hinge_torque
from gaitval_devices.walking import command_noise, hinge_numbers

STEP = 0.0005


def swung(
    hinge, *, command=0.0, seconds=4.0, amplitude=0.3, rate=2 * np.pi, engaged=True, step=STEP
):
    """Angles, rates, torques on the limb and states of a hinge whose joint is led on a sine."""
    numbers, state = hinge_numbers(hinge), np.zeros(column.STATE)
    time = step * np.arange(round(seconds / step))
    angle, speed = amplitude * np.sin(rate * time), amplitude * rate * np.cos(rate * time)
    state[column.SPEED] = speed[0]
    state[column.ENGAGED], state[column.COMMAND] = float(engaged), command
    torque, states = np.empty_like(time), np.empty((len(time), column.STATE))
    for t in range(len(time)):
        torque[t] = hinge_torque(step, angle[t], speed[t], numbers, state)
        states[t] = state
    return angle, speed, torque, states


def test_a_spring_gives_its_law_and_takes_no_energy_over_a_cycle():
    angle, speed, torque, _ = swung(
        Hinge(joint="knee_angle", spring=Spring(stiffness=50.0, rest=0.1))
    )
    np.testing.assert_allclose(torque, 50.0 * (0.1 - angle), atol=1e-12)
    assert abs(STEP * torque @ speed) < 1e-3


def test_a_damper_takes_what_theory_says():
    _, speed, torque, _ = swung(Hinge(joint="knee_angle", damping=2.0))
    # c ∫ ω² = c A² w² T / 2
    expected = 2.0 * 0.3**2 * (2 * np.pi) ** 2 * 4.0 / 2
    assert -STEP * torque @ speed == pytest.approx(expected, rel=1e-3)


def test_a_strap_in_series_has_the_compliance_of_both():
    strap = Strap(stiffness=400.0, damping=0.5)
    hinge = Hinge(joint="ankle_angle", spring=Spring(stiffness=100.0), strap=strap)
    angle, _, torque, states = swung(hinge, rate=0.5, seconds=12.0)
    late = slice(2000, None)
    # Slowly led, springs in series: 1 / (1/100 + 1/400) = 80 Nm/rad.
    np.testing.assert_allclose(torque[late], -80.0 * angle[late], atol=0.1)
    turned = states[late, column.ANGLE]
    np.testing.assert_allclose(turned, 0.8 * angle[late], atol=1e-3)
    # What the strap carries is what holds the spring.
    np.testing.assert_allclose(torque[late], -100.0 * turned, atol=1e-6)


def test_energy_balance_of_spring_strap_and_inertia():
    strap = Strap(stiffness=300.0, damping=1.5, inertia=0.01)
    hinge = Hinge(joint="hip_flexion", spring=Spring(stiffness=60.0), damping=0.8, strap=strap)
    errors = []
    for step in (4e-4, 1e-4):
        angle, speed, torque, states = swung(hinge, seconds=3.0, step=step)
        turned, rate = states[:, column.ANGLE], states[:, column.SPEED]
        stored = states[:, column.STORED] + 0.5 * 0.01 * rate**2
        lost = step * np.sum(0.8 * rate**2 + 1.5 * (rate - speed) ** 2)
        into_limb = step * np.sum(torque * speed)
        # What the limb gets is what was stored less what the dampers took.
        errors.append(abs(into_limb - (stored[0] - stored[-1] - lost)) / lost)
    assert errors[1] < 0.01
    assert errors[1] == pytest.approx(errors[0] / 4, rel=0.1)  # an integrator of first order
    assert np.abs(angle - turned).max() > 0.01


def socketed(**socket):
    return Hinge(
        joint="ankle_angle", muscles=False, spring=Spring(stiffness=100.0), damping=0.2,
        socket=Socket(damping=0.5, **socket),
    )  # fmt: skip


def test_a_socket_turns_freely_in_its_play_and_then_in_series_with_the_foot():
    angle, _, torque, states = swung(socketed(stiffness=400.0, play=0.05), rate=0.5, seconds=12.0)
    late = slice(2000, None)
    angle, torque, turned = angle[late], torque[late], states[late, column.ANGLE]
    # Beyond the play 1 / (1/100 + 1/400) = 80 Nm/rad; within it the dampers alone.
    wanted = -80.0 * np.sign(angle) * np.maximum(np.abs(angle) - 0.05, 0.0)
    np.testing.assert_allclose(torque, wanted, atol=0.1)
    # The foot turns by what the socket does not.
    wanted = 0.8 * np.sign(angle) * np.maximum(np.abs(angle) - 0.05, 0.0)
    np.testing.assert_allclose(turned, wanted, atol=1e-3)


def test_energy_balance_of_a_socket_with_play():
    errors = []
    for step in (4e-4, 1e-4):
        hinge = socketed(stiffness=300.0, play=0.03)
        _, speed, torque, states = swung(hinge, seconds=3.0, step=step)
        rate = states[:, column.SPEED]
        lost = step * np.sum(0.2 * rate**2 + 0.5 * (rate - speed) ** 2)
        stored = states[:, column.STORED]
        errors.append(abs(step * np.sum(torque * speed) - (stored[0] - stored[-1] - lost)) / lost)
    assert errors[1] < 0.05
    assert errors[1] == pytest.approx(errors[0] / 4, rel=0.05)  # of first order: it vanishes


def test_a_socket_without_play_is_a_strap():
    strap = Hinge(joint="ankle_angle", spring=Spring(stiffness=100.0), damping=0.2,
                  strap=Strap(stiffness=300.0, damping=0.5))  # fmt: skip
    ours, theirs = swung(socketed(stiffness=300.0)), swung(strap)
    for one, other in zip(ours, theirs, strict=True):
        np.testing.assert_array_equal(one, other)


@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_a_motor_gives_its_command_after_its_lag_and_within_its_limits(sign):
    motor = Motor(torque=10.0, speed=100.0, power=1e4, bandwidth=5.0)
    _, _, torque, _ = swung(
        Hinge(joint="knee_angle", motor=motor), command=sign * 8.0, amplitude=0.0
    )
    time = STEP * np.arange(1, len(torque) + 1)
    expected = sign * 8.0 * (1.0 - np.exp(-2 * np.pi * 5.0 * time))
    np.testing.assert_allclose(torque, expected, rtol=1e-9)
    _, _, torque, _ = swung(
        Hinge(joint="knee_angle", motor=motor), command=sign * 80.0, amplitude=0.0
    )
    assert np.abs(torque).max() == pytest.approx(10.0)


@pytest.mark.parametrize("bandwidth", [5.0, 16.0, 62.4])
def test_the_torque_has_the_noise_that_is_stated(bandwidth):
    motor = Motor(torque=1e3, speed=1e3, power=1e6, bandwidth=bandwidth, noise=1.5)
    numbers, state = hinge_numbers(Hinge(joint="knee_angle", motor=motor)), np.zeros(column.STATE)
    step, steps, random = 0.002, 3, np.random.default_rng(4)
    drawn = command_noise(motor, step, steps) * random.standard_normal(20_000)
    torque = []
    for state[column.COMMAND] in drawn:
        torque += [hinge_torque(step, 0.0, 0.0, numbers, state) for _ in range(steps)]
    assert np.std(torque) == pytest.approx(1.5, rel=0.05)


def test_at_its_bandwidth_a_motor_gives_what_a_first_order_lag_gives():
    """0.71 of a sine, an eighth of a period late, but for the steps of the command."""
    frequency, step = 62.4, 1e-4
    motor = Motor(torque=1e3, speed=1e3, power=1e6, bandwidth=frequency)
    numbers, state = hinge_numbers(Hinge(joint="knee_angle", motor=motor)), np.zeros(column.STATE)
    time = step * np.arange(1, 4001)
    wave = np.exp(2j * np.pi * frequency * time)
    torque = []
    for state[column.COMMAND] in wave.imag:
        torque.append(hinge_torque(step, 0.0, 0.0, numbers, state))
    late = slice(2000 - 2000 % 160, None)
    found = 2j * np.mean((np.array(torque) * wave.conj())[late])
    assert abs(found) == pytest.approx(np.sqrt(0.5), rel=0.02)
    assert np.angle(found, deg=True) == pytest.approx(-45.0, abs=2.0)


def test_a_motor_drives_with_no_more_than_its_power_and_speed():
    motor = Motor(torque=50.0, speed=1.5, power=20.0, bandwidth=1000.0)
    _, speed, torque, states = swung(Hinge(joint="knee_angle", motor=motor), command=40.0)
    late = slice(200, None)
    assert (states[late, column.MOTOR] * speed[late]).max() <= 20.0 + 0.5
    fast = np.flatnonzero(speed[late] > 1.52)
    assert np.abs(torque[late][fast]).max() < 1e-9
    slow = np.flatnonzero(speed[late] < -0.1)
    np.testing.assert_allclose(torque[late][slow], 40.0, rtol=1e-3)  # it brakes with all


def test_a_clutch_lets_go_and_a_ratchet_takes_up_slack():
    spring = Spring(stiffness=100.0, pulls="down")
    hinge = Hinge(joint="ankle_angle", spring=spring, clutch=Clutch.model_validate(
        {"while": "loaded", "ratchet": True}))  # fmt: skip
    _, _, torque, _ = swung(hinge, engaged=False)
    assert np.abs(torque).max() == 0.0
    angle, _, torque, _ = swung(hinge, seconds=2.0)
    lowest = np.minimum.accumulate(angle)
    np.testing.assert_allclose(torque, -100.0 * (angle - lowest), atol=1e-12)
    assert torque.max() <= 0.0


def test_a_cable_in_a_strap_never_pushes():
    hinge = Hinge(
        joint="ankle_angle",
        spring=Spring(stiffness=100.0, pulls="up"),
        strap=Strap(stiffness=500.0, damping=1.0),
    )
    angle, _, torque, _ = swung(hinge, rate=1.0, seconds=12.0)
    low = angle < -0.05
    assert torque[low].min() > 0.0
    assert np.abs(torque[angle > 0.05]).max() < 2.0  # the strap's damper alone
