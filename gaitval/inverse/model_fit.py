"""Joint fit of segment lengths, marker places and poses to a standing and a walking trial.

Joint centres from a standing trial alone carry the error of a regression (hip) or of a palpated
landmark (knee, ankle), and every marker is placed as wrongly on its segment. Walking shows where
the segments really turn: a length is right when one body with markers fixed to it fits all
frames. So this minimises, over the lengths λ, the places x of the markers on their segments and
the poses q of all frames f at once (bounded maximum a posteriori estimation),

    Σ_f Σ_m w (m − p(λ, x, q_f))² / σ² + Σ_m (x − x₀ − Cλ)² / s_m² + Σ_k (Pλ)² / s_k²

with Gaussian priors about the standing trial's placement x₀ and lengths (as AddBiomechanics does:
Werling et al. 2023, PLoS ONE 18:e0295152). Cλ says how the placement would have come out with
other lengths: a knee marker stays at the knee when the thigh grows. Without these priors a
constant angle could not be told from a turn of all markers of the segment.

A walking marker's variance σ² has two parts. Noise is new in every frame; it is estimated from the
residuals in turns with the fit. Soft tissue repeats with the gait cycle, and lengths and places
take up much of it, so the residuals do not show it: it is given, and all frames together count as
`INDEPENDENT_FRAMES` of it. Without it the hips of the recorded walks (WBDS01, Rajagopal) are
drawn 3 cm up, to where skin and not bone turns.

Only a frame's own pose and the shared λ and x meet in the normal matrix (block arrow), so the
poses are eliminated frame by frame (Schur complement), and Gauss-Newton with Marquardt's damping
takes some hundredths of a second per iteration.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Final, NamedTuple

import numpy as np
from scipy.spatial.transform import Rotation
from threadpoolctl import threadpool_limits  # type: ignore[import-untyped]

from gaitval.arrays import Array, Flags, Index
from gaitval.compiled import njit
from gaitval.coordinates import COORDINATES, RANGES
from gaitval.errors import ScalingError
from gaitval.inverse.inverse_kinematics import bounds, inverse_kinematics, moved, place
from gaitval.model.body import SEGMENTS, BodyModel
from gaitval.model.markers import ModelMarker
from gaitval.model.parameters import (
    PARAMETERS,
    apply_parameters,
    nominal_parameters,
    stretched_inertia,
)
from gaitval.model.tree import DOF_COUNT, FIRST_DOF, PARENT, forward, tree_arrays

LENGTH_SD: Final[dict[str, float]] = {
    "thigh": 0.006,
    "shank": 0.006,
    "hip_half_width": 0.008,
    "hip_forward": 0.008,
    "hip_up": 0.008,
    "lumbar_forward": 0.020,
    "lumbar_up": 0.020,
    "shoulder_half_width": 0.015,
    "shoulder_up": 0.015,
    "upper_arm": 0.015,
}
"""The lengths that are fitted, m, and the standard deviations of their priors. Both sides of the
body have the same.

| length | from | to |
|---|---|---|
| thigh, shank, upper_arm | joint | next joint |
| hip_half_width, shoulder_half_width | midline | joint |
| hip_forward, hip_up | where the standing trial put the hips in the pelvis | where they are |
| lumbar_forward, lumbar_up | middle of the hips | lumbar joint |
| shoulder_up | lumbar joint | level of the shoulders |

