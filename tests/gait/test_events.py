"""Heel strikes and toe-offs from force and from markers."""

from dataclasses import replace
from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest
from synthetic_recording import (
    BELTS,
    LANDMARKS,
    SPEED,
    STANCE,
    STRIDE,
    Y_UP,
    Rectangle,
    strikes,
    toe_offs,
    walk,
)

from gaitval.configuration import ProcessingSettings
from gaitval.coordinates import SIDES, Side
from gaitval.gait.events import (
    EVENTS,
    FOOT_SPREAD,
    _as_on_plates,
    _edge_landings,
    _filling,
    _timed_landing,
    find_events,
    foot_contacts,
    force_events,
    marker_events,
    marker_stance,
    on_ground,
)
from gaitval.gait.foot_forces import assign_forces
from gaitval.gait.plate_offset import zero_plates
from gaitval.mocap.c3d import read_c3d
from gaitval.mocap.reading import read_recording
from gaitval.mocap.recording import Event, EventKind, FootForces, Recording

PROCESSING = ProcessingSettings()
KINDS: tuple[EventKind, ...] = ("heel_strike", "toe_off")


def of(events: tuple[Event, ...], side: Side, kind: EventKind) -> np.ndarray:
    return np.array([event.time for event in events if (event.side, event.kind) == (side, kind)])


def true_events(side: Side, kind: EventKind, duration: float) -> np.ndarray:
    return strikes(side, duration) if kind == "heel_strike" else toe_offs(side, duration)


def foot_forces(vertical: np.ndarray, *, rate: float = 1000.0) -> FootForces:
    """Only the right foot is loaded."""
    force = np.zeros((len(vertical), 2, 3))
    force[:, 0, 2] = np.where(vertical > PROCESSING.force_threshold_n, vertical, 0.0)
    nothing = np.zeros_like(force)
    return FootForces(rate, 5.0, force, nothing, nothing, np.ones((len(vertical), 2), dtype=bool))


def differences(found: np.ndarray, expected: np.ndarray) -> np.ndarray:
    """ms, from each expected event to the one found; none may be missing or too many."""
    assert len(found) == len(expected)
    return 1000.0 * (found - expected)


# -- from force -----------------------------------------------------------------------------------


@pytest.mark.parametrize("rate", [100.0, 1000.0])
def test_the_crossing_of_the_threshold_is_found_between_samples(rate: float) -> None:
    time = np.arange(0.0, 2.0, 1.0 / rate)
    # 1 N per ms from 0.5043 s on: 20 N at 0.5243 s; back the same way, 20 N at 1.2777 s
    vertical = np.clip(1000.0 * np.minimum(time - 0.5043, 1.2977 - time), 0.0, 400.0)
    events = force_events(foot_forces(vertical, rate=rate), PROCESSING)
    assert [(event.side, event.kind) for event in events] == [
        ("right", "heel_strike"),
        ("right", "toe_off"),
    ]
    # the clock of the trial begins at 5 s
    assert [event.time for event in events] == pytest.approx([5.5243, 6.2777], abs=1e-9)


@pytest.mark.parametrize("comes_down", [True, False])
def test_a_foot_that_lands_on_its_toes_lands(comes_down: bool) -> None:
    """Equinus: the heel is high when the foot lands, and comes down in stance, or never does."""
    normal = walk(6.0)
    strides = (normal.time - 0.3) / STRIDE
    phase = strides - np.floor(strides)
    down = np.clip(np.minimum((phase - 0.15) / 0.15, (0.55 - phase) / 0.1), 0.0, 1.0)
    heel = normal.names.index("R.Heel")
    markers = normal.markers.copy()
    lift = markers[:, heel, 2] - markers[:, heel, 2].min()
    markers[:, heel, 2] = 0.05 + 0.5 * lift + 0.06 * (1.0 - down * comes_down)
    equinus = normal.with_markers(normal.names, markers)
    found = of(marker_events(equinus, landmarks=LANDMARKS), "right", "heel_strike")
    off = differences(found, strikes("right", 6.0))
    assert np.abs(off).max() < 60.0
    left = of(marker_events(equinus, landmarks=LANDMARKS), "left", "heel_strike")
    assert np.array_equal(
        left, of(marker_events(normal, landmarks=LANDMARKS), "left", "heel_strike")
    )


