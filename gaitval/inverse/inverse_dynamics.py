"""Joint moments of a measured motion under measured ground reactions (inverse dynamics).

A recursive Newton-Euler scheme from the feet to the pelvis (Winter 2009, chapters 5 and 7;
Featherstone 2008, table 5.1), in world axes about the joint of each segment. The whole ground
reaction of a side acts on its foot segment and none on its toes, as OpenSim's set-ups apply it
to the calcaneus: the moment of the metatarsophalangeal joint is then that of the toes' own
weight and inertia and not what the toes push off with.

Gravity is `constants.GRAVITY`, 9.81 m/s² along -z (OpenSim's default is 9.80665 m/s²).

What the ground reaction and the motion leave unexplained is the residual: the force and the
moment that would have to act on the pelvis beside the measured ones.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.interpolate import make_interp_spline
from scipy.spatial.transform import Rotation

from gaitval.arrays import Array
from gaitval.compiled import njit
from gaitval.constants import GRAVITY
from gaitval.coordinates import ACTUATED, COORDINATES
from gaitval.errors import RecordError
from gaitval.model.body import SEGMENTS, BodyModel
from gaitval.model.rotations import pelvis_angles
from gaitval.model.tree import (
    DOF_COUNT,
    FIRST_DOF,
    PARENT,
    ROOT_DOFS,
    forward,
    tree_arrays,
    velocities,
    whole_body_centre_of_mass,
)

_COUNT = len(SEGMENTS)
_DOFS = len(COORDINATES)
_FOOT = np.array([SEGMENTS.index("foot_r"), SEGMENTS.index("foot_l")])

JOINTS = ("hip", "knee", "ankle")
"""Joints of `InverseDynamics.joint_force` and `joint_moment`, in order."""
_JOINT_SEGMENT = np.array(
    [[SEGMENTS.index(f"{name}_{side}") for name in ("thigh", "shank", "foot")] for side in "rl"]
)

FEWEST_FRAMES = 6
"""A quintic spline has six coefficients."""

LOCKED_MOMENTS = ("knee_adduction", "knee_rotation", "ankle_rotation")
"""Moments about axes that the model's joints do not turn about."""


class Kinematics(NamedTuple):
    """A motion with its rates; T frames, root convention as in `model.tree`.

    Attributes
    ----------
    positions : (T, 31).
    velocities : (T, 31) per second; the pelvis's angular velocity first, world axes.
    accelerations : (T, 31) per second², rate of `velocities`.
    """

    positions: Array
    velocities: Array
    accelerations: Array


@dataclass(frozen=True)
class InverseDynamics:
    """Moments that a motion needs; T frames, SI, axes REP-103.

    Attributes
    ----------
    time : (T,) s.
    moments : (T, 25) Nm, of the joints in the order of `coordinates.ACTUATED`; positive where it
        would increase its coordinate.
    powers : (T, 25) W, moment times rate of its coordinate: positive where the joint gives
        energy to the segments.
    residual_force : (T, 3) N, on the pelvis, world axes.
    residual_moment : (T, 3) Nm, about the pelvis's origin (middle of the hips), world axes.
    joint_force : (T, 2, 3, 3) N, of the proximal on the distal segment at hip, knee and ankle
        (`JOINTS`), right side first, world axes. It is the net (intersegmental) force: muscles
        press the joint surfaces together with several times as much.
    joint_moment : (T, 2, 3, 3) Nm, likewise, about the joint.
    locked_moments : (T, 2, 3) Nm, right side first: `LOCKED_MOMENTS`, the components of the
        joint's moment about axes that the model does not turn about, positive in the sense of
        adduction and internal rotation. The axes are those of the distal segment (shank x and z,
        foot z), which are the floating and the distal axis of Grood and Suntay (1983) at a
        joint that does not move about them.
    centre_of_mass : (T, 3) m, of the whole body.
    peak_external_force : N, largest ground reaction on one foot.
    """

    time: Array
    moments: Array
    powers: Array
    residual_force: Array
    residual_moment: Array
    joint_force: Array
    joint_moment: Array
    locked_moments: Array
    centre_of_mass: Array
    peak_external_force: float

    def recorded_moments(self) -> Mapping[str, Array]:
        """Moments by the names of `gait.record.MOMENT_NAMES`, (T,) Nm each."""
        found = {}
        for i, side in enumerate("rl"):
            for name in ("hip_flexion", "hip_adduction", "hip_rotation", "knee_angle"):
                found[f"{name}_{side}"] = self.moments[:, ACTUATED.index(f"{name}_{side}")]
            for j, name in enumerate(LOCKED_MOMENTS):
                found[f"{name}_{side}"] = self.locked_moments[:, i, j]
            for name in ("ankle_angle", "subtalar_angle"):
                found[f"{name}_{side}"] = self.moments[:, ACTUATED.index(f"{name}_{side}")]
        return found


