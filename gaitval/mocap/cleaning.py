"""Marker trajectories made fit for kinematics: gaps, spikes, exchanged markers, low-pass filter.

Nothing is changed in silence: every frame that `clean` replaces, and every one that it could
not, stands in the report. It works in any axes of which z is up (the project's, REP-103), in
metres.
"""

import re
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from itertools import combinations
from typing import Final, Literal

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.interpolate import CubicHermiteSpline
from scipy.signal import butter, sosfiltfilt
from scipy.spatial.transform import Rotation

from gaitval.arrays import Array, Flags
from gaitval.configuration import ProcessingSettings
from gaitval.errors import RecordError
from gaitval.mocap.foot_markers import facing
from gaitval.mocap.recording import Recording

FindingKind = Literal["missing", "gap", "spike", "swap", "jump", "offset", "contact"]

LARGEST_ACCELERATION: Final = 150.0
"""m/s². No marker of a walking person exceeds it between neighbouring frames: the largest in
the walks of Rajagopal et al. 2016 (toe, 100 Hz) is 153, of the WBDS at 1.26 m/s 128, in both
mostly noise, which `JUMP_NOISE` adds to this."""
JUMP_NOISE: Final = 0.006
"""m: what noise of the cameras may add to a second difference (2.4 times its own size)."""
NOISE_MULTIPLE: Final = 4.0
"""In a noisy trial its own noise counts instead: this many medians of a marker's second
differences, which is 6 standard deviations of noise in three directions and so never exceeded."""
LONGEST_SPIKE: Final = 0.05
"""s. A marker that returns later than this has not spiked; it has been somewhere else."""
RETURNED: Final = 0.4
"""Share of a spike's size within which the marker comes back to where its velocity before it
leads; in the time of a spike velocity changes, so that nothing much smaller can be asked."""
RIGID_GAP_FACTOR: Final = 5.0
"""Rebuilding from the segment bridges gaps this many times as long as a spline does."""
LARGEST_DEFORMATION: Final = 0.02
"""m root-mean-square over the markers of a segment between the frames before and after a gap.
Skin moves by about this; if it is more, these markers are not on one segment."""
FLATTEST_CLUSTER: Final = 0.1
"""Second over first singular value of the markers about their mean; on a line (0) they do not
fix the turn about it."""
SPLINE_FIRST: Final = 0.5
"""Share of `largest_gap_s` up to which a spline is better than the segment's markers, which skin
moves. Gaps cut into the walk of Rajagopal et al. 2016 (shank, thigh, foot, pelvis), largest
error, mean: at 0.05 s 1.0, 0.9, 1.3, 0.7 mm by spline and 1.0, 1.1, 1.6, 1.1 mm by the segment;
at 0.1 s 2.3, 2.5, 3.8, 1.6 and 1.5, 2.2, 3.0, 2.3 mm; at 0.2 s 9, 9, 16, 5 and 3, 4, 7, 4 mm."""
SPLINE_SUPPORT: Final = 0.04
"""s at each side of a gap over which the velocity at its edge is fitted."""
LONGEST_HIDDEN_SWAP: Final = 0.2
"""s. In this time the line between two markers of a segment turns by far less than the half turn
that an exchange makes of it (the shank turns at up to 400 deg/s)."""
AMBIGUOUS_SHARE: Final = 0.25
"""Share of a trial. Two markers that change places once are put right if the shorter part is
less than this; otherwise nobody can say which part is right."""


@dataclass(frozen=True)
class Finding:
    """Something found in a recording, and what was done about it.

    Attributes
    ----------
    kind : what it is.
    names : the markers, plates or feet concerned.
    first, last : frames (or force samples) concerned, counted from 0, both included.
    start, end : their times, s, of the recording's clock.
    action : what was done, in words.
    """

    kind: FindingKind
    names: tuple[str, ...]
    first: int
    last: int
    start: float
    end: float
    action: str

    def __str__(self) -> str:
        unit = "sample" if self.kind in ("offset", "contact") else "frame"
        where = (
            f"{unit} {self.first}"
            if self.first == self.last
            else f"{unit}s {self.first}-{self.last}"
        )
        when = (
            f"{self.start:.3f} s"
            if self.first == self.last
            else (f"{self.start:.3f}-{self.end:.3f} s")
        )
        return f"{self.kind}: {', '.join(self.names)}, {where} ({when}): {self.action}"


