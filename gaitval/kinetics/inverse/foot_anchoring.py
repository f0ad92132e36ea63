"""Keep the feet from sliding while the markers show that they rest on the floor.

Markers on skin and shoe move by some millimetres relative to the bone, so in a motion from inverse
kinematics the feet slide on the floor while they bear weight. While all markers of a foot move with
the floor (or the belt) the sole is anchored: points on it get their mean position as the target, as
extra markers in a second run of inverse kinematics, and the whole body adjusts slightly.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Final

import numpy as np

from gaitval.arrays import Array, Flags, runs
from gaitval.coordinates import COORDINATES
from gaitval.gait.filters import low_pass
from gaitval.kinetics.inverse.inverse_kinematics import InverseKinematics, inverse_kinematics
from gaitval.kinetics.inverse.marked_body import marker_positions
from gaitval.model.body import BodyModel
from gaitval.model.markers import ModelMarker
from gaitval.model.measured_ranges import MEASURED_RANGES


@dataclass(frozen=True)
class AnchoringSettings:
    """When a foot rests, and how firmly it is held."""

    resting_speed: float = 0.10
    """m/s relative to the floor, below which a marker is at rest: 3 mm of noise leave about 0.02
    m/s after the filter, while a rolling heel or a toe in push-off moves at 0.3 m/s or more."""
    shortest_rest: float = 0.10
    """s; a foot that rests for less is not anchored."""
    cutoff_hz: float = 6.0
    """Low-pass of the markers before their speed is computed, as usual for walking (Winter
    2009)."""
    anchor_weight: float = 10.0
    """Weight of a point on the sole, relative to the mean weight of the markers."""
    fade: float = 0.06
    """s, over which a sole moves gradually to its anchored position at either end of a rest, so
    that the motion does not jump."""


ANCHORING: Final = AnchoringSettings()


_SUBTALAR: Final = ("subtalar_angle_r", "subtalar_angle_l")


@dataclass(frozen=True)
class AnchoredFeet:
    """Poses in which resting feet do not slide; T frames.

    Attributes
    ----------
    kinematics : the poses; `marker_errors` are those of the real markers only.
    resting : (T, 2) where the right and the left foot rest on the floor.
    floor_velocity : (3,) m/s, of the floor or belt.
    sliding_before, sliding_after : m, root mean square distance, along the floor, of points on
        resting soles from their mean position in that rest; NaN if no foot ever rests.
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
    ranges: Mapping[str, tuple[float, float]] = MEASURED_RANGES,
) -> AnchoredFeet:
    """Repeat inverse kinematics, which gave `kinematics` at `rate` Hz, with the feet anchored while
    they rest; `model`, `markers`, `measured` and `ranges` are as for `inverse_kinematics`.
    """
    measured = np.asarray(measured, dtype=float)
    velocities = _foot_velocities(markers, measured, rate)
    floor = _floor_velocity(velocities)
    resting = _resting(velocities, floor, rate)

    soles = [_sole(model, side) for side in "rl"]
    # How far the floor has moved. Relative to it a resting foot stands still on a belt, too.
    travel = np.outer(np.arange(len(measured)) / rate, floor)[:, None]
    mean_weight = float(np.mean([marker.weight for marker in markers]))
    targets = []
    for points, rest in zip(soles, resting.T, strict=True):
        places = marker_positions(model, points, kinematics.positions) - travel
        target = np.full_like(places, np.nan)
        for begin, end in zip(*runs(rest), strict=True):
            away = places[begin:end] - places[begin:end].mean(axis=0)
            away[..., 2] = 0.0  # it may roll, but not slide
            # At the mean place of the rest where the fade is 1, unchanged where it is 0.
            target[begin:end] = places[begin:end] - _fade(end - begin, rate) * away
        targets.append(target + travel)
    anchors = [
        replace(point, weight=ANCHORING.anchor_weight * mean_weight)
        for points in soles
        for point in points
    ]
    # What no marker shows of a foot, its anchors would show in its rests only, and move it there.
    blind = [n for n in _SUBTALAR if not kinematics.determined[:, COORDINATES.index(n)].any()]
    unseen = {n: float(kinematics.positions[0, COORDINATES.index(n)]) for n in blind}
    count = len(markers)
    solved = inverse_kinematics(
        model,
        [*markers, *anchors],
        np.concatenate([measured, *targets], axis=1),
        fixed=unseen,
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
    """Velocities (T, m, 3) m/s of the markers on the right and on the left foot, without those that
    are never seen.
    """
    velocities = []
    seen = np.asarray(np.isfinite(measured).all(axis=2).any(axis=0))
    for segment in ("foot_r", "foot_l"):
        columns = [i for i, marker in enumerate(markers) if marker.segment == segment and seen[i]]
        smooth = low_pass(measured[:, columns], rate=rate, cutoff_hz=ANCHORING.cutoff_hz)
        velocities.append(np.gradient(smooth, 1.0 / rate, axis=0))
    return velocities[0], velocities[1]


def _floor_velocity(velocities: tuple[Array, Array]) -> Array:
    """Median horizontal velocity (3,) of the feet while they move without rotating or rising; zero
    if they then hardly move, that is, without a belt.
    """
    level = []
    for velocity in velocities:
        if velocity.shape[1] < 2:
            continue
        mean = velocity.mean(axis=1)
        # Velocity of the markers relative to their mean: zero where the foot only translates.
        turning = np.linalg.norm(velocity - mean[:, None], axis=2).max(axis=1)
        flat = (turning < ANCHORING.resting_speed) & (np.abs(mean[:, 2]) < ANCHORING.resting_speed)
        level.append(mean[flat])
    gathered = np.concatenate(level) if level else np.zeros((0, 3))
    if not len(gathered):
        return np.zeros(3)
    floor = np.median(gathered, axis=0)
    floor[2] = 0.0
    return floor if np.linalg.norm(floor) > ANCHORING.resting_speed else np.zeros(3)


def _resting(velocities: tuple[Array, Array], floor: Array, rate: float) -> Flags:
    """(T, 2) whether all markers of a foot, at least two, move with the floor for long enough."""
    resting = np.zeros((len(velocities[0]), 2), dtype=np.bool_)
    for foot, velocity in enumerate(velocities):
        if velocity.shape[1] < 2:
            continue
        speed = np.linalg.norm(velocity - floor, axis=2)
        slow = np.asarray(
            (speed < ANCHORING.resting_speed).all(axis=1)
        )  # False where one was not seen
        for begin, end in zip(*runs(slow), strict=True):
            resting[begin:end, foot] = end - begin >= ANCHORING.shortest_rest * rate
    return resting


def _fade(count: int, rate: float) -> Array:
    """Factors (count, 1, 1) that rise from and fall to zero at the ends as a raised cosine."""
    # Frames from the nearer end, counted from 1.
    edge = np.minimum(np.arange(count), np.arange(count)[::-1]) + 1.0
    grown = 0.5 - 0.5 * np.cos(np.pi * np.minimum(edge / (ANCHORING.fade * rate), 1.0))
    return np.asarray(grown[:, None, None])


def _sole(model: BodyModel, side: str) -> list[ModelMarker]:
    """Points on the sole of one foot without the toes: the lowest points of its contact spheres."""
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
    """Root mean square and largest distance, m, along the floor, of points on resting soles from
    their mean position in each rest.
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