def test_an_event_that_markers_lack_is_taken_from_the_file() -> None:
    recording = walk(4.0)
    shown = marker_events(recording, landmarks=LANDMARKS)
    lost = [event for event in shown if (event.side, event.kind) == ("right", "toe_off")][1]
    left_out = tuple(event for event in shown if event is not lost)
    file = (replace(lost, time=lost.time + 0.01), Event(lost.time, "left", "toe_off"))
    assert _filling([e for e in left_out if e.side == "right"], file) == [file[0]]
    assert _filling([e for e in shown if e.side == "right"], file) == []


def test_a_foot_that_drags_over_the_plate_in_swing_has_no_events() -> None:
    vertical = np.zeros(2000)
    vertical[500:1100] = 700.0
    alone = force_events(foot_forces(vertical), PROCESSING)
    vertical[1400:1600] = 44.0  # longer than a brush
    assert force_events(foot_forces(vertical), PROCESSING) == alone
    assert len(alone) == 2


def test_a_trial_that_begins_and_ends_on_the_ground_has_no_events_there() -> None:
    assert force_events(foot_forces(np.full(1000, 500.0)), PROCESSING) == ()


def test_contacts_that_the_plates_do_not_show_whole_give_no_events() -> None:
    vertical = np.zeros(2000)
    vertical[500:1100] = 400.0
    forces = foot_forces(vertical)
    forces.valid[800, 0] = False
    assert force_events(forces, PROCESSING) == ()


def test_events_of_a_walk_on_plates_are_within_two_milliseconds() -> None:
    recording = walk(belt=SPEED, plates=BELTS)
    forces, _ = assign_forces(recording, PROCESSING, landmarks=LANDMARKS)
    events = force_events(forces, PROCESSING)
    for side in SIDES:
        for kind in KINDS:
            missed = differences(of(events, side, kind), true_events(side, kind, 6.0))
            # 20 of 700 N are passed 1 ms within the contact; the low-pass rounds the corner
            assert np.abs(missed).max() < 3.0


# -- from markers ---------------------------------------------------------------------------------


@pytest.mark.parametrize("belt", [0.0, SPEED])
@pytest.mark.parametrize("backwards", [False, True])
def test_markers_give_every_event_once_on_belt_and_ground_either_way(
    belt: float, backwards: bool
) -> None:
    recording = walk(belt=belt)
    if backwards:
        turned = recording.markers * np.array([-1.0, -1.0, 1.0])
        recording = recording.with_markers(recording.names, turned)
    events = marker_events(recording, landmarks=LANDMARKS)
    for side in SIDES:
        for kind in KINDS:
            expected = true_events(side, kind, 5.9)  # a swing must be seen to begin
            # made-up feet land and leave in their own way: an event is near, not exact
            assert np.abs(differences(of(events, side, kind), expected)).max() < 60.0


def test_markers_do_not_depend_on_the_rate_or_a_gap_elsewhere() -> None:
    slow = marker_events(walk(marker_rate=100.0), landmarks=LANDMARKS)
    fast = marker_events(walk(marker_rate=300.0), landmarks=LANDMARKS)
    assert [event.kind for event in slow] == [event.kind for event in fast]
    assert [e.time for e in slow] == pytest.approx([e.time for e in fast], abs=0.004)


def test_events_in_a_gap_are_not_made_up() -> None:
    recording = walk()
    markers = recording.markers.copy()
    gap = slice(125, 150)  # the right foot strikes at 1.4 s
    markers[gap, recording.names.index("R.Heel")] = np.nan
    events = marker_events(recording.with_markers(recording.names, markers), landmarks=LANDMARKS)
    assert not [e for e in events if e.side == "right" and 1.25 <= e.time < 1.5]
    assert len(of(events, "right", "heel_strike")) == len(strikes("right", 6.0)) - 1


