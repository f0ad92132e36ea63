"""A walk whose motion, moments and ground reactions are known exactly, for the tests of inverse
dynamics and of consistency."""

from dataclasses import dataclass
from functools import cache

import numpy as np
from scipy.spatial.transform import Rotation

from gaitval.coordinates import COORDINATES, SIDES
from gaitval.gait.record import GaitRecord
from gaitval.kinetics.inverse.inverse_dynamics import inverse_dynamics
from gaitval.kinetics.inverse.motion_rates import Kinematics, cardan_coordinates
from gaitval.kinetics.musculature.gait import LoadedMotion
from gaitval.model.body import SEGMENTS, BodyModel
from gaitval.model.rotations import pelvis_rotation
from gaitval.model.tree import segment_frames
from gaitval.scaling.scaling import scale_subject
from gaitval.subjects.subject_file import load_subject
from gaitval.walk.reference.motion import ReferenceMotion, build_reference

RATE = 150.0
HEIGHT = 1.75
HARMONICS = 8
"""Of a stride of 1.1 s: up to 7 Hz, what a filter at 6 Hz leaves of a recording."""


@dataclass(frozen=True)
class KnownWalk:
    """T frames; `moments` (T, 25) Nm belong to `kinematics` under the ground reactions."""

    model: BodyModel
    time: np.ndarray
    kinematics: Kinematics
    force: np.ndarray
    point: np.ndarray
    free_moment: np.ndarray
    moments: np.ndarray

    @property
    def positions(self) -> np.ndarray:
        return self.kinematics.positions

    @property
    def wrenches(self) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        return self.force, self.point, self.free_moment


def angular_rates(angles, rates, second_rates):
    """World angular velocity and acceleration (T, 3) of the pelvis's Cardan angles, from the
    product of three rotations (an own way to them: through the matrix and its derivatives)."""

    def turn(axis, angle, rate, second):
        matrix = Rotation.from_rotvec(np.outer(angle, axis)).as_matrix()
        cross = np.cross(np.eye(3), axis)  # cross[i] = e_i × axis, so cross @ v = axis × v
        first = rate[:, None, None] * (cross @ matrix)
        return (
            matrix,
            first,
            second[:, None, None] * (cross @ matrix) + rate[:, None, None] * (cross @ first),
        )

    axes = np.array([[0, 1, 0], [-1, 0, 0], [0, 0, 1]], dtype=float)
    a, b, c = (turn(axes[i], angles[:, i], rates[:, i], second_rates[:, i]) for i in range(3))
    matrix = a[0] @ b[0] @ c[0]
    first = a[1] @ b[0] @ c[0] + a[0] @ b[1] @ c[0] + a[0] @ b[0] @ c[1]
    second = (
        a[2] @ b[0] @ c[0]
        + a[0] @ b[2] @ c[0]
        + a[0] @ b[0] @ c[2]
        + 2 * (a[1] @ b[1] @ c[0] + a[1] @ b[0] @ c[1] + a[0] @ b[1] @ c[1])
    )
    transposed = np.swapaxes(matrix, 1, 2)
    spin = first @ transposed  # [ω]×
    change = second @ transposed + first @ np.swapaxes(first, 1, 2)  # [α]×

    def vector(skew):
        return np.column_stack([skew[:, 2, 1], skew[:, 0, 2], skew[:, 1, 0]])

    return vector(spin), vector(change)


@cache
def _subject() -> tuple[BodyModel, GaitRecord, ReferenceMotion]:
    subject = load_subject("S05")
    model, record = scale_subject(subject).model, subject.record()
    return model, record, build_reference(record, model)


def _shares(record: GaitRecord, phase: np.ndarray) -> np.ndarray:
    """Of each foot in the vertical ground reaction, (T, 2)."""
    vertical = np.column_stack(
        [
            record.ground_reaction(side, phase - (record.left_phase if side == "left" else 0.0))[
                :, 2
            ]
            for side in SIDES
        ]
    ).clip(0.0)
    return vertical / vertical.sum(axis=1, keepdims=True)


