"""The first lines of a page of devices: what changed, and never a slower walk as a saving."""

from dataclasses import replace

import pytest
from made_curves import made_curves

from gaitval.apps.devices.answer import answer, torques
from gaitval.apps.devices.results import MARGINS
from gaitval.apps.devices.study import SAME_SPEED, DeviceOutcome


def outcome(*, speed=1.2, fell=False, work=(), peak=1.1, torque=0.0):
    """A walk with some work, J/kg, by joint and side; of other joints 0.2."""
    curves = made_curves()
    of_joints = dict.fromkeys(curves.own, 0.2) | dict(work)
    for side in ("right", "left"):
        curves.forces[side][:] = peak
        curves.device["ankle_angle", side][:] = -torque
    curves = replace(curves, speed=speed, work=of_joints)
    return DeviceOutcome(None, curves, 20.0, fell)


def test_the_answer_has_the_change_its_side_and_its_sign():
    said = answer(outcome(), outcome(work=[(("hip_flexion", "left"), 0.13)], peak=1.2))
    assert "left hip positive work −35 %" in said
    assert "right vertical peak +9 %, left" in said
    assert "right hip" not in said
    assert "knee" not in said


def test_a_change_within_the_margin_is_none():
    less = 0.2 - 0.9 * MARGINS["J/kg a stride"]
    assert answer(outcome(), outcome(work=[(("hip_flexion", "left"), less)])).startswith("No work")


@pytest.mark.parametrize("part", [0.14, 2.0 * SAME_SPEED, -0.05])
def test_work_at_another_speed_is_never_said(part):
    now = outcome(speed=1.2 * (1.0 - part), work=[(("hip_flexion", "left"), 0.02)])
    said = answer(outcome(), now)
    assert "positive work" not in said
    assert "1.20 m/s" in said
    assert f"{abs(100 * part):.0f} %" in said


def test_who_falls_has_no_answer_but_that():
    assert answer(outcome(), outcome(fell=True)) == "The walker falls after 20 gait cycles."


def test_the_largest_torque_of_a_device_is_said_with_its_unit():
    (said,) = torques(outcome(torque=0.5))
    assert said == "Largest torque of the device at the ankle: 0.50 Nm/kg."
    assert torques(outcome()) == []
