"""Whether trajectories are those of markers that cameras saw, on a person who moves."""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from itertools import combinations
from typing import Final

import numpy as np

from gaitval.arrays import Array, Flags, runs
from gaitval.findings.finding import Finding, Seen
from gaitval.gait.filters import low_pass, octave
from gaitval.mocap.recording import Recording

MEDIAN_TO_SD: Final = 1.4826
"""Standard deviation of a normal distribution over the median of its absolute values."""


@dataclass(frozen=True)
class AsRead:
    """The markers of a walk as its file has them.

    Attributes
    ----------
    recording : in the axes of its file, along which coordinates are cut off or repeated.
    segments : that of each marker.
    """

    recording: Recording
    segments: Mapping[str, str]


@dataclass(frozen=True)
class Walking:
    """The markers of a walk, cleaned, in the project's axes, and the segment of each."""

    recording: Recording
    segments: Mapping[str, str]


@dataclass(frozen=True)
class Stood:
    """The markers of a standing trial as its file has them."""

    recording: Recording

    @property
    def frames(self) -> Mapping[str, int]:
        """How many frames show each marker that is seen at all."""
        markers = self.recording.markers
        seen = np.isfinite(markers).all(axis=2) & (markers != 0.0).any(axis=2)
        counts = zip(self.recording.names, seen.sum(axis=0).tolist(), strict=True)
        return {name: count for name, count in counts if count}


def _seldom(stood: Stood) -> Iterator[Seen]:
    """Share of the frames of a standing trial that show a marker."""
    every = len(stood.recording.markers)
    for name, count in stood.frames.items():
        yield Seen(count / every, name, {"count": count, "all": every})


def _filled(read: AsRead, *, away_m: float, alone_s: float, **of_paths: float) -> Iterator[Seen]:
    """How long markers have a path in which a gap was filled wrongly, s."""
    recording, segments = read.recording, read.segments
    parts = dict[str, tuple[float, str]]()
    for name in recording.names:
        filled = _polynomial(recording.marker(name), recording.marker_rate, **of_paths)
        seconds = float(filled.sum() / recording.marker_rate)
        others = [
            other
            for other in recording.names
            if other != name and segments.get(other) == segments.get(name, "torso") != "torso"
        ]
        away = max((_away(recording, name, other, filled) for other in others), default=np.nan)
        if away > away_m:
            parts[name] = seconds, f"by up to {1000 * away:.0f} mm"
        elif len(others) < 2 and seconds > alone_s:
            parts[name] = seconds, "where too few other markers show its segment"
    each = "; ".join(f"{name} for {seconds:.2f} s, {off}" for name, (seconds, off) in parts.items())
    longest = max((seconds for seconds, _ in parts.values()), default=0.0)
    yield Seen(longest, ", ".join(parts) or "all markers", {"each": each})


def _polynomial(
    path: Array, rate: float,
    *, share: float, least_s: float, frames: float, travel_m: float, rounding_m: float,
) -> Flags:  # fmt: skip
    """(T,) whether a `path` (T, 3) is an exact polynomial around a frame, of degree 5 or less: a
    straight line, a cubic or a quintic, whose differences of order 6 vanish.

    Rounding to a thousandth of a millimetre leaves some of them; noise of cameras is twenty times
    that, and markers that were smoothed and move have ten times as much.
    """
    found: Flags = np.zeros(len(path), dtype=bool)
    size = np.linalg.norm(np.diff(path, n=6, axis=0), axis=1)
    known = size[np.isfinite(size)]
    limit = min(rounding_m, share * np.median(known)) if len(known) else 0.0
    for begin, end in zip(*runs(size < limit), strict=True):
        last = end + 5
        # A marker that rests has no differences either, and no gap.
        moved = np.linalg.norm(path[last] - path[begin]) > travel_m
        if end - begin >= frames and (last + 1 - begin) / rate >= least_s and moved:
            found[begin : last + 1] = True
    return found


def _away(recording: Recording, name: str, other: str, filled: Flags) -> float:
    """m; NaN where the two are not seen together."""
    apart: Array = np.linalg.norm(recording.marker(name) - recording.marker(other), axis=1)
    seen = np.isfinite(apart)
    inside, outside = apart[seen & filled], apart[seen & ~filled]
    if not len(inside) or not len(outside):
        return float("nan")
    middle = np.median(outside)
    return float(np.abs(inside - middle).max() - np.abs(outside - middle).max())


def fall_of_markers(walk: Recording, *, least_hz: float = 50.0) -> float:
    """Octaves by which the rate of the markers of a `walk` changes from 4 to 8 Hz; NaN where none
    is seen in all frames, or it is too short, or recorded at less than `least_hz`.
    """
    if walk.marker_rate < least_hz or len(walk.markers) < walk.marker_rate:
        return float("nan")
    seen = np.isfinite(walk.markers).all(axis=(0, 2))
    if not seen.any():
        return float("nan")
    return octave(walk.markers[:, seen].reshape(len(walk.markers), -1), walk.marker_rate, 4.0)


