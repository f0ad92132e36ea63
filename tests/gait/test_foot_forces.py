"""Ground reaction of each foot from plates: offsets, assignment, doubtful contacts, filter."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from synthetic_recording import (
    BELTS,
    FREE_MOMENT,
    LANDMARKS,
    SPEED,
    STANCE,
    STRIDE,
    WEIGHT,
    Y_UP,
    Rectangle,
    centre_of_pressure,
    strikes,
    vertical_force,
    walk,
)

from gaitval.configuration import ProcessingSettings
from gaitval.coordinates import SIDES, Side
from gaitval.errors import RecordError
from gaitval.gait.filters import low_pass
from gaitval.gait.foot_forces import assign_forces, of_weight, resample_forces
from gaitval.gait.plate_offset import zero_plates
from gaitval.mocap.c3d import read_c3d
from gaitval.mocap.foot_markers import foot_markers
from gaitval.mocap.recording import FootForces, Recording
from gaitval.mocap.repairs import Repair

PROCESSING = ProcessingSettings()

WALKWAY = (
    Rectangle(x=(0.1, 0.55), y=(-0.3, 0.3)),
    Rectangle(x=(0.75, 1.25), y=(-0.3, 0.3)),
)
"""The right foot strikes the first plate at 0.3 s, the left foot the second one 0.55 s later."""


def test_contact_begins_at_a_twentieth_of_a_light_weight():
    assert of_weight(PROCESSING, 15.0).force_threshold_n == pytest.approx(0.05 * 15.0 * 9.80665)
    assert of_weight(PROCESSING, 41.0) == PROCESSING


def assigned(recording: Recording, **settings: float) -> tuple[FootForces, tuple[Repair, ...]]:
    return assign_forces(recording, PROCESSING, landmarks=LANDMARKS, **settings)


def times(forces: FootForces) -> np.ndarray:
    return forces.start + np.arange(len(forces.force)) / forces.rate


def with_offset(recording: Recording, plate: int, **change: np.ndarray) -> Recording:
    plates = list(recording.plates)
    plates[plate] = replace(plates[plate], **change)
    return replace(recording, plates=tuple(plates))


def without_moments(recording: Recording) -> Recording:
    plates = tuple(replace(plate, moment=None) for plate in recording.plates)
    return replace(recording, plates=plates)


# -- assignment -----------------------------------------------------------------------------------


@pytest.mark.parametrize("moments", [True, False])
def test_split_belt_forces_go_to_the_foot_on_the_belt(moments: bool) -> None:
    recording = walk(belt=SPEED, plates=BELTS)
    forces, findings = assigned(recording if moments else without_moments(recording))
    assert findings == ()
    assert forces.valid.all()
    for column, side in enumerate(SIDES):
        vertical = vertical_force(side, times(forces))
        expected = low_pass(vertical, rate=forces.rate, cutoff_hz=PROCESSING.force_cutoff_hz)
        on = forces.force[:, column, 2] > 0.0
        np.testing.assert_allclose(forces.force[on, column, 2], expected[on], atol=1.0)
        assert expected[~on].max() < PROCESSING.force_threshold_n + 1.0
        loaded = vertical > 0.5 * WEIGHT
        point = centre_of_pressure(side, times(forces), SPEED)
        np.testing.assert_allclose(
            forces.centre_of_pressure[loaded, column], point[loaded], atol=2e-3
        )
        plateau = vertical == WEIGHT
        free = FREE_MOMENT if side == "right" else -FREE_MOMENT
        assert np.median(forces.free_moment[plateau, column, 2]) == pytest.approx(free, rel=1e-3)


def test_air_has_no_force_and_no_centre_of_pressure() -> None:
    forces, _ = assigned(walk(belt=SPEED, plates=BELTS))
    air = forces.force[:, :, 2] == 0.0
    assert air.any()
    assert (forces.force[air] == 0.0).all()
    assert (forces.free_moment[air] == 0.0).all()
    assert np.isnan(forces.centre_of_pressure[air]).all()
    assert np.isfinite(forces.centre_of_pressure[~air]).all()
    assert forces.force[~air][:, 2].min() > PROCESSING.force_threshold_n


def test_over_ground_each_plate_shows_one_step_and_the_rest_is_not_valid() -> None:
    forces, findings = assigned(walk(plates=WALKWAY))
    for column, side in enumerate(SIDES):
        first = strikes(side, 6.0)[0]
        middle = (times(forces) > first + 0.05) & (times(forces) < first + STANCE * STRIDE - 0.05)
        np.testing.assert_allclose(forces.force[middle, column, 2], WEIGHT, rtol=0.1)
        assert forces.valid[middle, column].all()
        later = (times(forces) > first + STRIDE + 0.1) & (times(forces) < first + 1.5 * STRIDE)
        assert middle.any()
        assert later.any()
        assert (forces.force[later, column] == 0.0).all()
        assert not forces.valid[later, column].any()
    assert {finding.kind for finding in findings} == {"contact"}
    assert all("is on no plate" in finding.action for finding in findings)


def test_two_plates_under_one_foot_are_added() -> None:
    whole, _ = assigned(walk(belt=SPEED, plates=BELTS))
    halves = (
        Rectangle(x=(-1.0, -0.1), y=(-0.5, 0.0)),
        Rectangle(x=(-0.1, 1.0), y=(-0.5, 0.0)),
        BELTS[1],
    )
    recording = walk(belt=SPEED, plates=halves)
    split, findings = assigned(recording)
    assert findings == ()
    assert all(plate.force[:, 2].max() > 0.9 * WEIGHT for plate in recording.plates)
    np.testing.assert_allclose(split.force, whole.force, atol=25.0)
    loaded = whole.force[:, 0, 2] > 0.9 * WEIGHT
    np.testing.assert_allclose(
        split.centre_of_pressure[loaded, 0], whole.centre_of_pressure[loaded, 0], atol=5e-3
    )


def test_both_feet_on_one_plate_are_not_used_and_said() -> None:
    forces, findings = assigned(walk(belt=SPEED, plates=(Rectangle((-1.0, 1.0), (-0.5, 0.5)),)))
    both = (vertical_force("right", times(forces)) > 100.0) & (
        vertical_force("left", times(forces)) > 100.0
    )
    assert both.any()
    assert not forces.valid[both].any()
    assert findings
    assert all("both feet on this plate" in finding.action for finding in findings)
    # in single support the plate shows one foot, and which one
    alone = (vertical_force("right", times(forces)) == WEIGHT) & (
        vertical_force("left", times(forces)) == 0.0
    )
    middle = alone & np.roll(alone, 50) & np.roll(alone, -50)
    assert middle.any()
    assert forces.valid[middle].all()
    np.testing.assert_allclose(forces.force[middle, 0, 2], WEIGHT, rtol=0.05)


def test_a_foot_over_the_gap_of_the_belts_is_a_crossing() -> None:
    narrow = (
        Rectangle(x=(-1.0, 1.0), y=(-0.5, 0.10)),  # the left MT1 marker is at 0.08
        Rectangle(x=(-1.0, 1.0), y=(0.10, 0.5)),
    )
    forces, findings = assigned(walk(belt=SPEED, plates=narrow))
    crossings = [finding for finding in findings if "both feet on this plate" in finding.action]
    assert crossings
    assert all(finding.names[0] == "plate 1" for finding in crossings)
    for finding in crossings:
        assert not forces.valid[finding.first : finding.last + 1].any()


def test_a_foot_partly_beside_the_plate_is_not_used() -> None:
    short = (Rectangle(x=(0.25, 0.75), y=(-0.3, 0.3)),)  # its heel, at 0.2 m, is beside it
    forces, findings = assigned(walk(plates=short))
    beside = [finding for finding in findings if "beside the plates" in finding.action]
    assert [finding.names for finding in beside] == [("plate 1", "right foot")]
    assert not forces.valid[beside[0].first : beside[0].last + 1, 0].any()


def test_a_foot_a_little_beside_the_plate_is_used() -> None:
    """The markers' toes are an estimate: within 2 cm of an edge the centre of pressure decides."""
    short = (Rectangle(x=(0.215, 0.75), y=(-0.3, 0.3)),)  # its heel, at 0.2 m, is 15 mm beside it
    forces, findings = assigned(walk(plates=short))
    assert not [finding for finding in findings if "beside the plates" in finding.action]
    assert forces.valid[forces.force[:, 0, 2] > 0.0, 0].all()


