"""Heel strike and toe-off, from forces and from markers.

From force: the vertical force on the foot crosses the threshold. From markers: a published method
for each kind of event, chosen because the pair agrees best with the plates in two trials (mean
difference in ms, markers minus plates; WBDS01 T01 on a treadmill at 0.49 m/s, 33 strikes and 34
toe-offs, and the walk of Rajagopal et al. 2016 over ground, 3 and 3):

| method                                      | strike: T01, walk | toe-off: T01, walk |
|---------------------------------------------|-------------------|--------------------|
| O'Connor et al. 2007 (Gait & Posture 25:469) | **−4, +17**      | +9, −35            |
| Zeni et al. 2008 (Gait & Posture 27:710)     | −54, −19         | **+14, −18**       |
"""

from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import pairwise
from typing import Final

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import binary_dilation
from scipy.signal import find_peaks

from gaitval.arrays import Array, Flags, runs
from gaitval.configuration import ProcessingSettings
from gaitval.coordinates import SIDES, Side
from gaitval.gait.filters import low_pass, low_pass_simulated
from gaitval.gait.sampling import bridged
from gaitval.mocap.foot_markers import FootMarkers, facing, foot_markers, pelvis_markers
from gaitval.mocap.recording import Event, EventKind, FootForces, Recording


@dataclass(frozen=True)
class EventSettings:
    """What tells heel strikes and toe-offs."""

    foot_cutoff_hz: float = 7.0
    """Low-pass of the markers of foot and pelvis (O'Connor 2007)."""
    low_heel: float = 0.35
    """Fraction of the heel's height range below which it can strike (O'Connor 2007)."""
    smallest_share: float = 0.4
    """A landing has at least this fraction of the median landing's vertical speed; smaller peaks
    belong to the foot's swing."""
    shortest_excursion: float = 0.1
    """m. A foot that moves less than this fore and aft relative to the pelvis is not walking."""
    resting_share: float = 0.15
    """A foot whose speed over ground or belt is below this fraction of its swing's is at rest."""
    largest_correction: float = 0.005
    """s, half a frame of most cameras."""
    shortest_swing: float = 0.1
    """s. A foot that was faster for less than this has not swung."""
    least_prominence: float = 0.05
    """Fraction of the foot's fore-aft excursion by which the foot must be further forward before
    and after a toe-off; so how much of a swing must be visible at the ends of the trial."""
    landing_cutoff_hz: float = 12.0
    """Low-pass of the markers with which a landing that was found is timed: `foot_cutoff_hz`
    smooths the sudden end of its fall into the slow time after it, so that the fastest fall comes
    late."""
    forefoot_cutoff_hz: float = 18.0
    """The same of the forefoot, which comes down faster."""
    stop_after_sink: float = 0.009
    """s from the fastest sinking of the middle of the foot to the sharpest stop of the heel
    (`_timed_landing`); mean of six laboratories, each as heavy."""
    slap_after_sink: float = 0.0085
    """s from it to the fastest sinking of the forefoot; mean of seven laboratories, as the next
    one."""
    lands_before: float = 0.005
    """s from the load on a plate to the mean of the three."""
    largest_stop: float = 0.025
    """s from where the sinking of the middle says up to which the other two count: beyond it, they
    are others. Convention."""
    landing_error: float = 0.015
    """s within which 19 of 20 landings by markers are of those on plates, whose laboratory is left
    out of the means above (`python -m claims elsewhere.strikes`): 133 landings in seven
    laboratories. By the first two alone 0.017, by the sinking of the middle 0.019, at
    `foot_cutoff_hz` 0.028. Plates on which load rises fast show a landing later
    (docs/what-we-tried.md)."""
    near_landing: float = 0.06
    """s within which the faster path falls fastest, of where the slower one does."""
    edge_seconds: float = 0.1
    """s from the end of what markers show in which a filter does not know how the path goes on."""
    approach_seconds: float = 0.2
    """s before a landing in which a foot comes down as it does before another."""
    shortest_stride: float = 0.5
    """s. Two push-offs of a foot are never closer: 240 steps/min is faster than people walk."""
    bounce_seconds: float = 0.05
    """A foot unloaded for less than this has not started its swing."""
    scuff_seconds: float = 0.1
    """A foot loaded for less than this has only brushed the plate; no stance is this short."""
    dragged: float = 0.1
    """A contact with less than this fraction of the largest vertical force is a foot that drags
    over the plate in swing (in spastic gait for longer than a scuff)."""
    same_event_seconds: float = 0.1
    """An event from force and one from markers that are this close are the same event."""
    likely_seconds: float = 0.04
    """An event by markers that is farther from the plates' is no measure of its foot."""


