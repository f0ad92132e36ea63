"""Gait cycles, curves over them and spatiotemporal parameters."""

import re
from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
from scipy.spatial.transform import Rotation
from synthetic_recording import (
    LANDMARKS,
    SPEED,
    STANCE,
    STRIDE,
    WIDTH,
    strikes,
    toe_offs,
    walk,
)

from gaitval.coordinates import SIDES, Side
from gaitval.errors import RecordError
from gaitval.gait.cycles import (
    CYCLES,
    GaitCycle,
    average,
    belt_speed,
    cut_cycles,
    mean_and_deviation,
    normalise,
    spatiotemporal,
    travel,
)
from gaitval.mocap.foot_markers import facing
from gaitval.mocap.recording import Event, FootForces
from gaitval.session.trial import require_cycles


def true_events(duration: float = 6.0) -> list[Event]:
    events = []
    for side in SIDES:
        events += [Event(float(time), side, "heel_strike") for time in strikes(side, duration)]
        events += [Event(float(time), side, "toe_off") for time in toe_offs(side, duration)]
    return sorted(events, key=lambda event: event.time)


def shown(duration: float = 6.0) -> FootForces:
    nothing = np.zeros((int(duration * 500), 2, 3))
    valid = np.ones(nothing.shape[:2], dtype=bool)
    return FootForces(500.0, 0.0, nothing, nothing, nothing, valid)


# -- cycles ---------------------------------------------------------------------------------------


@pytest.mark.parametrize("side", SIDES)
def test_cycles_go_from_strike_to_strike(side: Side) -> None:
    cycles = cut_cycles(true_events(), side, forces=shown())
    expected = strikes(side, 6.0)
    assert [cycle.start for cycle in cycles] == pytest.approx(expected[:-1])
    assert [cycle.end for cycle in cycles] == pytest.approx(expected[1:])
    for cycle in cycles:
        assert cycle.side == side
        assert cycle.duration == pytest.approx(STRIDE)
        assert cycle.toe_off - cycle.start == pytest.approx(STANCE * STRIDE)
        assert cycle.opposite_strike - cycle.start == pytest.approx(0.5 * STRIDE)
        assert cycle.opposite_toe_off - cycle.start == pytest.approx((STANCE - 0.5) * STRIDE)
        assert cycle.kinematics_valid
        assert cycle.kinetics_valid
        assert cycle.reasons == ()


def test_without_plates_cycles_are_for_kinematics_only() -> None:
    cycles = cut_cycles(true_events(), "right")
    assert len(cycles) == 5
    assert all(cycle.kinematics_valid and not cycle.kinetics_valid for cycle in cycles)
    assert all("no force plates" in cycle.reasons[0] for cycle in cycles)


def test_a_cycle_whose_force_is_not_shown_keeps_its_kinematics() -> None:
    forces = shown()
    forces.valid[750:760, 0] = False  # 1.5 s: in the second right cycle
    right = cut_cycles(true_events(), "right", forces=forces)
    assert [cycle.kinetics_valid for cycle in right] == [True, False, True, True, True]
    assert all(cycle.kinematics_valid for cycle in right)
    assert "right foot alone at 1.500-1.518 s" in right[1].reasons[0]
    left = cut_cycles(true_events(), "left", forces=forces)
    assert left
    assert all(cycle.kinetics_valid for cycle in left)


def test_forces_that_end_early_leave_the_last_cycles_without_kinetics() -> None:
    cycles = cut_cycles(true_events(), "right", forces=shown(3.0))
    assert [cycle.kinetics_valid for cycle in cycles] == [True, True, False, False, False]
    assert "outside the time of the forces" in cycles[-1].reasons[0]


@pytest.mark.parametrize(
    ("dropped", "reason"),
    [
        (("right", "toe_off", 1), "no right toe-off"),
        (("left", "toe_off", 1), "no left toe-off"),
        (("left", "heel_strike", 1), "no left heel strike"),
        (("right", "heel_strike", 2), "more than 20 % from the trial's median of 1.10 s"),
    ],
)
def test_an_event_that_is_missing_is_named(dropped: tuple[Side, str, int], reason: str) -> None:
    events = true_events()
    side, kind, number = dropped
    events.remove([event for event in events if (event.side, event.kind) == (side, kind)][number])
    cycles = cut_cycles(events, "right", forces=shown())
    out = [cycle for cycle in cycles if not cycle.kinematics_valid]
    assert len(out) == 1
    assert not out[0].kinetics_valid
    assert any(reason in why for why in out[0].reasons)
    assert str(out[0]).startswith("right cycle ")


