"""Heel strikes and toe-offs of the forces beside those of the markers, and of the file."""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np

from gaitval.coordinates import SIDES, Side
from gaitval.findings.finding import Finding, Seen
from gaitval.gait.agreement import KINDS, SAME_SECONDS
from gaitval.gait.events import foot_contacts
from gaitval.mocap.activities import FEET
from gaitval.mocap.recording import Event, EventKind, FootForces, Recording

FEWEST_EVENTS: Final = 3
BESIDE_GAP_S: Final = 0.1


@dataclass(frozen=True)
class Contacts:
    """The `forces` of a walk at the plates' rate, and the events that its markers show
    (`marker_events`, but for those beside which a marker of the foot is hidden).
    """

    forces: FootForces
    shown: Sequence[Event]

    def late(self) -> dict[str, list[tuple[Side, float, float]]]:
        """For each kind of event its side, its time, and how much later it is by the forces, s,
        than usual. The median lag is the systematic difference of the two methods: only what one
        event strays from it is a fault of the plate.
        """
        found = {}
        for edge, (kind, name) in enumerate(KINDS.items()):
            late = [
                (event.side, event.time, event.time - nearest)
                for event in _contacts(self.forces, kind, edge)
                for nearest in [_nearest(event, self.shown)]
                if abs(event.time - nearest) < SAME_SECONDS
            ]
            if len(late) >= FEWEST_EVENTS:
                usual = float(np.median([lag for *_, lag in late]))
                found[name] = [(side, time, lag - usual) for side, time, lag in late]
        return found


def while_seen(
    events: Sequence[Event], recording: Recording, landmarks: Mapping[str, str]
) -> Iterator[Event]:
    """Those of the `events` by markers beside which no marker of the foot is hidden: a gap begins
    or ends where it does, not where the foot strikes.
    """
    near = round(BESIDE_GAP_S * recording.marker_rate)
    for event in events:
        at = round((event.time - recording.start) * recording.marker_rate)
        names = [landmarks.get(f"{event.side[0].upper()}.{each}") for each in FEET]
        during = slice(max(at - near, 0), at + near + 1)
        paths = [recording.marker(str(name)) for name in names if name in recording.names]
        if all(np.isfinite(path[during]).all() for path in paths if np.isfinite(path).any()):
            yield event


def _stray(of: Contacts) -> Iterator[Seen]:
    """s, of the event of each kind that strays most."""
    for name, late in of.late().items():
        side, time, stray = max(late, key=lambda one: abs(one[2]))
        words = {"name": name, "time": time, "way": "later" if stray > 0 else "earlier"}
        yield Seen(abs(stray), f"{side} foot", words)


def _contacts(forces: FootForces, kind: EventKind, edge: int) -> Iterator[Event]:
    """Where a known force of a foot begins (edge 0) or ends (edge 1)."""
    for column, side in enumerate(SIDES):
        loaded = forces.force[:, column, 2] > 0.0
        for sample in foot_contacts(loaded, rate=forces.rate)[edge]:
            around = slice(max(sample - 1, 0), sample + 1)
            # At an end of the trial the recording was cut, which is no event; and the force must be
            # known on both sides of the edge.
            if 0 < sample < len(loaded) and forces.valid[around, column].all():
                yield Event(float(forces.start + sample / forces.rate), side, kind)


def _nearest(event: Event, among: Sequence[Event]) -> float:
    """Time of the nearest event of the same foot and kind; infinite if there is none."""
    times = [e.time for e in among if (e.side, e.kind) == (event.side, event.kind)]
    return min(times, key=lambda time: abs(time - event.time), default=np.inf)


STRAY_EVENTS: Final[Finding] = Finding(
    name="events of forces and markers",
    needs=Contacts,
    values=_stray,
    limits=0.04,
    unit="s",
    sentence=(
        "by the forces, one of its {name} is at {time:.2f} s, {value:.0f ms} {way} than the "
        "markers show it, beside the others: the plate was silent or stuck, or something else was "
        "on it"
    ),
    source=(
        "at most 0.025 s (67 strikes and toe-offs of WBDS01 T01 at 0.49 m/s), and 0.013 in the "
        "other recordings named in `findings.plates`"
    ),
    # what was lost, not a plate, makes events differ
    hidden_by=("weight", "lost frames"),
)
