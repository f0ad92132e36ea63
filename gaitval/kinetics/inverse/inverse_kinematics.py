"""Inverse kinematics: the poses of a body model that best fit measured markers.

Every frame is a weighted least-squares problem, min f(q) = ½ Σ w |m − p(q)|² over the markers that
were seen (Lu and O'Connor 1999, J Biomech 32:129-134), with the coordinates' ranges as bounds. It
is solved by Newton's method from the pose of the previous frame (`pose_solver`), with the exact
second derivative (`marker_derivatives`).

The pelvis rotates by increments R ← exp(δ)R, so no heading is special. In results its rotation
vector continues beyond 180° instead of jumping to the opposite one.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Final

import numpy as np

from gaitval._internal.text.display import Saved
from gaitval.arrays import Array, Flags, Index
from gaitval.coordinates import COORDINATES, LEG, ROOT
from gaitval.errors import RecordError
from gaitval.kinetics.inverse.marked_body import (
    MarkerTrial,
    bounds,
    fixed_pose,
    marker_trial,
    place,
)
from gaitval.kinetics.inverse.marker_derivatives import evaluate, independent_coordinates, workspace
from gaitval.kinetics.inverse.pose_solver import solve_frame, solve_from_all_sides, solve_trial
from gaitval.model.body import BodyModel
from gaitval.model.markers import ModelMarker
from gaitval.model.measured_ranges import MEASURED_RANGES
from gaitval.model.tree import ROOT_DOFS

if TYPE_CHECKING:
    import pandas as pd


@dataclass(frozen=True)
class KinematicsLimits:
    """What angles can be told from."""

    smallest_lever: float = 0.010
    """m: a coordinate is not determined if it moves the seen markers by less than this per radian
    beyond what the coordinates nearer to the pelvis can explain: 3 mm of noise would change it by
    17°."""
    generic_angle: float = 0.3
    """rad, of every coordinate in the pose in which `smallest_lever` is tested: straight legs and
    arms would hide some coordinates."""
    largest_turn: float = np.deg2rad(320.0)
    """Largest rotation of the pelvis from the laboratory's axes; a rotation vector ends at 360°."""


KINEMATICS: Final = KinematicsLimits()


@dataclass(frozen=True, repr=False)
class InverseKinematics(Saved):
    """Poses that fit measured markers; T frames, M markers.

    Attributes
    ----------
    names : of the M markers.
    positions : (T, 31) in the order of `coordinates.COORDINATES`, rad and m; the rotation vector
        of the pelvis is continuous and may be longer than π.
    marker_errors : (T, M) m, distance of measured and model marker; NaN where it was not seen.
    determined : (T, 31) False for a coordinate that was held, or that the markers seen in this
        frame do not show. It has the given or neutral value if no frame shows it; otherwise it is
        interpolated linearly from the last frame that does to the next.
    at_limit : (T, 31) True where a coordinate is at an end of its range.
    iterations : (T,) of Newton's method.
    converged : (T,) False if they were not enough, or the markers do not show the pelvis.
    source : the file of the trial; "" if that is not known.
    time : (T,) s; None if that is not known.
    """

    names: tuple[str, ...]
    positions: Array
    marker_errors: Array
    determined: Flags
    at_limit: Flags
    iterations: Index
    converged: Flags
    source: str = ""
    time: Array | None = None

    def title(self) -> str:
        """Which trial, its length, and the distance of measured and model markers."""
        what = f"Joint angles of {self.source or 'a trial'}"
        length = f"{len(self.positions)} frames"
        if self.time is not None:
            length = f"{self.time[-1] - self.time[0]:.2f} s"
        return f"{what}: {length}, markers {1000 * marker_errors(self).whole_rms:.1f} mm RMS"

    def to_frame(self) -> "pd.DataFrame":
        """The joint angles (deg) by time (s), of the coordinates that the markers show; by
        frame where the time is not known.
        """
        from gaitval._internal.text.frames import angle_curves, curve_frame
        from gaitval.coordinates import ACTUATED

        ever = np.asarray(self.determined.any(axis=0))
        shown = [name for name in ACTUATED if ever[COORDINATES.index(name)]]
        curves = angle_curves(self.positions, shown)
        if self.time is None:
            return curve_frame(curves, axis="frame", at=np.arange(float(len(self.positions))))
        return curve_frame(curves, axis="time", at=self.time)


