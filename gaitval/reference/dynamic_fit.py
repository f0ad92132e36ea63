"""A reference motion that obeys Newton's laws and stays close to everything recorded.

A motion with exactly the recorded angles needs other forces and moments than the recorded ones: the
model is not the body, the mean recorded vertical force is not one body weight, and a force plate
that is two centimetres out of place changes the moments of its leg by 0.2 Nm/kg (those of the
built-in records seem to be 3.6 cm out, docs/decisions.md). No policy can follow a record that
contradicts itself. This fit finds the best compromise beforehand. Of the periodic motions without a
residual force on the pelvis, and whose feet neither slide nor sink, it is the one whose deviations
from the recorded angles, moments and ground reaction, each divided by the required accuracy
(`Accuracy`), have the smallest sum of squares. No policy can do better than the remaining
deviations. The walk is always compared with the unchanged record.

The unknowns are the first harmonics of all 31 coordinates and, at every instant of stance, each
foot's ground reaction: force, centre of pressure and free moment. Gauss-Newton solves it, with the
laws and their derivatives from `walking_laws`.
"""

from dataclasses import replace
from typing import NamedTuple

import numpy as np
from scipy.linalg import cho_factor, cho_solve

from gaitval.arrays import Array, Flags
from gaitval.configuration import ContactSettings
from gaitval.constants import GRAVITY
from gaitval.coordinates import ACTUATED, COORDINATES, LUMBAR, SIDES
from gaitval.gait.record import GaitRecord
from gaitval.inverse.motion_rates import cardan_coordinates, root_states
from gaitval.model.body import BodyModel
from gaitval.model.tree import ROOT_DOFS, Tree, tree_arrays
from gaitval.reference.motion import (
    FEED_FORWARD,
    SAMPLES,
    ReferenceMotion,
    build_reference,
    moved,
    side_phase,
    spectral_rate,
    static_stiffness,
)
from gaitval.reference.walking_laws import FOOT, FORCES, INPUTS, OUTPUTS, TRUNK, walking_laws

INSTANTS = 100
"""Instants of the cycle at which Newton's equations must hold, 1 % of the cycle apart."""

HARMONICS = 8
"""Harmonics of the change of every coordinate."""

MOST_STEPS = 15

SMALLEST_GAIN = 1e-3
"""Relative decrease of the sum of squares at which the Gauss-Newton steps end."""


class RecordAccuracy(NamedTuple):
    """Departures from the record, rad, Nm/kg, body weights (BW): two fifths to three quarters of
    the accuracy that the project aims at.
    """

    sagittal: float = np.deg2rad(1.5)
    frontal: float = np.deg2rad(1.4)
    """Hip adduction and rotation."""
    pelvis: float = np.deg2rad(1.5)
    moment: float = 0.06
    adduction_moment: float = 0.15
    forward_force: float = 0.020
    sideways_force: float = 0.015
    vertical_force: float = 0.020


class LawAccuracy(NamedTuple):
    """How well the laws of motion and of contact hold."""

    residual: float = 0.002
    """BW and BW m; residual force and moment on the pelvis, which nothing exerts."""
    sliding: float = 0.03
    """m/s, of the part of the sole that is on the ground."""
    pivoting: float = 0.3
    """rad/s, of a foot on the ground about the vertical."""
    depth: float = 0.0015
    """m, of the lowest point of the sole, relative to the height that carries the vertical
    force."""
    landing: float = 0.0004
    """m, likewise in the first `_LANDING` of the cycle: the sole descends 3 mm in 1 % of the cycle,
    and a strike that is 1 % late is a knee angle error of 3 degrees in late swing."""
    clearance: float = 0.002
    """m, by which the swinging foot misses `SWING_CLEARANCE`."""


class PressureAccuracy(NamedTuple):
    """How well the ground reaction stays under the sole and without jumps."""

    forward: float = 0.015
    sideways: float = 0.008
    """m, from the centre of pressure to the middle of the part of the sole on the ground."""
    change: float = 0.004
    """m, second difference of the centre of pressure."""
    force_change: float = 0.025
    """BW from one instant to the next, of the departure from the recorded force."""


class ConventionAccuracy(NamedTuple):
    """Departures from its convention of what was not recorded, rad, m, BW m."""

    subtalar: float = np.deg2rad(3.0)
    toes: float = np.deg2rad(5.0)
    arms: float = np.deg2rad(8.0)
    trunk: float = np.deg2rad(3.0)
    """Of the trunk's rotation from upright."""
    lumbar: float = np.deg2rad(10.0)
    translation: float = 0.03
    free_moment: float = 0.005


