import numpy as np
import pytest

from gaitval.apps.devices import hinge_step as column
from gaitval.apps.devices.hinge_step import hinge_torque
from gaitval.apps.devices.walking import command_noise, hinge_numbers
from gaitval.model.devices.device import Hinge, Strap
from gaitval.model.devices.springs_and_motors import Clutch, Motor, Spring

STEP = 0.0005


def swung(
    hinge,
    *,
    command=0.0,
    seconds=4.0,
    amplitude=0.3,
    rate=2 * np.pi,
    closes=0.0,
    extra=0.0,
    step=STEP,
):
    """Angles, rates, torques on the limb and states of a hinge whose joint is led on a sine, with a
    clutch that `closes` at that time, s, and `extra` damping.
    """
    numbers, state = hinge_numbers(hinge), np.zeros(column.STATE)
    time = step * np.arange(round(seconds / step))
    angle, speed = amplitude * np.sin(rate * time), amplitude * rate * np.cos(rate * time)
    state[column.SPEED] = speed[0]
    state[column.COMMAND], state[column.EXTRA] = command, extra
    torque, states = np.empty_like(time), np.empty((len(time), column.STATE))
    for t in range(len(time)):
        state[column.ENGAGED] = float(time[t] >= closes)
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


def test_a_motor_drives_with_no_more_than_its_power_and_speed():
    motor = Motor(torque=50.0, speed=1.5, power=20.0, bandwidth=1000.0)
    _, speed, torque, states = swung(Hinge(joint="knee_angle", motor=motor), command=40.0)
    late = slice(200, None)
    assert (states[late, column.MOTOR] * speed[late]).max() <= 20.0 + 0.5
    fast = np.flatnonzero(speed[late] > 1.52)
    assert np.abs(torque[late][fast]).max() < 1e-9
    slow = np.flatnonzero(speed[late] < -0.1)
    np.testing.assert_allclose(torque[late][slow], 40.0, rtol=1e-3)  # it brakes with all


def test_an_open_clutch_lets_go_of_spring_and_damper_but_not_of_the_stance_damper():
    hinge = Hinge(joint="knee_angle", spring=Spring(stiffness=50.0, rest=0.1), damping=2.0)
    angle, speed, torque, _ = swung(hinge, closes=2.0, extra=3.0)
    acts = STEP * np.arange(len(angle)) >= 2.0
    expected = acts * (50.0 * (0.1 - angle) - 2.0 * speed) - 3.0 * speed
    np.testing.assert_allclose(torque, expected, atol=1e-12)


@pytest.mark.parametrize(("pulls", "sign"), [("down", -1.0), ("up", 1.0)])
def test_a_cable_pulls_one_way(pulls, sign):
    hinge = Hinge(joint="knee_angle", spring=Spring(stiffness=50.0, rest=0.1, pulls=pulls))
    angle, _, torque, _ = swung(hinge)
    np.testing.assert_allclose(
        torque, sign * np.maximum(sign * 50.0 * (0.1 - angle), 0.0), atol=1e-12
    )


RATCHET = Clutch.model_validate({"while": "loaded", "ratchet": True})


@pytest.mark.parametrize(("pulls", "sign"), [("down", -1.0), ("up", 1.0)])
def test_a_ratchet_takes_up_slack_from_where_its_clutch_closes(pulls, sign):
    spring = Spring(stiffness=100.0, pulls=pulls)
    hinge = Hinge(joint="ankle_angle", spring=spring, clutch=RATCHET)
    angle, _, torque, _ = swung(hinge, closes=0.3, seconds=2.0)
    first = round(0.3 / STEP)
    # The highest angle, or the lowest, since it was last open.
    rest = sign * np.maximum.accumulate(sign * angle[first - 1 :])[1:]
    np.testing.assert_allclose(torque[first:], 100.0 * (rest - angle[first:]), atol=1e-12)
    assert np.abs(torque[:first]).max() == 0.0
    assert (sign * torque).min() >= 0.0


def test_a_ratchet_in_a_strap_holds_the_angle_of_the_device():
    strap = Strap(stiffness=200.0, damping=0.01)
    spring = Spring(stiffness=100.0, pulls="down")
    hinge = Hinge(joint="ankle_angle", spring=spring, clutch=RATCHET, strap=strap)
    _, _, torque, states = swung(hinge, seconds=2.0)
    turned = states[:, column.ANGLE]
    rest = np.minimum.accumulate(np.concatenate([[0.0], turned[:-1]]))
    # Without inertia the strap carries what the spring pulls.
    np.testing.assert_allclose(torque, -100.0 * np.maximum(turned - rest, 0.0), atol=1e-9)
    assert torque.min() < -10.0


def test_a_motor_turns_spring_and_strap_until_they_hold_it():
    motor = Motor(torque=10.0, speed=100.0, power=1e4, bandwidth=50.0)
    strap = Strap(stiffness=400.0, damping=1.0, inertia=0.001)
    spring = Spring(stiffness=100.0)
    hinge = Hinge(joint="knee_angle", spring=spring, motor=motor, strap=strap)
    _, _, torque, states = swung(hinge, command=8.0, amplitude=0.0)
    # 8 Nm = (100 + 400) Nm/rad x angle; the strap's part of it is on the limb.
    assert states[-1, column.ANGLE] == pytest.approx(0.016)
    assert torque[-1] == pytest.approx(6.4)
    assert states[-1, column.STORED] == pytest.approx(0.5 * 500.0 * 0.016**2)


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