@dataclass(frozen=True)
class Residuals:
    """How large the residuals of a motion are, in the measures that published limits use
    (`metrics/tolerances.toml`).

    Attributes
    ----------
    force_rms, force_peak : N; of the three world components the worst, as OpenSim's checklist
        looks at each by itself.
    moment_rms, moment_peak : Nm, likewise, about the pelvis's origin.
    force_share : largest residual force over the largest ground reaction on one foot (Hicks et
        al. 2015), of the vectors' lengths.
    moment_share : largest residual moment over the mean height of the centre of mass times the
        largest ground reaction on one foot (Hicks et al. 2015).
    frames : how many these are of.
    """

    force_rms: float
    force_peak: float
    moment_rms: float
    moment_peak: float
    force_share: float
    moment_share: float
    frames: int


@njit
def root_state(
    angles: Array,
    rates: Array,
    second_rates: Array,
    rotation_vector: Array,
    angular_velocity: Array,
    angular_acceleration: Array,
) -> None:
    """Orientation and its rates from the pelvis's Cardan angles.

    Parameters
    ----------
    angles : (3,) rad: anterior tilt about y, then the list (right side up +) about -x, then the
        rotation (right side forward +) about z, as `rotations.pelvis_angles` gives them; of any
        size.
    rates, second_rates : (3,) of the angles, rad/s and rad/s².
    rotation_vector, angular_velocity, angular_acceleration : (3,) out, world axes.
    """
    st, ct = np.sin(0.5 * angles[0]), np.cos(0.5 * angles[0])
    sl, cl = np.sin(-0.5 * angles[1]), np.cos(-0.5 * angles[1])
    sr, cr = np.sin(0.5 * angles[2]), np.cos(0.5 * angles[2])
    # Quaternion of the product: unlike the matrix it gives the vector at half a turn as well.
    w1, x1, y1, z1 = ct * cl, ct * sl, st * cl, -st * sl
    w = w1 * cr - z1 * sr
    x = x1 * cr + y1 * sr
    y = y1 * cr - x1 * sr
    z = z1 * cr + w1 * sr
    if w < 0.0:
        w, x, y, z = -w, -x, -y, -z
    sine = np.sqrt(x * x + y * y + z * z)
    factor = 2.0 if sine < 1e-9 else 2.0 * np.arctan2(sine, w) / sine
    rotation_vector[0], rotation_vector[1], rotation_vector[2] = factor * x, factor * y, factor * z

    sin_t, cos_t = np.sin(angles[0]), np.cos(angles[0])
    sin_l, cos_l = np.sin(angles[1]), np.cos(angles[1])
    # Axes in world: tilt y; list -(cos t, 0, -sin t); rotation R_y(t) R_x(-l) z.
    a0, a2 = -cos_t, sin_t
    b0, b1, b2 = sin_t * cos_l, sin_l, cos_t * cos_l
    dt, dl, dr = rates[0], rates[1], rates[2]
    angular_velocity[0] = dl * a0 + dr * b0
    angular_velocity[1] = dt + dr * b1
    angular_velocity[2] = dl * a2 + dr * b2
    # The list axis turns with the tilt, the rotation axis with tilt and list.
    u0, u1, u2 = dl * a0, dt, dl * a2
    ddt, ddl, ddr = second_rates[0], second_rates[1], second_rates[2]
    angular_acceleration[0] = ddl * a0 + ddr * b0 + dl * (dt * a2) + dr * (u1 * b2 - u2 * b1)
    angular_acceleration[1] = ddt + ddr * b1 + dr * (u2 * b0 - u0 * b2)
    angular_acceleration[2] = ddl * a2 + ddr * b2 - dl * (dt * a0) + dr * (u0 * b1 - u1 * b0)


