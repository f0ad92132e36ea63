"""Compare heel strikes and toe-offs of forces with those of markers."""

from collections.abc import Iterator, Mapping, Sequence
from typing import Final

import numpy as np

from gaitval.coordinates import SIDES, Side
from gaitval.gait.agreement import KINDS, SAME_SECONDS
from gaitval.gait.events import foot_contacts
from gaitval.gait.quality_flags import QualityFlag
from gaitval.mocap.activities import FEET
from gaitval.mocap.recording import Event, EventKind, FootForces, Recording

CLOCKS: Final = "clocks"
STRAY_EVENTS: Final = "events of forces and markers"
LARGEST_STRAY_S: Final = 0.04
"""s. Of one kind, each event of the forces is as late as the median after that of the markers: at
most 0.025 (67 strikes and toe-offs of WBDS01 T01 at 0.49 m/s), and 0.013 in the other recordings
named in `force_checks`."""
FEWEST_EVENTS: Final = 3
LARGEST_DRIFT_S: Final = 0.02
"""s, by which events of the forces may come later and later over a trial, where that is beyond
`CERTAIN_DRIFT` times its standard error: 3 ms in the 30 s of WBDS01 T01."""
CERTAIN_DRIFT: Final = 3.0
BESIDE_GAP_S: Final = 0.1


def contact_warnings(forces: FootForces, shown: Sequence[Event]) -> Iterator[QualityFlag]:
    """Warnings about strikes and toe-offs of the `forces`, at the plates' rate, that stray from
    those `shown` by the markers (`marker_events`): if they come later and later, or earlier, one
    about the clocks; else for the event of each kind that strays most, if by more than
    `LARGEST_STRAY_S`.
    """
    strays: dict[str, list[tuple[Side, float, float]]] = {}
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
        strays[name] = [(side, time, lag - usual) for side, time, lag in late]
    drift = _drift([one for late in strays.values() for one in late])
    if abs(drift) > LARGEST_DRIFT_S:
        way = "later" if drift > 0.0 else "earlier"
        yield QualityFlag(
            CLOCKS, "forces and markers", abs(drift), LARGEST_DRIFT_S, "s",
            f"over the events that both show, the forces come {way} and {way} than the markers, by "
            f"{1000 * abs(drift):.0f} ms at the end: a rate in the file is not that of its clock, "
            "or the clocks are not locked. Correct the rate, or synchronise plates and cameras",
        )  # fmt: skip
        return
    for name, late in strays.items():
        side, time, stray = max(late, key=lambda one: abs(one[2]))
        if abs(stray) > LARGEST_STRAY_S:
            yield QualityFlag(
                STRAY_EVENTS, f"{side} foot", abs(stray), LARGEST_STRAY_S, "s",
                f"by the forces, one of its {name} is at {time:.2f} s, {1000 * abs(stray):.0f} ms "
                f"{'later' if stray > 0 else 'earlier'} than the markers show it, beside the "
                "others: the plate was silent or stuck, or something else was on it",
            )  # fmt: skip


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


def _drift(late: Sequence[tuple[Side, float, float]]) -> float:
    """s, by how much events (side, time, how late) are later at the end than at the beginning, by
    the straight line through them; 0 if that is not certain.
    """
    if len(late) <= 2 * FEWEST_EVENTS:
        return 0.0
    _, times, lags = (np.array(column) for column in zip(*late, strict=True))
    (slope, _), covariance = np.polyfit(times, lags, 1, cov=True)
    certain = abs(slope) > CERTAIN_DRIFT * np.sqrt(covariance[0, 0])
    return float(slope * np.ptp(times)) if certain else 0.0


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