Hips: Harrington's regression leaves about 8-10 mm each way (Leardini et al. 1999, Harrington et
al. 2007); knee and ankle: middle of the palpated condyles and malleoli, with a marker's size of
error; lumbar joint, shoulder and upper arm: ANSUR II regressions on stature leave 14-21 mm.
The prior of the thigh is for the knee: a hip that is further up makes the thigh longer.
"""

ANATOMICAL_SD: Final = 0.005
"""m, of the place of a marker on a palpated landmark, each way."""

TRACKING_SD: Final = 0.020
"""m, of the place of any other marker: no anatomy says where it is, and a cluster may slip
between trials (in the Rajagopal walk that on the left thigh by 3-4 cm)."""

LARGEST_CHANGE: Final = 4.0
"""Standard deviations of its prior by which a length may change."""

FRAMES: Final = 60
"""Of the walking trial, equally spaced."""

SOFT_TISSUE_SD: Final = 0.010
"""m, of a marker of weight 1 on the skin about its mean place on the segment in walking, each
way: 5-30 mm on the thigh, under 15 mm on the shank (Leardini et al. 2005, Gait Posture 21:212)."""

INDEPENDENT_FRAMES: Final = 5.0
"""How many independent samples of the soft tissue's motion a walking trial holds; convention. It
repeats with every gait cycle and is smooth within it, so more frames do not average it out."""

STANDING_SD: Final = 0.010
"""m, of a marker in standing about that mean place, each way."""

SMALLEST_SD: Final = 1e-5
"""m: a residual of no size at all (made-up markers) is taken for this."""

_MOST_ITERATIONS = 100
_NOISE_UPDATES = 12
_STEP_TOLERANCE = 1e-6  # m and rad
_SHAPE = tuple(LENGTH_SD)


@dataclass(frozen=True)
class FittedLength:
    """One length before and after the fit, m.

    Attributes
    ----------
    name : a key of `LENGTH_SD`.
    prior, prior_sd : value in the model before, and its standard deviation by the prior alone
        (for the thigh, that of the hip and the knee together).
    fitted, standard_error : value after, and its standard deviation given all measurements;
        equal to `prior_sd` if no marker shows this length.
    at_bound : True if it would have changed by more than `LARGEST_CHANGE` deviations.
    """

    name: str
    prior: float
    prior_sd: float
    fitted: float
    standard_error: float
    at_bound: bool


@dataclass(frozen=True)
class ModelFit:
    """A body and its markers that fit both trials.

    Attributes
    ----------
    model : with the fitted lengths, see `with_lengths`.
    markers : on the fitted places.
    lengths : of `LENGTH_SD`, in its order.
    marker_shift : (M,) m, by how much each marker moved from where the standing trial had put
        it (given the fitted lengths).
    rms_before, rms_after, largest_before, largest_after : m, distance of measured and model
        markers over the frames used (standing and walking).
    standing_change : (31,) rad or m, pose in standing after the fit less that before.
    measurement_sd : m, each way, of a walking marker of mean weight, as the residuals show it.
    frames : (F,) indices of the walking frames used.
    iterations, converged : of Gauss-Newton, over all estimates of σ.
    """

    model: BodyModel
    markers: tuple[ModelMarker, ...]
    lengths: tuple[FittedLength, ...]
    marker_shift: Array
    rms_before: float
    rms_after: float
    largest_before: float
    largest_after: float
    standing_change: Array
    measurement_sd: float
    frames: Index
    iterations: int
    converged: bool

    def __getitem__(self, name: str) -> FittedLength:
        return next(length for length in self.lengths if length.name == name)


def lengths_of(model: BodyModel) -> dict[str, float]:
    """The lengths of `LENGTH_SD` in a model, m; how far the hips were moved is 0."""
    position = {segment.name: segment.joint_position for segment in model.segments}
    return {
        "thigh": float(-position["shank_r"][2]),
        "shank": float(-position["foot_r"][2]),
        "hip_half_width": float(-position["thigh_r"][1]),
        "hip_forward": 0.0,
        "hip_up": 0.0,
        "lumbar_forward": float(position["torso"][0]),
        "lumbar_up": float(position["torso"][2]),
        "shoulder_half_width": float(-position["upper_arm_r"][1]),
        "shoulder_up": float(position["upper_arm_r"][2]),
        "upper_arm": float(-position["forearm_r"][2]),
    }


def with_lengths(model: BodyModel, lengths: Mapping[str, float]) -> BodyModel:
    """The model with other lengths (m, keys as in `LENGTH_SD`; those not given stay).

    A longer thigh, shank or upper arm keeps its mass, and its centre of mass and inertia stretch
    with it (as in `model.parameters`). `hip_forward` and `hip_up` move the hips in the pelvis:
    since the pelvis's origin is between the hips, its centre of mass moves the other way.

    Raises
    ------
    ScalingError : no such length, or one that leaves no body.
    """
    before = lengths_of(model)
    unknown = [name for name in lengths if name not in before]
    if unknown:
        raise ScalingError(f"no such lengths: {', '.join(unknown)}. They are {', '.join(before)}.")
    after = before | dict(lengths)
    bad = [
        f"{name} {after[name]:.3f} m"
        for name in ("thigh", "shank", "hip_half_width", "shoulder_half_width", "upper_arm")
        if not after[name] > 0
    ]
    if bad or not all(np.isfinite(value) for value in after.values()):
        raise ScalingError(f"lengths must be finite and above zero, but: {', '.join(bad)}.")
    mu = nominal_parameters()
    mu[PARAMETERS.index("thigh_length")] = after["thigh"] / before["thigh"]
    mu[PARAMETERS.index("shank_length")] = after["shank"] / before["shank"]
    mu[PARAMETERS.index("hip_y")] = before["hip_half_width"] - after["hip_half_width"]
    legs = apply_parameters(model, mu)
    change = np.array([after[name] - before[name] for name in _SHAPE])
    moved = _joint_shifts() @ change
    hips = np.array([after["hip_forward"], 0.0, after["hip_up"]])
    arm = after["upper_arm"] / before["upper_arm"]
    segments = []
    for segment, shift in zip(legs.segments, moved, strict=True):
        if segment.name == "pelvis":
            segment = replace(segment, centre_of_mass=segment.centre_of_mass - hips)
        elif segment.name.startswith("upper_arm"):
            segment = replace(
                segment,
                centre_of_mass=segment.centre_of_mass * np.array([1.0, 1.0, arm]),
                inertia=stretched_inertia(segment.inertia, 2, arm),
            )
        if segment.name.startswith(("torso", "upper_arm", "forearm")):
            segment = replace(segment, joint_position=segment.joint_position + shift)
        segments.append(segment)
    return replace(legs, segments=tuple(segments))


def fit_model(
    model: BodyModel,
    markers: Sequence[ModelMarker],
    standing: Array,
    walking: Array,
    *,
    placement_sd: Mapping[str, float] | None = None,
    length_sd: Mapping[str, float] | None = None,
    held: Mapping[str, float] | None = None,
    ranges: Mapping[str, tuple[float, float]] = RANGES,
    soft_tissue_sd: float = SOFT_TISSUE_SD,
) -> ModelFit:
    """Fit lengths, marker places and poses to a standing and a walking trial.

    Parameters
    ----------
    model : scaled from the standing trial.
    markers : M markers where the standing trial puts them on the segments of `model`.
    standing : (S, M, 3) m, project axes, NaN where not seen; its median is used.
    walking : (T, M, 3) m, the same; the markers filtered as for inverse kinematics.
    placement_sd : m, standard deviation of the place of a marker, each way, by its name;
        `TRACKING_SD` for others.
    length_sd : m, of the prior of a length, in place of that in `LENGTH_SD`; 0 keeps it.
    held, ranges : as in `inverse_kinematics.inverse_kinematics`.
    soft_tissue_sd : m, see `SOFT_TISSUE_SD`; 0 for markers that do not move on their segments.

    Raises
    ------
    ScalingError : unknown names, deviations that are not positive, or too few frames.
    ModelError, RecordError : as `inverse_kinematics.inverse_kinematics` raises them.
    """
    standing, walking = np.asarray(standing, dtype=float), np.asarray(walking, dtype=float)
    length_deviation = _length_deviations(length_sd or {})
    placement_deviation = _placement_deviations(markers, placement_sd or {})
    stood = inverse_kinematics(model, markers, _median(standing), held=held, ranges=ranges)
    walked = inverse_kinematics(model, markers, walking, held=held, ranges=ranges)
    chosen = _choose(walking)

    measured = np.concatenate([_median(standing), walking[chosen]])
    seen = np.isfinite(measured).all(axis=2)
    # Weights span 50 to 1 by convention, far more than the variances of skin markers do.
    weights = np.sqrt([marker.weight for marker in markers])
    tree = tree_arrays(model)
    low, high = bounds({name: ranges[name] for name in ranges if name not in (held or {})})
    fit = _Fit(
        joint_position=tree.joint_position,
        shifts=_joint_shifts(),
        segment=np.array([SEGMENTS.index(marker.segment) for marker in markers], dtype=np.int64),
        placement=np.array([marker.position for marker in markers], dtype=float),
        coupling=_coupling(model, markers),
        placement_precision=placement_deviation**-2,
        length_precision=_length_precision(length_deviation),
        length_limit=LARGEST_CHANGE * length_deviation,
        measured=np.where(seen[..., None], measured, 0.0),
        weight=seen * (weights / weights.mean()),
        free=np.concatenate([stood.determined, walked.determined[chosen]]),
        low=low,
        high=high,
    )
    state = _State(
        lengths=np.zeros(len(_SHAPE)),
        places=fit.placement.copy(),
        poses=np.concatenate([stood.positions, walked.positions[chosen]]),
    )
    # More threads wait for each other longer than they compute on blocks of 31 × 150.
    with threadpool_limits(1, user_api="blas"):
        sigma = _measurement_sd(fit, state)
        iterations = 0
        fitted = state
        for _ in range(_NOISE_UPDATES):
            fitted, count, converged = _solve(fit, fitted, _precision(fit, sigma, soft_tissue_sd))
            iterations += count
            last, sigma = sigma, _measurement_sd(fit, fitted)
            if abs(sigma - last) < 0.01 * last:
                break
        else:
            converged = False
        return _result(
            model,
            markers,
            fit,
            state,
            fitted,
            _precision(fit, sigma, soft_tissue_sd),
            sigma,
            chosen,
            iterations,
            converged,
        )


class _Fit(NamedTuple):
    """The problem as arrays; K lengths, M markers, F frames of which the first is standing."""

    joint_position: Array  # (14, 3) m, before
    shifts: Array  # (14, 3, K) of joints per length
    segment: Index  # (M,)
    placement: Array  # (M, 3) m, x₀
    coupling: Array  # (M, 3, K), C
    placement_precision: Array  # (M,) 1/m²
    length_precision: Array  # (K, K) 1/m²
    length_limit: Array  # (K,) m
    measured: Array  # (F, M, 3) m
    weight: Array  # (F, M), 0 where not seen
    free: Flags  # (F, 31)
    low: Array  # (31,)
    high: Array  # (31,)


class _State(NamedTuple):
    """The unknowns: changes of the lengths (K,), places of the markers (M, 3), poses (F, 31)."""

    lengths: Array
    places: Array
    poses: Array


def _length_deviations(given: Mapping[str, float]) -> Array:
    unknown = [name for name in given if name not in LENGTH_SD]
    if unknown:
        raise ScalingError(
            f"no such lengths: {', '.join(unknown)}. They are {', '.join(LENGTH_SD)}."
        )
    values = LENGTH_SD | dict(given)
    bad = [f"{name} {value}" for name, value in values.items() if not 0 <= value < 1]
    if bad:
        raise ScalingError(
            f"standard deviations of lengths must be 0 m or more, but: {', '.join(bad)}."
        )
    return np.array([values[name] for name in _SHAPE], dtype=float)


def _placement_deviations(markers: Sequence[ModelMarker], given: Mapping[str, float]) -> Array:
    names = [marker.name for marker in markers]
    bad = [f"{name}: no such marker" for name in given if name not in names]
    bad += [f"{name}: {value} m" for name, value in given.items() if not 0 < value < 1]
    if bad:
        raise ScalingError(
            "standard deviations of the markers' places must be above 0 m and of markers of the "
            "model, but:\n  " + "\n  ".join(bad)
        )
    return np.array([given.get(name, TRACKING_SD) for name in names], dtype=float)


def _median(standing: Array) -> Array:
    """Median (1, M, 3) of the frames (S, M, 3) that show a marker; NaN for one never seen."""
    seen = np.asarray(np.isfinite(standing).all(axis=2))
    median = np.full((1, *standing.shape[1:]), np.nan)
    for marker in np.flatnonzero(seen.any(axis=0)):
        median[0, marker] = np.median(standing[seen[:, marker], marker], axis=0)
    return median


def _choose(walking: Array) -> Index:
    """Indices of equally spaced ones of the frames that show most markers."""
    seen = np.isfinite(walking).all(axis=2).sum(axis=1)
    good = np.flatnonzero(seen >= 0.9 * seen.max())
    if len(good) < 2:
        raise ScalingError(
            f"the walking trial has {len(good)} frames that show the markers: a fit of the body "
            "needs a trial in which the joints move."
        )
    return np.unique(good[np.linspace(0, len(good) - 1, min(FRAMES, len(good))).astype(np.int64)])


def _joint_shifts() -> Array:
    """How the joints (14, 3) move in their parents' frames per metre of each length (K)."""
    shifts = np.zeros((len(SEGMENTS), 3, len(_SHAPE)))

    def put(segment: str, axis: int, length: str, factor: float) -> None:
        shifts[SEGMENTS.index(segment), axis, _SHAPE.index(length)] = factor

    for side, outwards in (("r", -1.0), ("l", 1.0)):
        put(f"shank_{side}", 2, "thigh", -1.0)
        put(f"foot_{side}", 2, "shank", -1.0)
        put(f"forearm_{side}", 2, "upper_arm", -1.0)
        put(f"thigh_{side}", 1, "hip_half_width", outwards)
        put(f"upper_arm_{side}", 1, "shoulder_half_width", outwards)
        put(f"upper_arm_{side}", 2, "shoulder_up", 1.0)
    put("torso", 0, "lumbar_forward", 1.0)
    put("torso", 2, "lumbar_up", 1.0)
    # The pelvis's origin goes with the hips.
    put("torso", 0, "hip_forward", -1.0)
    put("torso", 2, "hip_up", -1.0)
    return shifts