@njit
def root_states(angles: Array, rates: Array, second_rates: Array, out: Array) -> None:
    """`root_state` of every frame, into (T, 3, 3)."""
    for t in range(len(angles)):
        root_state(angles[t], rates[t], second_rates[t], out[t, 0], out[t, 1], out[t, 2])


@njit
def newton_euler(
    joint_position: Array,
    mass: Array,
    centre_of_mass: Array,
    inertia: Array,
    q: Array,
    qd: Array,
    qdd: Array,
    force: Array,
    point: Array,
    free_moment: Array,
    rotation: Array,
    origin: Array,
    axes: Array,
    angular: Array,
    linear: Array,
    turning: Array,
    wrench: Array,
    generalised: Array,
) -> None:
    """Generalised forces of one frame.

    Parameters
    ----------
    joint_position, mass, centre_of_mass, inertia : of `Tree`.
    q, qd, qdd : (31,) positions, velocities, accelerations.
    force, point, free_moment : (2, 3) N, m, Nm on the right and the left foot, world; a point
        that is NaN is a foot in the air.
    rotation, origin, axes, angular, linear : out, as `tree.forward` and `tree.velocities` say.
    turning : (14, 2, 3) out, angular acceleration and acceleration of the joint less gravity.
    wrench : (14, 2, 3) out, moment about its joint and force of the parent on each segment.
    generalised : (31,) out, of the root the moment about the pelvis's origin and the force.
    """
    forward(joint_position, q, rotation, origin, axes, _COUNT)
    velocities(origin, axes, qd, angular, linear, _COUNT)
    for i in range(3):
        turning[0, 0, i] = qdd[i]
        turning[0, 1, i] = qdd[3 + i]
    turning[0, 1, 2] += GRAVITY
    for s in range(1, _COUNT):
        p = PARENT[s]
        w0, w1, w2 = angular[p, 0], angular[p, 1], angular[p, 2]
        e0, e1, e2 = turning[p, 0, 0], turning[p, 0, 1], turning[p, 0, 2]
        r0 = origin[s, 0] - origin[p, 0]
        r1 = origin[s, 1] - origin[p, 1]
        r2 = origin[s, 2] - origin[p, 2]
        v0, v1, v2 = w1 * r2 - w2 * r1, w2 * r0 - w0 * r2, w0 * r1 - w1 * r0
        turning[s, 1, 0] = turning[p, 1, 0] + e1 * r2 - e2 * r1 + w1 * v2 - w2 * v1
        turning[s, 1, 1] = turning[p, 1, 1] + e2 * r0 - e0 * r2 + w2 * v0 - w0 * v2
        turning[s, 1, 2] = turning[p, 1, 2] + e0 * r1 - e1 * r0 + w0 * v1 - w1 * v0
        for d in range(FIRST_DOF[s], FIRST_DOF[s] + DOF_COUNT[s]):
            a0, a1, a2 = axes[d, 0], axes[d, 1], axes[d, 2]
            # An axis turns with all rotations before it.
            e0 += a0 * qdd[d] + (w1 * a2 - w2 * a1) * qd[d]
            e1 += a1 * qdd[d] + (w2 * a0 - w0 * a2) * qd[d]
            e2 += a2 * qdd[d] + (w0 * a1 - w1 * a0) * qd[d]
            w0 += a0 * qd[d]
            w1 += a1 * qd[d]
            w2 += a2 * qd[d]
        turning[s, 0, 0], turning[s, 0, 1], turning[s, 0, 2] = e0, e1, e2

    for s in range(_COUNT):
        c0 = c1 = c2 = 0.0
        l0 = l1 = l2 = 0.0  # ω and α in the segment's axes
        k0 = k1 = k2 = 0.0
        for i in range(3):
            c0 += rotation[s, 0, i] * centre_of_mass[s, i]
            c1 += rotation[s, 1, i] * centre_of_mass[s, i]
            c2 += rotation[s, 2, i] * centre_of_mass[s, i]
            l0 += rotation[s, i, 0] * angular[s, i]
            l1 += rotation[s, i, 1] * angular[s, i]
            l2 += rotation[s, i, 2] * angular[s, i]
            k0 += rotation[s, i, 0] * turning[s, 0, i]
            k1 += rotation[s, i, 1] * turning[s, 0, i]
            k2 += rotation[s, i, 2] * turning[s, 0, i]
        w0, w1, w2 = angular[s, 0], angular[s, 1], angular[s, 2]
        e0, e1, e2 = turning[s, 0, 0], turning[s, 0, 1], turning[s, 0, 2]
        v0, v1, v2 = w1 * c2 - w2 * c1, w2 * c0 - w0 * c2, w0 * c1 - w1 * c0
        m = mass[s]
        f0 = m * (turning[s, 1, 0] + e1 * c2 - e2 * c1 + w1 * v2 - w2 * v1)
        f1 = m * (turning[s, 1, 1] + e2 * c0 - e0 * c2 + w2 * v0 - w0 * v2)
        f2 = m * (turning[s, 1, 2] + e0 * c1 - e1 * c0 + w0 * v1 - w1 * v0)
        # Euler's equation in the segment's axes: I α + ω × I ω.
        h0 = inertia[s, 0, 0] * l0 + inertia[s, 0, 1] * l1 + inertia[s, 0, 2] * l2
        h1 = inertia[s, 1, 0] * l0 + inertia[s, 1, 1] * l1 + inertia[s, 1, 2] * l2
        h2 = inertia[s, 2, 0] * l0 + inertia[s, 2, 1] * l1 + inertia[s, 2, 2] * l2
        n0 = inertia[s, 0, 0] * k0 + inertia[s, 0, 1] * k1 + inertia[s, 0, 2] * k2
        n1 = inertia[s, 1, 0] * k0 + inertia[s, 1, 1] * k1 + inertia[s, 1, 2] * k2
        n2 = inertia[s, 2, 0] * k0 + inertia[s, 2, 1] * k1 + inertia[s, 2, 2] * k2
        n0 += l1 * h2 - l2 * h1
        n1 += l2 * h0 - l0 * h2
        n2 += l0 * h1 - l1 * h0
        for i in range(3):
            wrench[s, 0, i] = rotation[s, i, 0] * n0 + rotation[s, i, 1] * n1
            wrench[s, 0, i] += rotation[s, i, 2] * n2
        wrench[s, 0, 0] += c1 * f2 - c2 * f1
        wrench[s, 0, 1] += c2 * f0 - c0 * f2
        wrench[s, 0, 2] += c0 * f1 - c1 * f0
        wrench[s, 1, 0], wrench[s, 1, 1], wrench[s, 1, 2] = f0, f1, f2

    for side in range(2):
        if np.isnan(point[side, 0]):
            continue
        s = _FOOT[side]
        r0 = point[side, 0] - origin[s, 0]
        r1 = point[side, 1] - origin[s, 1]
        r2 = point[side, 2] - origin[s, 2]
        f0, f1, f2 = force[side, 0], force[side, 1], force[side, 2]
        wrench[s, 0, 0] -= free_moment[side, 0] + r1 * f2 - r2 * f1
        wrench[s, 0, 1] -= free_moment[side, 1] + r2 * f0 - r0 * f2
        wrench[s, 0, 2] -= free_moment[side, 2] + r0 * f1 - r1 * f0
        for i in range(3):
            wrench[s, 1, i] -= force[side, i]

    for s in range(_COUNT - 1, 0, -1):
        p = PARENT[s]
        for d in range(FIRST_DOF[s], FIRST_DOF[s] + DOF_COUNT[s]):
            generalised[d] = (
                axes[d, 0] * wrench[s, 0, 0]
                + axes[d, 1] * wrench[s, 0, 1]
                + axes[d, 2] * wrench[s, 0, 2]
            )
        r0 = origin[s, 0] - origin[p, 0]
        r1 = origin[s, 1] - origin[p, 1]
        r2 = origin[s, 2] - origin[p, 2]
        f0, f1, f2 = wrench[s, 1, 0], wrench[s, 1, 1], wrench[s, 1, 2]
        wrench[p, 0, 0] += wrench[s, 0, 0] + r1 * f2 - r2 * f1
        wrench[p, 0, 1] += wrench[s, 0, 1] + r2 * f0 - r0 * f2
        wrench[p, 0, 2] += wrench[s, 0, 2] + r0 * f1 - r1 * f0
        for i in range(3):
            wrench[p, 1, i] += wrench[s, 1, i]
    for i in range(3):
        generalised[i] = wrench[0, 0, i]
        generalised[3 + i] = wrench[0, 1, i]


