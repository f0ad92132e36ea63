"""Compare heel strikes and toe-offs: of forces and of markers, stored in the file and found."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np

from gaitval.coordinates import SIDES
from gaitval.gait.events import foot_contacts
from gaitval.gait.quality_flags import QualityFlag
from gaitval.mocap.recording import Event, EventKind, FootForces

SAME_SECONDS: Final = 0.15
"""s. A stored event is at most this far from the one that was found of the same foot and kind."""
LARGEST_MEAN_S: Final = 0.06
"""s, mean difference; see `plate_contacts.LARGEST_LAG_SECONDS`."""
LARGEST_STRAY_S: Final = 0.04
"""s. Of one kind, each event of the forces is as late as the median after that of the markers: at
most 0.025 (67 strikes and toe-offs of WBDS01 T01 at 0.49 m/s), and 0.013 in the other recordings
named in `force_checks`."""
FEWEST_EVENTS: Final = 3
KINDS: Final[dict[EventKind, str]] = {"heel_strike": "heel strikes", "toe_off": "toe-offs"}


@dataclass(frozen=True)
class StoredEvents:
    """Stored events of one kind, compared with those found.

    Attributes
    ----------
    kind : "heel_strike" or "toe_off".
    stored : number in the file.
    matched : how many of them were found too.
    other_foot : how many lie at an event of the other foot instead.
    mean_s, sd_s : found less stored, s; NaN where none or a single one matches.
    """

    kind: EventKind
    stored: int
    matched: int
    other_foot: int
    mean_s: float
    sd_s: float

    def __str__(self) -> str:
        text = f"{self.matched} of the file's {self.stored} {KINDS[self.kind]} were found"
        if self.matched:
            text += f", {1000 * self.mean_s:+.0f} ms from them on average"
        if self.matched > 1:
            text += f" (SD {1000 * self.sd_s:.0f} ms)"
        if self.other_foot:
            text += f"; {self.other_foot} are at an event of the other foot"
        return text


def stored_events(stored: Sequence[Event], found: Sequence[Event]) -> tuple[StoredEvents, ...]:
    """Compare the events that a file stores with those found in its markers and forces.

    Parameters
    ----------
    stored : events that the file contains.
    found : events of `events.find_events` in the same trial.

    Returns
    -------
    tuple
        One comparison for each kind of event that the file has; empty if it has none.
    """
    compared = []
    for kind in KINDS:
        differences, mine, other_foot = [], [e for e in stored if e.kind == kind], 0
        for event in mine:
            # Signed time to the nearest event found, for either foot; infinite if there is none.
            away = {
                side: min(
                    (e.time - event.time for e in found if (e.side, e.kind) == (side, kind)),
                    key=abs,
                    default=np.inf,
                )
                for side in SIDES
            }
            own = away.pop(event.side)
            (other,) = away.values()
            if abs(own) <= SAME_SECONDS:
                differences.append(own)
            # At an event of the other foot and at none of its own, so the side is wrong.
            elif abs(other) <= SAME_SECONDS:
                other_foot += 1
        if mine:
            compared.append(
                StoredEvents(
                    kind,
                    len(mine),
                    len(differences),
                    other_foot,
                    float(np.mean(differences)) if differences else np.nan,
                    float(np.std(differences, ddof=1)) if len(differences) > 1 else np.nan,
                )
            )
    return tuple(compared)


def event_doubts(compared: Sequence[StoredEvents]) -> Iterator[QualityFlag]:
    """Warnings about the events that a file stores.

    Parameters
    ----------
    compared : of `stored_events`.

    Yields
    ------
    warning
        For a kind of event that is more often at one of the other foot than at one of its own, or
        whose mean difference is above `LARGEST_MEAN_S`.
    """
    for one in compared:
        if one.other_foot > one.matched:
            yield QualityFlag(
                "events of the file", KINDS[one.kind], one.other_foot, one.matched, "events",
                f"{one}: right and left are exchanged in the file's events or in its markers",
            )  # fmt: skip
        elif one.matched and abs(one.mean_s) > LARGEST_MEAN_S:
            yield QualityFlag(
                "events of the file", KINDS[one.kind], abs(one.mean_s), LARGEST_MEAN_S, "s",
                f"{one}: at most {1000 * LARGEST_MEAN_S:.0f} ms is the difference of methods. "
                "Those found are used",
            )  # fmt: skip


def contact_doubts(forces: FootForces, shown: Sequence[Event]) -> Iterator[QualityFlag]:
    """Warnings about strikes and toe-offs of the forces that stray from those of the markers.

    Parameters
    ----------
    forces : on the feet, at the plates' rate.
    shown : events of the markers (`marker_events`).

    Yields
    ------
    warning
        For the event of each kind that strays most, if by more than `LARGEST_STRAY_S`.
    """
    for edge, (kind, name) in enumerate(KINDS.items()):
        late = [
            (event.side, event.time, event.time - nearest)
            for event in _contacts(forces, kind, edge)
            for nearest in [_nearest(event, shown)]
            if abs(event.time - nearest) < SAME_SECONDS
        ]
        if len(late) < FEWEST_EVENTS:
            continue
        # The median lag is the systematic difference of the two methods. Only what one event strays
        # from it is a fault of the plate.
        usual = float(np.median([lag for *_, lag in late]))
        side, time, lag = max(late, key=lambda one: abs(one[2] - usual))
        stray = lag - usual
        if abs(stray) > LARGEST_STRAY_S:
            yield QualityFlag(
                "events of forces and markers", f"{side} foot", abs(stray), LARGEST_STRAY_S, "s",
                f"by the forces, one of its {name} is at {time:.2f} s, {1000 * abs(stray):.0f} ms "
                f"{'later' if stray > 0 else 'earlier'} than the markers show it, beside the "
                "others: the plate was silent or stuck, or something else was on it",
            )  # fmt: skip


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
