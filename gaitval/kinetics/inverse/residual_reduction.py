"""The smallest change of motion and masses that makes a recording dynamically consistent.

Markers, masses and force plates disagree, and inverse dynamics puts the disagreement on the pelvis
as a residual force and moment. OpenSim's residual reduction (Thelen and Anderson 2006, J Biomech
39:1107) and AddBiomechanics (Werling et al. 2023, PLoS ONE 18:e0295152) remove it by small changes
of the motion and of the segments' masses. So does this module, as one nonlinear least-squares
problem over the whole trial:

    minimise  Σ_frames (Δ markers / σ)² + (Δq / σ)² + (Δq̈ / σ)² + (residual / σ)²
              + Σ (ln mass factors / σ)² + (Δ total mass / σ)² + (trunk offset / σ)²

Δq(t) is a quintic spline for each of the 31 coordinates; coordinates that no marker shows (the
trunk and the arms with a lower-body marker set) are constrained loosely, and explain most of the
residual. It is solved by Gauss-Newton; the normal equations have a band with one block of
coordinates for each knot, and the masses as a border, so the time is proportional to the length of
the trial.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Final, NamedTuple

import numpy as np
from scipy.interpolate import make_interp_spline
from scipy.linalg import cho_factor, cho_solve, cho_solve_banded, cholesky_banded
from scipy.spatial.transform import Rotation
from threadpoolctl import threadpool_limits  # type: ignore[import-untyped]

from gaitval.arrays import Array, Flags, Index
from gaitval.coordinates import COORDINATES
from gaitval.kinetics.inverse.change_splines import (
    BLOCK,
    DEGREE,
    ChangeSplines,
    add_block,
    times_band,
)
from gaitval.kinetics.inverse.consistent_motion import ConsistentMotion
from gaitval.kinetics.inverse.inverse_dynamics import (
    checked_wrenches,
    ground_level,
    inverse_dynamics,
    residuals,
)
from gaitval.kinetics.inverse.motion_rates import cardan_coordinates, checked_motion
from gaitval.kinetics.inverse.residual_derivatives import (
    BODY_UNKNOWNS,
    GROUP_OF_SEGMENT,
    MASS_GROUPS,
    TORSO,
    marker_metric,
    moved_by,
    residual_derivatives,
    residuals_of_frames,
)
from gaitval.model.body import SEGMENTS, BodyModel
from gaitval.model.markers import ModelMarker
from gaitval.model.rotations import pelvis_rotation
from gaitval.model.tree import COORDINATE_COUNT, ROOT_DOFS, segment_frames, tree_arrays


@dataclass(frozen=True)
class ReductionLimits:
    """How far a search for smaller residuals goes."""

    stride_s: float = 1.0
    """s. Errors of markers, forces and the guessed trunk repeat from stride to stride, and within a
    stride are similar for the time between knots: relative to the priors of the masses, a trial of
    any length and frame rate counts as independent errors over this time."""
    largest_steps: int = 20
    shortest_step: float = 1e-3
    """Fraction of a Gauss-Newton step at which the search along it ends."""
    smallest_gain: float = 1e-3
    """Relative decrease of the cost per step below which the search ends."""


REDUCTION: Final = ReductionLimits()


@dataclass(frozen=True)
class ReductionSettings:
    """How much each quantity may change, as standard deviations: a change of this size costs as
    much as a residual of `residual_force_n` for the same time.

    Attributes
    ----------
    marker_m : m, displacement of a marker on the body; soft tissue moves this much.
    translation_m : m, of the pelvis.
    observed_rad : rad, of a coordinate that moves a marker.
    unobserved_rad : rad, of one that moves none: where the trunk was is a guess.
    highest_hz : changes that are faster than this, the usual low-pass of the motion, cost more,
        with the square of the frequency.
    residual_force_n, residual_moment_nm : of each component of the residual.
    segment_mass : of the logarithm of a segment's mass factor.
    total_mass : of the body's mass, relative: scales and force plates disagree by this much.
    trunk_offset_m : m, of the trunk's centre of mass in each direction.
    knot_s : s, between the knots of the change.

    Notes
    -----
    Looser markers and masses (10 mm, 5 %) do not lower the residual on recorded walks, but spoil
    the moments of a synthetic walk whose truth is known (3 mm of marker noise, a trunk that no
    marker shows): the largest error of a leg moment grew from 5 to 26 % of its peak, and the trunk
    lost a third of its mass. With the values used it grows to 7 %, and the masses are within 4 %.
    """

    marker_m: float = 0.005
    translation_m: float = 0.020
    observed_rad: float = float(np.deg2rad(2.0))
    unobserved_rad: float = float(np.deg2rad(20.0))
    highest_hz: float = 8.0
    residual_force_n: float = 3.0
    residual_moment_nm: float = 3.0
    segment_mass: float = 0.02
    total_mass: float = 0.01
    trunk_offset_m: float = 0.010
    knot_s: float = 0.050


@dataclass(frozen=True)
class _Problem:
    """What is constant over the steps; T frames, N = 31 × splines.

    Attributes
    ----------
    base : (T, 3, 31) recorded coordinates (Cardan angles of the pelvis) and their rates.
    wrenches : (T, 3, 2, 3) force, point, free moment on both feet.
    prior : band (N, 186) of the cost of a change of motion.
    scale : (6,) makes residuals (moment, force) comparable with the prior.
    body_sigma : (10,) standard deviations of ln mass factors and trunk offset.
    total_mass_sigma : kg.
    """

    model: BodyModel
    base: Array
    wrenches: Array
    known: Flags
    splines: ChangeSplines
    prior: Array
    scale: Array
    body_sigma: Array
    total_mass_sigma: float


class _Estimate(NamedTuple):
    """Coefficients of the change (N,), ln mass factors and trunk offset (10,), and the resulting
    states (T, 3, 31), scaled residuals (T, 6) and cost.
    """

    change: Array
    body: Array
    states: Array
    residual: Array
    cost: float


def _prior(
    model: BodyModel,
    coordinates: Array,
    markers: Sequence[ModelMarker],
    splines: ChangeSplines,
    weight: float,
    settings: ReductionSettings,
) -> Array:
    """Band (N, 186) of the quadratic cost of the change of motion; N = 31 × splines."""
    above = moved_by()
    segment, place, marker_weight = _marker_arrays(markers)
    # A coordinate is observed if it moves any segment with a marker.
    seen = above[segment].any(axis=0) if len(markers) else np.ones(COORDINATE_COUNT, dtype=bool)
    sigma = np.where(seen, settings.observed_rad, settings.unobserved_rad)
    sigma[3:ROOT_DOFS] = settings.translation_m
    tight = 1.0 / sigma**2
    # A change of amplitude A at the frequency f has the second derivative (2πf)² A, so at
    # `highest_hz` it costs as much again as the change itself, and more above.
    slow = tight / (2.0 * np.pi * settings.highest_hz) ** 4
    joint_position = tree_arrays(model).joint_position
    band = np.zeros((splines.count * COORDINATE_COUNT, BLOCK))
    i = np.arange(COORDINATE_COUNT)
    for interval, frames in splines.intervals:
        here = coordinates[frames]
        metric = np.zeros((len(here), COORDINATE_COUNT, COORDINATE_COUNT))
        marker_metric(joint_position, segment, place, marker_weight, above, here, metric)
        metric /= settings.marker_m**2
        value, second = splines.values[frames, 0], splines.values[frames, 2]
        # (spline a, coordinate i) by (spline b, coordinate j), summed over the frames of the
        # interval.
        block = np.einsum("ta,tb,tij->aibj", value, value, metric)
        block[:, i, :, i] += np.multiply.outer(tight, value.T @ value)
        block[:, i, :, i] += np.multiply.outer(slow, second.T @ second)
        add_block(band, interval * COORDINATE_COUNT, weight * block.reshape(BLOCK, BLOCK))
    return band


def _with_body(model: BodyModel, body: Array) -> BodyModel:
    """The model with ln mass factors and trunk offset (10,)."""
    factors = np.exp(body[: len(MASS_GROUPS)])
    segments = []
    for s, segment in enumerate(model.segments):
        factor = float(factors[GROUP_OF_SEGMENT[s]])
        centre = np.asarray(segment.centre_of_mass, dtype=float)
        segments.append(
            replace(
                segment,
                mass=segment.mass * factor,
                inertia=np.asarray(segment.inertia) * factor,
                centre_of_mass=centre + body[len(MASS_GROUPS) :] if s == TORSO else centre,
            )
        )
    return replace(model, segments=tuple(segments))


def _marker_arrays(markers: Sequence[ModelMarker]) -> tuple[Index, Array, Array]:
    """Segment (M,), position (M, 3) m, and weight (M,) / mean weight, of each marker."""
    segment = np.array([SEGMENTS.index(marker.segment) for marker in markers], dtype=np.int64)
    place = np.array([marker.position for marker in markers], dtype=float).reshape(-1, 3)
    weight = np.array([marker.weight for marker in markers], dtype=float)
    return segment, place, weight / (weight.mean() if len(weight) else 1.0)


def _same_turn(vectors: Array, like: Array) -> Array:
    """Rotation vectors (T, 3), extended by whole turns where that brings them next to `like`, whose
    vectors may go beyond half a turn.
    """
    angle = np.maximum(np.linalg.norm(vectors, axis=1, keepdims=True), 1e-12)
    axis = vectors / angle
    along = (like * axis).sum(axis=1, keepdims=True)
    # A vector along the same axis with 2π more is the same rotation.
    turns = np.round((along - angle) / (2.0 * np.pi))
    return np.asarray(axis * (angle + 2.0 * np.pi * turns))


def _marker_displacement(
    model: BodyModel, markers: Sequence[ModelMarker], before: Array, after: Array
) -> Array:
    """Distance (T, M) m of every marker on the body between two motions (T, 31); (T, 1) zeros
    without markers.
    """
    if not markers:
        return np.zeros((len(before), 1))
    segment, place, _ = _marker_arrays(markers)
    difference = segment_frames(model, after) - segment_frames(model, before)
    places = np.append(place, np.ones((len(place), 1)), axis=1)
    moved = np.einsum("tmij,mj->tmi", difference[:, segment, :3], places)
    return np.asarray(np.linalg.norm(moved, axis=2))


def _problem(
    model: BodyModel,
    time: Array,
    positions: Array,
    wrenches: Array,
    markers: Sequence[ModelMarker],
    known: Flags,
    settings: ReductionSettings,
) -> _Problem:
    coordinates = cardan_coordinates(positions)
    recorded = make_interp_spline(time, coordinates, k=DEGREE)
    base = np.stack([coordinates, recorded(time, 1), recorded(time, 2)], axis=1)
    splines = ChangeSplines(time, settings.knot_s)
    # Frames share the weight of one stride, a sample a knot; see `REDUCTION.stride_s`.
    weight = REDUCTION.stride_s / settings.knot_s / len(time)
    # In the order of the root's generalised forces: moment, then force.
    deviations = np.repeat([settings.residual_moment_nm, settings.residual_force_n], 3)
    body_deviations = [settings.segment_mass, settings.trunk_offset_m]
    return _Problem(
        model=model,
        base=base,
        wrenches=np.ascontiguousarray(wrenches),
        known=known,
        splines=splines,
        prior=_prior(model, coordinates, markers, splines, weight, settings),
        scale=np.sqrt(weight) / deviations,
        body_sigma=np.repeat(body_deviations, [len(MASS_GROUPS), 3]),
        total_mass_sigma=settings.total_mass * model.mass,
    )


def _total_mass_error(problem: _Problem, body: Array) -> tuple[float, Array]:
    """Change of the total mass in standard deviations, and its derivatives (10,)."""
    factors = np.exp(body[: len(MASS_GROUPS)])
    mass = tree_arrays(problem.model).mass
    masses = np.bincount(GROUP_OF_SEGMENT, weights=mass) / problem.total_mass_sigma
    # ln factors are the unknowns, so the derivative of a mass is the mass itself.
    return float(masses @ (factors - 1.0)), np.append(masses * factors, np.zeros(3))


def _estimate(problem: _Problem, change: Array, body: Array) -> _Estimate:
    states = problem.base + problem.splines.evaluate(change.reshape(-1, COORDINATE_COUNT))
    found = np.empty((len(states), 6))
    tree = tree_arrays(_with_body(problem.model, body))
    residuals_of_frames(tree, states, problem.wrenches, found)
    found = np.where(problem.known[:, None], found * problem.scale, 0.0)
    cost = float((found**2).sum() + change @ times_band(problem.prior, change))
    cost += float(((body / problem.body_sigma) ** 2).sum())
    cost += _total_mass_error(problem, body)[0] ** 2
    return _Estimate(change, body, states, found, cost)


def _gauss_newton_step(problem: _Problem, at: _Estimate) -> tuple[Array, Array]:
    """Step of the change (N,) and of the body (10,), by elimination of the banded part."""
    tree = tree_arrays(_with_body(problem.model, at.body))
    error, error_slope = _total_mass_error(problem, at.body)
    band, slope = problem.prior.copy(), times_band(problem.prior, at.change)
    border = np.zeros((len(at.change), BODY_UNKNOWNS))
    corner = np.diag(problem.body_sigma**-2.0) + np.outer(error_slope, error_slope)
    body_slope = at.body / problem.body_sigma**2 + error * error_slope
    for interval, frames in problem.splines.intervals:
        states, known = at.states[frames], problem.known[frames]
        by_state = np.zeros((len(states), 6, 3, COORDINATE_COUNT))
        by_body = np.zeros((len(states), 6, BODY_UNKNOWNS))
        residual_derivatives(tree, states, problem.wrenches[frames], known, by_state, by_body)
        # Chain rule over n: value, rate and second rate of a coordinate, each linear in its
        # coefficients.
        rows = np.einsum("trni,tna->trai", by_state, problem.splines.values[frames])
        rows = (rows * problem.scale[:, None, None]).reshape(-1, BLOCK)
        body_rows = (by_body * problem.scale[:, None]).reshape(-1, BODY_UNKNOWNS)
        residual = at.residual[frames].ravel()
        block = slice(interval * COORDINATE_COUNT, interval * COORDINATE_COUNT + BLOCK)
        add_block(band, interval * COORDINATE_COUNT, rows.T @ rows)
        # Masses belong to all frames, so they are coupled with every interval: the border of the
        # band.
        border[block] += rows.T @ body_rows
        slope[block] += rows.T @ residual
        corner += body_rows.T @ body_rows
        body_slope += body_rows.T @ residual
    # SciPy's lower form has a row for each diagonal, `band` a column; damping is not needed,
    # because the prior makes the matrix positive definite.
    factor = cholesky_banded(band.T, lower=True, overwrite_ab=True, check_finite=False)
    solved = cho_solve_banded((factor, True), np.column_stack([slope, border]), check_finite=False)
    # [A B; Bᵀ C] [x; y] = [g; h] by the Schur complement: (C − BᵀA⁻¹B) y = h − BᵀA⁻¹g, and then x =
    # A⁻¹g − A⁻¹B y.
    body_step = cho_solve(
        cho_factor(corner - border.T @ solved[:, 1:]), body_slope - border.T @ solved[:, 0]
    )
    return -(solved[:, 0] - solved[:, 1:] @ body_step), -body_step


def _solve(problem: _Problem) -> tuple[_Estimate, int]:
    """The estimate with the least cost, and the number of steps taken."""
    best = _estimate(problem, np.zeros(len(problem.prior)), np.zeros(BODY_UNKNOWNS))
    for steps in range(REDUCTION.largest_steps):
        change_step, body_step = _gauss_newton_step(problem, best)
        # Far from the minimum a whole step may overshoot, so it is halved until the cost falls.
        length = 1.0
        while True:
            trial = _estimate(
                problem, best.change + length * change_step, best.body + length * body_step
            )
            if trial.cost <= best.cost:
                break
            length *= 0.5
            if length < REDUCTION.shortest_step:  # rounding: there is nothing left to gain
                return best, steps
        gain, best = best.cost - trial.cost, trial
        if gain < REDUCTION.smallest_gain * best.cost:
            return best, steps + 1
    return best, REDUCTION.largest_steps


def reduce_residuals(
    model: BodyModel,
    time: Array,
    positions: Array,
    force: Array,
    point: Array,
    free_moment: Array,
    markers: Sequence[ModelMarker] = (),
    *,
    known: Flags | None = None,
    settings: ReductionSettings | None = None,
) -> ConsistentMotion:
    """Change motion and masses as little as needed to lower the residuals.

    Parameters
    ----------
    model : the scaled body.
    time, positions, force, point, free_moment : as for `inverse_dynamics`, filtered.
    markers : on the body, those of the inverse kinematics, with their weights. Coordinates that
        move none of them are free to explain residuals; start them from a good guess (the
        trunk upright). Without any marker, all coordinates count as observed.
    known : (T,) frames in which the ground reaction of both feet is known; the others are left out
        of the dynamics and change only smoothly with their neighbours. All if not given.
    settings : how much each quantity may change; the defaults if not given.

    Raises
    ------
    RecordError : as `inverse_dynamics` and `residuals`.
    ValueError : `known` or another array has another shape.
    """
    settings = settings or ReductionSettings()
    time, positions = checked_motion(time, positions)
    force, point, free_moment = checked_wrenches(time, force, point, free_moment)
    known = np.ones(len(time), dtype=bool) if known is None else np.asarray(known, dtype=bool)
    if known.shape != time.shape:
        raise ValueError(f"known must have shape {time.shape}, but its shape is {known.shape}")
    recorded = inverse_dynamics(model, time, positions, force, point, free_moment)
    ground = ground_level(point)
    before = residuals(recorded, known, ground_height=ground)

    # With blocks of 186 × 186, more threads wait for each other longer than they compute.
    with threadpool_limits(1, user_api="blas"):
        problem = _problem(
            model, time, positions, np.stack([force, point, free_moment], axis=1), markers, known,
            settings,
        )  # fmt: skip
        solution, steps = _solve(problem)

    changed = solution.states[:, 0].copy()
    orientation = Rotation.from_matrix(pelvis_rotation(*changed[:, :3].T))
    changed[:, :3] = _same_turn(orientation.as_rotvec(), positions[:, :3])
    difference = changed - positions
    # Rotation vectors cannot be subtracted; this is the rotation between the two, in world axes.
    difference[:, :3] = (orientation * Rotation.from_rotvec(positions[:, :3]).inv()).as_rotvec()
    displacement = _marker_displacement(model, markers, positions, changed)
    changed_model = _with_body(model, solution.body)
    dynamics = inverse_dynamics(changed_model, time, changed, force, point, free_moment)
    factors = np.exp(solution.body[: len(MASS_GROUPS)])
    return ConsistentMotion(
        model=changed_model,
        time=time,
        positions=changed,
        dynamics=dynamics,
        before=before,
        after=residuals(dynamics, known, ground_height=ground),
        coordinate_change=dict(
            zip(COORDINATES, np.sqrt((difference**2).mean(axis=0)).tolist(), strict=True)
        ),
        marker_change_rms=float(np.sqrt((displacement**2).mean())),
        marker_change_max=float(displacement.max()),
        mass_factors=dict(zip(MASS_GROUPS, factors.tolist(), strict=True)),
        trunk_offset=solution.body[len(MASS_GROUPS) :],
        steps=steps,
    )