def test_running_is_not_cut_as_walking() -> None:
    events = [
        replace(event, time=event.time - 0.25) if event.kind == "toe_off" else event
        for event in true_events()
    ]
    cycles = cut_cycles(events, "right")
    assert cycles
    assert all("is it running" in cycle.reasons[0] for cycle in cycles)
    assert not any(cycle.kinematics_valid for cycle in cycles)


# -- curves ---------------------------------------------------------------------------------------

CYCLE = GaitCycle("right", 1.003, 1.7, 2.107, 1.1, 1.5, True, True)


def test_a_curve_has_101_points_of_the_cycle() -> None:
    time = np.arange(0.0, 3.0, 0.01)
    curve = normalise(time, np.stack([3.0 * time, -time], axis=1), CYCLE)
    assert curve.shape == (101, 2)
    # straight lines are interpolated exactly
    np.testing.assert_allclose(curve[:, 0], 3.0 * np.linspace(1.003, 2.107, 101), atol=1e-12)


def test_samples_that_are_missing_stay_missing_and_no_others() -> None:
    time = np.arange(0.0, 3.0, 0.01)
    values = np.ones(len(time))
    values[150] = np.nan
    curve = normalise(time, values, CYCLE)
    at = np.linspace(1.003, 2.107, 101)
    np.testing.assert_array_equal(np.isnan(curve), np.abs(at - 1.5) < 0.01 - 1e-9)


@pytest.mark.parametrize(
    ("time", "values", "message"),
    [
        (np.arange(0.0, 2.0, 0.01), np.zeros(200), "is outside the values"),
        (np.arange(1.1, 3.0, 0.01), np.zeros(190), "is outside the values"),
        (np.arange(0.0, 3.0, 0.01), np.zeros(299), "Values at 299 times cannot be cut with 300"),
    ],
)
def test_values_of_another_trial_are_refused(
    time: np.ndarray, values: np.ndarray, message: str
) -> None:
    with pytest.raises(RecordError, match=message):
        normalise(time, values, CYCLE)


def test_mean_and_standard_deviation_over_cycles() -> None:
    time = np.arange(0.0, 6.0, 0.01)
    cycles = cut_cycles(true_events(), "right")[:3]
    # in cycle k the curve is the phase times k: mean 2, standard deviation 1 of the phase
    strides = np.floor((time - 0.3) / STRIDE) + 1.0
    values = strides * (((time - 0.3) / STRIDE) % 1.0)
    result = average([(time, values, cycles)])
    assert result is not None
    phase = np.linspace(0.0, 1.0, 101)
    inside = slice(2, 98)  # the jump at the strike is between two samples
    np.testing.assert_allclose(result.mean[inside], 2.0 * phase[inside], atol=1e-9)
    np.testing.assert_allclose(result.deviation[inside], phase[inside], atol=1e-9)
    assert result.curves.shape == (3, 101)
    single = average([(time, values, cycles[:1])])
    assert single is not None
    assert single.deviation.shape == single.mean.shape
    assert np.isnan(single.deviation).all()


def test_cycles_of_several_trials_are_averaged_together() -> None:
    time = np.arange(0.0, 6.0, 0.01)
    cycles = cut_cycles(true_events(), "right")[:3]
    result = average([(time, np.ones(600), cycles), (time, np.full(600, 4.0), cycles[:1])])
    assert result is not None
    np.testing.assert_allclose(result.mean, 1.75)
    np.testing.assert_allclose(result.deviation, 1.5)


def test_no_cycles_have_no_average() -> None:
    assert average([(np.arange(10.0), np.zeros(10), [])]) is None


# -- spatiotemporal parameters --------------------------------------------------------------------