def test_the_user_says_whose_foot_is_on_a_plate() -> None:
    recording = walk(belt=SPEED, plates=BELTS)

    def said(*sides: Side) -> Recording:
        stated = zip(recording.plates, sides, strict=True)
        return replace(recording, plates=tuple(replace(each, foot=side) for each, side in stated))

    as_found, _ = assigned(recording)
    as_said, findings = assigned(said("right", "left"))
    assert not [each for each in findings if "outside" in each.action]
    np.testing.assert_allclose(as_found.force, as_said.force, atol=1e-9)
    with pytest.raises(RecordError, match=r"what was said of them.*exchanged"):
        assigned(said("left", "right"))


def test_a_centre_of_pressure_outside_both_feet_is_not_used() -> None:
    recording = walk(belt=SPEED, plates=BELTS)
    shift = np.array([0.25, 0.0, 0.0])  # corners off by a quarter of a metre
    plate = recording.plates[0]
    assert plate.moment is not None
    moved = with_offset(
        recording,
        0,
        corners=plate.corners + shift,
        centre_of_pressure=plate.centre_of_pressure + shift,
        moment=plate.moment + np.cross(shift, plate.force),
    )
    forces, findings = assigned(moved)
    assert findings
    assert {finding.names for finding in findings} == {("plate 1", "right foot")}
    assert all("outside the foot" in finding.action for finding in findings)
    assert forces.valid[:, 1].all()


