"""Compare heel strikes and toe-offs of forces with those of markers."""

from collections.abc import Iterator, Sequence
from typing import Final

import numpy as np

from gaitval.coordinates import SIDES
from gaitval.gait.agreement import KINDS, SAME_SECONDS
from gaitval.gait.events import foot_contacts
from gaitval.gait.quality_flags import QualityFlag
from gaitval.mocap.recording import Event, EventKind, FootForces

LARGEST_STRAY_S: Final = 0.04
"""s. Of one kind, each event of the forces is as late as the median after that of the markers: at
most 0.025 (67 strikes and toe-offs of WBDS01 T01 at 0.49 m/s), and 0.013 in the other recordings
named in `force_checks`."""
FEWEST_EVENTS: Final = 3


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