@pytest.mark.parametrize("backwards", [False, True])
@pytest.mark.parametrize("belt", [0.0, SPEED, 0.5 * SPEED])
@pytest.mark.parametrize("side", SIDES)
def test_parameters_are_those_of_the_walk_on_belt_and_ground(
    side: Side, belt: float, backwards: bool
) -> None:
    recording = walk(8.0, belt=belt)
    if backwards:
        turned = recording.markers * np.array([-1.0, -1.0, 1.0])
        recording = recording.with_markers(recording.names, turned)
    events = true_events(8.0)
    assert belt_speed(recording, events, landmarks=LANDMARKS) == pytest.approx(belt, abs=1e-6)
    cycles = cut_cycles(events, side)
    result = spatiotemporal(recording, events, cycles, side, landmarks=LANDMARKS, belt=belt)
    expected = {
        "stride_time": STRIDE,
        "step_time": 0.5 * STRIDE,
        "cadence": 120.0 / STRIDE,
        "stride_length": SPEED * STRIDE,
        "step_length": 0.5 * SPEED * STRIDE,
        "step_width": 2.0 * WIDTH,
        "stance_fraction": STANCE,
        "double_support_fraction": 2.0 * STANCE - 1.0,
        "speed": SPEED,
        "walk_ratio": 0.5 * SPEED * STRIDE / (120.0 / STRIDE),
    }
    summary = result.summary()
    assert set(summary) == set(expected)
    for name, value in expected.items():
        assert summary[name][0] == pytest.approx(value, rel=2e-3), name
        assert summary[name][1] == pytest.approx(0.0, abs=2e-3 * value), name


@pytest.mark.parametrize("belt", [0.0, SPEED])
@pytest.mark.parametrize("degrees", [-20.0, 12.0])
def test_a_pelvis_that_is_turned_changes_no_step(belt: float, degrees: float) -> None:
    """Steps are along the walk, not to where the pelvis points."""
    recording, events = walk(8.0, belt=belt), true_events(8.0)
    turn = Rotation.from_euler("z", degrees, degrees=True).as_matrix()
    pelvis = [recording.names.index(f"{x}.{name}") for x in "RL" for name in ("ASIS", "PSIS")]
    markers = recording.markers.copy()
    middle = markers[:, pelvis].mean(axis=1, keepdims=True)
    markers[:, pelvis] = (markers[:, pelvis] - middle) @ turn.T + middle
    turned = recording.with_markers(recording.names, markers)
    forward = travel(turned, events, landmarks=LANDMARKS)
    np.testing.assert_allclose(forward, [1.0, 0.0, 0.0], atol=2e-3)
    assert belt_speed(turned, events, landmarks=LANDMARKS) == pytest.approx(belt, abs=1e-4)
    for side in SIDES:
        cycles = cut_cycles(events, side)
        same, plain = (
            spatiotemporal(each, events, cycles, side, landmarks=LANDMARKS, belt=belt).summary()
            for each in (turned, recording)
        )
        for name, value in plain.items():
            np.testing.assert_allclose(same[name], value, atol=1e-9, err_msg=name)


def test_without_a_whole_stride_the_person_goes_where_they_face() -> None:
    forward = travel(walk(), [], landmarks=LANDMARKS)
    np.testing.assert_allclose(forward, facing(walk(), LANDMARKS))


def test_a_place_that_is_not_seen_is_not_made_up() -> None:
    recording = walk()
    markers = recording.markers.copy()
    markers[140:200, recording.names.index("R.Heel")] = np.nan  # its stance from 1.4 s on
    gap = recording.with_markers(recording.names, markers)
    cycles = cut_cycles(true_events(), "right")
    result = spatiotemporal(gap, true_events(), cycles, "right", landmarks=LANDMARKS, belt=0.0)
    assert np.isnan(result.stride_length[:2]).all()
    assert np.isfinite(result.stride_length[2:4]).all()
    assert np.isfinite(result.stride_time).all()


def test_no_stance_means_no_belt_speed_and_no_cycle_no_parameters() -> None:
    strikes_only = [event for event in true_events() if event.kind == "heel_strike"]
    with pytest.raises(RecordError, match="speed of the belt is unknown"):
        belt_speed(walk(), strikes_only, landmarks=LANDMARKS)
    none = spatiotemporal(walk(), true_events(), [], "left", landmarks=LANDMARKS, belt=0.0)
    assert none.side == "left"
    assert none.speed.shape == (0,)
    assert np.isnan(none.summary()["stride_time"]).all()


# -- edges ----------------------------------------------------------------------------------------


def test_what_plates_show_just_before_the_next_strike_does_not_matter() -> None:
    """The next strike, at 1.4 s, may be found a little late."""
    for at, valid in ((1.396, True), (1.35, False), (0.3, False), (0.298, True)):
        forces = shown()
        forces.valid[round(at * 500.0), 0] = False
        first = cut_cycles(true_events(), "right", forces=forces)[0]
        assert first.kinetics_valid == valid, at


