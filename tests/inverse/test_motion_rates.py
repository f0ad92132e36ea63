"""Velocities and accelerations of motions whose rates are known."""

import numpy as np
from known_walk import angular_rates
from scipy.spatial.transform import Rotation

from gaitval.kinetics.inverse.motion_rates import cardan_coordinates, differentiate
from gaitval.model.rotations import pelvis_rotation


def test_rates_of_smooth_coordinates():
    """Splines of order six at 150 Hz through a wave of 3 Hz; the error of a second derivative
    falls with the fourth power of the step times the frequency, (2π·3/150)⁴/60 at most."""
    time = np.arange(300) / 150.0
    omega = 2 * np.pi * 3.0
    shift = np.linspace(0, 3, 31)
    value = 0.2 * np.sin(omega * time[:, None] + shift)
    rate = 0.2 * omega * np.cos(omega * time[:, None] + shift)
    second = -(omega**2) * value
    positions = value.copy()
    positions[:, :3] = Rotation.from_matrix(pelvis_rotation(*value[:, :3].T)).as_rotvec()
    found = differentiate(time, positions)
    spin, turning = angular_rates(value[:, :3], rate[:, :3], second[:, :3])
    np.testing.assert_allclose(found.velocities[:, 3:], rate[:, 3:], atol=1e-4)
    np.testing.assert_allclose(found.velocities[:, :3], spin, atol=1e-4)
    np.testing.assert_allclose(found.accelerations[:, 3:], second[:, 3:], atol=0.02)
    np.testing.assert_allclose(found.accelerations[:, :3], turning, atol=0.05)
    np.testing.assert_array_equal(found.positions, positions)


def test_cardan_coordinates_do_not_jump():
    """Turning once and a half round while walking."""
    heading = np.linspace(0.0, 3.0 * np.pi, 200)
    positions = np.zeros((200, 31))
    tilt, list_right = 0.1 * np.sin(heading), 0.05 * np.cos(heading)
    positions[:, :3] = Rotation.from_matrix(pelvis_rotation(tilt, list_right, heading)).as_rotvec()
    found = cardan_coordinates(positions)[:, :3]
    np.testing.assert_allclose(found, np.column_stack([tilt, list_right, heading]), atol=1e-9)