EVENTS: Final = EventSettings()


FOOT_SPREAD: Final[Mapping[EventKind, float]] = {"heel_strike": 0.36, "toe_off": 0.14}
"""Variance of an event by markers about the plates' from step to step, over that of the mean of a
foot from foot to foot: of 46 feet of 23 people in nine laboratories the former have SD of 5.4 ms
(strikes) and 3.8 ms (toe-offs), the latter of 9 and 10 ms, by how a foot lands and where its
markers are."""


def foot_contacts(loaded: Flags, *, rate: float) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """First sample of each contact and first sample after it, (n,) each, from where the force is
    above the threshold, `loaded` (T,), at `rate` Hz.

    Gaps shorter than `EVENTS.bounce_seconds` are closed, then contacts shorter than
    `EVENTS.scuff_seconds` are dropped; at the ends of the trial both may be parts of longer ones,
    and are kept.
    """
    return runs(on_ground(loaded, rate=rate, scuff_s=EVENTS.scuff_seconds)[0])


def on_ground(loaded: Flags, *, rate: float, scuff_s: float) -> tuple[Flags, int]:
    """When a foot is on the ground, (T,), with bounces closed, then scuffs dropped, and the number
    of scuffs.

    Of where the force is above the threshold, `loaded` (T,) at `rate` Hz, gaps shorter than
    `EVENTS.bounce_seconds` are bounces, and contacts shorter than `scuff_s` (s) scuffs. At the ends
    of a trial or a simulation a gap or a contact may be part of a longer one, and is kept.
    """
    on = loaded.copy()
    scuffs = 0
    # Bounces first: a stance that a bounce interrupts would otherwise look like two short contacts,
    # and both could be dropped as scuffs.
    for state, shortest in ((False, EVENTS.bounce_seconds), (True, scuff_s)):
        for begin, end in zip(*runs(on == state), strict=True):
            if begin > 0 and end < len(on) and end - begin < shortest * rate:
                on[begin:end] = not state
                scuffs += state
    return on, scuffs


def force_events(forces: FootForces, processing: ProcessingSettings) -> tuple[Event, ...]:
    """Heel strikes and toe-offs of both feet from the vertical force, in order of time, s on the
    recording's clock.

    The time is that of the crossing of the `force_threshold_n` (N) of `processing`, on the line
    through the two nearest samples above it. Contacts that the plates show only in part (`valid` is
    False at one of their samples) give no events, nor do those of a foot that is `EVENTS.dragged`.
    `forces` are filtered at `force_cutoff_hz`; at a lower cut-off the strike comes early.
    """
    events = []
    threshold, rate = processing.force_threshold_n, forces.rate
    least = EVENTS.dragged * forces.force[..., 2].max(initial=0.0)
    for column, side in enumerate(SIDES):
        vertical = forces.force[:, column, 2]
        for begin, end in zip(*foot_contacts(vertical > threshold, rate=rate), strict=True):
            if not forces.valid[begin:end, column].all() or vertical[begin:end].max() < least:
                continue
            # Kind, outermost loaded sample, direction into the contact (+1 or −1), and the number
            # of samples outside the contact on that side.
            edges: list[tuple[EventKind, int, int, int]] = [
                ("heel_strike", begin, 1, begin),
                ("toe_off", end - 1, -1, len(vertical) - end),
            ]
            for kind, sample, inward, before in edges:
                if before == 0:
                    continue  # the trial begins or ends on the ground
                # The line through the two outermost loaded samples falls to the threshold `share`
                # of a sample outside them: at most one sample, because the next one is below the
                # threshold.
                rise = vertical[sample + inward] - vertical[sample]
                excess = vertical[sample] - threshold
                share = 1.0 if rise <= 0.0 else min(1.0, excess / rise)
                time = forces.start + (sample - inward * share) / rate
                events.append(Event(float(time), side, kind))
    return tuple(sorted(events, key=lambda event: event.time))


