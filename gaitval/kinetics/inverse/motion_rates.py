"""Velocities and accelerations of a motion; for the pelvis through its Cardan angles."""

from typing import NamedTuple

import numpy as np
from scipy.interpolate import make_interp_spline
from scipy.spatial.transform import Rotation

from gaitval._internal.numba.compiled import njit, njit_borrowing
from gaitval._internal.numba.lanes import arctangent, sine_cosine, sqrt, where
from gaitval.arrays import Array
from gaitval.coordinates import COORDINATES
from gaitval.errors import RecordError
from gaitval.model.rotations import pelvis_angles
from gaitval.model.tree import COORDINATE_COUNT

FEWEST_FRAMES = 6
"""A quintic spline has six coefficients."""


class Kinematics(NamedTuple):
    """A motion with its rates; T frames, root convention as in `model.tree`.

    Attributes
    ----------
    positions : (T, 31).
    velocities : (T, 31) per second; the pelvis' angular velocity first, world axes.
    accelerations : (T, 31) per second², rate of `velocities`.
    """

    positions: Array
    velocities: Array
    accelerations: Array


def cardan_coordinates(positions: Array) -> Array:
    """`positions` (T, 31), root convention of `model.tree`, with the pelvis' Cardan angles instead
    of its rotation vector: the first three columns are tilt, list and rotation
    (`rotations.pelvis_angles`), rad, without jumps of a full turn.
    """
    coordinates = np.array(positions, dtype=float)
    orientation = Rotation.from_rotvec(coordinates[:, :3]).as_matrix()
    coordinates[:, :3] = np.unwrap(pelvis_angles(orientation), axis=0)
    return coordinates


@njit_borrowing
def root_state(
    angles: Array,
    rates: Array,
    second_rates: Array,
    rotation_vector: Array,
    angular_velocity: Array,
    angular_acceleration: Array,
) -> None:
    """Orientation and its rates from the pelvis' Cardan angles.

    Parameters
    ----------
    angles : (3,) rad: anterior tilt about y, then the list (right side up +) about -x, then the
        rotation (right side forward +) about z, as `rotations.pelvis_angles` gives them; of any
        size.
    rates, second_rates : (3,) of the angles, rad/s and rad/s².
    rotation_vector, angular_velocity, angular_acceleration : (3,) out, world axes.
    """
    st, ct = sine_cosine(0.5 * angles[0])
    sl, cl = sine_cosine(-0.5 * angles[1])
    sr, cr = sine_cosine(0.5 * angles[2])
    # Quaternion of the product: unlike the matrix it also gives the vector at half a turn.
    # (ct + st j)(cl + sl i), then times (cr + sr k); j i = −k.
    w1, x1, y1, z1 = ct * cl, ct * sl, st * cl, -st * sl
    w = w1 * cr - z1 * sr
    x = x1 * cr + y1 * sr
    y = y1 * cr - x1 * sr
    z = z1 * cr + w1 * sr
    # q and −q are the same rotation; with w ≥ 0 the vector is at most half a turn long.
    turned = where(w < 0.0, -1.0, 1.0)
    w, x, y, z = turned * w, turned * x, turned * y, turned * z
    sine = sqrt(x * x + y * y + z * z)
    small = sine < 1e-9
    # 2 atan2(|v|, w) / |v|, at no rotation its limit 2. Both branches are computed, so neither may
    # divide by zero.
    factor = where(small, 2.0, 2.0 * arctangent(sine, w) / where(small, 1.0, sine))
    rotation_vector[0], rotation_vector[1], rotation_vector[2] = factor * x, factor * y, factor * z

    sin_t, cos_t = sine_cosine(angles[0])
    sin_l, cos_l = sine_cosine(angles[1])
    # Axes in world: tilt y; list -(cos t, 0, -sin t); rotation R_y(t) R_x(-l) z.
    a0, a2 = -cos_t, sin_t
    b0, b1, b2 = sin_t * cos_l, sin_l, cos_t * cos_l
    dt, dl, dr = rates[0], rates[1], rates[2]
    angular_velocity[0] = dl * a0 + dr * b0
    angular_velocity[1] = dt + dr * b1
    angular_velocity[2] = dl * a2 + dr * b2
    # The list axis rotates with the tilt, the rotation axis with tilt and list.
    u0, u1, u2 = dl * a0, dt, dl * a2
    ddt, ddl, ddr = second_rates[0], second_rates[1], second_rates[2]
    angular_acceleration[0] = ddl * a0 + ddr * b0 + dl * (dt * a2) + dr * (u1 * b2 - u2 * b1)
    angular_acceleration[1] = ddt + ddr * b1 + dr * (u2 * b0 - u0 * b2)
    angular_acceleration[2] = ddl * a2 + ddr * b2 - dl * (dt * a0) + dr * (u0 * b1 - u1 * b0)


