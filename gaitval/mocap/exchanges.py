"""Markers that change places within a trial, and labels with left and right exchanged."""

import re
from collections.abc import Callable, Iterable, Mapping, Sequence
from functools import partial
from itertools import combinations
from typing import Final

import numpy as np

from gaitval.arrays import Array, runs
from gaitval.errors import RecordError
from gaitval.mocap.foot_markers import facing
from gaitval.mocap.recording import Recording
from gaitval.mocap.repairs import Repair, repair, seen_frames
from gaitval.mocap.spikes import jump_tolerance, surprise_of

_Exchange = tuple[int, int, int]
"""First frame of an exchange, and the columns of the two markers."""
LIMITS: Final[Mapping[str, float]] = {
    # Share of a trial. Two markers that change places once are corrected if the shorter part
    # is less than this; otherwise it is unclear which part is right.
    "ambiguous_share": 0.25,
    # s. In this time the line between two markers of a segment turns far less than the half
    # turn that an exchange causes (the shank turns at up to 400 deg/s).
    "longest_hidden_swap": 0.2,
    # m by which a left marker may be on the right of its partner in the median frame:
    # runners' toes are by 8 mm (Hamner et al. 2010). Exchanged labels are by the width of a
    # step or a joint.
    "on_one_line_m": 0.02,
}
"""What decides in this module: each in the unit and for the reason that is said before it."""


def exchange_back(
    recording: Recording, markers: Array, segments: Mapping[str, str]
) -> list[Repair]:
    """Undo exchanges of two trajectories within the trial: a finding for each part that was
    exchanged back.

    `recording` has names and rate; `markers` (T, M, 3) m, NaN where not seen, are changed in place;
    `segments` has the segment of the body model of each marker. Raises RecordError if two markers
    change places once, near the middle of the trial, so it is unclear which part is right.
    """
    next_change = partial(_next_change, recording, markers, segments)
    if next_change(set()) is None:
        return []
    return undo_exchanges(recording, markers, next_change)


def _next_change(
    recording: Recording,
    markers: Array,
    segments: Mapping[str, str],
    done: set[tuple[int, int, int]],
) -> tuple[int, int, int] | None:
    """First frame at which two markers take each other's place, and the two; none of `done`."""
    rate = recording.marker_rate
    surprise = np.stack([surprise_of(markers[:, i]) for i in range(markers.shape[1])], axis=1)
    allowed = [jump_tolerance(markers[:, i], rate) for i in range(markers.shape[1])]
    jumped = surprise > np.array(allowed)
    # An exchange makes two markers jump in the same frame.
    for frame in np.flatnonzero(jumped.sum(axis=1) >= 2):
        for first, second in combinations(np.flatnonzero(jumped[frame]), 2):
            pair = [first, second]
            # Where both would be if they kept their velocities.
            ahead = 2.0 * markers[frame - 1, pair] - markers[frame - 2, pair]
            crossed = np.linalg.norm(markers[frame, pair[::-1]] - ahead, axis=1)
            change = int(frame), int(first), int(second)
            # after a swap each is where the other was; two spikes do not meet this
            if (crossed < 0.5 * surprise[frame, pair]).all() and change not in done:
                return change
    return _change_over_gap(recording, markers, segments, done)


def _change_over_gap(
    recording: Recording,
    markers: Array,
    segments: Mapping[str, str],
    done: set[tuple[int, int, int]],
) -> tuple[int, int, int] | None:
    """The same for two markers of a segment that vanish together before they change places.

    The vector between two markers of a segment turns little during a short gap, but an exchange
    reverses it.
    """
    names, rate = recording.names, recording.marker_rate
    longest = round(LIMITS["longest_hidden_swap"] * rate)
    seen = seen_frames(markers)
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
            # If the vector is reversed its two values nearly cancel in the sum.
            reversed_ = np.linalg.norm(after + before) < 0.5 * np.linalg.norm(after - before)
            if reversed_ and change not in done:
                return change
    return None