def _coupling(model: BodyModel, markers: Sequence[ModelMarker]) -> Array:
    """How the standing trial's places of the markers (M, 3) in their segments would differ per
    metre of each length (K): the skin stays where it is, and a segment's frame runs from its
    upper joint to its lower one.
    """
    lengths = lengths_of(model)
    coupling = np.zeros((len(markers), 3, len(_SHAPE)))

    for row, marker in zip(coupling, markers, strict=True):

        def put(axis: int, length: str, factor: float, row: Array = row) -> None:
            row[axis, _SHAPE.index(length)] = factor

        kind, side = marker.segment.split("_")[0], marker.segment[-1]
        if kind == "pelvis":
            put(0, "hip_forward", -1.0)
            put(2, "hip_up", -1.0)
        elif kind == "thigh":
            # At the hip the skin stays; at the knee it goes with the knee.
            down = -float(marker.position[2]) / lengths["thigh"]
            put(2, "thigh", -down)
            put(2, "hip_up", -(1.0 - down))
            put(0, "hip_forward", -(1.0 - down))
            put(1, "hip_half_width", (1.0 - down) * (1.0 if side == "r" else -1.0))
        elif kind == "shank":
            put(2, "shank", float(marker.position[2]) / lengths["shank"])
        elif kind == "torso":
            put(0, "lumbar_forward", -1.0)
            put(2, "lumbar_up", -1.0)
        elif kind == "upper":
            put(2, "upper_arm", float(marker.position[2]) / lengths["upper_arm"])
    return coupling