@pytest.mark.parametrize(
    ("stop", "slap", "later"),
    [
        (0.018, 0.0085, 0.003),
        (0.009, 0.0085, 0.0),
        (0.055, 0.0085, 0.025 / 3.0),
        (0.009, 0.0205, 0.004),
        (0.009, -0.05, -0.025 / 3.0),
    ],
)
def test_a_foot_lands_in_the_mean_of_its_fall_the_heel_s_stop_and_the_forefoot_s_fall(
    stop: float, slap: float, later: float
) -> None:
    """The middle falls fastest at 1 s, the heel's acceleration is largest `stop` later, and the
    forefoot falls fastest `slap` later.
    """
    rate, time = 500.0, np.arange(1000) / 500.0
    middle = -0.02 * np.tanh((time - 1.0) / 0.05)
    slows = np.exp(-0.5 * ((time - 1.0 - stop) / 0.01) ** 2)
    heel = np.cumsum(np.cumsum(slows)) / rate**2
    front = -0.02 * np.tanh((time - 1.0 - slap) / 0.05)
    found = _timed_landing(heel, middle, front, 505, rate) / rate
    assert found == pytest.approx(1.0 + later - EVENTS.lands_before, abs=0.002)


def test_events_beside_the_plates_are_moved_as_those_on_them_differ() -> None:
    markers = [
        Event(time, side, kind)
        for time, side, kind in (
            (1.0, "right", "heel_strike"), (1.6, "right", "toe_off"), (2.0, "right", "heel_strike"),
            (0.5, "left", "heel_strike"), (1.5, "left", "heel_strike"),
        )
    ]  # fmt: skip
    plates = {Event(1.015, "right", "heel_strike"), Event(1.57, "right", "toe_off")}

    def moved(shown: set[Event]) -> list[float]:
        after = _as_on_plates(markers, shown)
        assert [(e.side, e.kind) for e in after] == [(e.side, e.kind) for e in markers]
        return [1000.0 * (a.time - b.time) for a, b in zip(after, markers, strict=True)]

    strike = 15.0 / (1.0 + FOOT_SPREAD["heel_strike"])
    toe_off = -30.0 / (1.0 + FOOT_SPREAD["toe_off"])
    assert moved(plates) == pytest.approx([strike, toe_off, strike, 0.0, 0.0])
    # two steps say more than one, and what is far off says nothing
    second = plates | {Event(2.011, "right", "heel_strike"), Event(0.55, "left", "heel_strike")}
    both = 26.0 / (2.0 + FOOT_SPREAD["heel_strike"])
    assert moved(second) == pytest.approx([both, toe_off, both, 0.0, 0.0])
    assert moved(set()) == [0.0] * 5


def test_a_foot_that_is_lost_in_swing_has_not_landed() -> None:
    recording = walk(marker_rate=250.0)
    whole = of(marker_events(recording, landmarks=LANDMARKS), "right", "heel_strike")
    for before in (0.06, 0.09, 0.12, 0.15, 0.18):
        markers = recording.markers.copy()
        lost = round(250.0 * (whole[-1] - before))
        markers[lost:, recording.names.index("R.Heel")] = np.nan
        seen = recording.with_markers(recording.names, markers)
        found = of(marker_events(seen, landmarks=LANDMARKS), "right", "heel_strike")
        assert found == pytest.approx(whole[:-1], abs=0.01), before