@pytest.mark.parametrize("names", [("R.MT1", "R.MT5"), ("R.Heel",), ("R.Heel", "R.MT1", "R.MT5")])
@pytest.mark.parametrize("hidden", [(0.0, 2.0), (2.4, 3.2), (2.5, 3.9), (3.6, 5.0), (2.6, 9.0)])
def test_no_plate_is_accused_while_markers_of_the_foot_are_hidden(hidden, names) -> None:
    recording = walk(belt=SPEED, plates=BELTS)
    whole, _ = assigned(recording)
    markers = recording.markers.copy()
    gap = slice(*(round(each * recording.marker_rate) for each in hidden))
    markers[gap, [recording.names.index(name) for name in names]] = np.nan
    forces, findings = assigned(recording.with_markers(recording.names, markers))
    assert findings == ()
    np.testing.assert_array_equal(forces.force, whole.force)


def test_what_no_plate_shows_of_a_hidden_foot_is_not_known() -> None:
    """The right foot walks beside the plate; for a while its markers are hidden."""
    recording = walk(belt=SPEED, plates=BELTS[1:])
    markers = recording.markers.copy()
    markers[375:405, [recording.names.index(n) for n in ("R.Heel", "R.MT1", "R.MT5")]] = np.nan
    forces, _ = assigned(recording.with_markers(recording.names, markers))
    stance = (times(forces) > 3.65) & (times(forces) < 4.25)
    assert not forces.valid[stance, 0].any()


# -- refused --------------------------------------------------------------------------------------


def test_a_trial_without_plates_says_what_to_do() -> None:
    with pytest.raises(RecordError, match=r"no force plates.*--forces"):
        assigned(walk())


