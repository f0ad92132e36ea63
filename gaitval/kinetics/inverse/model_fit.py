"""Joint fit of segment lengths, marker positions and poses to a standing and a walking trial.

Joint centres from a standing trial alone have the error of a regression (hip) or of a palpated
landmark (knee, ankle), and every marker's position on its segment has the same error. Walking shows
where the segments really rotate: a length is right when one body with fixed markers fits all
frames. So this minimises, simultaneously over the lengths λ, the positions x of the markers on
their segments and the poses q of all frames f (bounded maximum a posteriori estimation),

    Σ_f Σ_m w (m − p(λ, x, q_f))² / σ² + Σ_m (x − x₀ − Cλ)² / s_m² + Σ_k (Pλ)² / s_k²

with Gaussian priors about the standing trial's placement x₀ and lengths (as AddBiomechanics does:
Werling et al. 2023, PLoS ONE 18:e0295152). Cλ is how the placement would differ with other
lengths: a knee marker stays at the knee when the thigh grows. Without these priors a constant angle
could not be distinguished from a rotation of all markers of the segment.

A walking marker's variance σ² has two parts. Noise is independent in every frame; it is estimated
from the residuals, alternating with the fit. Soft tissue motion repeats with the gait cycle, and
lengths and positions absorb much of it, so the residuals do not show it: its size is given, and all
frames together count as `MODEL_FIT.independent_frames` samples of it. Without it the hips of the
recorded walks (WBDS01, Rajagopal) are pulled 3 cm upwards, to where the skin rotates instead of the
bone.

`segment_lengths` contains the lengths and what moves with them, `model_fit_solver` the solver.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Final

import numpy as np
from scipy.spatial.transform import Rotation
from threadpoolctl import threadpool_limits  # type: ignore[import-untyped]

from gaitval.arrays import Array, Flags, Index
from gaitval.coordinates import COORDINATES
from gaitval.errors import ScalingError
from gaitval.kinetics.inverse.inverse_kinematics import inverse_kinematics
from gaitval.kinetics.inverse.marked_body import bounds
from gaitval.kinetics.inverse.model_fit_solver import (
    FitProblem,
    FitState,
    model_markers,
    shared_covariance,
    solve,
)
from gaitval.kinetics.inverse.segment_lengths import (
    LENGTH_SD,
    LENGTHS,
    joint_shifts,
    length_precision,
    lengths_of,
    skin_shifts,
    with_lengths,
)
from gaitval.model.body import SEGMENTS, BodyModel
from gaitval.model.markers import ModelMarker
from gaitval.model.measured_ranges import MEASURED_RANGES
from gaitval.model.tree import tree_arrays


@dataclass(frozen=True)
class ModelFitSettings:
    """Standard deviations and sizes of the fit of a model to markers."""

    anatomical_sd: float = 0.005
    """m, standard deviation of the position of a marker on a palpated landmark, each way."""
    tracking_sd: float = 0.020
    """m, standard deviation of the position of any other marker: anatomy does not fix its place,
    and a cluster may slip between trials (the one on the left thigh in the Rajagopal walk by 3-4
    cm)."""
    largest_change: float = 4.0
    """Largest change of a length, in standard deviations of its prior."""
    frames: int = 60
    """Number of frames of the walking trial, equally spaced."""
    soft_tissue_sd: float = 0.010
    """m, of a marker of weight 1 on the skin about its mean place on the segment in walking, each
    way: 5-30 mm on the thigh, under 15 mm on the shank (Leardini et al. 2005, Gait Posture
    21:212)."""
    independent_frames: float = 5.0
    """Number of independent samples of soft tissue motion in a walking trial; convention. The
    motion repeats with every gait cycle and is smooth within it, so more frames do not average it
    out."""
    standing_sd: float = 0.010
    """m, of a marker in standing about that mean place, each way."""
    smallest_sd: float = 1e-5
    """m: smallest residual assumed (made-up markers have none)."""
    noise_updates: int = 12


MODEL_FIT: Final = ModelFitSettings()


@dataclass(frozen=True)
class FittedLength:
    """One length before and after the fit, m.

    Attributes
    ----------
    name : a key of `LENGTH_SD`.
    prior, prior_sd : value in the model before the fit, and its standard deviation from the prior
        only (for the thigh, that of hip and knee together).
    fitted, standard_error : value after the fit, and its standard deviation given all measurements;
        equal to `prior_sd` if no marker shows this length.
    at_bound : True if it would have changed by more than `MODEL_FIT.largest_change` deviations.
    """

    name: str
    prior: float
    prior_sd: float
    fitted: float
    standard_error: float
    at_bound: bool


@dataclass(frozen=True)
class ModelFit:
    """A body and its markers, fitted to both trials.

    Attributes
    ----------
    model : with the fitted lengths, see `with_lengths`.
    markers : in the fitted positions.
    lengths : of `LENGTH_SD`, in its order.
    rms_before, rms_after, largest_before, largest_after : m, distance of measured and model
        markers over the frames used (standing and walking).
    measurement_sd : m, each way, of a walking marker of mean weight, from the residuals.
    converged : whether Gauss-Newton and the estimates of σ did.
    """

    model: BodyModel
    markers: tuple[ModelMarker, ...]
    lengths: tuple[FittedLength, ...]
    rms_before: float
    rms_after: float
    largest_before: float
    largest_after: float
    measurement_sd: float
    converged: bool

    def __getitem__(self, name: str) -> FittedLength:
        return next(length for length in self.lengths if length.name == name)


def fit_model(
    model: BodyModel,
    markers: Sequence[ModelMarker],
    standing: Array,
    walking: Array,
    *,
    placement_sd: Mapping[str, float] | None = None,
    length_sd: Mapping[str, float] | None = None,
    ranges: Mapping[str, tuple[float, float]] = MEASURED_RANGES,
    soft_tissue_sd: float = MODEL_FIT.soft_tissue_sd,
) -> ModelFit:
    """Fit lengths, marker positions and poses to a standing and a walking trial.

    Parameters
    ----------
    model : scaled from the standing trial.
    markers : M markers in the positions from the standing trial on the segments of `model`.
    standing : (S, M, 3) m, project axes, NaN where not seen; its median is used.
    walking : (T, M, 3) m, the same; the markers filtered as for inverse kinematics.
    placement_sd : m, standard deviation of a marker's position, each way, by its name;
        `MODEL_FIT.tracking_sd` for others.
    length_sd : m, standard deviation of the prior of a length, instead of that in `LENGTH_SD`; 0
        fixes the length.
    ranges : as in `inverse_kinematics.inverse_kinematics`.
    soft_tissue_sd : m, see `MODEL_FIT.soft_tissue_sd`; 0 for markers that do not move on their
        segments.

    Raises
    ------
    ScalingError : there are too few frames.
    ModelError, RecordError : as `inverse_kinematics.inverse_kinematics` raises them.
    """
    standing, walking = np.asarray(standing, dtype=float), np.asarray(walking, dtype=float)
    known, placed = LENGTH_SD | dict(length_sd or {}), placement_sd or {}
    deviations = (
        np.array([known[name] for name in LENGTHS], dtype=float),
        np.array(
            [placed.get(marker.name, MODEL_FIT.tracking_sd) for marker in markers], dtype=float
        ),
    )
    # The start of the fit, and which coordinates the markers of each frame show.
    stood = inverse_kinematics(model, markers, _median(standing), ranges=ranges)
    walked = inverse_kinematics(model, markers, walking, ranges=ranges)
    chosen = _choose(walking)

    measured = np.concatenate([_median(standing), walking[chosen]])
    free = np.concatenate([stood.determined, walked.determined[chosen]])
    fit = _problem(model, markers, measured, free, deviations, bounds(ranges))
    state = FitState(
        lengths=np.zeros(len(LENGTHS)),
        places=fit.placement.copy(),
        poses=np.concatenate([stood.positions, walked.positions[chosen]]),
    )
    # With blocks of 31 × 150, more threads wait for each other longer than they compute.
    with threadpool_limits(1, user_api="blas"):
        sigma = _measurement_sd(fit, state)
        fitted = state
        # σ weighs the fit and is estimated from its residuals, so the two alternate.
        for _ in range(MODEL_FIT.noise_updates):
            fitted, _, converged = solve(fit, fitted, _precision(fit, sigma, soft_tissue_sd))
            last, sigma = sigma, _measurement_sd(fit, fitted)
            if abs(sigma - last) < 0.01 * last:
                break
        else:
            converged = False
        precision = _precision(fit, sigma, soft_tissue_sd)
        level = with_level_pelvis(fit, fitted)
        return _result(model, markers, fit, state, level, precision, sigma, converged)


def _problem(
    model: BodyModel,
    markers: Sequence[ModelMarker],
    measured: Array,
    free: Flags,
    deviations: tuple[Array, Array],
    limits: tuple[Array, Array],
) -> FitProblem:
    """The fit as arrays: `measured` (F, M, 3) m, standing first; `free` (F, 31) what the markers
    determine; `deviations` (K,) and (M,) m of the priors of lengths and positions; `limits` (31,)
    each, lowest and highest value of the coordinates.
    """
    length_deviation, placement_deviation = deviations
    low, high = limits
    seen = np.asarray(np.isfinite(measured).all(axis=2))
    # By convention weights range over 50 to 1, far more than the variances of skin markers.
    weights = np.sqrt([marker.weight for marker in markers])
    return FitProblem(
        joint_position=tree_arrays(model).joint_position,
        shifts=joint_shifts(),
        segment=np.array([SEGMENTS.index(marker.segment) for marker in markers], dtype=np.int64),
        placement=np.array([marker.position for marker in markers], dtype=float),
        coupling=skin_shifts(model, markers),
        placement_precision=placement_deviation**-2,
        length_precision=length_precision(length_deviation),
        length_limit=MODEL_FIT.largest_change * length_deviation,
        measured=np.where(seen[..., None], measured, 0.0),
        weight=seen * (weights / weights.mean()),
        free=free,
        low=low,
        high=high,
    )


def _median(standing: Array) -> Array:
    """Median (1, M, 3) of the frames (S, M, 3) that show a marker; NaN for one never seen."""
    seen = np.asarray(np.isfinite(standing).all(axis=2))
    median = np.full((1, *standing.shape[1:]), np.nan)
    for marker in np.flatnonzero(seen.any(axis=0)):
        median[0, marker] = np.median(standing[seen[:, marker], marker], axis=0)
    return median


def _choose(walking: Array) -> Index:
    """Indices of equally spaced frames among those that show the most markers."""
    seen = np.isfinite(walking).all(axis=2).sum(axis=1)
    good = np.flatnonzero(seen >= 0.9 * seen.max())
    if len(good) < 2:
        raise ScalingError(
            f"only {len(good)} frames of the walking trial show the markers, but a fit of the "
            "body needs a trial in which the joints move. Give a longer trial."
        )
    return np.unique(
        good[np.linspace(0, len(good) - 1, min(MODEL_FIT.frames, len(good))).astype(np.int64)]
    )


def with_level_pelvis(fit: FitProblem, state: FitState) -> FitState:
    """The body of `state` in the same poses, with the pelvis' axes where its landmarks put them;
    `state` itself if the pelvis has fewer than two markers.

    Turning the pelvis' axes about the line through the hips moves nothing but the zero of pelvic
    tilt, hip flexion and lumbar extension. The fit uses that freedom to please the trunk: in four
    of twelve children (biomechZoo) it turned the axes by 4 to 12 degrees. So they are turned back
    until the markers of the pelvis have, about their middle, the tilt that the standing trial gave
    them (the placement of `fit`); markers and lumbar joint keep their places in the laboratory.
    """
    pelvis = fit.segment == SEGMENTS.index("pelvis")
    if pelvis.sum() < 2:
        return state
    share = fit.placement_precision[pelvis] / fit.placement_precision[pelvis].sum()
    wanted = fit.placement[pelvis] + fit.coupling[pelvis] @ state.lengths
    # In the sagittal plane (x, z), about the mean weighted by the precision of the placement.
    here, there = (
        (places - share @ places)[:, [0, 2]] for places in (state.places[pelvis], wanted)
    )
    # The best rotation in a plane: sum of the cross products over sum of the dot products.
    angle = np.arctan2(
        share @ (here[:, 1] * there[:, 0] - here[:, 0] * there[:, 1]),
        share @ (here * there).sum(axis=1),
    )
    turn = Rotation.from_rotvec([0.0, angle, 0.0])
    places = state.places.copy()
    places[pelvis] = turn.apply(places[pelvis])
    lengths, poses = state.lengths.copy(), state.poses.copy()
    # R x = (R T⁻¹)(T x): the pelvis turns against its markers, which stay in the laboratory.
    poses[:, :3] = (Rotation.from_rotvec(poses[:, :3]) * turn.inv()).as_rotvec()
    turned = ["hip_flexion_r", "hip_flexion_l"]
    torso = SEGMENTS.index("torso")
    if (fit.segment == torso).any():  # else nobody knows where the lumbar joint is
        # The lumbar joint stays there as well, so its place in the turned axes changes.
        joint = fit.joint_position[torso] + fit.shifts[torso] @ lengths
        for axis, name in ((0, "lumbar_forward"), (2, "lumbar_up")):
            lengths[LENGTHS.index(name)] += turn.apply(joint)[axis] - joint[axis]
        turned.append("lumbar_extension")
    for name in turned:
        poses[:, COORDINATES.index(name)] -= angle
    return FitState(lengths=lengths, places=places, poses=poses)


def _precision(fit: FitProblem, sigma: float, soft_tissue_sd: float) -> Array:
    """Inverse variance (F, M) of a coordinate of each measured marker: noise is independent in
    every frame, and soft tissue counts as `MODEL_FIT.independent_frames` samples.
    """
    # With F frames, each has F / `MODEL_FIT.independent_frames` times the variance, so that
    # together they weigh as much as that many samples.
    repeated = max(1.0, (len(fit.weight) - 1) / MODEL_FIT.independent_frames)
    precision = fit.weight / (sigma**2 + repeated * soft_tissue_sd**2)
    # Markers that do not move on their segments in walking do not do so in standing either.
    standing = MODEL_FIT.standing_sd if soft_tissue_sd > 0 else sigma
    precision[0] = fit.weight[0] / standing**2
    return np.asarray(precision)


def _measurement_sd(fit: FitProblem, state: FitState) -> float:
    """Standard deviation of a coordinate of a walking marker of weight 1, m."""
    errors = (fit.measured - model_markers(fit, state))[1:]
    weight = fit.weight[1:]
    unknowns = fit.free[1:].sum() + 3 * len(fit.placement)
    # Unknowns absorb part of the noise: dividing by the number of measurements would make σ too
    # small.
    freedom = 3 * np.count_nonzero(weight) - unknowns
    if freedom <= 0:
        raise ScalingError(
            f"the walking trial has {3 * np.count_nonzero(weight)} marker coordinates in the "
            f"{len(weight)} frames used, too few for the {unknowns} unknown angles and positions. "
            "Use a trial with more frames or more markers."
        )
    variance = float((weight[..., None] * errors**2).sum()) / float(freedom)
    return max(float(np.sqrt(variance)), MODEL_FIT.smallest_sd)


def _result(
    model: BodyModel,
    markers: Sequence[ModelMarker],
    fit: FitProblem,
    before: FitState,
    after: FitState,
    precision: Array,
    sigma: float,
    converged: bool,
) -> ModelFit:
    covariance = shared_covariance(fit, after, precision)
    # A fixed length has no deviation; `length_precision` only gives it one to be invertible.
    prior_sd = np.sqrt(np.diag(np.linalg.inv(fit.length_precision))) * (fit.length_limit > 0)
    prior = lengths_of(model)
    at_bound = np.abs(after.lengths) >= fit.length_limit
    lengths = tuple(
        FittedLength(
            name=name,
            prior=prior[name],
            prior_sd=float(prior_sd[k]),
            fitted=prior[name] + float(after.lengths[k]),
            standard_error=0.0 if at_bound[k] else float(np.sqrt(covariance[k, k])),
            at_bound=bool(at_bound[k] and prior_sd[k] > 0),
        )
        for k, name in enumerate(LENGTHS)
    )
    errors = []
    for state in (before, after):
        distance = np.linalg.norm(fit.measured - model_markers(fit, state), axis=2)
        errors.append(distance[fit.weight > 0])
    return ModelFit(
        model=with_lengths(model, {length.name: length.fitted for length in lengths}),
        markers=tuple(
            replace(marker, position=place)
            for marker, place in zip(markers, after.places, strict=True)
        ),
        lengths=lengths,
        rms_before=float(np.sqrt((errors[0] ** 2).mean())),
        rms_after=float(np.sqrt((errors[1] ** 2).mean())),
        largest_before=float(errors[0].max()),
        largest_after=float(errors[1].max()),
        measurement_sd=sigma,
        converged=converged,
    )
