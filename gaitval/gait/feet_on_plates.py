"""Where the feet are on the force plates, according to the markers.

Axes: the project's (REP-103, z up).
"""

from collections.abc import Mapping
from dataclasses import dataclass
from itertools import combinations
from typing import Final

import numpy as np

from gaitval.arrays import Array, Flags, runs
from gaitval.coordinates import SIDES
from gaitval.gait.events import marker_stance
from gaitval.gait.sampling import interpolated
from gaitval.mocap.foot_markers import foot_markers
from gaitval.mocap.force_plates import plate_axes
from gaitval.mocap.recording import Plate, Recording


@dataclass(frozen=True)
class FeetLimits:
    """Which foot is on which plate."""

    settling_seconds: float = 0.06
    """s. Around a strike or toe-off found from markers, which is accurate to about 20 ms, nothing
    is concluded about the plate for this long."""
    low_point: float = 0.03
    """m. A marker of the foot is on the ground if it is within this of its usual lowest height."""
    shortest_shared_seconds: float = 0.03
    """Both feet on a plate for less than this is within the error of the markers' events, s."""


FEET: Final = FeetLimits()


@dataclass(frozen=True)
class Feet:
    """Markers of the feet at the times of the forces: T samples, right foot first.

    Attributes
    ----------
    outlines : (T, n, 3) m of each foot.
    low : (T, n) whether each of these points is on the ground, in stance.
    stance : (T, 2).
    """

    outlines: tuple[Array, Array]
    low: tuple[Flags, Flags]
    stance: Flags


def feet_of(recording: Recording, landmarks: Mapping[str, str]) -> Feet:
    """The feet at the times of the forces of `recording`, in the project's axes; `landmarks`: see
    `foot_markers`. A marker in a gap is NaN, and counts as not on the ground. Raises RecordError as
    `marker_events`.
    """
    markers = foot_markers(recording, landmarks)
    stance_frames = marker_stance(recording, landmarks=landmarks)
    frames = (recording.force_time - recording.start) * recording.marker_rate
    # Stance is yes or no, so it is that of the nearest frame; positions are interpolated.
    nearest = np.clip(np.rint(frames).astype(int), 0, len(recording.markers) - 1)
    stance = stance_frames[nearest]
    outlines, lows = [], []
    for column, side in enumerate(SIDES):
        measured = markers[side].outline
        outline = interpolated(measured, frames)
        with np.errstate(invalid="ignore"):
            # the foot is low in more than half of all frames
            floor = np.nanpercentile(measured[:, :, 2], 20.0, axis=0)
            low = (outline[:, :, 2] < floor + FEET.low_point) & stance[:, column, None]
        outlines.append(outline)
        lows.append(low)
    return Feet((outlines[0], outlines[1]), (lows[0], lows[1]), stance)


def reaches(plate: Plate, outline: Array) -> Flags:
    """(T,) whether a foot may touch a `plate`: part of its `outline` (T, n, 3) m, of
    `Feet.outlines`, is over it, or within 2 cm of it. A plate without corners may be anywhere, so
    every foot may touch it.
    """
    if not np.isfinite(plate.corners).all():
        return np.ones(len(outline), dtype=bool)
    inside = over_plate(plate, outline, margin=0.02)
    # a marker that is not seen may be anywhere
    return np.asarray((inside | ~np.isfinite(outline).all(axis=2)).any(axis=1))


def over_plate(plate: Plate, points: Array, *, margin: float = 0.0) -> Flags:
    """(T, n) whether `points` (T, n, 3) m are over a `plate` with known corners, widened by
    `margin` (m) on all sides, whatever their height; False for a point that is NaN.
    """
    centre, axes = plate.corners.mean(axis=0), plate_axes(plate.corners)
    # In its own axes the plate is a rectangle about its middle.
    half = np.abs((plate.corners - centre) @ axes).max(axis=0)[:2] + margin
    with np.errstate(invalid="ignore"):
        inside = np.abs((points - centre) @ axes)[..., :2] <= half
    return np.asarray(inside.all(axis=-1))


def shared_by_both(plate: Plate, feet: Feet, rate: float) -> Flags:
    """(T,) whether both `feet` are on one `plate`, at least partly, at the samples of the force,
    `rate` Hz; periods under `FEET.shortest_shared_seconds` are left out. A plate without corners is
    never shared, because nothing is known of its place.
    """
    if not np.isfinite(plate.corners).all():
        return np.zeros(len(plate.force), dtype=bool)
    standing = [
        (over_plate(plate, feet.outlines[column]) & feet.low[column]).any(axis=1)
        for column in (0, 1)
    ]
    shared = np.asarray(standing[0] & standing[1])
    # strikes and toe-offs from markers are accurate to about 20 ms
    for begin, end in zip(*runs(shared), strict=True):
        if end - begin < FEET.shortest_shared_seconds * rate:
            shared[begin:end] = False
    return shared


def distances_to_feet(plate: Plate, feet: Feet, begin: int, end: int) -> Array:
    """Horizontal distance, (n, 2) m, right foot first, from a `plate`'s centre of pressure to the
    outline of each of `feet`, from the force sample `begin` of a contact to the one before `end`; 0
    inside the outline, NaN where the foot or the point is unknown.
    """
    point = plate.centre_of_pressure[begin:end, :2]
    return np.stack(
        [_outside(point, outline[begin:end, :, :2]) for outline in feet.outlines], axis=1
    )


def _outside(point: Array, outline: Array) -> Array:
    """(T,) m: distance of points (T, 2) to the convex hull of a foot's outline (T, n, 2).

    In the plane the hull is the union of the triangles of any three points, and a point outside
    it is nearest to a segment between two.
    """
    best = np.full(len(point), np.inf)
    for first, second in combinations(range(outline.shape[1]), 2):
        a, b = outline[:, first], outline[:, second]
        along = b - a
        # Markers at one point have no direction; the bound only keeps the division finite.
        length = np.maximum((along**2).sum(axis=1), 1e-12)
        # Foot of the perpendicular, kept between the ends of the segment.
        share = np.clip(((point - a) * along).sum(axis=1) / length, 0.0, 1.0)
        # `fmin` ignores NaN: a marker in a gap leaves out its own segments and triangles only.
        best = np.fmin(best, np.linalg.norm(point - a - share[:, None] * along, axis=1))
    for corners in combinations(range(outline.shape[1]), 3):
        a, b, c = (outline[:, corner] for corner in corners)
        turns = np.sign([_turn(p, q, point) for p, q in ((a, b), (b, c), (c, a))])
        # Inside a triangle a point is on the same side of all three edges.
        best[(turns[0] == turns[1]) & (turns[1] == turns[2])] = 0.0
    return np.where(np.isfinite(best), best, np.nan)


def _turn(start: Array, end: Array, point: Array) -> Array:
    """Twice the signed area of the triangles of points (T, 2)."""
    u, v = end - start, point - start
    return np.asarray(u[:, 0] * v[:, 1] - u[:, 1] * v[:, 0])


def nearest_foot(distances: Array) -> int:
    """Column of the foot that is nearer on average, by `distances` (n, 2) m of `distances_to_feet`:
    0 for the right foot, also if neither is seen, 1 for the left one.
    """
    known = np.where(np.isfinite(distances), distances, np.inf)
    return int(np.argmin(np.median(known, axis=0)))