@dataclass(frozen=True)
class CleaningReport:
    """What `clean` found.

    Attributes
    ----------
    findings : in order of time.
    missing : markers that the trial names but never shows.
    filled : frames filled or put right, by marker; markers without any are left out.
    left_open : frames still without a position, by marker; markers without any are left out.
    """

    findings: tuple[Finding, ...]
    missing: tuple[str, ...]
    filled: Mapping[str, int]
    left_open: Mapping[str, int]


def low_pass(values: ArrayLike, *, rate: float, cutoff_hz: float, order: int = 4) -> Array:
    """Zero-lag Butterworth low-pass along the first axis, each block between NaN by itself.

    A filter of half the order runs forwards and backwards. Two passes would halve the amplitude
    at its cut-off, so that is raised until the whole has 1/√2 (−3.01 dB) at `cutoff_hz`:
    tan(π f′/rate) = tan(π f/rate) / (√2 − 1)^(1/order), which is the correction of Winter 2009
    (Biomechanics and Motor Control of Human Movement, section 3.4.4.2) carried through the
    bilinear transformation, so that it is exact at every sample rate.

    Parameters
    ----------
    values : (T, ...) uniformly sampled; a column that is NaN at a sample is filtered in blocks.
    rate : Hz.
    cutoff_hz : Hz, below half the rate.
    order : of the whole filter, even.

    Raises
    ------
    RecordError : a cut-off that the rate does not allow, or a signal shorter than one period of
        the cut-off.
    """
    values = np.asarray(values, dtype=float)
    if not 0.0 < cutoff_hz < 0.5 * rate:
        raise RecordError(
            f"A low-pass at {cutoff_hz:g} Hz needs samples at more than {2 * cutoff_hz:g} Hz, but "
            f"these come at {rate:g} Hz. Lower the cut-off in the section [processing] of the "
            "configuration."
        )
    period = int(np.ceil(rate / cutoff_hz))
    if len(values) < period:
        raise RecordError(
            f"{len(values)} samples at {rate:g} Hz are {len(values) / rate:.3g} s, shorter than "
            f"one period of the low-pass at {cutoff_hz:g} Hz: the trial is too short to filter. "
            "Give a longer one."
        )
    passes = 0.5 * order
    warped = np.tan(np.pi * cutoff_hz / rate) / (np.sqrt(2.0) - 1.0) ** (1.0 / order)
    sections = butter(int(passes), np.arctan(warped) / np.pi * rate, fs=rate, output="sos")
    filtered = values.reshape(len(values), -1).copy()
    seen = np.isfinite(filtered)
    if seen.all():
        # the ends are extended over one period of the cut-off, in which the filter settles
        padding = min(period, len(values) - 1)
        filtered = np.asarray(sosfiltfilt(sections, filtered, axis=0, padlen=padding))
    else:
        for column in range(filtered.shape[1]):
            for begin, end in zip(*runs(seen[:, column]), strict=True):
                block = filtered[begin:end, column]
                padding = min(period, len(block) - 1)
                filtered[begin:end, column] = sosfiltfilt(sections, block, padlen=padding)
    return filtered.reshape(values.shape)


def clean(
    recording: Recording,
    segments: Mapping[str, str],
    processing: ProcessingSettings,
    *,
    landmarks: Mapping[str, str],
) -> tuple[Recording, CleaningReport]:
    """Put right what can be put right in the marker trajectories of a trial, and say so.

    In this order: samples at exactly the origin, which some systems write for a marker that was
    not seen, become gaps; markers that change places are changed back; spikes become gaps; gaps
    are filled. A gap is rebuilt from three or more other markers of its segment (their rigid
    motion by Kabsch's method, joined to the frames around the gap) up to five times
    `largest_gap_s`; a cubic through position and velocity at its edges fills what cannot be
    rebuilt up to `largest_gap_s`, and all up to half of that, where it is the better of the two.
    What is longer, and what touches an end of the trial without such neighbours, stays NaN.

    Parameters
    ----------
    recording : z up, m.
    segments : marker -> segment of the body model; markers that are not in it are cleaned
        without their neighbours.
    processing : `largest_gap_s`.
    landmarks : anatomical landmark -> marker, see `foot_markers`. They tell where the person
        faces, and so which side is left.

    Raises
    ------
    RecordError : no marker is ever seen; left and right labels are exchanged in the whole trial;
        two markers change places once, and it is open which part is right.
    """
    markers = recording.markers.copy()
    # axes are turned about the origin, so that a zero stays a zero
    markers[(markers == 0.0).all(axis=2)] = np.nan
    seen = _seen(markers)
    markers[~seen] = np.nan
    if not seen.any():
        raise RecordError(
            f"{recording.source}: none of the {len(recording.names)} markers is ever seen (all "
            "positions are empty, NaN or zero). Export the trial again with its reconstructed and "
            "labelled trajectories."
        )
    never = np.asarray(~seen.any(axis=0))
    missing = tuple(name for name, gone in zip(recording.names, never, strict=True) if gone)
    last = len(markers) - 1
    findings = [
        _finding(recording, "missing", [name], 0, last, "never seen in this trial; left out")
        for name in missing
    ]
    findings += _exchange_back(recording, markers, segments)
    _refuse_mirrored_labels(recording.with_markers(recording.names, markers), landmarks)
    found, spiked = _cut_spikes(recording, markers)
    findings += found
    findings += _fill_gaps(recording, markers, segments, processing, spiked)
    now = _seen(markers)
    changed = now & ~(markers == recording.markers).all(axis=2)
    report = CleaningReport(
        findings=tuple(sorted(findings, key=lambda finding: (finding.start, finding.names))),
        missing=missing,
        filled=_counts(recording.names, changed.sum(axis=0)),
        left_open=_counts(recording.names, np.where(never, 0, (~now).sum(axis=0))),
    )
    return recording.with_markers(recording.names, markers), report