@pytest.mark.parametrize("names", [("R.Heel",), ("R.MT1", "R.MT5"), ("R.Heel", "R.MT1", "R.MT5")])
@pytest.mark.parametrize(
    "hidden", [(0.0, 0.5), (2.4, 3.8), (3.1, 3.5), (3.2, 3.4), (3.2, 3.6), (3.3, 4.1), (3.4, 9.0)]
)
def test_no_event_is_invented_where_markers_end_or_begin(hidden, names) -> None:
    recording = walk()
    whole = marker_events(recording, landmarks=LANDMARKS)
    markers = recording.markers.copy()
    gap = slice(*(round(each * recording.marker_rate) for each in hidden))
    markers[gap, [recording.names.index(name) for name in names]] = np.nan
    seen = recording.with_markers(recording.names, markers)
    found = marker_events(seen, landmarks=LANDMARKS)
    assert {e for e in found if e.side == "left"} == {e for e in whole if e.side == "left"}
    right = {kind: of(whole, "right", kind) for kind in ("heel_strike", "toe_off")}
    for event in found:
        if event.side == "right":
            assert min(abs(event.time - other) for other in right[event.kind]) < 0.03, event


def test_a_landing_at_the_very_end_is_as_far_down_the_path_as_those_before() -> None:
    frames = np.arange(272)  # a foot comes down every 110 frames: at 50, 160 and 270
    height = 0.02 * (1.0 + np.cos(2.0 * np.pi * (frames - 50) / 110 - 1.2)) + 1e-4 * frames
    landings = _edge_landings([50.0, 160.0, 265.0], [50.0, 160.0], height, 271, 100.0)
    assert landings == pytest.approx([50.0, 160.0, 270.0], abs=0.1)
    # a foot whose markers are lost 120 ms before it lands has not landed where they end
    assert _edge_landings([50.0, 160.0, 256.0], [50.0, 160.0], height, 258, 100.0) == [50.0, 160.0]
    # with nothing to go by it stays
    assert _edge_landings([265.0], [265.0], height, 271, 100.0) == [265.0]


def test_somebody_who_stands_has_no_events() -> None:
    recording = walk()
    standing = np.repeat(recording.markers[:1], 300, axis=0)
    sway = 0.005 * np.sin(np.arange(300) / 30.0)[:, None, None]
    still = recording.with_markers(recording.names, standing + sway)
    assert marker_events(still, landmarks=LANDMARKS) == ()
    assert marker_stance(still, landmarks=LANDMARKS).all()


def test_stance_from_markers() -> None:
    stance = marker_stance(walk(), landmarks=LANDMARKS)
    assert stance.mean() == pytest.approx(STANCE, abs=0.1)
    assert stance.any(axis=1).all()  # one foot is always down


# -- both -----------------------------------------------------------------------------------------


def test_over_ground_force_gives_the_events_on_plates_and_markers_the_others() -> None:
    recording = walk(plates=(Rectangle(x=(0.1, 0.6), y=(-0.3, 0.0)),))
    forces, _ = assign_forces(recording, PROCESSING, landmarks=LANDMARKS)
    from_markers = marker_events(recording, landmarks=LANDMARKS)
    from_force = force_events(forces, PROCESSING)
    assert len(from_force) == 2
    events = find_events(recording, forces, PROCESSING, landmarks=LANDMARKS)
    assert len(events) == len(from_markers)
    assert set(from_force) <= set(events)
    assert find_events(recording, None, PROCESSING, landmarks=LANDMARKS) == from_markers


def test_an_event_from_markers_that_breaks_the_order_gives_way_to_force() -> None:
    recording = walk(belt=SPEED, plates=BELTS)
    forces, _ = assign_forces(recording, PROCESSING, landmarks=LANDMARKS)
    # markers 0.2 s late, as when cameras and plates were started apart
    late = np.roll(recording.markers, 20, axis=0)
    late[:20] = late[20]
    moved = replace(recording, markers=late)
    events = find_events(moved, forces, PROCESSING, landmarks=LANDMARKS)
    assert set(force_events(forces, PROCESSING)) <= set(events)
    for side in SIDES:
        kinds = [event.kind for event in events if event.side == side]
        assert len(kinds) > 2
        assert all(first != second for first, second in pairwise(kinds))


# -- recorded walks -------------------------------------------------------------------------------


@pytest.fixture(scope="module")
def t01(gait_data: Path) -> Recording:
    return read_c3d(gait_data / "wbds" / "raw" / "WBDS01walkT01.c3d").turned(Y_UP)