class Accuracy(NamedTuple):
    """Departures that weigh the same."""

    record: RecordAccuracy = RecordAccuracy()
    laws: LawAccuracy = LawAccuracy()
    pressure: PressureAccuracy = PressureAccuracy()
    convention: ConventionAccuracy = ConventionAccuracy()


SWING_CLEARANCE = 0.012
"""m below the lowest point of a swinging sole; people have about 13 mm (Winter 1992, from memory),
and a policy that is given less lifts its feet more than the reference, which delays heel strike."""

_SHARING_SPHERES = 3
"""Number of spheres that share a foot's vertical force, for computing how deep they are pressed
in."""

_LANDING = 0.05
"""Fraction of the cycle."""

_STANCE_EDGE = 0.04
"""Fraction of the cycle at both ends of stance in which the foot may still slide."""


class _Problem(NamedTuple):
    """The fit of one record; T instants.

    Attributes
    ----------
    path : three (T, 31): coordinates of the motion to change and their first two rates, without
        the forward travel but with its speed.
    series : three (T, 17), `_series`.
    force : (T, 12) N, m, Nm: recorded ground reaction with a first guess of the rest.
    scale : (12,) units of the unknown changes of `force`.
    unknown : (T, 12) bool, where `force` may change: in stance.
    target, weight : (T, 46) of the numbers of `walking_laws`.
    swinging : (T, 2) bool, the foot must clear the ground.
    clearance_weight : weight of missing it.
    penalty, miss : (R, U), (R,): the residuals that are linear in the U unknowns are penalty @
        unknowns + miss.
    """

    tree: Tree
    path: tuple[Array, Array, Array]
    series: tuple[Array, Array, Array]
    force: Array
    scale: Array
    unknown: Flags
    target: Array
    weight: Array
    swinging: Flags
    clearance_weight: float
    penalty: Array
    miss: Array


def _series(phase: Array, stride_time: float) -> tuple[Array, Array, Array]:
    """Harmonics 0 to `HARMONICS` (T, 17) with their first and second rates in time."""
    k = 2.0 * np.pi * np.arange(1, HARMONICS + 1)
    angle = np.outer(phase, k)
    one = np.ones((len(phase), 1))
    return (
        np.hstack([one, np.cos(angle), np.sin(angle)]),
        np.hstack([0.0 * one, -k * np.sin(angle), k * np.cos(angle)]) / stride_time,
        np.hstack([0.0 * one, -(k**2) * np.cos(angle), -(k**2) * np.sin(angle)]) / stride_time**2,
    )


