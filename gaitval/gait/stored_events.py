"""Compare heel strikes and toe-offs that a file stores with those found."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np

from gaitval.coordinates import SIDES
from gaitval.gait.agreement import KINDS, SAME_SECONDS
from gaitval.gait.quality_flags import QualityFlag
from gaitval.mocap.recording import Event, EventKind

LARGEST_MEAN_S: Final = 0.06
"""s, mean difference; see `plate_contacts.LARGEST_LAG_SECONDS`."""


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


def event_warnings(compared: Sequence[StoredEvents]) -> Iterator[QualityFlag]:
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