@dataclass(frozen=True)
class MarkerErrors:
    """Distances between measured and model markers over the frames that show pelvis and legs, m.

    Attributes
    ----------
    rms : (M,) of each marker over the frames that show it; NaN for one that is never seen.
    largest : (M,) of each marker.
    whole_rms, whole_largest : over all markers and frames.
    worst_marker : name of that of `whole_largest`.
    """

    names: tuple[str, ...]
    rms: Array
    largest: Array
    whole_rms: float
    whole_largest: float
    worst_marker: str


def marker_errors(result: InverseKinematics) -> MarkerErrors:
    """Root-mean-square and largest error in `result`, of each marker and of all, in the frames that
    show pelvis and legs: of who walks into the cameras' view too little is seen at first to fit a
    body to.
    """
    errors = result.marker_errors
    lower = [i for i, name in enumerate(COORDINATES) if name in ROOT or name[:-2] in LEG]
    shown = np.all((result.determined | ~result.determined.any(axis=0))[:, lower], axis=1)
    seen = np.isfinite(errors) & (shown if shown.any() else ~shown)[:, None]
    filled = np.where(seen, errors, 0.0)
    count = seen.sum(axis=0)
    # A marker that is never seen has 0 / 0, which is NaN, as it should be.
    with np.errstate(invalid="ignore"):
        rms = np.sqrt((filled**2).sum(axis=0) / count)
    largest = np.where(count > 0, filled.max(axis=0), np.nan)
    frame, marker = np.unravel_index(int(filled.argmax()), filled.shape)
    return MarkerErrors(
        names=result.names,
        rms=rms,
        largest=largest,
        whole_rms=float(np.sqrt((filled**2).sum() / count.sum())),
        whole_largest=float(filled[frame, marker]),
        worst_marker=result.names[marker],
    )


def inverse_kinematics(
    model: BodyModel,
    markers: Sequence[ModelMarker],
    measured: Array,
    *,
    fixed: Mapping[str, float] | None = None,
    ranges: Mapping[str, tuple[float, float]] = MEASURED_RANGES,
) -> InverseKinematics:
    """Poses of the model that best fit measured markers, frame by frame.

    Parameters
    ----------
    model : the scaled model.
    markers : M markers on its segments, with their weights.
    measured : (T, M, 3) m, project axes, in the order of `markers`; NaN where not seen.
    fixed : value (rad) of actuated coordinates that are not fitted.
    ranges : lowest and highest value of actuated coordinates, rad; others are free.

    Raises
    ------
    ModelError : markers are on unknown segments, share a name, or have unusable positions or
        weights.
    RecordError : `measured` has another shape, is not in metres or shows the pelvis in no frame, or
        the pelvis rotates by more than `KINEMATICS.largest_turn`.
    """
    problem = marker_trial(model, markers, measured)
    fixed = fixed or {}
    frozen, start = fixed_pose(fixed)
    low, high = bounds({name: ranges[name] for name in ranges if name not in fixed})
    start = np.clip(start, low, high)
    determined = _determined(problem, frozen)
    solvable = np.asarray(determined[:, :ROOT_DOFS].all(axis=1))
    if not solvable.any():
        raise RecordError(_why_unsolvable(problem, markers))

    # Start where most coordinates are determined and, among such frames, most markers are seen.
    count = determined.sum(axis=1) * len(markers) + (problem.weight > 0).sum(axis=1)
    first = int(np.argmax(np.where(solvable, count, -1)))
    positions = np.tile(start, (len(determined), 1))
    iterations = np.zeros(len(positions), dtype=np.int64)
    converged = np.zeros(len(positions), dtype=np.bool_)
    free = determined & solvable[:, None]
    work = workspace()
    solve_from_all_sides(problem, first, start, positions[first], free[first], low, high, work)
    # From there to the end of the trial, then to its beginning.
    for way in (1, -1):
        solve_trial(
            problem, positions, start, free, low, high, first, way, iterations, converged, work
        )
    gaps = _interpolate(positions, free)
    for t in np.flatnonzero(gaps & free.any(axis=1)):
        # The rest of the body must fit what was filled in.
        count = solve_frame(problem, t, positions[t], free[t], low, high, work)
        iterations[t] += abs(count)
        converged[t] = count > 0

    positions[:, :3] = _continuous(positions[:, :3])
    edge = 1e-9
    at_limit = determined & ((positions <= low + edge) | (positions >= high - edge))
    points = np.empty_like(problem.measured)
    place(problem.joint_position, problem.segment, problem.position, positions, points)
    seen = np.isfinite(measured).all(axis=2)
    errors = np.where(seen, np.linalg.norm(problem.measured - points, axis=2), np.nan)
    return InverseKinematics(
        names=tuple(marker.name for marker in markers),
        positions=positions,
        marker_errors=errors,
        determined=free,
        at_limit=at_limit,
        iterations=iterations,
        converged=converged & solvable,
    )