def _counts(names: Sequence[str], counts: NDArray[np.int64]) -> dict[str, int]:
    return {name: int(count) for name, count in zip(names, counts, strict=True) if count}


def _finding(
    recording: Recording,
    kind: FindingKind,
    names: Iterable[str],
    first: int,
    last: int,
    action: str,
) -> Finding:
    start, rate = recording.start, recording.marker_rate
    return Finding(
        kind, tuple(names), int(first), int(last), start + first / rate, start + last / rate, action
    )


def _seen(positions: Array) -> Flags:
    """Where all three coordinates are known."""
    return np.asarray(np.isfinite(positions).all(axis=-1))


def runs(on: Flags) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """First sample of each run of True, and the first sample after it, (n,) each."""
    edges = np.diff(np.concatenate(([0], on.astype(np.int8), [0])))
    return np.flatnonzero(edges == 1), np.flatnonzero(edges == -1)


def _tolerance(path: Array, rate: float, frames: int = 1) -> float:
    """Farthest that a marker is from where its velocity would take it in some frames, m."""
    usual = _surprise(path)
    usual = usual[usual > 0.0]
    noise = NOISE_MULTIPLE * float(np.median(usual)) if len(usual) else 0.0
    return max(JUMP_NOISE, noise) + LARGEST_ACCELERATION * (frames / rate) ** 2


def _surprise(path: Array) -> Array:
    """(T,) m: distance of each frame from where the velocity before it leads; 0 where unknown."""
    distance = np.zeros(len(path))
    if len(path) > 2:
        distance[2:] = np.linalg.norm(path[2:] - 2.0 * path[1:-1] + path[:-2], axis=1)
    return np.nan_to_num(distance)


# -- markers that change places ---------------------------------------------------------------


def _exchange_back(
    recording: Recording, markers: Array, segments: Mapping[str, str]
) -> list[Finding]:
    """Undo exchanges of two trajectories within the trial, in place."""
    names = recording.names
    changes: dict[tuple[int, int], list[int]] = {}
    done: set[tuple[int, int, int]] = set()
    while (change := _next_change(recording, markers, segments, done)) is not None:
        done.add(change)
        frame, first, second = change
        _exchange(markers, first, second, frame, len(markers))
        changes.setdefault((first, second), []).append(frame)
    findings = []
    for (first, second), frames in changes.items():
        pair = names[first], names[second]
        if len(frames) % 2:
            opened = frames.pop()
            tail = len(markers) - opened
            head = opened - (frames[-1] if frames else 0)
            if min(head, tail) > AMBIGUOUS_SHARE * len(markers):
                time = recording.start + opened / recording.marker_rate
                raise RecordError(
                    f"{recording.source}: markers {pair[0]} and {pair[1]} change places at frame "
                    f"{opened} ({time:.3f} s) and do not change back, so it is open whether they "
                    "are labelled rightly before or after. Correct the labels of one part in the "
                    "capture software, or cut the trial there."
                )
            if tail <= head:
                frames += [opened, len(markers)]
            else:
                begin = frames[-1] if frames else 0
                _exchange(markers, first, second, begin, len(markers))
                # the exchange over the whole of the rest leaves only the head exchanged
                frames = [*frames[:-1], opened] if frames else [0, opened]
        for begin, end in zip(frames[::2], frames[1::2], strict=True):
            findings.append(
                _finding(recording, "swap", pair, begin, end - 1, "trajectories exchanged back")
            )
    return findings