def test_plates_that_nobody_stands_on_are_refused() -> None:
    with pytest.raises(RecordError, match="no foot is on the 1 force plate"):
        assigned(walk(plates=(Rectangle((20.0, 20.5), (-0.3, 0.3)),)))


def test_feet_without_markers_are_refused() -> None:
    recording = walk(belt=SPEED, plates=BELTS)
    landmarks = {name: name for name in LANDMARKS if name != "L.Heel"}
    with pytest.raises(RecordError, match="no marker on the left heel"):
        assign_forces(recording, PROCESSING, landmarks=landmarks)


# -- offset ---------------------------------------------------------------------------------------


def _drifting(time: np.ndarray) -> np.ndarray:
    """Offset with a drift, N and Nm about the origin."""
    still = np.array([2.0, -10.0, -34.0, 5.0, 18.0, 12.0])
    return still + np.outer(time, [0.0, 0.0, 2.0, 0.0, -1.0, 0.0])


def test_an_offset_is_found_where_no_foot_is_and_taken_away_with_its_drift() -> None:
    true, _ = assigned(walk(belt=SPEED, plates=BELTS))
    shown = walk(belt=SPEED, plates=BELTS, offset=_drifting)
    zeroed, findings = zero_plates(shown, landmarks=LANDMARKS)
    assert [finding.names for finding in findings] == [("plate 1",), ("plate 2",)]
    assert all("taken away" in finding.action for finding in findings)
    forces, _ = assigned(zeroed)
    # what is left: the offset before the first phase without a foot is taken as constant
    np.testing.assert_allclose(forces.force, true.force, atol=21.0)  # threshold at the edges
    loaded = (true.force[:, :, 2] > 100.0) & (forces.force[:, :, 2] > 100.0)
    np.testing.assert_allclose(
        forces.centre_of_pressure[loaded], true.centre_of_pressure[loaded], atol=0.02
    )
    middle = loaded.copy()
    middle[(times(true) < 1.5) | (times(true) > 4.5)] = False
    np.testing.assert_allclose(forces.force[middle], true.force[middle], atol=0.1)
    np.testing.assert_allclose(
        forces.centre_of_pressure[middle], true.centre_of_pressure[middle], atol=1e-3
    )


def test_zeroed_plates_are_left_as_they_are() -> None:
    recording = walk(belt=SPEED, plates=BELTS)
    zeroed, findings = zero_plates(recording, landmarks=LANDMARKS)
    assert findings == ()
    for plate, before in zip(zeroed.plates, recording.plates, strict=True):
        assert plate is before


def test_an_offset_without_moments_is_reported_and_left() -> None:
    recording = without_moments(walk(belt=SPEED, plates=BELTS, offset=_drifting))
    zeroed, findings = zero_plates(recording, landmarks=LANDMARKS)
    assert len(findings) == 2
    assert all("left as it is" in finding.action for finding in findings)
    assert zeroed.plates[0] is recording.plates[0]


def test_a_plate_that_is_pushed_without_a_foot_is_not_zeroed() -> None:
    def pushed(time: np.ndarray) -> np.ndarray:
        return np.outer(60.0 * np.sin(2.0 * np.pi * 4.0 * time), [0, 0, 1, 0, 0, 0])

    recording = walk(belt=SPEED, plates=BELTS, offset=pushed)
    zeroed, findings = zero_plates(recording, landmarks=LANDMARKS)
    assert zeroed.plates[0] is recording.plates[0]
    assert "something else" in findings[0].action