def _smoothed(read: AsRead) -> Iterator[Seen]:
    fall = fall_of_markers(read.recording)
    yield Seen(fall, "all markers", {"fall": -fall})


def _loose(walk: Walking, *, shakes_hz: float, frames: int) -> Iterator[Seen]:
    """By what shakes against the other markers of its segment, m. The trunk, in which shoulder
    blades move, is left out. Of two that only each other shows, either may be it.
    """
    limit = LOOSE.high
    of: dict[str, list[str]] = {}
    for name in walk.recording.names:
        if walk.segments.get(name, "torso") != "torso":
            of.setdefault(walk.segments[name], []).append(name)
    for names in of.values():
        shakes = {
            pair: _shake(walk.recording, *pair, frames=frames, shakes_hz=shakes_hz)
            for pair in combinations(names, 2)
        }
        own = {
            name: [s for pair, s in shakes.items() if name in pair and np.isfinite(s)]
            for name in names
        }
        found = {name: float(np.median(own[name])) for name in names if own[name]}
        if not found:
            continue
        worst = max(found, key=lambda name: found[name])
        # What shakes moves its distances to all others; theirs to each other stay.
        every = [name for name in found if min(own[name]) > limit]
        yield Seen(found[worst], " or ".join(every if worst in every else [worst]))


def _shake(recording: Recording, one: str, other: str, *, frames: int, shakes_hz: float) -> float:
    """m; NaN where the two are hardly seen together."""
    apart: Array = np.linalg.norm(recording.marker(one) - recording.marker(other), axis=1)
    seen = np.isfinite(apart)
    if seen.sum() < frames:
        return float("nan")
    every = np.arange(len(apart))
    whole = np.interp(every, every[seen], apart[seen])[:, None]
    fast = (whole - low_pass(whole, rate=recording.marker_rate, cutoff_hz=shakes_hz))[seen]
    return float(MEDIAN_TO_SD * np.median(np.abs(fast)))


SELDOM: Final[Finding] = Finding(
    name="seldom seen",
    needs=Stood,
    values=_seldom,
    limits=(0.1, np.inf),
    unit="of the frames",
    sentence=(
        "only {count} of the {all} frames of the standing trial show it, so it is left out there"
    ),
    remedy="Label it in the recording program, and export again",
    source=(
        "one of 107 frames in a file of MOtoNMS, 11 cm from its place: a ghost more often than a "
        "marker"
    ),
)
FILLED: Final[Finding] = Finding(
    name="filled gap",
    needs=AsRead,
    values=_filled,
    numbers={
        "away_m": 0.006, "alone_s": 0.3, "least_s": 0.15, "frames": 6, "travel_m": 0.02,
        "share": 0.1, "rounding_m": 1.6e-5,
    },
    limits=0.0,
    unit="s",
    sentence=(
        "paths that are exact polynomials, without the noise of cameras, and farther from the "
        "other markers of their segments than in the rest of the trial, or not held by them: "
        "{each}. Gaps were filled before the file was written, and the angles of these segments "
        "are wrong there"
    ),
    remedy=(
        "Export the trial with the gaps left open, or fill them by the other markers of the segment"
    ),
    source=(
        "of 25 public trials three have longer ones, all splines: a child's (HC040A, 0.4 s) and "
        "two of the instrumented knee (0.25 s); skin moves by less than 6 mm more"
    ),
)  # fmt: skip
SMOOTHED: Final[Finding] = Finding(
    name="smoothed markers",
    needs=AsRead,
    values=_smoothed,
    limits=(-4.5, np.inf),
    unit="octaves",
    sentence=(
        "hardly anything in them is faster than 4 Hz (from there to 8 Hz their rate falls by "
        "{fall:.1f} octaves, elsewhere by at most 3.5): they were low-passed at a few Hz before "
        "the file was written. Angles are flattened, distances between markers of a segment and "
        "accelerations change"
    ),
    remedy="Export them as they were recorded",
    source=(
        "-2.4 ± 0.6 in 23 public recordings (-3.5 at least), -3.8 to -6.5 after a zero-lag "
        "low-pass at 4 to 2 Hz"
    ),
)
LOOSE: Final[Finding] = Finding(
    name="loose marker",
    needs=Walking,
    values=_loose,
    numbers={"shakes_hz": 5.0, "frames": 60},
    limits=0.002,
    unit="m",
    sentence=(
        "above 5 Hz its distance to the other markers of its segment changes by {value:.1f mm} "
        "(SD; elsewhere below 1 mm): it is loose and shakes, or the cameras scatter. Moments, and "
        "angles of its segment, shake with it"
    ),
    remedy="Look at the calibration of the cameras, fix it, or leave it out of the file",
    source=(
        "SD above 5 Hz of the distances to the other markers of a segment: at most 0.9 mm in 22 "
        "recordings of 20 people"
    ),
)
