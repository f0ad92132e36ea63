"""Whose foot a contact is, and whether plates show it whole, at contacts made by hand."""

from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest
from synthetic_recording import BELTS, LANDMARKS, Rectangle, walk

from gaitval.configuration import ProcessingSettings
from gaitval.errors import RecordError
from gaitval.gait.events import marker_events
from gaitval.gait.feet_on_plates import Feet
from gaitval.gait.plate_contacts import (
    check_synchrony,
    judge_brushes,
    judge_contact,
    judge_unshown,
    owners_of,
)
from gaitval.mocap.recording import Plate, Recording

RATE = 500.0
N = 300
"""Samples of the trials here."""
PROCESSING = ProcessingSettings()
NEAR, FAR = 0.02, 0.3
"""m, distances of the centre of pressure to a foot."""


def distances(right, left, count=100):
    return np.tile([right, left], (count, 1)).astype(float)


def owners(right, left, load=None, shared=slice(0, 0)):
    both = np.zeros(len(right), bool)
    both[shared] = True
    load = np.full(len(right), 700.0) if load is None else load
    return owners_of(load, np.column_stack([right, left]), both).tolist()


def test_a_contact_belongs_to_the_foot_nearer_under_load():
    assert owners([NEAR] * 4, [FAR] * 4) == [0] * 4
    assert owners([FAR] * 4, [NEAR] * 4) == [1] * 4
    # nearer for longer, but hardly loaded then; a force that pulls counts nothing
    load = np.array([10.0, 10.0, 10.0, 700.0])
    assert owners([NEAR] * 3 + [FAR], [FAR] * 3 + [NEAR], load) == [1] * 4
    assert owners([NEAR] * 3 + [FAR], [FAR] * 3 + [NEAR], -load) == [0] * 4


def test_a_foot_that_is_not_seen_has_no_distance():
    nan = float("nan")
    assert owners([nan] * 4, [NEAR] * 4) == [1] * 4
    assert owners([NEAR] * 4, [nan] * 4) == [0] * 4
    # what is outside the foot that is seen belongs to the other one
    assert owners([nan] * 4, [FAR] * 4) == [0] * 4
    assert owners([FAR] * 4, [nan] * 4) == [1] * 4
    # known half of the time: the mean over that half
    assert owners([nan, nan, 0.1, 0.1], [0.09] * 4) == [1] * 4
    assert owners([nan, nan, 0.1, 0.1], [0.11] * 4) == [0] * 4


def test_a_shared_period_stays_with_the_foot_before_it():
    right, left = [NEAR] * 4 + [FAR] * 6, [FAR] * 4 + [NEAR] * 6
    assert owners(right, left, shared=slice(4, 6)) == [0] * 6 + [1] * 4
    assert owners(right, left, shared=slice(3, 10)) == [0] * 10
    # without a foot before it goes to the first that is alone, and if none ever is, to the nearer
    assert owners([FAR] * 10, [NEAR] * 10, shared=slice(0, 2)) == [1] * 10
    assert owners(left, right, shared=slice(0, 4)) == [0] * 10
    assert owners([FAR] * 5, [NEAR] * 5, shared=slice(0, 5)) == [1] * 5