def _resampled(values: Array, count: int) -> Array:
    """One cycle of samples (N, …) at `count` equally spaced phases, by its Fourier series."""
    terms = min(len(values), count) // 2
    spectrum = np.fft.rfft(values, axis=0)[:terms]
    padded = np.zeros((count // 2 + 1, *values.shape[1:]), dtype=complex)
    padded[:terms] = spectrum
    return np.asarray(np.fft.irfft(padded, count, axis=0) * (count / len(values)))


def _coordinate_accuracy(accuracy: Accuracy) -> Array:
    """Accuracy (31,) of every coordinate; infinite for the lumbar ones, because the trunk is
    constrained instead.
    """
    kinds = {
        "hip_flexion": accuracy.record.sagittal,
        "knee_angle": accuracy.record.sagittal,
        "ankle_angle": accuracy.record.sagittal,
        "hip_adduction": accuracy.record.frontal,
        "hip_rotation": accuracy.record.frontal,
        "subtalar_angle": accuracy.convention.subtalar,
        "mtp_angle": accuracy.convention.toes,
    }
    scales = [accuracy.record.pelvis] * 3 + [accuracy.convention.translation] * 3
    for name in ACTUATED:
        joint = name.rpartition("_")[0]
        scales.append(np.inf if name in LUMBAR else kinds.get(joint, accuracy.convention.arms))
    return np.array(scales)


def _penalties(
    accuracy: Accuracy, departure: Array, series: Array, force: Array, scale: Array,
    unknown: Flags,
) -> tuple[Array, Array]:  # fmt: skip
    """Rows (R, U) and constants (R,) of the residuals that are linear in the unknowns: deviations
    of the coordinates and of the recorded forces, and roughness of the forces over time.

    Parameters
    ----------
    departure : (T, 31) deviation of the initial motion from the record.
    """
    instants, terms = series.shape
    count = terms * len(COORDINATES)
    column = np.full(unknown.shape, -1)
    column[unknown] = count + np.arange(unknown.sum())
    total = count + int(unknown.sum())
    norm = 1.0 / np.sqrt(instants)
    rows, constants = [], []
    for k, wanted in enumerate(_coordinate_accuracy(accuracy)):
        block = slice(k * terms, (k + 1) * terms)
        if np.isfinite(wanted):
            row = np.zeros((instants, total))
            row[:, block] = series / wanted * norm
            constants.append(departure[:, k] / wanted * norm)
        else:
            row = np.zeros((terms, total))
            row[:, block] = np.eye(terms) / accuracy.convention.lumbar
            constants.append(np.zeros(terms))
        rows.append(row)
    record = accuracy.record
    sizes = [record.forward_force, record.sideways_force, record.vertical_force]
    close = np.array([*sizes, np.inf, np.inf, accuracy.convention.free_moment])
    smooth = np.array([accuracy.pressure.force_change] * 3 + [accuracy.pressure.change] * 2)
    smooth = np.append(smooth, accuracy.convention.free_moment)
    weights = np.concatenate([scale[:3] / scale[0], scale[3:5], scale[5:6] / scale[0]])
    for t in range(instants):
        after, before = (t + 1) % instants, t - 1
        for i in range(12):
            kind = i % 6
            if not unknown[t, i]:
                continue
            if np.isfinite(close[kind]):
                row = np.zeros((1, total))
                row[0, column[t, i]] = weights[kind] / close[kind] * norm
                rows.append(row)
                constants.append(np.zeros(1))
            size = weights[kind] / smooth[kind] * norm
            row = np.zeros((1, total))
            if kind in (3, 4):
                if unknown[after, i] and unknown[before, i]:
                    row[0, [column[before, i], column[t, i], column[after, i]]] = size * np.array(
                        [1.0, -2.0, 1.0]
                    )
                    bend = force[after, i] - 2.0 * force[t, i] + force[before, i]
                    rows.append(row)
                    constants.append(np.array([bend / smooth[kind] * norm]))
            elif unknown[after, i]:
                row[0, [column[t, i], column[after, i]]] = size * np.array([-1.0, 1.0])
                rows.append(row)
                constants.append(np.zeros(1))
    return np.vstack(rows), np.concatenate(constants)


def _problem(
    reference: ReferenceMotion,
    record: GaitRecord,
    model: BodyModel,
    contact: ContactSettings,
    accuracy: Accuracy,
) -> _Problem:
    tree = tree_arrays(model)
    weight = model.mass * GRAVITY
    time = record.stride_time
    phase = np.arange(INSTANTS) / INSTANTS
    whole = _periodic_coordinates(reference)
    rates = spectral_rate(whole) / time
    second = spectral_rate(rates) / time
    rates[:, 3] += record.speed
    path = tuple(_resampled(values, INSTANTS) for values in (whole, rates, second))
    series = _series(phase, time)
    offsets = np.concatenate([np.zeros(ROOT_DOFS), reference.offsets])

    # Rounded, so that an instant at the edge of stance is treated the same on both sides.
    own = np.column_stack([np.mod(side_phase(record, side, phase).round(9), 1.0) for side in SIDES])
    ends = np.array([record.stance_fraction[side] for side in SIDES])
    stance = own <= ends
    sliding = (own > _STANCE_EDGE) & (own < ends - _STANCE_EDGE)
    force = np.zeros((INSTANTS, 2, 6))
    for i, side in enumerate(SIDES):
        force[:, i, :3] = weight * record.ground_reaction(side, own[:, i])
    stiffness = static_stiffness(contact, tree.sphere_radius.mean())
    depth = (np.maximum(force[..., 2], 0.0) / _SHARING_SPHERES / stiffness) ** (2.0 / 3.0)

    target = np.zeros((INSTANTS, OUTPUTS))
    weights = np.zeros((INSTANTS, OUTPUTS))
    weights[:, :ROOT_DOFS] = 1.0 / (accuracy.laws.residual * weight)
    weights[:, TRUNK] = 1.0 / accuracy.convention.trunk
    for i, side in enumerate(SIDES):
        for name in FEED_FORWARD:
            place = COORDINATES.index(f"{name}_{side[0]}")
            wanted = (
                accuracy.record.adduction_moment
                if name == "hip_adduction"
                else accuracy.record.moment
            )
            weights[:, place] = 1.0 / (wanted * model.mass)
            target[:, place] = record.moments[f"{name}_{side[0]}"](own[:, i]) * model.mass
        first = FOOT + 6 * i
        weights[:, first : first + 2] = sliding[:, i, None] / accuracy.laws.sliding
        weights[:, first + 2] = sliding[:, i] / accuracy.laws.pivoting
        weights[:, first + 3] = stance[:, i] / accuracy.laws.depth
        weights[stance[:, i] & (own[:, i] < _LANDING), first + 3] = 1.0 / accuracy.laws.landing
        target[:, first + 3] = -depth[:, i]
        weights[:, first + 4] = stance[:, i] / accuracy.pressure.forward
        weights[:, first + 5] = stance[:, i] / accuracy.pressure.sideways

    # The initial guess of the centre of pressure is the middle of the sole on the ground.
    inputs = np.hstack([*path, force.reshape(INSTANTS, 12)])
    out = walking_laws(tree, inputs)
    for i in range(2):
        force[:, i, 3:5] = -out[:, FOOT + 6 * i + 4 : FOOT + 6 * i + 6]

    scale = np.tile([weight, weight, weight, 0.1, 0.1, weight], 2)
    unknown = np.repeat(stance, 6, axis=1)
    penalty, miss = _penalties(
        accuracy, np.broadcast_to(offsets, path[0].shape), series[0],
        force.reshape(INSTANTS, 12), scale, unknown,
    )  # fmt: skip
    norm = 1.0 / np.sqrt(INSTANTS)
    return _Problem(
        tree=tree,
        path=(path[0], path[1], path[2]),
        series=series,
        force=force.reshape(INSTANTS, 12),
        scale=scale,
        unknown=unknown,
        target=target,
        weight=weights * norm,
        swinging=(own > ends + _STANCE_EDGE) & (own < 1.0 - _STANCE_EDGE),
        clearance_weight=norm / accuracy.laws.clearance,
        penalty=penalty,
        miss=miss,
    )


def _unpacked(problem: _Problem, unknowns: Array) -> tuple[Array, Array]:
    """Changes of the coordinates' series (17, 31), and forces (T, 12)."""
    terms = problem.series[0].shape[1]
    count = terms * len(COORDINATES)
    force = problem.force.copy()
    change = np.zeros_like(force)
    change[problem.unknown] = unknowns[count:]
    return unknowns[:count].reshape(len(COORDINATES), terms).T, force + change * problem.scale


def _laws(
    problem: _Problem, unknowns: Array, slope: Array | None = None
) -> tuple[Array, Array, Array]:
    """The numbers (T, 46) of `walking_laws`, their weighted residuals and the weights."""
    change, force = _unpacked(problem, unknowns)
    parts = [path + part @ change for path, part in zip(problem.path, problem.series, strict=True)]
    out = walking_laws(problem.tree, np.hstack([*parts, force]), slope)
    weight = problem.weight.copy()
    residual = out - problem.target
    for i in range(2):
        height = FOOT + 6 * i + 3
        low = problem.swinging[:, i] & (out[:, height] < SWING_CLEARANCE)
        weight[low, height] = problem.clearance_weight
        residual[low, height] = out[low, height] - SWING_CLEARANCE
    return out, residual * weight, weight


def _normal_equations(problem: _Problem, unknowns: Array) -> tuple[Array, Array]:
    """Matrix (U, U) and gradient (U,) of half the sum of squares."""
    slope = np.zeros((INSTANTS, OUTPUTS, INPUTS))
    _, residual, weight = _laws(problem, unknowns, slope)
    slope *= weight[:, :, None]
    count = len(COORDINATES) * problem.series[0].shape[1]
    columns = np.zeros((INSTANTS, OUTPUTS, len(unknowns)))
    for i, part in enumerate(problem.series):
        rows = slope[:, :, 31 * i : 31 * (i + 1), None] * part[:, None, None, :]
        columns[:, :, :count] += rows.reshape(INSTANTS, OUTPUTS, count)
    place = np.cumsum(problem.unknown).reshape(problem.unknown.shape) - 1 + count
    for t in range(INSTANTS):
        free = np.flatnonzero(problem.unknown[t])
        columns[t][:, place[t, free]] = slope[t][:, FORCES + free] * problem.scale[free]
    used = weight.reshape(-1) > 0.0
    jacobian = columns.reshape(-1, len(unknowns))[used]
    linear = problem.penalty @ unknowns + problem.miss
    return (
        jacobian.T @ jacobian + problem.penalty.T @ problem.penalty,
        jacobian.T @ residual.reshape(-1)[used] + problem.penalty.T @ linear,
    )


def _cost(problem: _Problem, unknowns: Array) -> float:
    _, residual, _ = _laws(problem, unknowns)
    linear = problem.penalty @ unknowns + problem.miss
    return float(np.sum(residual**2) + np.sum(linear**2))


def _solve(problem: _Problem) -> Array:
    """Unknowns (U,) with the least sum of squares, by damped Gauss-Newton steps."""
    unknowns = np.zeros(problem.penalty.shape[1])
    cost, damping = _cost(problem, unknowns), 1e-6
    for _ in range(MOST_STEPS):
        matrix, gradient = _normal_equations(problem, unknowns)
        diagonal = np.diag(matrix).copy()
        before = cost
        while damping < 1.0:
            matrix[np.diag_indices_from(matrix)] = diagonal * (1.0 + damping)
            tried = unknowns - cho_solve(cho_factor(matrix), gradient)
            tried_cost = _cost(problem, tried)
            if tried_cost < cost:
                unknowns, cost = tried, tried_cost
                damping = max(0.2 * damping, 1e-9)
                break
            damping = max(10.0 * damping, 1e-5)
        if before - cost < SMALLEST_GAIN * cost:
            break
    return unknowns


def _periodic_coordinates(reference: ReferenceMotion) -> Array:
    """Coordinates (N, 31) with the pelvis' Cardan angles first, without the forward travel."""
    coordinates = cardan_coordinates(reference.positions)
    coordinates[:, 3] -= reference.speed * reference.stride_time * reference.phase
    return coordinates


def fitted(
    reference: ReferenceMotion,
    record: GaitRecord,
    model: BodyModel,
    contact: ContactSettings,
    accuracy: Accuracy | None = None,
) -> ReferenceMotion:
    """The motion near `reference` that obeys the laws of motion and of contact.

    Its `moments` are the net joint moments that it needs, for all joints (the toes' from their
    share of the ground reaction). Its `ground_reaction` is that of the fit, zero in swing, with a
    mean of one body weight.

    Parameters
    ----------
    reference : of `reference.motion.build_reference`, from `record`.
    contact : law that sets how deep the feet press into the ground.
    accuracy : deviations of equal weight.
    """
    problem = _problem(reference, record, model, contact, accuracy or Accuracy())
    unknowns = _solve(problem)
    change, force = _unpacked(problem, unknowns)
    out, _, _ = _laws(problem, unknowns)

    whole = _periodic_coordinates(reference)
    series, series_rate, _ = _series(reference.phase, record.stride_time)
    coordinates = whole + series @ change
    rates = spectral_rate(whole) / record.stride_time + series_rate @ change
    rates[:, 3] += record.speed
    positions, velocities = coordinates.copy(), rates.copy()
    root = np.empty((len(coordinates), 3, 3))
    root_states(coordinates[:, :3], rates[:, :3], np.zeros((len(coordinates), 3)), root)
    positions[:, :3], velocities[:, :3] = root[:, 0], root[:, 1]
    positions[:, 3] += record.speed * record.stride_time * reference.phase
    closed = np.concatenate([force, force[:1]]).reshape(INSTANTS + 1, 2, 6)[..., :3]
    instants = np.arange(INSTANTS + 1) / INSTANTS
    ground_reaction = np.stack(
        [
            np.stack([np.interp(reference.phase, instants, closed[:, i, j]) for j in range(3)], 1)
            for i in range(2)
        ],
        axis=1,
    ) / (model.mass * GRAVITY)
    return replace(
        moved(reference, model, positions, velocities),
        moments=_resampled(out[:, ROOT_DOFS : TRUNK.start], SAMPLES),
        ground_reaction=ground_reaction,
        offsets=reference.offsets + change[0, ROOT_DOFS:],
    )


def consistent_reference(
    record: GaitRecord, model: BodyModel, contact: ContactSettings | None = None
) -> ReferenceMotion:
    """Reference motion of a record on a scaled model: built from the record, then `fitted`."""
    contact = contact or ContactSettings()
    return fitted(build_reference(record, model, contact), record, model, contact)
