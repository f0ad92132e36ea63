"""Keep the feet from sliding where the markers show that they stand still.

Markers on skin and shoe wander by some millimetres against the bone, so the feet of a motion from
inverse kinematics slide on the floor while they bear weight. Where all markers of a foot go with
the floor (or the belt) the sole is anchored: points of it are wanted over the place where they
were on average, as further markers of a second run of inverse kinematics, and the whole body
gives way a little.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Final

import numpy as np

from gaitval.arrays import Array, Flags, runs
from gaitval.coordinates import RANGES
from gaitval.errors import RecordError
from gaitval.gait.filters import low_pass
from gaitval.inverse.inverse_kinematics import InverseKinematics, inverse_kinematics
from gaitval.inverse.marked_body import marker_positions
from gaitval.model.body import BodyModel
from gaitval.model.markers import ModelMarker

RESTING_SPEED: Final = 0.10
"""m/s relative to the floor, below which a marker rests: 3 mm of noise leave about 0.02 m/s after
the filter, a rolling heel or a toe that pushes off move at 0.3 m/s and more."""

SHORTEST_REST: Final = 0.10
"""s; a foot that rests for less is not anchored."""

CUTOFF_HZ: Final = 6.0
"""Low-pass of the markers before their speed is taken, as usual for walking (Winter 2009)."""

ANCHOR_WEIGHT: Final = 10.0
"""Of a point of the sole, in mean weights of the markers."""

FADE: Final = 0.06
"""s, over which a sole is drawn from where it was to its place, at either end of a rest, so that
the motion does not jump."""


@dataclass(frozen=True)
class AnchoredFeet:
    """Poses whose resting feet do not slide; T frames.

    Attributes
    ----------
    kinematics : the poses; `marker_errors` are of the real markers alone.
    resting : (T, 2) where the right and the left foot rest on the floor.
    floor_velocity : (3,) m/s, of the floor or belt.
    sliding_before, sliding_after : m, root mean square distance, along the floor, of points of
        the resting soles from their mean place in that rest; NaN if no foot ever rests.
    largest_before, largest_after : m, largest such distance.
    marker_rms_before, marker_rms_after : m, over all markers and frames.
    """

    kinematics: InverseKinematics
    resting: Flags
    floor_velocity: Array
    sliding_before: float
    sliding_after: float
    largest_before: float
    largest_after: float
    marker_rms_before: float
    marker_rms_after: float


def anchored(
    model: BodyModel,
    markers: Sequence[ModelMarker],
    measured: Array,
    kinematics: InverseKinematics,
    *,
    rate: float,
    floor_velocity: Array | None = None,
    held: Mapping[str, float] | None = None,
    ranges: Mapping[str, tuple[float, float]] = RANGES,
) -> AnchoredFeet:
    """Inverse kinematics again, with the feet anchored where they rest.

    Parameters
    ----------
    model, markers, measured, held, ranges : as for `inverse_kinematics`, whose result is
        `kinematics`.
    rate : Hz, of the frames.
    floor_velocity : (3,) m/s of the floor in the axes of the markers: zero overground, that of
        the belt on a treadmill; found from the resting feet if not given.

    Raises
    ------
    RecordError : `floor_velocity` is not three numbers.
    """
    measured = np.asarray(measured, dtype=float)
    velocities = _foot_velocities(markers, measured, rate)
    if floor_velocity is None:
        floor = _floor_velocity(velocities)
    else:
        floor = np.asarray(floor_velocity, dtype=float)
        if floor.shape != (3,) or not np.isfinite(floor).all():
            raise RecordError(
                f"the velocity of the floor must be three numbers in m/s, but it is {floor}."
            )
    resting = _resting(velocities, floor, rate)

    soles = [_sole(model, side) for side in "rl"]
    travel = np.outer(np.arange(len(measured)) / rate, floor)[:, None]
    mean_weight = float(np.mean([marker.weight for marker in markers]))
    targets = []
    for points, rest in zip(soles, resting.T, strict=True):
        places = marker_positions(model, points, kinematics.positions) - travel
        target = np.full_like(places, np.nan)
        for begin, end in zip(*runs(rest), strict=True):
            away = places[begin:end] - places[begin:end].mean(axis=0)
            away[..., 2] = 0.0  # it may roll, but not slide
            target[begin:end] = places[begin:end] - _fade(end - begin, rate) * away
        targets.append(target + travel)
    anchors = [
        replace(point, weight=ANCHOR_WEIGHT * mean_weight) for points in soles for point in points
    ]
    count = len(markers)
    solved = inverse_kinematics(
        model,
        [*markers, *anchors],
        np.concatenate([measured, *targets], axis=1),
        held=held,
        ranges=ranges,
    )
    solved = replace(
        solved, names=solved.names[:count], marker_errors=solved.marker_errors[:, :count]
    )
    before, largest_before = _sliding(model, soles, kinematics.positions, resting, travel)
    after, largest_after = _sliding(model, soles, solved.positions, resting, travel)
    return AnchoredFeet(
        kinematics=solved,
        resting=resting,
        floor_velocity=floor,
        sliding_before=before,
        sliding_after=after,
        largest_before=largest_before,
        largest_after=largest_after,
        marker_rms_before=float(np.sqrt(np.nanmean(kinematics.marker_errors**2))),
        marker_rms_after=float(np.sqrt(np.nanmean(solved.marker_errors**2))),
    )


def _foot_velocities(
    markers: Sequence[ModelMarker], measured: Array, rate: float
) -> tuple[Array, Array]:
    """Velocities (T, m, 3) m/s of the markers on the right and on the left foot, but those that
    the trial never shows.
    """
    velocities = []
    seen = np.asarray(np.isfinite(measured).all(axis=2).any(axis=0))
    for segment in ("foot_r", "foot_l"):
        columns = [i for i, marker in enumerate(markers) if marker.segment == segment and seen[i]]
        smooth = low_pass(measured[:, columns], rate=rate, cutoff_hz=CUTOFF_HZ)
        velocities.append(np.gradient(smooth, 1.0 / rate, axis=0))
    return velocities[0], velocities[1]


def _floor_velocity(velocities: tuple[Array, Array]) -> Array:
    """Median velocity (3,), level, of the feet while they move without turning or rising; zero
    for feet that then hardly move: no belt.
    """
    level = []
    for velocity in velocities:
        if velocity.shape[1] < 2:
            continue
        mean = velocity.mean(axis=1)
        turning = np.linalg.norm(velocity - mean[:, None], axis=2).max(axis=1)
        flat = (turning < RESTING_SPEED) & (np.abs(mean[:, 2]) < RESTING_SPEED)
        level.append(mean[flat])
    gathered = np.concatenate(level) if level else np.zeros((0, 3))
    if not len(gathered):
        return np.zeros(3)
    floor = np.median(gathered, axis=0)
    floor[2] = 0.0
    return floor if np.linalg.norm(floor) > RESTING_SPEED else np.zeros(3)


def _resting(velocities: tuple[Array, Array], floor: Array, rate: float) -> Flags:
    """Where (T, 2) all markers of a foot, two or more, go with the floor for long enough."""
    resting = np.zeros((len(velocities[0]), 2), dtype=np.bool_)
    for foot, velocity in enumerate(velocities):
        if velocity.shape[1] < 2:
            continue
        speed = np.linalg.norm(velocity - floor, axis=2)
        slow = np.asarray((speed < RESTING_SPEED).all(axis=1))  # False where one was not seen
        for begin, end in zip(*runs(slow), strict=True):
            resting[begin:end, foot] = end - begin >= SHORTEST_REST * rate
    return resting


def _fade(count: int, rate: float) -> Array:
    """Factors (count, 1, 1) that grow from and fall to zero at the ends as a raised cosine."""
    edge = np.minimum(np.arange(count), np.arange(count)[::-1]) + 1.0
    grown = 0.5 - 0.5 * np.cos(np.pi * np.minimum(edge / (FADE * rate), 1.0))
    return np.asarray(grown[:, None, None])


def _sole(model: BodyModel, side: str) -> list[ModelMarker]:
    """Points of the sole of one foot without the toes: where its contact spheres touch."""
    return [
        ModelMarker(
            f"sole of {sphere.name}",
            sphere.segment,
            sphere.position - np.array([0.0, 0.0, sphere.radius]),
        )
        for sphere in model.spheres
        if sphere.segment == f"foot_{side}"
    ]


def _sliding(
    model: BodyModel,
    soles: Sequence[Sequence[ModelMarker]],
    positions: Array,
    resting: Flags,
    travel: Array,
) -> tuple[float, float]:
    """Root mean square and largest distance, m, along the floor, of the points of resting soles
    from their mean place in each rest.
    """
    distances = [np.zeros(0)]
    for points, rest in zip(soles, resting.T, strict=True):
        places = (marker_positions(model, points, positions) - travel)[..., :2]
        for begin, end in zip(*runs(rest), strict=True):
            away = places[begin:end] - places[begin:end].mean(axis=0)
            distances.append(np.linalg.norm(away, axis=2).ravel())
    gathered = np.concatenate(distances)
    if not len(gathered):
        return np.nan, np.nan
    return float(np.sqrt(np.mean(gathered**2))), float(gathered.max())
