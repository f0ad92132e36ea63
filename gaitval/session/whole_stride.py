"""A trial that is one stride of a periodic walk, such as a simulated or an averaged one.

It shows the gait cycle of one side if it is cut at that one's heel strike, else of none, though all
of both is in it. Joined to itself it does: the walk goes on as it began.
"""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace
from typing import Final

import numpy as np

from gaitval.arrays import Array
from gaitval.gait.cycles import CYCLES, GaitCycle
from gaitval.mocap.recording import Plate, Recording

COPIES: Final = 3
"""Filters and derivatives have neighbours around all of the one in the middle."""
CLOSED: Final = 0.003
"""m, root mean square over markers. Strides of people differ by more; a jump of this size moves a
moment by less than its band."""
LONGER: Final = 0.2
"""Of the trial, what may be more than a stride."""
FEWEST_MARKERS: Final = 4
_NEIGHBOURS: Final = 5
"""Frames at an end from which its velocity is taken."""


@dataclass(frozen=True)
class WholeStride:
    """A stride that was joined to itself.

    Attributes
    ----------
    recording : the stride three times; the second has the times of the trial.
    seconds : from its beginning to that of the next, s.
    apart : root mean square distance of the markers from where they began, m, the person's way
        taken away.
    """

    recording: Recording
    seconds: float
    apart: float

    def __str__(self) -> str:
        return (
            f"the trial is one stride of {self.seconds:.3f} s that ends as it began, within "
            f"{1000.0 * self.apart:.2f} mm: it is joined to itself, so that each side has a whole "
            "cycle"
        )

    def once(self, cycles: Sequence[GaitCycle]) -> tuple[GaitCycle, ...]:
        """One of the equal `cycles` of a side, the one that is furthest from both ends."""
        first = self.recording.start + 0.5 * self.seconds
        return tuple(each for each in cycles if first <= each.start < first + self.seconds)[:1]


def joined(recording: Recording) -> WholeStride | None:
    """The stride that a clean `recording`, along +x, consists of; None if it is no whole stride, or
    ends in another pose than it began.
    """
    rate = recording.marker_rate
    seen = np.isfinite(recording.markers).all(axis=(0, 2))
    if seen.sum() < FEWEST_MARKERS or len(recording.markers) < 2 * _NEIGHBOURS:
        return None
    markers = recording.markers[:, seen]
    middle = markers.mean(axis=1)
    pose = markers - middle[:, None]
    off = np.sqrt(((pose - pose[-1]) ** 2).mean(axis=(1, 2)))
    first = int(np.argmin(off[: round(LONGER * len(off))]))  # of a little more than a stride
    several = off[len(off) // 4 : -len(off) // 4].min() < 10.0 * CLOSED
    middle, pose = middle[first:], pose[first:]
    velocity = _between_ends(pose, rate)
    if not velocity.any():  # the trial ends in frames that repeat each other
        return None
    apart = pose[0] - pose[-1]
    # when the last pose has become the first
    gap = float((apart * velocity).sum() / (velocity**2).sum())
    frames = round(gap * rate)
    left = float(np.sqrt(np.mean((apart - velocity * frames / rate) ** 2)))
    count = len(pose) - 1 + frames
    seconds = count / rate
    # 0: the last frame is the first again; 1: it is the one before
    closes = frames in (0, 1) and left <= CLOSED and not several
    if not closes or np.clip(seconds, *CYCLES.plausible_stride) != seconds:
        return None
    way = (middle[-1] - middle[0] + _between_ends(middle, rate) * frames / rate) * [1, 1, 0]
    shifts = [(copy - 1) * way for copy in range(COPIES)]
    per_frame = round(recording.force_rate / rate)
    samples = slice(first * per_frame, (first + count) * per_frame)
    again = replace(
        recording,
        markers=_repeated(recording.markers[first : first + count], shifts),
        start=recording.start + first / rate - seconds,
        plates=tuple(_again(plate, samples, shifts) for plate in recording.plates),
        events=(),
    )
    return WholeStride(again, seconds, left)


def _between_ends(values: Array, rate: float) -> Array:
    """Velocity where the end of `values` (T, …), at `rate` Hz, meets their beginning."""
    ends = values[:_NEIGHBOURS], values[-_NEIGHBOURS:]
    return np.asarray(rate * np.mean([np.diff(each, axis=0).mean(axis=0) for each in ends], axis=0))


def _repeated(values: Array, more: Iterable[Array]) -> Array:
    return np.concatenate([values + each for each in more])


def _again(plate: Plate, samples: slice, shifts: Sequence[Array]) -> Plate:
    """A plate of the walkway for every copy, as one; it has no corners."""
    still, force = np.zeros((len(shifts), 3)), plate.force[samples]
    moment = plate.moment
    turned = [np.cross(shift, force) for shift in shifts]
    return replace(
        plate,
        corners=np.full((4, 3), np.nan),
        force=_repeated(force, still),
        centre_of_pressure=_repeated(plate.centre_of_pressure[samples], shifts),
        free_moment=_repeated(plate.free_moment[samples], still),
        moment=None if moment is None else _repeated(moment[samples], turned),
    )