ARMS: Final = frozenset(
    ("torso", *(f"{part}_{side}" for part in ("upper_arm", "forearm") for side in "rl"))
)
"""Segments whose markers no leg needs."""
# How names mark a side, the clearest way first: a whole word, a capital at the beginning of a word,
# a single small letter, a capital at the end.
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
    """The marker among the `names` of a trial at the same place on the other side of the body than
    that of this `name`, from which the side is read; None if there is none.

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


def mirrored_arms(
    recording: Recording, segments: Mapping[str, str], landmarks: Mapping[str, str]
) -> list[tuple[str, str]]:
    """Left and right markers of `ARMS` that have each other's names throughout; which of them is
    which is plain, and no leg needs them.

    `recording` has z up, m; `segments` of the body model are by marker; `landmarks`, see
    `foot_markers`, show where the person faces. Raises RecordError if those of a leg or the pelvis
    are exchanged, so the file may be mirrored, or the direction the person faces is unknown.
    """
    forward = facing(recording, landmarks)
    leftward = np.array([-forward[1], forward[0], 0.0])
    wrong = []
    for name in recording.names:
        partner = opposite_marker(name, recording.names)
        if partner is None or not _is_left(name, partner, landmarks):
            continue
        apart = (recording.marker(name) - recording.marker(partner)) @ leftward
        apart = apart[np.isfinite(apart)]
        # Legs may cross for a moment, but not in the median of all frames; runners and people whose
        # legs scissor land on one line, where markers are a little across it.
        if len(apart) and np.median(apart) < -LIMITS["on_one_line_m"]:
            wrong.append((name, partner))
    if "pelvis" not in {segments.get(left) for left, _ in wrong}:
        wrong = [pair for pair in wrong if not _rigid(recording, pair, segments, wrong)]
    if not {segments.get(name) for pair in wrong for name in pair} <= ARMS:
        pairs = "; ".join(f"{left} and {right}" for left, right in wrong)
        raise RecordError(
            f"{recording.source}: left and right are exchanged for {pairs}: seen in the direction "
            "that the person faces, the markers labelled left are on the right in most frames. "
            "Exchange these labels in the recording program and export the trial again; if all "
            "markers are listed, the file is mirrored: its axes must be right-handed."
        )
    return wrong


def _rigid(
    recording: Recording,
    pair: tuple[str, str],
    segments: Mapping[str, str],
    wrong: Sequence[tuple[str, str]],
) -> bool:
    """Whether a left marker across its partner keeps its distance from those of its own segment
    that are not across theirs, and the partner does not: then the steps are narrow.
    """
    across = {each for both in wrong for each in both}
    away = [
        np.nanstd(np.linalg.norm(recording.marker(one) - recording.marker(other), axis=1))
        for other in set(recording.names) - across
        if segments.get(other, "") == segments.get(pair[0])
        for one in pair
    ]
    own, exchanged = np.array(away).reshape(-1, 2).T
    return bool(len(own)) and bool(np.median(own) < 0.5 * np.median(exchanged))


def _is_left(name: str, partner: str, landmarks: Mapping[str, str]) -> bool:
    """Whether a name is the left one of two: by the landmark that it marks, else by the first
    letter that differs from its `partner`.
    """
    marked = [at[0] for at, marker in landmarks.items() if marker == name and at[1:2] == "."]
    differing = (a for a, b in zip(name, partner, strict=False) if a != b)
    return next(iter((*marked, *differing))) in "Ll"


def undo_exchanges(
    recording: Recording, markers: Array, next_change: Callable[[set[_Exchange]], _Exchange | None]
) -> list[Repair]:
    """Change back what changes places; see `exchanges.exchange_back`.

    Parameters
    ----------
    recording : for names, rate and messages.
    markers : (T, M, 3) m, changed in place; NaN where not seen.
    next_change : the first exchange in `markers` as they are, none of those given.

    Raises
    ------
    RecordError : two markers change places once, near the middle of the trial.
    """
    names = recording.names
    changes: dict[tuple[int, int], list[int]] = {}
    done: set[_Exchange] = set()
    # Each change is undone up to the end of the trial, so a change back shows up as the next one.
    # `done` keeps a pair from being exchanged at the same frame for ever.
    while (change := next_change(done)) is not None:
        done.add(change)
        frame, first, second = change
        _exchange(markers, first, second, frame, len(markers))
        changes.setdefault((first, second), []).append(frame)
    findings = []
    for (first, second), frames in changes.items():
        pair = names[first], names[second]
        # An odd number of changes leaves the two in each other's places at the end of the trial.
        if len(frames) % 2:
            opened = frames.pop()
            tail = len(markers) - opened
            head = opened - (frames[-1] if frames else 0)
            if min(head, tail) > LIMITS["ambiguous_share"] * len(markers):
                time = recording.start + opened / recording.marker_rate
                raise RecordError(
                    f"{recording.source}: markers {pair[0]} and {pair[1]} change places at frame "
                    f"{opened} ({time:.3f} s) and do not change back, so it is unclear whether "
                    "the labels are right before or after it. Correct the labels of the wrong "
                    "part in the recording program, or cut the trial there."
                )
            if tail <= head:
                frames += [opened, len(markers)]
            else:
                begin = frames[-1] if frames else 0
                _exchange(markers, first, second, begin, len(markers))
                # exchanging all the rest leaves only the first part exchanged
                frames = [*frames[:-1], opened] if frames else [0, opened]
        for begin, end in zip(frames[::2], frames[1::2], strict=True):
            findings.append(
                repair(recording, "swap", pair, begin, end, "trajectories exchanged back")
            )
    return findings


def _exchange(markers: Array, first: int, second: int, begin: int, end: int) -> None:
    markers[begin:end, [first, second]] = markers[begin:end, [second, first]]