def marker_events(recording: Recording, *, landmarks: Mapping[str, str]) -> tuple[Event, ...]:
    """Heel strikes and toe-offs of both feet from the markers of feet and pelvis, in order of time,
    s on the recording's clock.

    Toe-off is when the forefoot is farthest behind the pelvis (Zeni et al. 2008), up to
    `EVENTS.largest_correction` nearer to the mean with two other methods (`_other_methods`). Heel
    strike is when the middle of heel and forefoot sinks fastest, between two toe-offs and with the
    heel in the lowest 35 % of its height range (O'Connor et al. 2007). A foot that does not land
    so, but flat or on its toes, lands when at least two of three other methods say so. A person who
    does not walk has no events.

    `recording` has z up, m; `landmarks`: see `foot_markers`, and of the pelvis `R.ASIS`, `L.ASIS`,
    `R.PSIS`, `L.PSIS` or `Sacrum`. Raises RecordError if a foot or the pelvis has no markers, or
    the trial is too short.
    """
    pelvis = pelvis_markers(recording, landmarks)
    forward = facing(recording, landmarks)
    events = []
    for side, foot in foot_markers(recording, landmarks).items():
        events += _foot_events(recording, side, foot, pelvis, forward)
    return tuple(sorted(events, key=lambda event: event.time))


def _foot_events(
    recording: Recording, side: Side, foot: FootMarkers, pelvis: Array, forward: Array
) -> list[Event]:
    rate, time = recording.marker_rate, recording.time
    heights = foot.heel[:, 2], foot.front[:, 2]
    along = foot.heel @ forward, foot.front @ forward
    columns = np.stack([*heights, *along, (foot.front - pelvis) @ forward], axis=1)
    known = np.asarray(np.isfinite(columns).all(axis=1))
    if known.sum() < 2:
        return []
    # gaps are bridged for the filter, and events in them are dropped below
    paths = low_pass(bridged(columns, known), rate=rate, cutoff_hz=EVENTS.foot_cutoff_hz).T
    heel, front, *_, ahead = paths
    excursion = float(np.ptp(ahead))
    if excursion < EVENTS.shortest_excursion:
        return []
    apart = max(1, int(EVENTS.shortest_stride * rate))
    offs, _ = find_peaks(-ahead, prominence=EVENTS.least_prominence * excursion, distance=apart)
    # A dip of the path while the foot is in the forward half of its excursion is no push-off.
    offs = offs[ahead[offs] < ahead.min() + 0.5 * excursion]
    # Vertical velocity of the middle of the foot, m/s, negative downwards: a landing is a minimum.
    speed = np.gradient(0.5 * (heel + front)) * rate
    sinks, _ = find_peaks(-speed)
    sinks = sinks[
        (heel[sinks] < heel.min() + EVENTS.low_heel * np.ptp(heel)) & (speed[sinks] < 0.0)
    ]
    # one landing between two toe-offs, the fastest
    swings = [*pairwise(np.concatenate(([0], offs, [len(time)])).tolist())]
    inside = [sinks[(sinks >= begin) & (sinks < end)] for begin, end in swings]
    fastest = [int(each[np.argmin(speed[each])]) if len(each) else None for each in inside]
    typical = np.median([speed[each] for each in fastest if each is not None] or [0.0])
    # Both sides are negative, so `<` keeps the landings that sink faster.
    heel_first = [
        each if each is not None and speed[each] < EVENTS.smallest_share * typical else None
        for each in fastest
    ]
    others = _other_methods(paths, rate, apart)
    landings: list[float] = []
    both = bridged(columns[:, :2], known)
    middle = both.mean(axis=1)
    cutoff = min(EVENTS.landing_cutoff_hz, 0.4 * rate)
    pair = np.stack([both[:, 0], middle], axis=1)
    low_heel, low = low_pass(pair, rate=rate, cutoff_hz=cutoff).T
    cutoff = min(EVENTS.forefoot_cutoff_hz, 0.4 * rate)
    toes = low_pass(both[:, 1:], rate=rate, cutoff_hz=cutoff)[:, 0]
    sinking_at = [each for each in heel_first if each is not None]
    sunk = [_timed_landing(low_heel, low, toes, each, rate) for each in sinking_at]
    timed = dict(zip(sinking_at, sunk, strict=True))
    for sinking, swing in zip(heel_first, swings, strict=True):
        agreed = _agreed(others["heel_strike"], *swing, rate)
        at = None if sinking is None else timed[sinking]
        # A heel that comes down later, in stance, is no landing.
        late = at is None or (agreed is not None and at - agreed > EVENTS.same_event_seconds * rate)
        landings += [each for each in (agreed if late else at,) if each is not None]
    last = int(np.flatnonzero(known)[-1])
    landings = _edge_landings(landings, sunk, middle, last, rate)
    # Beside a gap the filter shows the bridge's bend; after the last frame landings were judged.
    near = binary_dilation(~known[: last + 1], iterations=max(1, round(EVENTS.edge_seconds * rate)))
    found_at: dict[EventKind, list[float]] = {
        "toe_off": [_mean_of_near(_vertex(ahead, at), others["toe_off"], rate) for at in offs],
        "heel_strike": landings,
    }
    return [
        Event(float(time[0] + at / rate), side, kind)
        for kind, frames in found_at.items()
        for at in frames
        if known[round(at)] and not near[round(at)]
    ]


