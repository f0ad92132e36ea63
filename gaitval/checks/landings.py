"""When each foot lands and leaves by every method, and what all plates carry together.

Force plates, markers and the file itself may each say when a foot lands. `landings` has them side
by side, `disagreements` says where they are apart, and `landings_picture` draws it. Two feet on one
plate have forces that cannot be divided, but their sum is measured: `Landings.total` keeps it.

Axes: the project's (REP-103, z up). Forces act on the person.
"""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from itertools import combinations, pairwise
from typing import Final, Literal, NamedTuple

import numpy as np
from scipy.ndimage import binary_erosion

from gaitval.arrays import Array, Flags
from gaitval.checks.event_checks import LARGEST_STRAY_S
from gaitval.configuration import ProcessingSettings
from gaitval.constants import GRAVITY
from gaitval.coordinates import SIDES, Side
from gaitval.gait.agreement import SAME_SECONDS
from gaitval.gait.events import force_events, marker_events
from gaitval.gait.feet_on_plates import (
    SETTLING_SECONDS,
    Feet,
    feet_of,
    over_plate,
    shared_by_both,
)
from gaitval.gait.foot_forces import assign_forces
from gaitval.gait.plate_contacts import EDGE_M
from gaitval.gait.plate_offset import zero_plates
from gaitval.mocap.recording import Event, EventKind, FootForces, Recording

_Method = Literal["plates", "markers", "file"]
METHODS: Final[tuple[_Method, ...]] = ("plates", "markers", "file")


class Disagreement(NamedTuple):
    """An event about which two methods are more than 40 ms apart, or that one of them lacks.

    Attributes
    ----------
    time : s, of the event by the `first` method.
    late : s, by how much later it is by the `second`; NaN where that has none within 0.15 s.
    """

    side: Side
    kind: EventKind
    time: float
    first: _Method
    second: _Method
    late: float

    def __str__(self) -> str:
        what = {"heel_strike": "lands", "toe_off": "leaves"}[self.kind]
        message = f"{self.side} foot {what} at {self.time:.2f} s by the {self.first}"
        if np.isnan(self.late):
            return f"{message}; the {self.second} show{'s' * (self.second == 'file')} nothing there"
        when = "later" if self.late > 0.0 else "earlier"
        return f"{message}, {1000.0 * abs(self.late):.0f} ms {when} by the {self.second}"


@dataclass(frozen=True)
class Landings:
    """Events of a walking trial by every method; T samples of the forces.

    Attributes
    ----------
    recording : cleaned, zeroed, in the project's axes.
    events : by method; without those that the trial does not have.
    time : (T,) s.
    total : (T, 3) N, sum over all plates.
    complete : (T,) whether every foot on the ground is on plates, both on one or not, so that
        `total` is all that the ground does to the person. Where a plate's place is unknown: whether
        the plates show at least four fifths of the stance of every foot on the ground.
    shared : (T,) whether both feet are on one plate.
    """

    recording: Recording
    events: Mapping[_Method, tuple[Event, ...]]
    time: Array
    total: Array
    complete: Flags
    shared: Flags

    def carried(self) -> tuple[float, ...]:
        """kg that the plates carry, for each stride of which they have all: its mean vertical force
        is the body's weight, however the feet share the plates.
        """
        found = []
        for side in SIDES:
            strikes = [
                each.time
                for each in self.events["markers"]
                if (each.side, each.kind) == (side, "heel_strike")
            ]
            for begin, end in pairwise(strikes):
                stride = (self.time >= begin) & (self.time < end)
                if stride.any() and self.complete[stride].all():
                    found.append(float(self.total[stride, 2].mean()) / GRAVITY)
        return tuple(found)


def landings(
    recording: Recording, landmarks: Mapping[str, str], processing: ProcessingSettings
) -> Landings:
    """The events of a walking trial by every method that it has. `recording` is cleaned, in the
    project's axes; `landmarks` are as in `foot_markers`; `processing` has thresholds and filters of
    an import. Raises RecordError as `marker_events` and `assign_forces`.
    """
    events: dict[_Method, tuple[Event, ...]] = {}
    count = len(recording.force_time) if recording.plates else 0
    time, total = np.zeros(count), np.zeros((count, 3))
    complete, shared = np.zeros(count, dtype=bool), np.zeros(count, dtype=bool)
    if recording.plates:
        recording, _ = zero_plates(recording, landmarks=landmarks)
        forces, _ = assign_forces(recording, processing, landmarks=landmarks)
        events["plates"] = force_events(forces, processing)
        time = recording.force_time
        total = np.sum([plate.force for plate in recording.plates], axis=0)
        feet = feet_of(recording, landmarks)
        placed = all(np.isfinite(plate.corners).all() for plate in recording.plates)
        complete = all_on_plates(recording, feet) if placed else all_shown(forces, feet)
        shared = np.any(
            [shared_by_both(each, feet, recording.force_rate) for each in recording.plates], axis=0
        )
    events["markers"] = marker_events(recording, landmarks=landmarks)
    if recording.events:
        events["file"] = tuple(recording.events)
    return Landings(recording, events, time, total, complete, shared)


def all_on_plates(recording: Recording, feet: Feet) -> Flags:
    """(T,) whether every point of a foot that is on the ground is over a plate, or within 2 cm of
    one, and so for 60 ms before and after, as events of markers are not exact.
    """
    if not all(np.isfinite(plate.corners).all() for plate in recording.plates):
        return np.zeros(len(feet.stance), dtype=bool)
    good = np.ones(len(feet.stance), dtype=bool)
    for column, outline in enumerate(feet.outlines):
        on_any = np.any(
            [over_plate(plate, outline, margin=EDGE_M) for plate in recording.plates], axis=0
        )
        low = feet.low[column]
        good &= ~feet.stance[:, column] | (low.any(axis=1) & ~(low & ~on_any).any(axis=1))
    reach = round(SETTLING_SECONDS * recording.force_rate)
    return np.asarray(binary_erosion(good, iterations=max(reach, 1), border_value=1))


def all_shown(forces: FootForces, feet: Feet) -> Flags:
    """(T,) whether the `forces` of each of the `feet` that is on the ground are known, which plates
    without corners may say too; but not that no part of the foot is beside them.
    """
    return np.asarray((forces.valid | ~feet.stance).all(axis=1))


def disagreements(found: Landings) -> Iterator[Disagreement]:
    """Where two methods are more than 40 ms apart about an event, in the order of METHODS and time.

    Plates show only some steps, so what they lack is none; what the markers lack is.
    """
    there = [method for method in METHODS if method in found.events]
    for first, second in combinations(there, 2):
        yield from _apart(found, first, second)
        if first != "plates":
            yield from (each for each in _apart(found, second, first) if np.isnan(each.late))


def _apart(found: Landings, first: _Method, second: _Method) -> Iterator[Disagreement]:
    for event in sorted(found.events[first], key=lambda each: each.time):
        late = _late(event, found.events[second])
        if abs(late) > SAME_SECONDS:
            late = np.nan
        if not abs(late) <= LARGEST_STRAY_S:
            yield Disagreement(event.side, event.kind, event.time, first, second, late)


def _late(event: Event, among: Sequence[Event]) -> float:
    times = [e.time - event.time for e in among if (e.side, e.kind) == (event.side, event.kind)]
    return min(times, key=abs, default=np.inf)
