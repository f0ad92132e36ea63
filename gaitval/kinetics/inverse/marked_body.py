"""A body with markers, and a trial of measured ones, as arrays for the solver."""

from collections.abc import Mapping, Sequence
from typing import NamedTuple

import numpy as np

from gaitval._internal.numba.compiled import njit
from gaitval.arrays import Array, Flags, Index
from gaitval.coordinates import COORDINATES
from gaitval.errors import ModelError, RecordError
from gaitval.model.body import SEGMENTS, BodyModel
from gaitval.model.markers import ModelMarker
from gaitval.model.tree import SEGMENT_COUNT, empty_frames, forward, tree_arrays
from gaitval.units import REACH, from_middle, looks_like


class MarkerTrial(NamedTuple):
    """A trial as arrays; unseen markers have weight 0 and any position.

    Attributes
    ----------
    joint_position : (14, 3) m, as in `tree.Tree`.
    segment : (M,) index into `SEGMENTS`.
    position : (M, 3) m, in the frames of the segments.
    weight : (T, M).
    measured : (T, M, 3) m, world axes.
    """

    joint_position: Array
    segment: Index
    position: Array
    weight: Array
    measured: Array


def marker_trial(model: BodyModel, markers: Sequence[ModelMarker], measured: Array) -> MarkerTrial:
    """The trial of `measured` (T, M, 3) m, project axes, NaN where not seen, of the M `markers` on
    the scaled `model` as arrays. Raises ModelError if markers are on unknown segments, share a
    name, or have unusable positions or weights; RecordError if `measured` has another shape or is
    not in metres.
    """
    measured = np.asarray(measured, dtype=float)
    problems = []
    names = [marker.name for marker in markers]
    for name in sorted({name for name in names if names.count(name) > 1}):
        problems.append(f"{name}: {names.count(name)} markers of this name")
    for marker in markers:
        if marker.segment not in SEGMENTS:
            problems.append(
                f"{marker.name}: on {marker.segment!r}, which is not a segment of the model"
            )
        position = np.asarray(marker.position, dtype=float)
        if position.shape != (3,) or not np.isfinite(position).all():
            problems.append(f"{marker.name}: position {marker.position} is not three numbers")
        elif np.abs(position).max() > 2.0:
            problems.append(f"{marker.name}: {position} is over 2 m from its joint (millimetres?)")
        if not (np.isfinite(marker.weight) and marker.weight >= 0):
            problems.append(f"{marker.name}: weight {marker.weight} is not 0 or more")
    if problems or not markers:
        raise ModelError(
            "the model's markers cannot be used:\n  "
            + "\n  ".join(problems or ["there are none"])
            + f"\nSegments are {', '.join(SEGMENTS)}; positions are in metres."
        )
    if measured.ndim != 3 or measured.shape[1:] != (len(markers), 3) or not len(measured):
        raise RecordError(
            f"measured markers must have shape (frames, {len(markers)}, 3) for the {len(markers)} "
            f"markers of the model, but their shape is {measured.shape}."
        )
    seen = np.asarray(np.isfinite(measured).all(axis=2))
    # A weight of 0 does not remove NaN from a sum, so unseen markers get a number.
    filled = np.where(seen[..., None], measured, 0.0)
    frame = int(seen.sum(axis=1).argmax())
    away = from_middle(filled[frame, seen[frame]]) if seen.any() else np.zeros(1)
    # Half of them, for a single one may be astray: that is no error of the unit.
    if np.median(away) > REACH.high:
        raise RecordError(
            f"in frame {frame} half of the markers are more than {np.median(away):.0f} m from the "
            f"middle of all, which no person is: their unit is wrong"
            f"{looks_like(2.0 * float(np.median(away)))}. Give metres."
        )
    weight = seen * np.array([marker.weight for marker in markers], dtype=float)
    return MarkerTrial(
        joint_position=tree_arrays(model).joint_position,
        segment=np.array([SEGMENTS.index(marker.segment) for marker in markers], dtype=np.int64),
        position=np.array([marker.position for marker in markers], dtype=float),
        weight=np.ascontiguousarray(weight),
        measured=np.ascontiguousarray(filled),
    )


def fixed_pose(fixed: Mapping[str, float]) -> tuple[Flags, Array]:
    """(31,) which coordinates are `fixed`, actuated ones by name, and a pose (31,) with their
    values, rad, zero for all others.
    """
    frozen, start = np.zeros(len(COORDINATES), dtype=np.bool_), np.zeros(len(COORDINATES))
    for name, value in fixed.items():
        frozen[COORDINATES.index(name)] = True
        start[COORDINATES.index(name)] = value
    return frozen, start


def bounds(ranges: Mapping[str, tuple[float, float]]) -> tuple[Array, Array]:
    """Lowest and highest value, (31,) each, of all coordinates by the `ranges`, rad, of actuated
    ones; infinite without a range.
    """
    low, high = np.full(len(COORDINATES), -np.inf), np.full(len(COORDINATES), np.inf)
    for name, ends in ranges.items():
        low[COORDINATES.index(name)], high[COORDINATES.index(name)] = ends
    return low, high


def marker_positions(model: BodyModel, markers: Sequence[ModelMarker], positions: Array) -> Array:
    """Positions (T, M, 3) m, world axes, of the `markers` of the scaled `model` in the poses
    `positions` (T, 31), root convention of `model.tree`. Raises ModelError as `marker_trial`.
    """
    poses = np.array(positions, dtype=float)
    points = np.zeros((len(poses), len(markers), 3))
    problem = marker_trial(model, markers, points)
    place(problem.joint_position, problem.segment, problem.position, poses, points)
    return points


@njit
def place(
    joint_position: Array, segment: Index, position: Array, poses: Array, points: Array
) -> None:
    """`points` (T, M, 3) m, out: places in world axes of the markers at `position` (M, 3) m in the
    frames of each `segment` (M,), by its index, in `poses` (T, 31); `joint_position` (14, 3) m is
    as in `tree.Tree` (compiled).
    """
    frames = empty_frames()
    rotation, origin = frames.rotation, frames.origin
    for t in range(len(poses)):
        forward(joint_position, poses[t], frames, SEGMENT_COUNT)
        for m in range(len(segment)):
            s = segment[m]
            for i in range(3):
                # o + R x, in scalars: numba would allocate an array for every product.
                points[t, m, i] = (
                    origin[s, i]
                    + rotation[s, i, 0] * position[m, 0]
                    + rotation[s, i, 1] * position[m, 1]
                    + rotation[s, i, 2] * position[m, 2]
                )