def _timed_landing(heel: Array, middle: Array, front: Array, sink: int, rate: float) -> float:
    """The frame near `sink` at which a foot lands, by the heights (T,) of its heel and of the
    middle of heel and forefoot, low-passed at `EVENTS.landing_cutoff_hz`, and of the forefoot
    (`front`), at `EVENTS.forefoot_cutoff_hz`.

    The mean of three: where the middle sinks fastest (O'Connor et al. 2007), where the heel stops
    most sharply, its largest acceleration upwards (Hreljac & Marshall 2000, J Biomech 33:783), and
    where the forefoot sinks fastest. Where one is early in a laboratory's shoes and markers another
    is late.
    """
    near = max(1, round(EVENTS.near_landing * rate))

    def least(values: Array, at: float) -> float:
        begin, end = max(1, round(at) - near), min(round(at) + near + 1, len(values) - 1)
        return _vertex(values, begin + int(np.argmin(values[begin:end])))

    sinks = least(np.gradient(middle), sink)
    others = (
        (-np.gradient(np.gradient(heel)), EVENTS.stop_after_sink),
        (np.gradient(front), EVENTS.slap_after_sink),
    )
    beyond = [(least(values, sinks) - sinks) / rate - after for values, after in others]
    later = (
        float(np.clip(beyond, -EVENTS.largest_stop, EVENTS.largest_stop).sum()) / 3.0
        - EVENTS.lands_before
    )
    return float(np.clip(sinks + later * rate, 0.0, len(middle) - 1.0))


def _edge_landings(
    landings: Sequence[float], sunk: Sequence[float], height: Array, end: int, rate: float
) -> list[float]:
    """The frames of `landings`; of one within `EVENTS.edge_seconds` of the frame `end`, the last
    that is known, where the `height` (T,) of the middle of the foot came down until then as it did
    before the landings `sunk`, in the mean over these.

    A foot whose markers are lost while it swings falls fastest at their end. It has not landed:
    before its other landings it came down so more than `EVENTS.landing_error` earlier, and the
    landing is left out.
    """
    inside = [
        at
        for at in sunk
        if end - at > EVENTS.edge_seconds * rate
        and at > (EVENTS.approach_seconds + EVENTS.near_landing) * rate
    ]
    found = []
    for at in landings:
        if not inside or end - at > EVENTS.edge_seconds * rate:
            found.append(at)
            continue
        placed = float(np.mean([_as_before(height, each, at, end, rate) for each in inside]))
        if placed <= end + EVENTS.landing_error * rate:
            found.append(min(placed, float(end)))
    return found


def _as_before(height: Array, landing: float, near: float, end: int, rate: float) -> float:
    """The frame from which back the `height` (T,), known up to the frame `end`, goes down as it
    does before a `landing`: from `EVENTS.near_landing` before `near` to `EVENTS.approach_seconds`
    after the end.
    """
    frames = np.arange(len(height))
    shown = np.arange(int(near - EVENTS.approach_seconds * rate), end + 1)
    tried = np.arange(near - EVENTS.near_landing * rate, end + EVENTS.approach_seconds * rate, 0.1)

    def differs(at: float) -> float:
        before = np.interp(landing + shown - at, frames, height)
        return float(np.var(height[shown] - before))

    return float(tried[np.argmin([differs(at) for at in tried])])


