"""What was found in a recording, and what was done about it."""

import warnings
from collections.abc import Iterable
from dataclasses import dataclass
from typing import Final, Literal

import numpy as np

from gaitval.arrays import Array, Flags
from gaitval.errors import RecordWarning
from gaitval.mocap.recording import Recording

RepairKind = Literal["missing", "gap", "spike", "jump", "lost", "offset", "contact"]
OF_FORCES: Final = ("offset", "contact")
"""Kinds that are found in samples of the forces; the others are in frames of the markers."""


@dataclass(frozen=True)
class Repair:
    """Something found in a recording, and what was done about it.

    Attributes
    ----------
    kind : what it is.
    names : the markers, plates or feet concerned.
    first, last : frames (or force samples) concerned, counted from 0, both included.
    start, end : their times, s, of the recording's clock.
    action : what was done, in words.
    """

    kind: RepairKind
    names: tuple[str, ...]
    first: int
    last: int
    start: float
    end: float
    action: str

    def __str__(self) -> str:
        unit = "sample" if self.kind in OF_FORCES else "frame"
        if self.first == self.last:
            where, when = f"{unit} {self.first}", f"{self.start:.3f} s"
        else:
            where = f"{unit}s {self.first}-{self.last}"
            when = f"{self.start:.3f}-{self.end:.3f} s"
        return f"{self.kind}: {', '.join(self.names)}, {where} ({when}): {self.action}"


def repair(
    recording: Recording, kind: RepairKind, names: Iterable[str], begin: int, end: int, action: str
) -> Repair:
    """A repair of a `kind` in frames of the markers, or in samples of the forces (`OF_FORCES`),
    from `begin`, counted from 0, to the one before `end`, at the times of `recording`. `names` are
    the markers, plates or feet concerned, `action` says in words what was done about it.
    """
    rate = recording.force_rate if kind in OF_FORCES else recording.marker_rate
    first, last = int(begin), int(end) - 1
    start, stop = recording.start + first / rate, recording.start + last / rate
    return Repair(kind, tuple(names), first, last, start, stop, action)


def passed_over(message: str) -> None:
    """Warn of something in a file that could be passed over, as `message` says (RecordWarning)."""
    warnings.warn(message, RecordWarning, stacklevel=3)


def seen_frames(positions: Array) -> Flags:
    """(...) whether all three of `positions` (..., 3) are known: neither NaN nor infinite."""
    return np.asarray(np.isfinite(positions).all(axis=-1))