def _determined(problem: MarkerTrial, frozen: Flags) -> Flags:
    """Which coordinates (T, 31) the markers of each frame determine."""
    seen = np.asarray(problem.weight > 0)
    # What is determined depends only on which markers are seen, and a trial has few different sets
    # of seen markers.
    patterns, pattern = np.unique(seen, axis=0, return_inverse=True)
    found = np.empty((len(patterns), len(COORDINATES)), dtype=np.bool_)
    work = workspace()
    pose = np.full(len(COORDINATES), KINEMATICS.generic_angle)
    pose[:ROOT_DOFS] = 0.0
    # JᵀJ does not depend on the measured positions, so those of any frame will do. Weights are 1: a
    # small weight does not make a marker less seen.
    problem = problem._replace(weight=patterns.astype(float))
    for t, row in enumerate(found):
        evaluate(problem, t, pose, work)
        independent_coordinates(work.normal, frozen, KINEMATICS.smallest_lever**2, row)
    return np.asarray(found[pattern.reshape(-1)])


def _why_unsolvable(problem: MarkerTrial, markers: Sequence[ModelMarker]) -> str:
    most = problem.weight.max(axis=0)
    names = [marker.name for marker, weight in zip(markers, most, strict=True) if weight > 0]
    return (
        "no frame shows enough markers to find the pelvis: three on the pelvis that are not in "
        f"one line are needed, or as many on both thighs. Of the model's {len(markers)} markers, "
        f"the trial shows with a weight above 0: {', '.join(names) or 'none'}."
    )


def _interpolate(positions: Array, free: Flags) -> Flags:
    """In frames that do not determine a coordinate, fill it from those that do, in place; returns
    (T,) in which something was filled.
    """
    touched = np.zeros(len(positions), dtype=np.bool_)
    frames = np.arange(len(positions))
    known = free[:, :ROOT_DOFS].all(axis=1)
    if known.any() and not known.all():
        # Linear interpolation over a jump between opposite vectors would spin the pelvis round.
        vectors = _continuous(positions[known, :3])
        for d in range(ROOT_DOFS):
            values = vectors[:, d] if d < 3 else positions[known, d]
            positions[~known, d] = np.interp(frames[~known], frames[known], values)
        touched |= ~known
    for d in range(ROOT_DOFS, positions.shape[1]):
        known = free[:, d]
        if known.any() and not known.all():
            positions[~known, d] = np.interp(frames[~known], frames[known], positions[known, d])
            touched |= ~known
    return touched


def _continuous(vectors: Array) -> Array:
    """Rotation vectors (T, 3) of the same rotations without jumps: v and v − 2πv/|v| are the same
    rotation, and each frame uses the one nearer to the previous frame.
    """
    vectors = vectors.copy()
    turn = 2 * np.pi
    # Between frames the pelvis turns by far less than 1 rad; a larger step is a vector that became
    # its opposite.
    jumps = np.flatnonzero(np.linalg.norm(np.diff(vectors, axis=0), axis=1) > 1.0)
    for t in range(jumps[0] + 1 if len(jumps) else len(vectors), len(vectors)):
        length = float(np.linalg.norm(vectors[t]))
        if length < 1e-6:
            continue
        axis = vectors[t] / length
        # Whole turns about this axis that bring the vector nearest to the last one.
        vectors[t] += turn * np.round((axis @ vectors[t - 1] - length) / turn) * axis
    lengths = np.linalg.norm(vectors, axis=1)
    # Shifted by a full turn as a whole the path is as continuous. Of the two, the one that stays
    # farther from 360°, where a rotation vector ends, is used.
    if lengths.max() > np.pi and lengths.min() > 1e-6:
        other = vectors * (1.0 - turn / lengths)[:, None]
        if np.linalg.norm(other, axis=1).max() < lengths.max():
            vectors = other
    largest = float(np.linalg.norm(vectors, axis=1).max())
    if largest > KINEMATICS.largest_turn:
        raise RecordError(
            f"the pelvis rotates {np.degrees(largest):.0f}° from the laboratory's axes (at most "
            f"{np.degrees(KINEMATICS.largest_turn):.0f}° is possible). Cut the trial where the "
            "person turns "
            "round."
        )
    return vectors
