"""What was found in a recording, and what was done about it."""

from collections.abc import Iterable
from dataclasses import dataclass
from typing import Literal

import numpy as np

from gaitval.arrays import Array, Flags
from gaitval.mocap.recording import Recording

FindingKind = Literal["missing", "gap", "spike", "swap", "jump", "offset", "contact"]


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


def frame_finding(
    recording: Recording,
    kind: FindingKind,
    names: Iterable[str],
    first: int,
    last: int,
    action: str,
) -> Finding:
    """A finding in frames of the markers.

    Parameters
    ----------
    recording : whose clock and marker rate give the times.
    kind : what was found.
    names : the markers concerned.
    first, last : frames counted from 0, both included.
    action : what was done about it, in words.
    """
    return _finding(recording.start, recording.marker_rate, kind, names, first, last, action)


def sample_finding(
    recording: Recording,
    kind: FindingKind,
    names: Iterable[str],
    begin: int,
    end: int,
    action: str,
) -> Finding:
    """A finding in samples of the forces.

    Parameters
    ----------
    recording : whose clock and force rate give the times.
    kind : what was found.
    names : the plates or feet concerned.
    begin, end : first sample, counted from 0, and the first one after it.
    action : what was done about it, in words.
    """
    last = int(end) - 1
    return _finding(recording.start, recording.force_rate, kind, names, begin, last, action)


def _finding(
    start: float,
    rate: float,
    kind: FindingKind,
    names: Iterable[str],
    first: int,
    last: int,
    action: str,
) -> Finding:
    first, last = int(first), int(last)
    return Finding(
        kind, tuple(names), first, last, start + first / rate, start + last / rate, action
    )


def seen_frames(positions: Array) -> Flags:
    """Where all three coordinates are known.

    Parameters
    ----------
    positions : (..., 3) m.

    Returns
    -------
    array
        (...) True where none of the three is NaN or infinite.
    """
    return np.asarray(np.isfinite(positions).all(axis=-1))