def trial(*plates, samples=N):
    return Recording(
        "w.c3d", "project", ("A",), np.zeros((samples // 5, 1, 3)), RATE / 5, plates=plates,
        force_rate=RATE,
    )  # fmt: skip


def loaded(begin=100, end=200, name="1", corners=None, newtons=700.0):
    """A plate with a contact; 0.6 by 0.4 m about the origin."""
    if corners is None:
        corners = Rectangle(x=(-0.3, 0.3), y=(-0.2, 0.2)).corners
    force = np.zeros((N, 3))
    force[begin:end, 2] = newtons
    point = np.where(force[:, 2:] > 0.0, np.zeros(3), np.nan)
    return Plate(name, corners, force, point, np.zeros((N, 3)))


def feet_at(right, left):
    """Two points of each foot, low throughout, at places (n,) m along x."""
    outlines = []
    for places in (right, left):
        outline = np.zeros((N, 2, 3))
        outline[:, :, 0] = places
        outlines.append(outline)
    low = np.ones((N, 2), bool)
    return Feet((outlines[0], outlines[1]), (low, low.copy()), np.ones((N, 2), bool))


def judged(plate, feet, owner, away, *, sharing=None, others=()):
    valid = np.ones((N, 2), bool)
    found = judge_contact(
        trial(plate, *others), plate, feet, 100, 200, owner, away,
        np.zeros(N, bool) if sharing is None else sharing, valid,
    )  # fmt: skip
    return found, valid


RIGHT = np.zeros(100, dtype=int)
OFF = 10.0
"""m: far from every plate."""


def test_a_whole_contact_of_one_foot_is_used():
    found, valid = judged(loaded(), feet_at([-0.1, 0.1], [OFF, OFF]), RIGHT, distances(NEAR, FAR))
    assert found == []
    assert valid.all()


@pytest.mark.parametrize(("share", "refused"), [(0.19, False), (0.22, True)])
@pytest.mark.parametrize("column", [0, 1])
def test_a_centre_of_pressure_outside_the_foot_for_a_fifth_of_the_time(share, refused, column):
    away = distances(NEAR, NEAR)
    away[: round(share * 100), column] = 0.07
    owner = np.full(100, column)
    found, valid = judged(loaded(), feet_at([0.0, 0.1], [0.0, 0.1]), owner, away)
    assert len(found) == refused
    expected = np.ones((N, 2), bool)
    if refused:
        expected[100:200, column] = False
        (one,) = found
        assert one.names == ("plate 1", ("right foot", "left foot")[column])
        assert (one.first, one.last) == (100, 199) or one.start == pytest.approx(100 / RATE)
        assert "is up to 7 cm outside the foot, in 22 % of the loaded time" in one.action
    np.testing.assert_array_equal(valid, expected)


@pytest.mark.parametrize(
    ("heel", "samples", "refused"), [(-0.315, 100, False), (-0.325, 14, False), (-0.325, 17, True)]
)
def test_a_foot_partly_beside_the_plates_for_30_ms(heel, samples, refused):
    """From 2 cm beside the edge on; the plate begins at -0.3 m."""
    feet = feet_at([0.0, 0.1], [OFF, OFF])
    feet.outlines[0][120 : 120 + samples, 0, 0] = heel
    found, valid = judged(loaded(), feet, RIGHT, distances(NEAR, FAR))
    assert [each.action for each in found] == (
        ["part of the foot is beside the plates; forces not used"] if refused else []
    )
    assert valid[:, 0].sum() == (N - 100 if refused else N)
    assert valid[:, 1].all()


def test_beside_one_plate_may_be_on_another_or_on_one_whose_place_is_unknown():
    feet = feet_at([-0.4, 0.1], [OFF, OFF])
    away = distances(NEAR, FAR)
    assert judged(loaded(), feet, RIGHT, away)[0] != []
    other = loaded(name="2", corners=Rectangle(x=(-0.9, -0.3), y=(-0.2, 0.2)).corners)
    assert judged(loaded(), feet, RIGHT, away, others=[other])[0] == []
    unknown = loaded(name="2", corners=np.full((4, 3), np.nan))
    assert judged(loaded(), feet, RIGHT, away, others=[unknown])[0] == []
    lifted = replace(feet, low=(np.tile([False, True], (N, 1)), feet.low[1]))
    assert judged(loaded(), lifted, RIGHT, away)[0] == []


def test_both_feet_on_a_plate():
    sharing = np.zeros(N, bool)
    sharing[150:180] = True
    feet = feet_at([0.0, 0.1], [0.2, 0.5])
    away = distances(NEAR, FAR)
    found, valid = judged(loaded(), feet, RIGHT, away, sharing=sharing)
    assert [each.action for each in found] == ["both feet on this plate; forces not used"]
    assert found[0].names == ("plate 1", "right foot", "left foot")
    expected = np.ones((N, 2), bool)
    expected[150:180] = False
    np.testing.assert_array_equal(valid, expected)


@pytest.mark.parametrize(("peak", "message"), [(1.9, False), (2.1, True)])
@pytest.mark.parametrize("column", [0, 1])
def test_a_touch_too_short_for_a_stance(peak, message, column):
    """From twice the threshold on, of the nearer foot; what is part of a contact is none."""
    threshold = PROCESSING.force_threshold_n
    plate = loaded(150, 160, newtons=peak * threshold)
    places = ([0.0, 0.1], [1.0, 1.1])
    feet = feet_at(*(places if column == 0 else places[::-1]))
    valid = np.ones((N, 2), bool)
    used = np.zeros(N, bool)
    vertical = plate.force[:, 2]
    arguments = (trial(plate), plate, feet, vertical)
    found = judge_brushes(*arguments, used, PROCESSING, valid)
    assert len(found) == message
    expected = np.ones((N, 2), bool)
    if message:
        expected[150:160, column] = False
        assert found[0].names == ("plate 1", ("right foot", "left foot")[column])
        assert f"touched with {peak * threshold:.0f} N" in found[0].action
    np.testing.assert_array_equal(valid, expected)
    used[145:165] = True
    assert judge_brushes(*arguments, used, PROCESSING, valid) == []


@pytest.mark.parametrize(
    ("shown", "words"),
    [(range(30, 280), None), (range(50, 240), None), (range(60, 198), "only 79 % of this stance"),
     (range(60, 234), "only 94 %"), (range(80, 280), "only 92 %"), (range(100, 101), "only 24 %"),
     (range(10, 12), "on no plate"), (range(0), "on no plate")],
)  # fmt: skip
@pytest.mark.parametrize("column", [0, 1])
def test_a_stance_of_which_plates_show_too_little(shown, words, column):
    """Of 250 samples; 60 ms (30) at each end of what they show are within the events' error."""
    stance = np.zeros((N, 2), bool)
    stance[30:280, column] = True
    touched = np.zeros((N, 2), bool)
    touched[list(shown), column] = True
    feet = replace(feet_at([0.0, 0.1], [0.0, 0.1]), stance=stance)
    valid = np.ones((N, 2), bool)
    found = judge_unshown(trial(loaded()), feet, touched, valid)
    assert len(found) == (words is not None)
    expected = np.ones((N, 2), bool)
    if words is not None:
        expected[30:280, column] = False
        assert words in found[0].action
        assert found[0].names == (("right foot", "left foot")[column],)
    np.testing.assert_array_equal(valid, expected)


@pytest.mark.parametrize(
    ("strikes", "offs", "refused"),
    [(0.07, 0.07, True), (-0.07, -0.07, True), (0.05, 0.05, False), (0.07, 0.0, False),
     (-0.07, 0.07, False), (0.07, 0.05, False), (0.09, 0.065, True)],
)  # fmt: skip
def test_forces_on_another_clock(strikes, offs, refused):
    """Strikes and toe-offs both later, or both earlier, by more than 60 ms in the median; longer
    or shorter contacts have other reasons."""
    recording = walk(plates=BELTS, belt=1.2)
    time = recording.force_time
    touched = np.zeros((len(time), 2), bool)
    for column, side in enumerate(("right", "left")):
        mine = [each for each in marker_events(recording, landmarks=LANDMARKS) if each.side == side]
        for before, after in pairwise(mine):
            if before.kind == "heel_strike":
                touched[(time >= before.time + strikes) & (time < after.time + offs), column] = True
    if not refused:
        check_synchrony(recording, touched, LANDMARKS)
        return
    when = "after" if strikes > 0.0 else "before"
    words = f"strike the ground {abs(strikes):.2f} s and leave it {abs(offs) - 1e-9:.2f} s {when}"
    with pytest.raises(RecordError, match=words if abs(offs) != 0.065 else when):
        check_synchrony(recording, touched, LANDMARKS)


@pytest.mark.parametrize("wrong", [0.3, -0.3])
def test_a_few_contacts_that_are_far_off_say_nothing_of_the_clock(wrong):
    """The lag is the median: of a step that landed between the plates the mean would be beyond
    60 ms, and most contacts show that the clock is right."""
    recording = walk(plates=BELTS, belt=1.2)
    time = recording.force_time
    touched = np.zeros((len(time), 2), bool)
    events = marker_events(recording, landmarks=LANDMARKS)
    shown = []
    for column, side in enumerate(("right", "left")):
        mine = [each for each in events if each.side == side]
        shown += [
            (column, before.time, after.time)
            for before, after in pairwise(mine)
            if before.kind == "heel_strike"
        ]
    few = len(shown) // 3
    for number, (column, begin, end) in enumerate(shown):
        off = wrong if number < few else 0.0
        touched[(time >= begin + off) & (time < end + off), column] = True
    assert few * abs(wrong) / len(shown) > 0.06
    check_synchrony(recording, touched, LANDMARKS)


@pytest.mark.parametrize("jitter", [0.0, 0.02])
def test_exchanged_sides_are_told_from_another_clock(jitter):
    """Half a stride is the mark of sides that are exchanged, and of nothing else at once. It is as
    near to the strike before as to the one after, which a few ms decide.
    """
    recording = walk(plates=BELTS, belt=1.2)
    time = recording.force_time
    touched = np.zeros((len(time), 2), bool)
    for column, side in enumerate(("right", "left")):
        mine = [each for each in marker_events(recording, landmarks=LANDMARKS) if each.side == side]
        for number, (before, after) in enumerate(pairwise(mine)):
            off = jitter if number // 2 % 2 else -jitter
            if before.kind == "heel_strike":
                on = (time >= before.time + off) & (time < after.time + off)
                touched[on, 1 - column] = True
    with pytest.raises(RecordError, match="under the other one") as error:
        check_synchrony(recording, touched, LANDMARKS)
    assert "another trial" not in str(error.value)
    for word in ("corners", "other way round", "CHANNEL"):
        assert word in str(error.value)