@njit
def _all_frames(
    joint_position: Array,
    mass: Array,
    centre_of_mass: Array,
    inertia: Array,
    positions: Array,
    rates: Array,
    second_rates: Array,
    force: Array,
    point: Array,
    free_moment: Array,
    generalised: Array,
    joint: Array,
    locked: Array,
    centre: Array,
    ankle: Array,
) -> None:
    """`newton_euler` of every frame.

    Parameters
    ----------
    generalised : (T, 31) out.
    joint : (T, 2, 3, 2, 3) out: side, joint, moment and force, component.
    locked : (T, 2, 3) out, `LOCKED_MOMENTS`.
    centre : (T, 3) out, centre of mass of the body.
    ankle : (T, 2, 3) out, origin of both feet.
    """
    rotation, origin = np.empty((_COUNT, 3, 3)), np.empty((_COUNT, 3))
    axes = np.zeros((_DOFS, 3))
    angular, linear = np.empty((_COUNT, 3)), np.empty((_COUNT, 3))
    turning, wrench = np.empty((_COUNT, 2, 3)), np.empty((_COUNT, 2, 3))
    for t in range(len(positions)):
        newton_euler(
            joint_position,
            mass,
            centre_of_mass,
            inertia,
            positions[t],
            rates[t],
            second_rates[t],
            force[t],
            point[t],
            free_moment[t],
            rotation,
            origin,
            axes,
            angular,
            linear,
            turning,
            wrench,
            generalised[t],
        )
        for side in range(2):
            for j in range(3):
                joint[t, side, j] = wrench[_JOINT_SEGMENT[side, j]]
            shank, foot = _JOINT_SEGMENT[side, 1], _JOINT_SEGMENT[side, 2]
            sign = 1.0 if side == 0 else -1.0  # adduction +x, internal rotation +z on the right
            ankle[t, side] = origin[foot]
            locked[t, side] = 0.0
            for i in range(3):
                locked[t, side, 0] += sign * rotation[shank, i, 0] * wrench[shank, 0, i]
                locked[t, side, 1] += sign * rotation[shank, i, 2] * wrench[shank, 0, i]
                locked[t, side, 2] += sign * rotation[foot, i, 2] * wrench[foot, 0, i]
        centre[t] = whole_body_centre_of_mass(mass, centre_of_mass, rotation, origin)


