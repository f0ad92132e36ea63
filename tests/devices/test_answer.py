"""The first lines of a page of devices: what changed, and never a slower walk as a saving."""

from dataclasses import replace

import pytest
from made_curves import made_curves

from gaitval.apps.devices.answer import answers, kept_in_words, torques
from gaitval.apps.devices.results import MARGINS
from gaitval.apps.devices.study import SAME_SPEED, DeviceOutcome
from gaitval.model.devices.device import shipped_device


def outcome(assumption, *, speed=1.2, fell=False, held=False, work=(), peak=1.1, torque=0.0):
    """A walk with some work, J/kg, by joint and side; of other joints 0.2."""
    curves = made_curves()
    of_joints = dict.fromkeys(curves.own, 0.2) | dict(work)
    for side in ("right", "left"):
        curves.forces[side][:] = peak
        curves.device["ankle_angle", side][:] = -torque
    curves = replace(curves, speed=speed, work=of_joints)
    return DeviceOutcome(assumption, None, curves, 20.0, fell, None, held)


DEVICES = [shipped_device("hip_exo")]


def test_the_answer_has_the_change_its_side_and_its_sign():
    now = outcome("moments kept", work=[(("hip_flexion", "left"), 0.13)], peak=1.2)
    (found,) = answers([outcome("without"), now], DEVICES)
    assert not found.warning
    assert "left hip positive work −35 %" in found.changes
    assert "vertical peak +9 % on both sides" in found.changes
    assert not [each for each in found.changes if "right hip" in each or "knee" in each]


def test_a_change_within_the_margin_is_none():
    less = 0.2 - 0.9 * MARGINS["J/kg a stride"]
    now = outcome("learned", work=[(("hip_flexion", "left"), less)])
    (found,) = answers([outcome("without"), now], DEVICES)
    assert (found.changes, found.warning) == ((), "")


@pytest.mark.parametrize("part", [0.14, 2.0 * SAME_SPEED, -0.05])
def test_work_at_another_speed_is_never_said(part):
    now = outcome("moments kept", speed=1.2 * (1.0 - part), work=[(("hip_flexion", "left"), 0.02)])
    both = [outcome("without"), now]
    (found,) = answers(both, DEVICES)
    assert found.changes == ()
    assert "1.20 m/s" in found.warning
    assert f"{abs(100 * part):.0f} %" in found.warning


def test_who_falls_has_no_answer_but_that():
    (found,) = answers([outcome("without"), outcome("learned", fell=True)], DEVICES)
    assert found.changes == ()
    assert "falls after 20 gait cycles" in found.warning


def test_the_largest_torque_of_a_device_is_said_with_its_unit():
    (said,) = torques([outcome("without"), outcome("moments kept", torque=0.5)])
    assert said == "Largest torque of the device at the ankle: 0.50 Nm/kg."
    assert torques([outcome("without"), outcome("moments kept")]) == []


def test_how_well_the_speed_is_kept_is_computed():
    held = outcome("moments kept", speed=1.2 * 0.995, held=True)
    assert "0.5 %" in kept_in_words([outcome("without"), held])
    assert kept_in_words([outcome("without"), outcome("moments kept")]) == ""