def test_a_foot_whose_heel_is_not_seen_is_not_taken_for_an_offset() -> None:
    """From one swing to another its strikes are not seen: the foot seems to be in the air."""
    seen = walk(belt=SPEED, plates=BELTS, offset=_drifting)
    markers = seen.markers.copy()
    heel = seen.names.index(LANDMARKS["L.Heel"])
    height = markers[:, heel, 2]
    swings = [int(np.nanargmax(np.where(np.abs(seen.time - t) < 0.6, height, 0))) for t in (2, 4)]
    markers[slice(*swings), heel] = np.nan
    hidden = replace(seen, markers=markers)
    expected, _ = zero_plates(seen, landmarks=LANDMARKS)
    zeroed, _ = zero_plates(hidden, landmarks=LANDMARKS)
    for plate, other in zip(zeroed.plates, expected.plates, strict=True):
        np.testing.assert_allclose(plate.force, other.force, atol=1.0)


def test_a_foot_on_exchanged_plates_is_not_taken_for_an_offset() -> None:
    """Each plate shows the weight while the foot at its place is in the air."""
    recording = walk(belt=SPEED, plates=BELTS)
    first, second = recording.plates
    plates = (replace(first, corners=second.corners), replace(second, corners=first.corners))
    zeroed, findings = zero_plates(replace(recording, plates=plates), landmarks=LANDMARKS)
    assert all(one is other for one, other in zip(zeroed.plates, plates, strict=True))
    assert len(findings) == 2
    assert all("corners of two plates are exchanged" in each.action for each in findings)


# -- filter and sample rate -----------------------------------------------------------------------


def test_the_centre_of_pressure_is_that_of_the_filtered_wrench() -> None:
    """Filtering the wrench keeps force and moment consistent at every cut-off: the impulse and
    the impulse of the moment over a step do not depend on it.
    """
    recording = walk(belt=SPEED, plates=BELTS)
    impulses = []
    for cutoff in (20.0, 6.0):
        forces, _ = assigned(recording, cutoff_hz=cutoff)
        moment = np.cross(np.nan_to_num(forces.centre_of_pressure), forces.force)
        step = (times(forces) > 0.9) & (times(forces) < 2.3)
        total = np.concatenate([forces.force, moment + forces.free_moment], axis=2)[step, 0]
        impulses.append(total.sum(axis=0) / forces.rate)
    np.testing.assert_allclose(impulses[0], impulses[1], rtol=0.01, atol=0.05)


@pytest.mark.parametrize("rate", [100.0, 250.0, 500.0, 1000.0])
def test_resampled_forces_are_those_of_the_same_times(rate: float) -> None:
    forces, _ = assigned(walk(belt=SPEED, plates=BELTS))
    wanted = np.arange(0.0, 5.99, 1.0 / rate)
    there = resample_forces(forces, wanted)
    assert (there.rate, there.start) == (pytest.approx(rate), 0.0)
    vertical = np.interp(wanted, times(forces), forces.force[:, 0, 2])
    # the low-pass against aliasing rounds the 20 N at which contact begins
    np.testing.assert_allclose(there.force[:, 0, 2], vertical, atol=21.0)
    loaded = vertical > 100.0
    np.testing.assert_allclose(there.force[loaded, 0, 2], vertical[loaded], atol=7.0)
    point = np.interp(wanted, times(forces), forces.centre_of_pressure[:, 0, 0])
    np.testing.assert_allclose(there.centre_of_pressure[loaded, 0, 0], point[loaded], atol=5e-3)
    assert there.valid.all()


def test_resampling_keeps_what_is_not_valid() -> None:
    forces, _ = assigned(walk(plates=WALKWAY))
    there = resample_forces(forces, np.arange(0.0, 5.99, 0.01))
    exact = forces.valid[np.rint(np.arange(0.0, 5.99, 0.01) * 500.0).astype(int)]
    np.testing.assert_array_equal(there.valid, exact)