def cardan_coordinates(positions: Array) -> Array:
    """Positions (T, 31) whose first three columns are the pelvis's tilt, list and rotation
    (`rotations.pelvis_angles`) without jumps of a full turn, rad, in place of the rotation vector.
    """
    coordinates = np.array(positions, dtype=float)
    orientation = Rotation.from_rotvec(coordinates[:, :3]).as_matrix()
    coordinates[:, :3] = np.unwrap(pelvis_angles(orientation), axis=0)
    return coordinates


def checked_motion(time: Array, positions: Array) -> tuple[Array, Array]:
    """Time (T,) and positions (T, 31) as float arrays that can be differentiated.

    Raises
    ------
    RecordError : fewer than six frames, NaN, or times that do not increase.
    ValueError : other shapes.
    """
    # One memory layout: the compiled functions are compiled anew for every other one.
    time = np.ascontiguousarray(time, dtype=float)
    positions = np.ascontiguousarray(positions, dtype=float)
    if time.ndim != 1 or positions.shape != (len(time), _DOFS):
        raise ValueError(
            f"time must have shape (T,) and positions (T, {_DOFS}), "
            f"however they have {time.shape} and {positions.shape}"
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
            f"{time[at + 1]:.6g} s (frame {at + 1}). Take repeated frames out."
        )
    missing = ~np.isfinite(positions)
    if missing.any():
        t, i = np.argwhere(missing)[0]
        raise RecordError(
            f"The motion has no value of {COORDINATES[i]} at {time[t]:.4g} s "
            f"({missing.any(axis=1).sum()} of {len(time)} frames miss one). Leave these frames "
            "out, or fill the gap before."
        )
    return time, positions