def _exchange(markers: Array, first: int, second: int, begin: int, end: int) -> None:
    markers[begin:end, [first, second]] = markers[begin:end, [second, first]]


def _next_change(
    recording: Recording,
    markers: Array,
    segments: Mapping[str, str],
    done: set[tuple[int, int, int]],
) -> tuple[int, int, int] | None:
    """First frame at which two markers take each other's place, and the two; none of `done`."""
    rate = recording.marker_rate
    surprise = np.stack([_surprise(markers[:, i]) for i in range(markers.shape[1])], axis=1)
    allowed = [_tolerance(markers[:, i], rate) for i in range(markers.shape[1])]
    jumped = surprise > np.array(allowed)
    for frame in np.flatnonzero(jumped.sum(axis=1) >= 2):
        for first, second in combinations(np.flatnonzero(jumped[frame]), 2):
            pair = [first, second]
            ahead = 2.0 * markers[frame - 1, pair] - markers[frame - 2, pair]
            crossed = np.linalg.norm(markers[frame, pair[::-1]] - ahead, axis=1)
            change = int(frame), int(first), int(second)
            # a swap leaves both where the other was; a pair of spikes does not come here
            if (crossed < 0.5 * surprise[frame, pair]).all() and change not in done:
                return change
    return _change_over_gap(recording, markers, segments, done)


def _change_over_gap(
    recording: Recording,
    markers: Array,
    segments: Mapping[str, str],
    done: set[tuple[int, int, int]],
) -> tuple[int, int, int] | None:
    """The same where both of a segment's markers vanish together before they change places.

    The vector between two markers of a segment turns little in the time of a short gap, and an
    exchange reverses it.
    """
    names, rate = recording.names, recording.marker_rate
    longest = round(LONGEST_HIDDEN_SWAP * rate)
    seen = _seen(markers)
    for first, second in combinations(range(len(names)), 2):
        segment = segments.get(names[first])
        if segment is None or segment != segments.get(names[second]):
            continue
        begins, ends = runs(~(seen[:, first] & seen[:, second]))
        for begin, end in zip(begins, ends, strict=True):
            if begin == 0 or end == len(markers) or end - begin > longest:
                continue
            before = markers[begin - 1, first] - markers[begin - 1, second]
            after = markers[end, first] - markers[end, second]
            change = int(end), first, second
            reversed_ = np.linalg.norm(after + before) < 0.5 * np.linalg.norm(after - before)
            if reversed_ and change not in done:
                return change
    return None


_LEFT_RIGHT: Final = (
    (r"(?i)(?<![a-z])left(?![a-z])", "right"),
    (r"(?i)(?<![a-z])right(?![a-z])", "left"),
    (r"(?<![A-Za-z])L", "R"),
    (r"(?<![A-Za-z])R", "L"),
    (r"(?<![A-Za-z])l(?![a-z])", "r"),
    (r"(?<![A-Za-z])r(?![a-z])", "l"),
    (r"L$", "R"),
    (r"R$", "L"),
)


def opposite_marker(name: str, names: Iterable[str]) -> str | None:
    """The marker of the same place on the other side of the body, by its name, if there is one.

    >>> opposite_marker("R.Knee", ["R.Knee", "L.Knee"])
    'L.Knee'
    """
    known = set(names)
    for pattern, other in _LEFT_RIGHT:
        for found in re.finditer(pattern, name):
            candidate = name[: found.start()] + other + name[found.end() :]
            if candidate in known and candidate != name:
                return candidate
    return None


def _refuse_mirrored_labels(recording: Recording, landmarks: Mapping[str, str]) -> None:
    """Raise if the markers labelled left are on the right of their partners all along."""
    forward = facing(recording, landmarks)
    leftward = np.array([-forward[1], forward[0], 0.0])
    left_of = {name: _side(name, landmarks, recording.names) for name in recording.names}
    wrong = []
    for name in recording.names:
        partner = opposite_marker(name, recording.names)
        if left_of[name] != "left" or partner is None:
            continue
        apart = (recording.marker(name) - recording.marker(partner)) @ leftward
        apart = apart[np.isfinite(apart)]
        # legs may cross for a moment; they are not crossed in the middle of all frames
        if len(apart) and np.median(apart) < 0.0:
            wrong.append((name, partner))
    if wrong:
        pairs = "; ".join(f"{left} and {right}" for left, right in wrong)
        raise RecordError(
            f"{recording.source}: left and right are exchanged for {pairs}: seen along the "
            "direction in which the person faces, the markers labelled left are on the right in "
            "most frames. Exchange these labels in the capture software and export the trial "
            "again (if all markers are listed, check also that the axes of the laboratory are "
            "right-handed)."
        )