def _other_methods(paths: Array, rate: float, apart: int) -> dict[EventKind, tuple[Array, ...]]:
    """Frames at which a foot lands and leaves by other methods, which need no heel to land on.

    Zeni et al. 2008, of landings: the foot is farthest ahead of the pelvis. High-pass (Desailly et
    al. 2009, Gait & Posture 29:76): farthest ahead of, or behind, its own path below half the
    stride's frequency. Foot velocity (Ghoussayni et al. 2004, Gait & Posture 20:266): heel or
    forefoot comes to rest on the ground or belt, below `EVENTS.resting_share` of its speed in
    swing; the forefoot moves again.
    """
    heel, front, heel_at, front_at, ahead = paths

    def farthest(path: Array) -> Array:
        least = EVENTS.least_prominence * np.ptp(path)
        return np.asarray(find_peaks(path, prominence=least, distance=apart)[0])

    pushes = farthest(-ahead)
    stride = np.median(np.diff(pushes)) / rate if len(pushes) > 1 else 1.0
    swung = front_at - low_pass_simulated(front_at, step=1.0 / rate, frequency=0.5 / stride)
    low = front < np.percentile(front, 20.0) + 0.03
    belt = np.median(np.gradient(front_at)[low]) * rate
    along = [np.gradient(path) * rate - belt for path in (heel_at, front_at)]
    up = [np.gradient(path) * rate for path in (heel, front)]
    speeds = [np.hypot(x, z) for x, z in zip(along, up, strict=True)]
    resting = EVENTS.resting_share * np.percentile(np.abs(along[1]), 90.0)
    (_, rests), (moves, _) = (
        (begins[long], ends[long])
        for begins, ends in (runs(np.minimum(*speeds) > resting), runs(speeds[1] > resting))
        for long in [ends - begins >= EVENTS.shortest_swing * rate]
    )
    rested = np.array(rests[rests < len(front)], dtype=float)
    moved = np.array(moves[moves > 0], dtype=float)
    return {
        "heel_strike": (farthest(ahead), farthest(swung), rested),
        "toe_off": (farthest(-swung), moved),
    }


def _mean_of_near(at: float, methods: Sequence[Array], rate: float) -> float:
    """A frame, up to `EVENTS.largest_correction` nearer to its mean with those of other methods.

    Alone, Zeni's toe-off is 22 ms late in a child with equinus, where foot velocity is 2; but in
    the walk of Rajagopal et al. 2016 it is 19 ms early, and foot velocity earlier still.
    """
    near = [found[np.argmin(np.abs(found - at))] for found in methods if len(found)]
    near = [frame for frame in near if abs(frame - at) < EVENTS.same_event_seconds * rate]
    most = EVENTS.largest_correction * rate
    return at + float(np.clip(np.mean([at, *near]) - at, -most, most))


def _agreed(methods: Sequence[Array], begin: int, end: int, rate: float) -> float | None:
    """Frame of the landing between two toe-offs on which most methods agree; None if they do not.

    It is the median of the methods' nearest frames to their common median.
    """
    inside = [found[(found >= begin) & (found < end)] for found in methods]
    all_found = np.concatenate(inside)
    if not len(all_found):
        return None
    middle = np.median(all_found)
    near = [found[np.argmin(np.abs(found - middle))] for found in inside if len(found)]
    near = [
        frame for frame in near if abs(frame - np.median(near)) < EVENTS.same_event_seconds * rate
    ]
    return float(np.median(near)) if len(near) > 1 else None


def _vertex(values: Array, sample: int) -> float:
    """Position of an extremum between samples: the vertex of the parabola through three samples."""
    before, here, after = values[sample - 1 : sample + 2]
    curvature = before - 2.0 * here + after
    # y(x) = y₀ + b x + ½ c x², with central difference b and second difference c, has its vertex
    # at x = −b / c.
    return sample + (0.5 * (before - after) / curvature if curvature else 0.0)