def _length_precision(deviation: Array) -> Array:
    """PᵀDP (K, K), the inverse covariance of the lengths' prior."""
    deviation = np.where(deviation > 0, deviation, list(LENGTH_SD.values()))
    relation = np.eye(len(_SHAPE))
    relation[_SHAPE.index("thigh"), _SHAPE.index("hip_up")] = -1.0
    return np.asarray(relation.T @ (relation / deviation[:, None] ** 2))


def _precision(fit: _Fit, sigma: float, soft_tissue_sd: float) -> Array:
    """Inverse variance (F, M) of a coordinate of each measured marker: with noise that is new
    in every frame, and soft tissue that counts as `INDEPENDENT_FRAMES`.
    """
    repeated = max(1.0, (len(fit.weight) - 1) / INDEPENDENT_FRAMES)
    precision = fit.weight / (sigma**2 + repeated * soft_tissue_sd**2)
    standing = STANDING_SD if soft_tissue_sd > 0 else sigma
    precision[0] = fit.weight[0] / standing**2
    return np.asarray(precision)


def _model_markers(fit: _Fit, state: _State) -> Array:
    """Model markers (F, M, 3) m, world."""
    points = np.empty_like(fit.measured)
    joints = fit.joint_position + fit.shifts @ state.lengths
    place(joints, fit.segment, state.places, state.poses, points)
    return points


