"""Which way is up, which way a person faces, and where they stand, from points without names."""

import warnings
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Final

import numpy as np

from gaitval.arrays import Array
from gaitval.mocap.recording import Recording


@dataclass(frozen=True)
class StandingSettings:
    """What a standing person is found by."""

    headings: int = 72
    """Directions of the plane of symmetry that are tried, over half a turn."""
    still_m: float = 0.015
    """m. Median movement of the markers about their middle, below which a person stands."""
    still_m_s: float = 0.04
    """m/s. Median speed of the markers about their middle below which a person holds a posture:
    that of a slow walker is twice as large, and standing people sway with 1 cm/s."""
    upright: float = 0.02
    """Difference of the height over all markers, as a share, within which postures are as
    upright."""
    bends: float = 0.08
    """Share of that height by which somebody who squats or sits becomes shorter; a walker's changes
    by a third of it."""
    still_s: float = 0.5
    """s. Least time for which somebody stands."""
    frames: int = 400
    """Frames from which the distances of markers are taken."""
    stands_for: float = 35.0
    """Percentile of a marker's height that stands for its height in standing, where a person walks:
    a foot is on the ground for two thirds of the time."""


STANDING: Final = StandingSettings()


def stood(recording: Recording) -> Array:
    """Where each marker of a recording is while its person stands, (N, 3) m in the laboratory's
    axes; NaN for a marker that is never seen. Of a walk: its mean place among all markers.
    """
    markers = np.asarray(recording.markers, dtype=np.float64)
    about = _about_their_middle(markers)
    if _is_still(about):
        return np.asarray(np.nanmedian(markers, axis=0))
    upright, _ = _upright(about, recording)
    if upright.any():
        there = np.nanmedian(about[upright], axis=0)
        # A marker that is hidden just then is where it is on average.
        return np.asarray(np.where(np.isfinite(there), there, np.nanmean(about, axis=0)))
    mean = np.nanmean(about, axis=0)
    # A body is taller than it is wide, and its feet move most.
    up = _up_axis(mean)
    order = np.argsort(mean[:, up])
    ends = max(len(order) // 5, 2)
    moves = np.linalg.norm(np.nanstd(about, axis=0), axis=1)
    feet_low = np.nanmean(moves[order[:ends]]) > np.nanmean(moves[order[-ends:]])
    share = STANDING.stands_for if feet_low else 100.0 - STANDING.stands_for
    mean[:, up] = np.nanpercentile(about[:, :, up], share, axis=0)
    return np.asarray(mean)


def stands(recording: Recording) -> bool:
    """Whether the person of a recording stands still, all the time or for a while."""
    about = _about_their_middle(np.asarray(recording.markers, dtype=np.float64))
    return _is_still(about) or bool(_upright(about, recording)[1].any())


def _is_still(about: Array) -> bool:
    return bool(np.nanmedian(np.nanstd(about, axis=0)) < STANDING.still_m)


def _up_axis(mean: Array) -> int:
    """The axis along which a body is longest, by the mean place of its markers."""
    return int(np.argmax(np.nanmax(mean, axis=0) - np.nanmin(mean, axis=0)))


def _upright(about: Array, recording: Recording) -> tuple[Array, Array]:
    """(T,) whether somebody who does not stand all the time is as upright as mostly at the tallest,
    and whether they hold still then; none of a walk, in which the height hardly changes.
    """
    none = np.zeros(len(about), dtype=bool)
    window = round(STANDING.still_s * recording.marker_rate)
    if window < 2 or len(about) <= window:
        return none, none
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", RuntimeWarning)  # frames without a marker
        went = np.linalg.norm(about[window:] - about[:-window], axis=2)
        slow = np.nanmedian(went, axis=1) < STANDING.still_m_s * STANDING.still_s
    height = about[:, _often(about), _up_axis(np.nanmean(about, axis=0))]
    tall = np.ptp(height, axis=1)
    still = none.copy()
    still[window // 2 : window // 2 + len(slow)] = slow
    still &= np.isfinite(tall)
    # Not the greatest height: somebody may raise an arm.
    low, most = np.nanpercentile(tall[still] if still.any() else tall, [10, 90])
    upright = np.abs(tall - most) < STANDING.upright * most
    if (upright & still).sum() >= window:
        return upright & still, upright & still
    bends = low < (1.0 - STANDING.bends) * most
    return upright if bends and upright.sum() >= window else none, none


def apart(recording: Recording) -> Array | None:
    """Standard deviation of the distance of each pair of markers over a walk, (N, N) m; NaN where
    the two were hardly seen together. None where nobody moves: distances then say nothing.
    """
    markers = np.asarray(recording.markers, dtype=np.float64)
    step = max(len(markers) // STANDING.frames, 1)
    markers = markers[::step]
    if np.nanmedian(np.nanstd(_about_their_middle(markers), axis=0)) < STANDING.still_m:
        return None
    count = markers.shape[1]
    found = np.full((count, count), np.nan)
    for marker in range(count):
        distance = np.linalg.norm(markers - markers[:, marker : marker + 1], axis=2)
        often = np.isfinite(distance).sum(axis=0) > 20
        found[marker, often] = np.nanstd(distance[:, often], axis=0)
    return found


def _about_their_middle(markers: Array) -> Array:
    """(T, N, 3) from the middle of the markers that are nearly always seen, NaN without them."""
    return np.asarray(markers - markers[:, _often(markers)].mean(axis=1, keepdims=True))


def _often(markers: Array) -> Array:
    """(N,) whether a marker is seen nearly as often as any."""
    share = np.isfinite(markers).all(axis=2).mean(axis=0)
    return np.asarray(share > 0.9 * share.max())


def frames_of(points: Array) -> Iterator[tuple[Array, float]]:
    """Rotations (3, 3) to axes forward, left, up that a body of these `points` (N, 3) may have,
    each with how badly its left and right mirror each other, m. Both ways to face are among them.
    """
    seen = points[np.isfinite(points).all(axis=1)]
    for axis in range(3):
        for sign in (1.0, -1.0):
            up = np.zeros(3)
            up[axis] = sign
            first = np.zeros(3)
            first[(axis + 1) % 3] = 1.0
            second = np.cross(up, first)
            level = np.column_stack([seen @ first, seen @ second])
            angle, misfit = _symmetry(level, seen @ up)
            forward = np.cos(angle) * first + np.sin(angle) * second
            for facing in (forward, -forward):
                yield np.stack([facing, np.cross(up, facing), up]), misfit


def middle_of(level: Array) -> float:
    """Where the plane of symmetry is, from places across it (N,): the middle of opposite ones."""
    return float((np.percentile(level, 10) + np.percentile(level, 90)) / 2)


def _symmetry(level: Array, height: Array) -> tuple[float, float]:
    """Direction of the vertical plane that mirrors the points best, and the median distance of a
    mirrored point to its nearest.
    """
    best = (np.inf, 0.0)
    centre = level - level.mean(axis=0)
    for angle in np.linspace(0.0, np.pi, STANDING.headings, endpoint=False):
        across = -np.sin(angle) * centre[:, 0] + np.cos(angle) * centre[:, 1]
        along = np.cos(angle) * centre[:, 0] + np.sin(angle) * centre[:, 1]
        here = np.column_stack([along, height])
        for offset in (middle_of(across), float(np.mean(across))):
            apart = ((here[:, None] - here[None]) ** 2).sum(axis=2) + (
                2 * offset - across[:, None] - across[None]
            ) ** 2
            found = float(np.sqrt(np.sort(apart.min(axis=1))[: max(3 * len(apart) // 4, 1)].mean()))
            best = min(best, (found, angle))
    return best[1], best[0]