@njit
def root_states(angles: Array, rates: Array, second_rates: Array, out: Array) -> None:
    """`root_state` of every frame: `angles`, `rates` and `second_rates` (T, 3) of the pelvis'
    Cardan angles, rad, rad/s and rad/s²; `out` (T, 3, 3): rotation vector, angular velocity and
    angular acceleration, world axes.
    """
    for t in range(len(angles)):
        root_state(angles[t], rates[t], second_rates[t], out[t, 0], out[t, 1], out[t, 2])


def checked_motion(time: Array, positions: Array) -> tuple[Array, Array]:
    """`time` (T,) s and `positions` (T, 31) as float arrays that can be differentiated. Raises
    RecordError for fewer than six frames, NaN, or times that do not increase; ValueError for other
    shapes.
    """
    # One memory layout, because the compiled functions are compiled again for every other one.
    time = np.ascontiguousarray(time, dtype=float)
    positions = np.ascontiguousarray(positions, dtype=float)
    if time.ndim != 1 or positions.shape != (len(time), COORDINATE_COUNT):
        raise ValueError(
            f"time must have shape (T,) and positions (T, {COORDINATE_COUNT}), but their shapes "
            f"are {time.shape} and {positions.shape}"
        )
    if len(time) < FEWEST_FRAMES:
        raise RecordError(
            f"The motion has {len(time)} frames; velocities and accelerations need at least "
            f"{FEWEST_FRAMES}. Use a longer part of the trial."
        )
    if not np.all(np.diff(time) > 0):
        at = int(np.argmin(np.diff(time) > 0))
        raise RecordError(
            f"The times of the motion do not increase: {time[at]:.6g} s is followed by "
            f"{time[at + 1]:.6g} s (frame {at + 1}). Remove repeated frames."
        )
    missing = ~np.isfinite(positions)
    if missing.any():
        t, i = np.argwhere(missing)[0]
        raise RecordError(
            f"The motion has no value of {COORDINATES[i]} at {time[t]:.4g} s "
            f"({missing.any(axis=1).sum()} of {len(time)} frames miss one). Leave these frames "
            "out, or fill the gap first."
        )
    return time, positions


def differentiate(time: Array, positions: Array) -> Kinematics:
    """Velocities and accelerations of a motion by quintic splines through every frame: `positions`
    (T, 31), root convention of `model.tree`, any heading, at `time` (T,) s, whose steps may differ.
    Raises as `checked_motion`.

    Each coordinate has its own spline; the pelvis' orientation is differentiated through its Cardan
    angles, as in OpenSim's inverse dynamics (which uses natural quintic splines, different only in
    the first and last frames). Noise is not smoothed: filter the motion first.
    """
    time, positions = checked_motion(time, positions)
    coordinates = cardan_coordinates(positions)
    spline = make_interp_spline(time, coordinates, k=5)
    rates, second_rates = spline.derivative(1)(time), spline.derivative(2)(time)
    root = np.empty((len(time), 3, 3))
    root_states(coordinates[:, :3], rates[:, :3], second_rates[:, :3], root)
    # Rates of Cardan angles become angular velocity and acceleration, in world axes.
    rates[:, :3], second_rates[:, :3] = root[:, 1], root[:, 2]
    return Kinematics(positions, rates, second_rates)