def marker_stance(recording: Recording, *, landmarks: Mapping[str, str]) -> Flags:
    """Whether each foot is on the ground at each marker frame, (T, 2), right foot first, by
    `marker_events` of `recording` and `landmarks`, as which it raises RecordError; a foot without
    events is on the ground throughout.
    """
    stance = np.ones((len(recording.markers), 2), dtype=bool)
    events = marker_events(recording, landmarks=landmarks)
    for column, side in enumerate(SIDES):
        mine = [event for event in events if event.side == side]
        for number, event in enumerate(mine):
            if event.kind == "toe_off":
                stance[recording.time > event.time, column] = False
            else:
                # The first event is a strike, so the foot was in the air before it.
                if number == 0:
                    stance[:, column] = False
                stance[recording.time >= event.time, column] = True
    return stance


def find_events(
    recording: Recording,
    forces: FootForces | None,
    processing: ProcessingSettings,
    *,
    landmarks: Mapping[str, str],
) -> tuple[Event, ...]:
    """All events of both feet, in order of time, s on the recording's clock: from force if
    possible, else from markers.

    An event from force replaces one from markers of the same foot and kind if they are close, or if
    no event of the other kind lies between them. Other events by markers are moved by what those of
    their foot and kind are off the plates' (`_as_on_plates`): a cycle that begins on a plate and
    ends beside it would else be too long or short, and its curves would not close. Where an event
    is still missing between two of one kind, the file's own is taken. `recording` is cleaned, z up,
    m; `forces` are those of `assign_forces` at `force_cutoff_hz`, None without plates; `processing`
    is as for `force_events`, `landmarks` for `foot_markers`. Raises RecordError as `marker_events`.
    """
    from_force = set(force_events(forces, processing)) if forces is not None else set()
    from_markers = _as_on_plates(marker_events(recording, landmarks=landmarks), from_force)
    events = sorted(from_force.union(from_markers), key=lambda event: event.time)
    kept = []
    for side in SIDES:
        mine = [event for event in events if event.side == side]
        shown = {
            kind: np.array([e.time for e in mine if e.kind == kind and e in from_force])
            for kind in ("heel_strike", "toe_off")
        }
        for number, event in enumerate(mine):
            # strikes and toe-offs alternate: a second one next to one from force is wrong
            beside = mine[max(number - 1, 0) : number] + mine[number + 1 : number + 2]
            doubled = any(e.kind == event.kind and e in from_force for e in beside)
            near = (np.abs(shown[event.kind] - event.time) < EVENTS.same_event_seconds).any()
            if event in from_force or not (doubled or near):
                kept.append(event)
        kept += _filling([event for event in kept if event.side == side], recording.events)
    return tuple(sorted(kept, key=lambda event: event.time))


def _as_on_plates(events: Sequence[Event], on_plates: Collection[Event]) -> list[Event]:
    """Events by markers, each moved by the mean by which those of its foot and kind differ from
    the ones `on_plates`, as far as `FOOT_SPREAD` lets expect it of steps that no plate shows.
    """
    shifts: dict[tuple[Side, EventKind], float] = {}
    for kind in ("heel_strike", "toe_off"):
        for side in SIDES:
            shown = [e.time for e in on_plates if (e.side, e.kind) == (side, kind)]
            seen = np.array([e.time for e in events if (e.side, e.kind) == (side, kind)])
            off = [time - seen[np.argmin(np.abs(seen - time))] for time in shown if len(seen)]
            off = [each for each in off if abs(each) < EVENTS.likely_seconds]
            if off:
                shifts[side, kind] = float(np.sum(off) / (len(off) + FOOT_SPREAD[kind]))
    return [
        replace(event, time=event.time + shifts.get((event.side, event.kind), 0.0))
        for event in events
    ]


def _filling(found: Sequence[Event], stored: Sequence[Event]) -> list[Event]:
    """The file's events of a foot where two found of one kind follow each other, and one of the
    other kind must have been between.
    """
    filling: list[Event] = []
    for before, after in pairwise(sorted(found, key=lambda event: event.time)):
        between = [
            event
            for event in stored
            if event.side == before.side and event.kind != before.kind == after.kind
            if before.time < event.time < after.time
        ]
        filling += between if len(between) == 1 else []
    return filling