def checked_wrenches(
    time: Array, force: Array, point: Array, free_moment: Array
) -> tuple[Array, Array, Array]:
    """Ground reactions (T, 2, 3) each as float arrays.

    Raises
    ------
    RecordError : a foot has a centre of pressure but no force or free moment.
    ValueError : other shapes.
    """
    arrays = [np.asarray(a, dtype=float) for a in (force, point, free_moment)]
    names = ("force", "point", "free_moment")
    for name, array in zip(names, arrays, strict=True):
        if array.shape != (len(time), 2, 3):
            raise ValueError(
                f"{name} must have shape ({len(time)}, 2, 3), however it has {array.shape}"
            )
    known = ~np.isnan(arrays[1]).any(axis=2)
    arrays[1] = np.where(known[..., None], arrays[1], np.nan)
    for name, array in (("force", arrays[0]), ("free moment", arrays[2])):
        missing = known & ~np.isfinite(array).all(axis=2)
        if missing.any():
            t, side = np.argwhere(missing)[0]
            raise RecordError(
                f"The ground reaction on the {('right', 'left')[side]} foot has a centre of "
                f"pressure but no {name} at {time[t]:.4g} s. Give both, or neither where the "
                "foot is in the air."
            )
    force, point, free_moment = (np.ascontiguousarray(array) for array in arrays)
    return force, point, free_moment


def differentiate(time: Array, positions: Array) -> Kinematics:
    """Velocities and accelerations of a motion by quintic splines through every frame.

    Each coordinate has its own spline, the pelvis's orientation through its Cardan angles, as in
    OpenSim's inverse dynamics (there: natural quintic splines, which differ in the first and last
    frames only). Noise is not smoothed: filter the motion before.

    Parameters
    ----------
    time : (T,) s, increasing; the steps may differ.
    positions : (T, 31), root convention of `model.tree`; any heading.

    Raises
    ------
    RecordError : fewer than six frames, NaN, or times that do not increase.
    """
    time, positions = checked_motion(time, positions)
    coordinates = cardan_coordinates(positions)
    spline = make_interp_spline(time, coordinates, k=5)
    rates, second_rates = spline.derivative(1)(time), spline.derivative(2)(time)
    root = np.empty((len(time), 3, 3))
    root_states(coordinates[:, :3], rates[:, :3], second_rates[:, :3], root)
    rates[:, :3], second_rates[:, :3] = root[:, 1], root[:, 2]
    return Kinematics(positions, rates, second_rates)


def _check_feet(ankle: Array, point: Array) -> None:
    """Refuse forces that act under the other foot. The residual would not show it, for the sum
    of the forces is the same, but every moment of both legs would be wrong.
    """
    own = np.linalg.norm((point - ankle)[..., :2], axis=2)
    other = np.linalg.norm((point - ankle[:, ::-1])[..., :2], axis=2)
    loaded = ~np.isnan(own)
    wrong = (own > other) & loaded
    if 2 * wrong.sum() > loaded.sum():
        raise RecordError(
            f"In {wrong.sum()} of {loaded.sum()} loaded frames the centre of pressure of a foot "
            f"is nearer to the other foot ({np.median(other[loaded]):.2f} m, as the median) than "
            f"to its own ({np.median(own[loaded]):.2f} m). Either the plates are given to the "
            "wrong feet, or plates and markers are in different axes."
        )