def own_landmarks(recording: Recording) -> dict[str, str]:
    return {name: name for name in recording.names}


def test_force_and_markers_agree_within_20_ms_on_average_on_wbds01(t01: Recording) -> None:
    landmarks = own_landmarks(t01)
    zeroed, _ = zero_plates(t01, landmarks=landmarks)
    forces, _ = assign_forces(zeroed, PROCESSING, landmarks=landmarks)
    from_force = force_events(forces, PROCESSING)
    from_markers = marker_events(t01, landmarks=landmarks)
    for side in SIDES:
        for kind in KINDS:
            apart = differences(of(from_markers, side, kind), of(from_force, side, kind))
            assert len(apart) >= 16
            assert abs(apart.mean()) < 20.0  # ms, three frames of the cameras
            assert apart.std() < 10.0
            assert np.abs(apart).max() < 35.0


@pytest.mark.parametrize("zero", [False, True])
def test_force_agrees_with_the_events_stored_in_wbds01(t01: Recording, zero: bool) -> None:
    """The authors' events are those of plates that were not zeroed; zeroing the right plate's
    −34 N makes its toe-off 30 ms later, away from theirs and towards the markers'.
    """
    landmarks = own_landmarks(t01)
    trial = zero_plates(t01, landmarks=landmarks)[0] if zero else t01
    forces, _ = assign_forces(trial, PROCESSING, landmarks=landmarks)
    found = force_events(forces, PROCESSING)
    apart = {}
    for side in SIDES:
        for kind in KINDS:
            ours, stored = of(found, side, kind), of(t01.events, side, kind)
            assert len(stored) >= 15
            nearest = ours[np.abs(ours[:, None] - stored).argmin(axis=0)]
            apart[side, kind] = np.abs(nearest - stored).mean() * 1000.0
    assert np.mean(list(apart.values())) < 20.0
    unzeroed_toe_off = zero and ("right", "toe_off")
    assert all(value < 20.0 for key, value in apart.items() if key != unzeroed_toe_off)


def test_force_and_markers_agree_over_ground(gait_data: Path) -> None:
    folder = gait_data / "opensim_rajagopal" / "ExpData"
    recording = read_recording(
        folder / "motion_capture_walk.trc", forces=folder / "grf_walk.mot"
    ).turned(Y_UP)
    landmarks = own_landmarks(recording)
    forces, _ = assign_forces(recording, PROCESSING, landmarks=landmarks)
    from_force = force_events(forces, PROCESSING)
    assert len(from_force) == 6
    from_markers = marker_events(recording, landmarks=landmarks)
    for event in from_force:
        others = of(from_markers, event.side, event.kind)
        assert np.abs(others - event.time).min() < 0.030


# -- single rules ---------------------------------------------------------------------------------


def test_contacts_begin_and_end_at_samples() -> None:
    """At 1000 Hz: a gap of 49 ms is a bounce, one of 50 ms is none; likewise scuffs of 100 ms."""
    for gap, count in ((49, 1), (50, 2)):
        loaded = np.zeros(1000, dtype=bool)
        loaded[100:300], loaded[300 + gap : 600] = True, True
        begins, ends = foot_contacts(loaded, rate=1000.0)
        assert (begins[0], ends[-1], len(begins)) == (100, 600, count)
    for length, count in ((99, 0), (100, 1)):
        loaded = np.zeros(1000, dtype=bool)
        loaded[300 : 300 + length] = True
        on, scuffs = on_ground(loaded, rate=1000.0, scuff_s=0.1)
        assert (scuffs, on.any()) == (1 - count, bool(count))
        assert len(foot_contacts(loaded, rate=1000.0)[0]) == count
    ends_on = np.zeros(1000, dtype=bool)
    ends_on[:20], ends_on[950:] = True, True
    np.testing.assert_array_equal(on_ground(ends_on, rate=1000.0, scuff_s=0.1)[0], ends_on)