@pytest.mark.parametrize(
    ("frames", "fits"), [(1.4, True), (1.6, False), (-1.4, True), (-1.6, False)]
)
def test_forces_may_be_one_and_a_half_frames_longer_or_shorter(frames: float, fits: bool) -> None:
    recording = walk(belt=SPEED, plates=BELTS)
    count = round((len(recording.markers) + frames) / recording.marker_rate * recording.force_rate)

    def of_length(values: np.ndarray) -> np.ndarray:
        return np.concatenate([values, values])[:count]

    plates = tuple(
        replace(
            plate,
            force=of_length(plate.force),
            centre_of_pressure=of_length(plate.centre_of_pressure),
            free_moment=of_length(plate.free_moment),
            moment=None,
        )
        for plate in recording.plates
    )
    if fits:
        assigned(replace(recording, plates=plates))
        return
    with pytest.raises(RecordError, match="one of them is cut off or from another trial"):
        assigned(replace(recording, plates=plates))


def test_plates_of_different_lengths_are_refused() -> None:
    recording = walk(belt=SPEED, plates=BELTS)
    first, second = recording.plates
    short = replace(
        second, force=second.force[:-1], centre_of_pressure=second.centre_of_pressure[:-1],
        free_moment=second.free_moment[:-1], moment=None,
    )  # fmt: skip
    with pytest.raises(RecordError, match="2999, 3000 samples at 500 Hz"):
        assigned(replace(recording, plates=(first, short)))


@pytest.mark.parametrize("height", [0.25, -0.1])
def test_a_walk_on_a_raised_floor_has_its_centre_of_pressure_there(height: float) -> None:
    """The lever of the horizontal forces about the origin is the plates' height."""
    recording = walk(belt=SPEED, plates=BELTS)
    up = np.array([0.0, 0.0, height])
    plates = tuple(
        replace(
            plate,
            corners=plate.corners + up,
            centre_of_pressure=plate.centre_of_pressure + up,
            moment=plate.moment + np.cross(up, plate.force),
        )
        for plate in recording.plates
        if plate.moment is not None
    )
    raised = replace(recording, markers=recording.markers + up, plates=plates)
    there, _ = assigned(raised)
    here, _ = assigned(recording)
    np.testing.assert_allclose(there.force, here.force, atol=1e-9)
    np.testing.assert_allclose(there.free_moment, here.free_moment, atol=1e-9)
    np.testing.assert_allclose(there.centre_of_pressure, here.centre_of_pressure + up, atol=1e-9)
    times_there = np.arange(0.0, 5.9, 0.01)
    np.testing.assert_allclose(
        resample_forces(there, times_there).centre_of_pressure,
        resample_forces(here, times_there).centre_of_pressure + up, atol=1e-9,
    )  # fmt: skip


def test_a_load_that_is_below_the_threshold_between_two_contacts_counts_once() -> None:
    """The foot does not leave the plate, which shows 15 N for 90 ms: 15 N, not twice as much."""
    recording = walk(belt=SPEED, plates=BELTS)
    plate = recording.plates[0]
    assert plate.moment is not None
    middle = strikes("right", 6.0)[1] + 0.5 * STANCE * STRIDE
    samples = np.arange(len(plate.force)) / recording.force_rate
    light = np.where(np.abs(samples - middle) < 0.045, 15.0 / WEIGHT, 1.0)[:, None]
    hop = with_offset(
        recording, 0, force=light * plate.force, moment=light * plate.moment,
        free_moment=light * plate.free_moment,
    )  # fmt: skip
    forces, _ = assigned(hop, cutoff_hz=100.0)
    gap = np.abs(times(forces) - middle) < 0.03
    assert not forces.force[gap, 0].any()
    edges = (np.abs(times(forces) - middle) < 0.06) & ~gap & (forces.force[:, 0, 2] > 0.0)
    true = low_pass(hop.plates[0].force, rate=500.0, cutoff_hz=100.0)
    assert edges.sum() > 8
    np.testing.assert_allclose(forces.force[edges, 0], true[edges], atol=0.5)