def known_walk(
    *,
    seconds: float = 3.0,
    rate: float = RATE,
    heading: float = 0.0,
    body: BodyModel | None = None,
    settling: float = 0.0,
) -> KnownWalk:
    """Subject 5's reference motion as a Fourier series over several cycles, with the ground
    reactions that it needs. Its toes stay straight, for no usual marker set shows them.

    The total wrench on the feet is what Newton-Euler asks for, so no residual is left. It is
    shared between the feet as the record shares the vertical force; each acts under the ankle,
    with the moment that is left as a free moment about all three axes.

    heading : rad, direction of the walk, turned to the left from x.
    body : that walks so; subject 5's own if left out.
    settling : s, in which the share of the ground reaction changes smoothly at strikes and
        toe-offs, where the mean curves of the record jump by up to 7 %.
    """
    model, record, reference = _subject()
    if body is not None:
        model, reference = body, build_reference(record, body)
    time = np.arange(round(seconds * rate)) / rate
    cycle = cardan_coordinates(reference.positions)
    cycle[:, [COORDINATES.index(f"mtp_angle_{side}") for side in "rl"]] = 0.0
    cycle[:, 3] -= reference.speed * reference.stride_time * reference.phase
    spectrum = np.fft.rfft(cycle, axis=0)[: HARMONICS + 1] / len(cycle)
    spectrum[1:] *= 2.0
    omega = 2j * np.pi * np.arange(HARMONICS + 1) / reference.stride_time
    waves = np.exp(np.outer(time, omega))
    coordinates, rates, second = ((waves @ (omega[:, None] ** n * spectrum)).real for n in range(3))
    coordinates[:, 3] += reference.speed * time
    rates[:, 3] += reference.speed

    turn = Rotation.from_rotvec([0.0, 0.0, heading])
    velocities, accelerations, positions = rates.copy(), second.copy(), coordinates.copy()
    velocities[:, :3], accelerations[:, :3] = angular_rates(
        coordinates[:, :3], rates[:, :3], second[:, :3]
    )
    pelvis = Rotation.from_matrix(pelvis_rotation(*coordinates[:, :3].T))
    positions[:, :3] = (turn * pelvis).as_rotvec()
    positions[:, 3:6] = turn.apply(coordinates[:, 3:6])
    for array in (velocities, accelerations):
        array[:, :3], array[:, 3:6] = turn.apply(array[:, :3]), turn.apply(array[:, 3:6])
    kinematics = Kinematics(positions, velocities, accelerations)

    nowhere = np.full((len(time), 2, 3), np.nan)
    needed = inverse_dynamics(
        model, time, positions, nowhere, nowhere, nowhere, kinematics=kinematics
    )
    window = np.hanning(round(settling * rate) + 3)[1:-1]
    moments_in_it = settling * np.linspace(-0.5, 0.5, len(window) + 2)[1:-1]
    share = sum(
        weight * _shares(record, (time + moment) / reference.stride_time)
        for weight, moment in zip(window / window.sum(), moments_in_it, strict=True)
    )
    feet = [SEGMENTS.index("foot_r"), SEGMENTS.index("foot_l")]
    point = segment_frames(model, positions)[:, feet][..., :3, 3] * [1.0, 1.0, 0.0]
    force = share[..., None] * needed.residual_force[:, None]
    arm = point - positions[:, None, 3:6]
    left_over = needed.residual_moment - np.cross(arm, force).sum(axis=1)
    free_moment = share[..., None] * left_over[:, None]
    point[share == 0.0] = np.nan
    moments = inverse_dynamics(
        model, time, positions, force, point, free_moment, kinematics=kinematics
    ).moments
    return KnownWalk(model, time, kinematics, force, point, free_moment, moments)


def loaded_walk() -> LoadedMotion:
    """`known_walk` with its moments, as muscles take it: a cycle of each side as long as it."""
    walk = known_walk()
    dynamics = inverse_dynamics(
        walk.model, walk.time, walk.positions, walk.force, walk.point, walk.free_moment,
        kinematics=walk.kinematics,
    )  # fmt: skip
    span = float(walk.time[0]), float(walk.time[-1])
    cycles = {side: [span] for side in SIDES}
    return LoadedMotion("walk", walk.model, HEIGHT, walk.positions, dynamics, cycles)
