"""The joint servos' stiffness and the tables of the reference that they follow."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from gaitval.configuration import Configuration
from gaitval.coordinates import ACTUATED
from gaitval.walk.simulation.servo import SERVO, reference_tables, servo_stiffness


def test_servo_gains_are_scaled_with_the_mass(task):
    servo = Configuration().servo
    stiffness = dict(zip(ACTUATED, servo_stiffness(servo, SERVO.reference_mass), strict=True))
    assert stiffness["hip_rotation_l"] == servo.hip
    assert stiffness["knee_angle_r"] == servo.knee
    assert stiffness["ankle_angle_r"] == servo.ankle
    assert stiffness["subtalar_angle_r"] == servo.subtalar
    assert stiffness["mtp_angle_l"] == servo.toe
    assert stiffness["lumbar_bending"] == servo.lumbar
    assert stiffness["arm_rot_r"] == stiffness["elbow_flex_l"] == servo.shoulder
    doubled = servo_stiffness(servo, 2 * SERVO.reference_mass)
    np.testing.assert_allclose(doubled, 2 * np.array(list(stiffness.values())))


def test_reference_tables_close_the_cycle(task):
    tables = reference_tables(task.reference, 0.5)
    for table in tables:
        np.testing.assert_array_equal(table[0], table[-1])


def test_what_is_fed_forward_is_what_muscles_give(task):
    """Half of a moment that alternates at the limit's frequency, all of a slow one."""
    count, stride = len(task.reference.moments), task.reference.stride_time
    phase = np.arange(count)[:, None] / count
    slow, fast = 1, round(SERVO.feed_forward_hz * stride)
    kept = 1.0 / (1.0 + (fast / stride / SERVO.feed_forward_hz) ** 8)
    assert 0.4 < kept < 0.6
    for harmonic, share in ((slow, 1.0), (fast, kept), (10 * fast, 0.0)):
        wave = np.cos(2 * np.pi * harmonic * phase) * np.ones(task.reference.moments.shape[1])
        tables = reference_tables(replace(task.reference, moments=wave), 0.5)
        np.testing.assert_allclose(tables.moments[:-1], 0.5 * share * wave, atol=1e-6)


def test_half_of_a_moment_at_ten_hertz_is_fed_forward_and_gains_are_of_seventy_kilograms():
    wave = np.cos(2 * np.pi * 10 * np.arange(200) / 200)[:, None] * np.ones(31)
    second = SimpleNamespace(positions=wave, velocities=wave, moments=wave[:, 6:], stride_time=1.0)
    np.testing.assert_allclose(
        reference_tables(second, 1.0).moments[:-1], 0.5 * wave[:, 6:], atol=1e-12
    )
    servo = Configuration().servo
    assert servo_stiffness(servo, 70.0)[0] == pytest.approx(servo.hip)


def test_what_is_asked_for_is_as_late_at_every_step(task):
    """A table that is read one step before the state that it acts on asks, at any step, for what
    the reference has the lag before that state."""
    phase = task.reference.phase
    usual = reference_tables(task.reference, 1.0).positions[:-1]
    for step in (0.25 * SERVO.target_lag, 2.0 * SERVO.target_lag):
        table = reference_tables(task.reference, 1.0, step).positions[:-1]
        at = phase + (SERVO.target_lag - step) / task.reference.stride_time
        for column, late in zip(usual.T, table.T, strict=True):
            expected = np.interp(phase, at, column, period=1.0)
            np.testing.assert_allclose(late, expected, atol=2e-4)
    # and it is not what nobody would notice
    assert np.abs(table - usual).max() > 2e-3


def test_what_is_asked_for_is_two_milliseconds_late():
    """At the default's step of 2 ms the tables are the reference's own; at 1 ms, and at 4, they are
    that much later and earlier."""
    assert Configuration().environment.physics_step == 0.002
    phase = np.arange(200) / 200
    wave = np.cos(2 * np.pi * phase)[:, None] * np.ones(31)
    for step, late in ((0.002, 0.0), (0.001, 0.001), (0.004, -0.002)):
        reference = SimpleNamespace(
            positions=wave, velocities=wave, moments=wave[:, 6:], stride_time=1.1
        )
        found = reference_tables(reference, 1.0, step).positions[:-1, 0]
        np.testing.assert_allclose(found, np.cos(2 * np.pi * (phase - late / 1.1)), atol=1e-12)