def _measurement_sd(fit: _Fit, state: _State) -> float:
    """Standard deviation of a coordinate of a walking marker of weight 1, m."""
    errors = (fit.measured - _model_markers(fit, state))[1:]
    weight = fit.weight[1:]
    unknowns = fit.free[1:].sum() + 3 * len(fit.placement)
    freedom = 3 * np.count_nonzero(weight) - unknowns
    if freedom <= 0:
        raise ScalingError(
            f"the walking trial has {3 * np.count_nonzero(weight)} marker coordinates in the "
            f"{len(weight)} frames used, too few for the {unknowns} unknown angles and places: "
            "use a trial with more frames or more markers."
        )
    variance = float((weight[..., None] * errors**2).sum()) / float(freedom)
    return max(float(np.sqrt(variance)), SMALLEST_SD)


def _cost(fit: _Fit, state: _State, precision: Array) -> float:
    errors = fit.measured - _model_markers(fit, state)
    misplaced = state.places - fit.placement - fit.coupling @ state.lengths
    return 0.5 * float(
        (precision[..., None] * errors**2).sum()
        + (fit.placement_precision[:, None] * misplaced**2).sum()
        + state.lengths @ fit.length_precision @ state.lengths
    )


class _Normal(NamedTuple):
    """Gauss-Newton's normal equations in blocks: poses (q) and shared unknowns (s: lengths,
    then places marker by marker).
    """

    pose: Array  # (F, 31, 31)
    mixed: Array  # (F, 31, K + 3M)
    shared: Array  # (K + 3M, K + 3M)
    pose_gradient: Array  # (F, 31)
    shared_gradient: Array  # (K + 3M,)