def _side(name: str, landmarks: Mapping[str, str], names: Sequence[str]) -> str | None:
    """Side that the name states: by the landmark it stands for, else by its first L or left."""
    for landmark, marker in landmarks.items():
        if marker == name and landmark[:2] in ("L.", "R."):
            return "left" if landmark.startswith("L.") else "right"
    partner = opposite_marker(name, names)
    if partner is None:
        return None
    place = next(i for i, (a, b) in enumerate(zip(name, partner, strict=False)) if a != b)
    return "left" if name[place] in "Ll" else "right"


# -- spikes -------------------------------------------------------------------------------------


def _cut_spikes(recording: Recording, markers: Array) -> tuple[list[Finding], Flags]:
    """Make gaps of frames in which a marker is away from its path for a moment, in place."""
    rate = recording.marker_rate
    findings = []
    spiked = np.zeros(markers.shape[:2], dtype=bool)
    for column, name in enumerate(recording.names):
        path = markers[:, column]
        for begin, end, away in _spikes(path, rate):
            path[begin:end] = np.nan
            spiked[begin:end, column] = True
            action = f"up to {1000 * away:.0f} mm off its path; taken out"
            findings.append(_finding(recording, "spike", [name], begin, end - 1, action))
        surprise = _surprise(path)
        jumps = np.flatnonzero(surprise > _tolerance(path, rate))
        if len(jumps):
            action = (
                f"leaves its path by up to {1000 * surprise[jumps].max():.0f} mm in {len(jumps)} "
                "frame(s) and does not return; left as it is: check the label"
            )
            first, last = int(jumps[0]), int(jumps[-1])
            findings.append(_finding(recording, "jump", [name], first, last, action))
    return findings, spiked


def _spikes(path: Array, rate: float) -> list[tuple[int, int, float]]:
    """First frame, frame after the last, and largest distance from the path (m) of each spike."""
    longest = max(1, round(LONGEST_SPIKE * rate))
    # by the number of frames that a velocity is carried on
    allowed = [_tolerance(path, rate, frames) for frames in range(longest + 2)]
    path = path.copy()
    found = []
    # forwards, then backwards for spikes that the beginning of the trial or of a block hides
    for reverse in (False, True):
        view = path[::-1] if reverse else path
        for frame in np.flatnonzero(_surprise(view) > allowed[1]):
            spike = _spike_at(view, int(frame), allowed)
            if spike is not None:
                begin, end, away = spike
                view[begin:end] = np.nan
                found.append((len(path) - end, len(path) - begin, away) if reverse else spike)
    return found


def _spike_at(path: Array, frame: int, allowed: Sequence[float]) -> tuple[int, int, float] | None:
    """The shortest spike that begins at a frame where the marker has jumped."""
    seen = _seen(path[frame - 2 : frame + len(allowed)])
    if not seen[:3].all():
        return None  # a spike that ended here has become a gap
    base, velocity = path[frame - 1], path[frame - 1] - path[frame - 2]
    for length in range(1, len(allowed) - 1):
        back = frame + length
        away = _distance(path[frame:back], base, velocity)
        if back >= len(path) or not seen[length + 2]:
            return frame, back, away
        miss = float(np.linalg.norm(path[back] - base - (length + 1) * velocity))
        if miss < min(RETURNED * away, allowed[length + 1]):
            return frame, back, away
    return None


def _distance(away: Array, base: Array, velocity: Array) -> float:
    """Largest distance of some frames from a path that goes on as before, m."""
    steps = np.arange(1, len(away) + 1)[:, None]
    return float(np.linalg.norm(away - base - steps * velocity, axis=1).max())


# -- gaps ---------------------------------------------------------------------------------------