def linear(rate: float = 100.0, count: int = 50) -> FootForces:
    """A right foot whose force and point change linearly; the left one is in the air."""
    time = np.arange(count) / rate
    force = np.zeros((count, 2, 3))
    force[:, 0] = np.column_stack([10.0 + 20.0 * time, -5.0 * time, 500.0 + 100.0 * time])
    point = np.full((count, 2, 3), np.nan)
    point[:, 0] = np.column_stack([0.0 * time + 0.1, 0.0 * time - 0.2, 0.0 * time])
    moment = np.zeros((count, 2, 3))
    moment[:, 0, 2] = 4.0 * time
    return FootForces(rate, 2.0, force, point, moment, np.ones((count, 2), dtype=bool))


def test_what_is_above_half_the_new_rate_is_no_slow_wave() -> None:
    """95 Hz, of which samples at 100 Hz would make 5 Hz; 10 Hz stays."""
    forces = linear(rate=1000.0, count=1000)
    time = np.arange(1000) / 1000.0
    wanted = 2.0 + np.arange(0.0, 0.99, 0.01)
    middle = slice(20, -20)
    for hertz, kept in ((95.0, 0.0), (10.0, 1.0)):
        wave = np.zeros_like(forces.force)
        wave[:, 0, 0] = 50.0 * np.sin(2.0 * np.pi * hertz * time)
        there = resample_forces(replace(forces, force=forces.force + wave), wanted)
        plain = resample_forces(forces, wanted)
        found = (there.force - plain.force)[middle, 0, 0]
        true = kept * 50.0 * np.sin(2.0 * np.pi * hertz * (wanted - 2.0))[middle]
        np.testing.assert_allclose(found, true, atol=6.0)


def test_a_time_next_to_a_sample_that_is_not_valid_is_not_valid() -> None:
    forces = linear()
    forces.valid[20, 0] = False
    wanted = 2.0 + np.arange(0.17, 0.24, 0.0025)
    there = resample_forces(forces, wanted)
    into = np.round((wanted - 2.0) * 100.0, 6)
    np.testing.assert_array_equal(there.valid[:, 0], ~((into > 19.0) & (into < 21.0)))
    assert there.valid[:, 1].all()


# -- WBDS01 T01 -----------------------------------------------------------------------------------


def test_zeroing_brings_the_centre_of_pressure_of_wbds01_into_the_feet(gait_data: Path) -> None:
    """The right plate shows −34 N in swing. Unzeroed, the centre of pressure is outside the foot
    in a third of the time under a light load (50 to 150 N), and the plates carry 3.6 % less of the
    body's weight; zeroed, it is outside in a twentieth, at the tip of the shoe in push-off.
    """
    recording = read_c3d(gait_data / "wbds" / "raw" / "WBDS01walkT01.c3d").turned(Y_UP)
    landmarks = {name: name for name in recording.names}
    feet = foot_markers(recording, landmarks)
    zeroed, findings = zero_plates(recording, landmarks=landmarks)
    assert "-33." in findings[1].action
    weight, reach = [], []
    for trial in (recording, zeroed):
        forces, _ = assign_forces(trial, PROCESSING, landmarks=landmarks)
        at_frames = resample_forces(forces, recording.time)
        weight.append(at_frames.force[300:4200, :, 2].sum(axis=1).mean())
        share = []
        for column, side in enumerate(SIDES):
            point = at_frames.centre_of_pressure[:, column, 0]
            behind = feet[side].heel[:, 0] - 0.03
            ahead = feet[side].front[:, 0] + 0.07  # the toes
            vertical = at_frames.force[:, column, 2]
            light = (vertical > 50.0) & (vertical < 150.0)
            share.append(((point > behind) & (point < ahead))[light])
        reach.append(np.concatenate(share).mean())
    assert reach[0] < 0.70
    assert reach[1] > 0.93
    body_weight = 74.3 * 9.80665
    assert weight[0] / body_weight == pytest.approx(0.926, abs=0.005)
    assert weight[1] / body_weight == pytest.approx(0.962, abs=0.005)