def _normal_equations(fit: _Fit, state: _State, precision: Array) -> _Normal:
    frames, count = precision.shape
    lengths = len(_SHAPE)
    points = _model_markers(fit, state)
    turns = np.empty((*points.shape, 3))
    poses = np.zeros((*points.shape, len(COORDINATES)))
    stretches = np.zeros((*points.shape, lengths))
    joints = fit.joint_position + fit.shifts @ state.lengths
    _derivatives(joints, fit.shifts, fit.segment, state.poses, points, turns, poses, stretches)
    errors = fit.measured - points
    misplaced = state.places - fit.placement - fit.coupling @ state.lengths

    rows = (frames, 3 * count, -1)
    stretches_weighted = precision[..., None, None] * stretches
    poses_weighted = precision[..., None, None] * poses
    by_pose = poses_weighted.reshape(rows).transpose(0, 2, 1)  # (F, 31, 3M)
    by_place = poses_weighted.transpose(0, 1, 3, 2) @ turns  # (F, M, 31, 3)
    by_place = by_place.transpose(0, 2, 1, 3).reshape(frames, len(COORDINATES), -1)
    mixed = np.concatenate([by_pose @ stretches.reshape(rows), by_place], axis=2)

    prior = fit.placement_precision
    coupled = prior[:, None, None] * fit.coupling  # (M, 3, K)
    weighted_errors = precision[..., None] * errors
    shared = np.zeros((lengths + 3 * count, lengths + 3 * count))
    shared[:lengths, :lengths] = (
        _product(stretches, stretches_weighted)
        + _product(fit.coupling, coupled)
        + fit.length_precision
    )
    crossed = (stretches_weighted.transpose(0, 1, 3, 2) @ turns).sum(axis=0)  # (M, K, 3)
    crossed -= coupled.transpose(0, 2, 1)
    shared[:lengths, lengths:] = crossed.transpose(1, 0, 2).reshape(lengths, -1)
    shared[lengths:, :lengths] = shared[:lengths, lengths:].T
    # A marker's place turns into the world by a rotation R, and RᵀR is one.
    shared[lengths:, lengths:] = np.diag(np.repeat(precision.sum(axis=0) + prior, 3))
    to_places = (turns.transpose(0, 1, 3, 2) @ weighted_errors[..., None])[..., 0].sum(axis=0)
    gradient = np.concatenate(
        [
            fit.length_precision @ state.lengths
            - _product(stretches, weighted_errors[..., None])[:, 0]
            - _product(coupled, misplaced[..., None])[:, 0],
            (prior[:, None] * misplaced - to_places).reshape(-1),
        ]
    )
    return _Normal(
        pose=by_pose @ poses.reshape(rows),
        mixed=mixed,
        shared=shared,
        pose_gradient=-(by_pose @ errors.reshape(rows))[..., 0],
        shared_gradient=gradient,
    )