def inverse_dynamics(
    model: BodyModel,
    time: Array,
    positions: Array,
    force: Array,
    point: Array,
    free_moment: Array,
    *,
    kinematics: Kinematics | None = None,
) -> InverseDynamics:
    """Joint moments and residuals of a motion under measured ground reactions.

    Parameters
    ----------
    time : (T,) s.
    positions : (T, 31), filtered (nothing is smoothed here), root convention of
        `model.tree`.
    force : (T, 2, 3) N, ground on the right and the left foot, world axes, at the same times.
    point : (T, 2, 3) m, where `force` acts (centre of pressure); NaN where the foot is in the
        air, whatever its force.
    free_moment : (T, 2, 3) Nm, ground on the foot about `point`.
    kinematics : rates to use in place of `differentiate(time, positions)`.

    Raises
    ------
    RecordError : a motion that cannot be differentiated, a centre of pressure without force, or
        forces of the wrong feet.
    """
    time, positions = checked_motion(time, positions)
    force, point, free_moment = checked_wrenches(time, force, point, free_moment)
    rates = kinematics or differentiate(time, positions)
    tree = tree_arrays(model)
    frames = len(time)
    generalised = np.empty((frames, _DOFS))
    joint, locked = np.empty((frames, 2, 3, 2, 3)), np.empty((frames, 2, 3))
    centre, ankle = np.empty((frames, 3)), np.empty((frames, 2, 3))
    _all_frames(
        tree.joint_position,
        tree.mass,
        tree.centre_of_mass,
        tree.inertia,
        *(np.ascontiguousarray(values, dtype=float) for values in rates),
        force,
        point,
        free_moment,
        generalised,
        joint,
        locked,
        centre,
        ankle,
    )
    _check_feet(ankle, point)
    loaded = ~np.isnan(point[..., 0])
    size = np.linalg.norm(force, axis=2)[loaded]
    return InverseDynamics(
        time=time,
        moments=generalised[:, ROOT_DOFS:],
        powers=generalised[:, ROOT_DOFS:] * rates.velocities[:, ROOT_DOFS:],
        residual_force=generalised[:, 3:6],
        residual_moment=generalised[:, :3],
        joint_force=joint[:, :, :, 1],
        joint_moment=joint[:, :, :, 0],
        locked_moments=locked,
        centre_of_mass=centre,
        peak_external_force=float(size.max(initial=0.0)),
    )


def residuals(
    result: InverseDynamics,
    frames: NDArray[np.bool_] | None = None,
    *,
    ground_height: float = 0.0,
) -> Residuals:
    """Measures of the residuals.

    Parameters
    ----------
    frames : (T,) which to look at, for example those whose ground reaction is known; all when
        not given.
    ground_height : m, of the ground above z = 0, for the height of the centre of mass.

    Raises
    ------
    RecordError : no frame is left, or no foot is on the ground in the whole motion.
    """
    chosen = np.ones(len(result.time), dtype=bool) if frames is None else np.asarray(frames)
    if not chosen.any():
        raise RecordError(
            "The residuals cannot be judged: in no frame is the ground reaction of both feet "
            "known. Use a trial in which each foot steps on its own plate."
        )
    if result.peak_external_force == 0.0:
        raise RecordError(
            "The residuals cannot be judged: no foot has a ground reaction in the whole motion. "
            "Check that the force plates were recorded and assigned to the feet."
        )
    force, moment = result.residual_force[chosen], result.residual_moment[chosen]
    height = float(result.centre_of_mass[chosen, 2].mean()) - ground_height
    peak = result.peak_external_force
    return Residuals(
        force_rms=float(np.sqrt((force**2).mean(axis=0)).max()),
        force_peak=float(np.abs(force).max()),
        moment_rms=float(np.sqrt((moment**2).mean(axis=0)).max()),
        moment_peak=float(np.abs(moment).max()),
        force_share=float(np.linalg.norm(force, axis=1).max() / peak),
        moment_share=float(np.linalg.norm(moment, axis=1).max() / (height * peak)),
        frames=int(chosen.sum()),
    )
