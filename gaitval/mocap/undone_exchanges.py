"""Markers that change places within a trial, changed back."""

from collections.abc import Callable
from typing import Final

from gaitval.arrays import Array
from gaitval.errors import RecordError
from gaitval.mocap.findings import Finding, finding
from gaitval.mocap.recording import Recording

_Exchange = tuple[int, int, int]
"""First frame of an exchange, and the columns of the two markers."""

AMBIGUOUS_SHARE: Final = 0.25
"""Share of a trial. Two markers that change places once are corrected if the shorter part is less
than this; otherwise it is unclear which part is right."""


def undo_exchanges(
    recording: Recording, markers: Array, next_change: Callable[[set[_Exchange]], _Exchange | None]
) -> list[Finding]:
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
            if min(head, tail) > AMBIGUOUS_SHARE * len(markers):
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
                finding(recording, "swap", pair, begin, end, "trajectories exchanged back")
            )
    return findings


def _exchange(markers: Array, first: int, second: int, begin: int, end: int) -> None:
    markers[begin:end, [first, second]] = markers[begin:end, [second, first]]