def _product(a: Array, b: Array) -> Array:
    """aᵀb of arrays (…, p) and (…, q), as matrices of p and q columns."""
    return np.asarray(a.reshape(-1, a.shape[-1]).T @ b.reshape(-1, b.shape[-1]))


def _without_fixed(fit: _Fit, state: _State, normal: _Normal) -> _Normal:
    """The equations with a step of zero for what is not free, or at a bound that it would pass."""
    gradient = normal.pose_gradient
    fixed = ~fit.free
    fixed |= (state.poses <= fit.low) & (gradient > 0)
    fixed |= (state.poses >= fit.high) & (gradient < 0)
    kept = (~fixed).astype(float)
    pose = normal.pose * kept[:, :, None] * kept[:, None, :]
    pose += (1.0 - kept)[:, :, None] * np.eye(kept.shape[1])

    lengths = len(_SHAPE)
    shared_gradient = normal.shared_gradient
    still = np.zeros(len(shared_gradient), dtype=np.bool_)
    still[:lengths] = fit.length_limit == 0
    still[:lengths] |= (state.lengths <= -fit.length_limit) & (shared_gradient[:lengths] > 0)
    still[:lengths] |= (state.lengths >= fit.length_limit) & (shared_gradient[:lengths] < 0)
    going = (~still).astype(float)
    return _Normal(
        pose=pose,
        mixed=normal.mixed * kept[:, :, None] * going,
        shared=normal.shared * going[:, None] * going + np.diag(1.0 - going),
        pose_gradient=gradient * kept,
        shared_gradient=shared_gradient * going,
    )


def _reduced(normal: _Normal, damping: float) -> tuple[Array, Array]:
    """The poses eliminated: the Schur complement (K + 3M, K + 3M), and what takes the shared
    step to the poses' (F, 31, K + 3M + 1).
    """
    diagonal = np.arange(normal.pose.shape[1])
    pose = normal.pose.copy()
    pose[:, diagonal, diagonal] *= 1.0 + damping
    inverse = np.linalg.solve(
        pose, np.concatenate([normal.mixed, normal.pose_gradient[..., None]], axis=2)
    )
    shared = normal.shared + damping * np.diag(np.diag(normal.shared))
    shared -= _product(normal.mixed, inverse[..., :-1])
    return shared, inverse


def _solve(fit: _Fit, state: _State, precision: Array) -> tuple[_State, int, bool]:
    """Gauss-Newton with Marquardt's damping from `state`; with the number of iterations and
    whether these sufficed.
    """
    damping = 0.0
    cost = _cost(fit, state, precision)
    for iteration in range(1, _MOST_ITERATIONS + 1):
        normal = _without_fixed(fit, state, _normal_equations(fit, state, precision))
        while True:
            shared, inverse = _reduced(normal, damping)
            right = _product(normal.mixed, inverse[..., -1:])[:, 0] - normal.shared_gradient
            step = np.asarray(np.linalg.solve(shared, right), dtype=float)
            poses = -inverse[..., -1] - inverse[..., :-1] @ step
            longest = max(float(np.abs(step).max()), float(np.abs(poses).max()))
            trial = _moved(fit, state, step, poses)
            trial_cost = _cost(fit, trial, precision)
            if trial_cost <= cost * (1.0 + 1e-12):
                break
            if longest < _STEP_TOLERANCE or damping > 1e9:
                return state, iteration, longest < _STEP_TOLERANCE
            damping = max(1e-4, 10.0 * damping)
        state, cost = trial, trial_cost
        if longest < _STEP_TOLERANCE:
            return state, iteration, True
        damping = 0.0 if damping < 1e-6 else 0.1 * damping
    return state, _MOST_ITERATIONS, False