def _fill_gaps(
    recording: Recording,
    markers: Array,
    segments: Mapping[str, str],
    processing: ProcessingSettings,
    spiked: Flags,
) -> list[Finding]:
    """Fill gaps in place from what was seen, never from what another gap was filled with."""
    rate = recording.marker_rate
    measured = markers.copy()
    seen = _seen(measured)
    findings = []
    for column, name in enumerate(recording.names):
        others = np.array(
            [
                other
                for other, partner in enumerate(recording.names)
                if other != column and name in segments and segments.get(partner) == segments[name]
            ],
            dtype=int,
        )
        for begin, end in zip(*runs(~seen[:, column]), strict=True):
            if end - begin == len(markers):
                continue
            duration = (end - begin) / rate
            filled, action = None, "left open"
            if duration <= SPLINE_FIRST * processing.largest_gap_s:
                filled = _bridge(measured[:, column], begin, end, rate)
                action = "filled with a spline"
            if filled is None and duration <= RIGID_GAP_FACTOR * processing.largest_gap_s:
                rebuilt = _rebuild(measured, seen, column, others, begin, end)
                if rebuilt is not None:
                    filled, used, deformation = rebuilt
                    action = (
                        f"rebuilt from {', '.join(recording.names[i] for i in used)} "
                        f"(these moved {1000 * deformation:.1f} mm against each other)"
                    )
            if filled is None and duration <= processing.largest_gap_s:
                filled = _bridge(measured[:, column], begin, end, rate)
                action = "filled with a spline"
            if filled is not None:
                markers[begin:end, column] = filled
            else:
                action = "left open" + (
                    " (at an end of the trial)"
                    if begin == 0 or end == len(markers)
                    else f" ({duration:.3f} s is too long without three markers of its segment)"
                )
            if spiked[begin:end, column].any():
                action += ", after a spike was taken out"
            findings.append(_finding(recording, "gap", [name], begin, end - 1, action))
    return findings


def _rebuild(
    markers: Array, seen: Flags, column: int, others: NDArray[np.int64], begin: int, end: int
) -> tuple[Array, list[int], float] | None:
    """Positions (n, 3) of a marker in its gap from the rigid motion of others on its segment.

    Kabsch's method (1976, Acta Cryst A32:922) gives the motion of the others from an edge of
    the gap to each of its frames; the marker moves with them. At the other edge that misses by
    the skin's movement, which is spread evenly over the gap, so that both edges join.
    """
    edges = [frame for frame in (begin - 1, end) if 0 <= frame < len(markers)]
    frames = np.arange(begin - (begin > 0), end + (end < len(markers)))
    used = [int(i) for i in others if seen[frames, i].all()]
    if len(used) < 3:
        return None
    template = markers[edges[0]][used]
    centre = template.mean(axis=0)
    spread = np.linalg.svd(template - centre, compute_uv=False)
    if spread[1] < FLATTEST_CLUSTER * spread[0]:
        return None
    local = markers[edges[0], column] - centre
    moved = np.empty((len(frames), 3))
    deformation = 0.0
    for row, frame in enumerate(frames):
        cluster = markers[frame][used]
        middle = cluster.mean(axis=0)
        turn, distance = Rotation.align_vectors(cluster - middle, template - centre)
        deformation = max(deformation, float(distance) / np.sqrt(len(used)))
        moved[row] = turn.apply(local) + middle
    if deformation > LARGEST_DEFORMATION:
        return None
    if len(edges) == 2:
        share = np.linspace(0.0, 1.0, len(frames))[:, None]
        moved += share * (markers[end, column] - moved[-1])
    return moved[begin - frames[0] : end - frames[0]], used, deformation


def _bridge(path: Array, begin: int, end: int, rate: float) -> Array | None:
    """Positions (n, 3) in a gap: the cubic with the position and velocity at both edges.

    The velocities are those of parabolas through the frames next to the gap, so that the noise
    of two single frames does not bulge the curve.
    """
    support = max(3, round(SPLINE_SUPPORT * rate))
    knots, positions, velocities = [], [], []
    for frame, step in ((begin - 1, -1), (end, 1)):
        frames = frame + step * np.arange(support)
        frames = frames[(frames >= 0) & (frames < len(path))]
        known = _seen(path[frames])
        count = len(frames) if known.all() else int(np.argmin(known))
        if count < 2:
            return None
        degree = 2 if count > 3 else 1
        fit = np.polyfit(frames[:count] - frame, path[frames[:count]], degree)
        knots.append(frame)
        positions.append(path[frame])
        velocities.append(fit[-2])
    curve = CubicHermiteSpline(knots, np.array(positions), np.array(velocities))
    return np.asarray(curve(np.arange(begin, end)))