def events_of(durations: list[float]) -> list[Event]:
    """Of strides of the right foot one after another, s."""
    events, strike = [], 0.0
    for duration in durations:
        for share, side, kind in (
            (0.0, "right", "heel_strike"), (0.12, "left", "toe_off"),
            (0.5, "left", "heel_strike"), (0.62, "right", "toe_off"),
        ):  # fmt: skip
            events.append(Event(strike + share * duration, side, kind))
        strike += duration
    return events


@pytest.mark.parametrize(
    "duration", [CYCLES.plausible_stride[0] - 0.01, CYCLES.plausible_stride[1] + 0.01]
)
def test_strides_that_nobody_takes(duration: float) -> None:
    cycles = cut_cycles(events_of([duration] * 5), "right")
    assert cycles
    assert all("it lasts" in cycle.reasons[0] for cycle in cycles)
    assert not any(cycle.kinematics_valid for cycle in cycles)


@pytest.mark.parametrize(("longer", "valid"), [(0.19, True), (0.21, False), (-0.21, False)])
def test_a_stride_a_fifth_off_the_median(longer: float, valid: bool) -> None:
    cycles = cut_cycles(events_of([1.0, 1.0, 1.0 + longer, 1.0, 1.0, 1.0]), "right")
    assert [cycle.kinematics_valid for cycle in cycles] == [True, True, valid, True, True]


def test_the_message_counts_strikes_and_says_why_cycles_do_not_count() -> None:
    def refused(events: list[Event]) -> str:
        cycles = {side: cut_cycles(events, side) for side in SIDES}
        recording = SimpleNamespace(source="walk.c3d")
        walk = SimpleNamespace(recording=recording, events=events, cycles=cycles)
        with pytest.raises(RecordError) as error:
            require_cycles([walk, walk])
        return str(error.value)

    assert re.match(
        r"walk.c3d: no complete right gait cycle in the trial.* 1 right heel strike found.*at "
        "least 2 times",
        refused(true_events(1.0)),
    )
    assert ": 0 right heel strikes found" in refused([])
    one_footed = [event for event in true_events() if event.side == "right"]
    message = refused(one_footed).splitlines()
    assert "6 right heel strikes found" in message[0]
    assert len(message) == 6
    assert all("no left toe-off in it" in line for line in message[1:])


@pytest.mark.parametrize("turn", [0.0, 90.0, 215.0])
def test_the_belt_runs_against_the_way_that_the_person_faces(turn: float) -> None:
    """Of steps forward and to the left, whichever way the laboratory's axes point."""
    recording = walk(belt=SPEED)
    c, s = np.cos(np.radians(turn)), np.sin(np.radians(turn))
    around = np.array([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]])
    turned = recording.with_markers(recording.names, recording.markers @ around.T)
    assert belt_speed(turned, true_events(), landmarks=LANDMARKS) == pytest.approx(SPEED, rel=1e-6)
    for side in SIDES:
        cycles = cut_cycles(true_events(), side)
        found = spatiotemporal(turned, true_events(), cycles, side, landmarks=LANDMARKS, belt=SPEED)
        np.testing.assert_allclose(found.step_width, 2 * WIDTH, atol=1e-6)
        np.testing.assert_allclose(found.stride_length, SPEED * STRIDE, atol=1e-6)


def test_a_foot_that_slips_in_one_stance_changes_no_speed_of_the_belt() -> None:
    recording = walk(belt=SPEED)
    strike = strikes("right", 6.0)[1]
    slips = (recording.time > strike) & (recording.time < strike + STANCE * STRIDE)
    mine = [i for i, name in enumerate(recording.names) if name in ("R.Heel", "R.MT2", "R.MT5")]
    recording.markers[np.ix_(slips, mine, [0])] += (
        0.5 * (recording.time[slips] - strike)[:, None, None]
    )
    assert belt_speed(recording, true_events(), landmarks=LANDMARKS) == pytest.approx(
        SPEED, rel=1e-6
    )


def test_a_deviation_is_that_of_a_sample_of_what_was_measured() -> None:
    mean, deviation = mean_and_deviation(np.array([1.0, np.nan, 2.0, 6.0]))
    assert (mean, deviation) == (3.0, pytest.approx(np.sqrt((4.0 + 1.0 + 9.0) / 2.0)))
    np.testing.assert_equal(mean_and_deviation(np.array([1.0, np.nan])), (1.0, np.nan))
    np.testing.assert_equal(mean_and_deviation(np.array([np.nan])), (np.nan, np.nan))