def _moved(fit: _Fit, state: _State, step: Array, pose_steps: Array) -> _State:
    """The state after a step, within the bounds."""
    lengths = len(_SHAPE)
    poses = np.empty_like(state.poses)
    for pose, pose_step, out in zip(state.poses, pose_steps, poses, strict=True):
        moved(pose, pose_step, fit.low, fit.high, out)
    return _State(
        lengths=np.clip(state.lengths + step[:lengths], -fit.length_limit, fit.length_limit),
        places=state.places + step[lengths:].reshape(-1, 3),
        poses=poses,
    )


def _result(
    model: BodyModel,
    markers: Sequence[ModelMarker],
    fit: _Fit,
    before: _State,
    after: _State,
    precision: Array,
    sigma: float,
    chosen: Index,
    iterations: int,
    converged: bool,
) -> ModelFit:
    normal = _without_fixed(fit, after, _normal_equations(fit, after, precision))
    covariance = np.linalg.inv(_reduced(normal, 0.0)[0])
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
        for k, name in enumerate(_SHAPE)
    )
    errors = []
    for state in (before, after):
        distance = np.linalg.norm(fit.measured - _model_markers(fit, state), axis=2)
        errors.append(distance[fit.weight > 0])
    turn = (
        Rotation.from_rotvec(after.poses[0, :3]) * Rotation.from_rotvec(before.poses[0, :3]).inv()
    )
    change = after.poses[0] - before.poses[0]
    change[:3] = turn.as_rotvec()
    return ModelFit(
        model=with_lengths(model, {length.name: length.fitted for length in lengths}),
        markers=tuple(
            replace(marker, position=place)
            for marker, place in zip(markers, after.places, strict=True)
        ),
        lengths=lengths,
        marker_shift=np.linalg.norm(
            after.places - fit.placement - fit.coupling @ after.lengths, axis=1
        ),
        rms_before=float(np.sqrt((errors[0] ** 2).mean())),
        rms_after=float(np.sqrt((errors[1] ** 2).mean())),
        largest_before=float(errors[0].max()),
        largest_after=float(errors[1].max()),
        standing_change=change,
        measurement_sd=sigma,
        frames=chosen,
        iterations=iterations,
        converged=converged,
    )


@njit
def _derivatives(
    joint_position: Array,
    shifts: Array,
    segment: Index,
    poses: Array,
    points: Array,
    place_derivative: Array,
    pose_derivative: Array,
    length_derivative: Array,
) -> None:
    """Of the model markers (F, M, 3): by their places (F, M, 3, 3), by the coordinates (F, M, 3,
    31), the pelvis's turn as a rotation vector in world axes, and by the lengths (F, M, 3, K);
    the last two are zero at first.
    """
    rotation = np.empty((len(PARENT), 3, 3))
    origin = np.empty((len(PARENT), 3))
    axes = np.zeros((poses.shape[1], 3))
    for i in range(3):
        axes[i, i] = 1.0
    for f in range(len(poses)):
        forward(joint_position, poses[f], rotation, origin, axes, len(PARENT))
        for m in range(len(segment)):
            s = segment[m]
            place_derivative[f, m] = rotation[s]
            point = points[f, m]
            while s >= 0:
                x = point[0] - origin[s, 0]
                y = point[1] - origin[s, 1]
                z = point[2] - origin[s, 2]
                first = FIRST_DOF[s]
                for d in range(first, first + (DOF_COUNT[s] if s > 0 else 3)):
                    pose_derivative[f, m, 0, d] = axes[d, 1] * z - axes[d, 2] * y
                    pose_derivative[f, m, 1, d] = axes[d, 2] * x - axes[d, 0] * z
                    pose_derivative[f, m, 2, d] = axes[d, 0] * y - axes[d, 1] * x
                if s > 0:
                    parent = rotation[PARENT[s]]
                    for k in range(shifts.shape[2]):
                        for i in range(3):
                            for j in range(3):
                                length_derivative[f, m, i, k] += parent[i, j] * shifts[s, j, k]
                s = PARENT[s]
            for i in range(3):
                pose_derivative[f, m, i, 3 + i] = 1.0
