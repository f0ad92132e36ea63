"""Doubts about forces and clock, at the figures of single plates and walks."""

from dataclasses import replace

import numpy as np
import pytest
from synthetic_recording import BELTS, LANDMARKS, STANCE, STRIDE, walk

from gaitval.configuration import ProcessingSettings
from gaitval.errors import RecordError
from gaitval.gait.foot_forces import assign_forces
from gaitval.gait.force_checks import channel_doubts, place_doubts, stance_figures, whole_stances
from gaitval.gait.marker_checks import foot_marker_doubts
from gaitval.gait.quality_flags import QualityFlag, refuse_certain


def waves(rate=500.0, seconds=4.0):
    """A plate on which a foot stands for half of each second, with 700 N at most."""
    (plate, _) = walk(plates=BELTS, belt=1.2, force_rate=rate, duration=seconds).plates
    time = np.arange(len(plate.force)) / rate
    load = np.clip(np.sin(2 * np.pi * time), 0.0, None)
    along = np.sin(4 * np.pi * time)
    force = np.column_stack([100 * load * along, 40 * load * np.cos(4 * np.pi * time), 700 * load])
    point = np.column_stack([0.2 * along, -0.1 + 0.02 * along, 0 * time])
    moment = np.cross(point, force) + np.outer(5 * load * along, [0, 0, 1.0])
    return replace(plate, force=force, centre_of_pressure=point, moment=moment)


def test_a_plate_that_works():
    assert not list(channel_doubts(waves(), 500.0))


@pytest.mark.parametrize(("axis", "words"), [(0, "fore-aft"), (1, "sideways")])
@pytest.mark.parametrize(("left", "certain"), [(0.0, True), (0.03, False)])
def test_a_dead_force(axis, words, left, certain):
    plate = waves()
    plate.force[:, axis] *= left
    (doubt,) = [d for d in channel_doubts(plate, 500.0) if words in d.message]
    assert (doubt.check, doubt.certain) == ("dead channel", certain)


def test_a_dead_vertical_channel():
    plate = waves()
    plate.force[:, 2] *= 1e-3
    (doubt,) = channel_doubts(plate, 500.0)
    assert doubt.certain
    assert "vertical channel is dead" in doubt.message


def test_a_plate_that_nobody_steps_on():
    plate = waves()
    assert not list(channel_doubts(replace(plate, force=0.01 * plate.force), 500.0))


@pytest.mark.parametrize(("step", "clipped"), [(0.0, False), (0.5, False), (None, True)])
def test_a_clipped_force_but_not_one_stored_in_steps(step, clipped):
    plate = waves(rate=1000.0)
    vertical = plate.force[:, 2]
    if step is None:
        plate.force[:, 2] = np.minimum(vertical, 650.0)
    elif step:
        plate.force[:, 2] = np.round(vertical / step) * step
    found = [d for d in channel_doubts(plate, 1000.0) if d.check == "saturated channel"]
    assert len(found) == clipped


@pytest.mark.parametrize("channel", ["force", "moment", "free_moment"])
def test_a_channel_that_repeats_itself_for_a_while(channel):
    plate = waves(rate=300.0)
    plate = replace(plate, free_moment=np.gradient(plate.force, axis=0) * [0, 0, 1.0])
    values = getattr(plate, channel)
    assert not list(channel_doubts(plate, 300.0))
    values[30:36] = values[30]  # 17 ms
    assert not list(channel_doubts(plate, 300.0))
    values[30:45] = values[30]
    (doubt,) = channel_doubts(plate, 300.0)
    assert (doubt.check, doubt.plate, doubt.certain) == ("stuck channel", plate.name, False)
    assert doubt.value == pytest.approx(14 / 300.0)


@pytest.mark.parametrize("axis", [0, 1])
def test_a_centre_of_pressure_that_is_cut_off(axis):
    """A file without moments has it as a channel of its own."""
    plate = replace(waves(rate=300.0), moment=None)
    point = plate.centre_of_pressure
    point[:, :2] = 0.05 * np.sin(np.linspace(0.0, 20.0, len(point)))[:, None]
    assert not list(channel_doubts(plate, 300.0))
    point[:, axis] = point[:, axis].clip(-0.03, 0.03)
    (doubt,) = channel_doubts(plate, 300.0)
    assert (doubt.check, doubt.plate) == ("stuck channel", plate.name)


@pytest.mark.parametrize("step", [2.0, 5.0])
def test_a_plate_that_stores_steps_is_not_stuck(step):
    plate = waves(rate=1000.0)
    force = np.round(plate.force / step) * step
    longest = np.diff(np.flatnonzero(np.diff(force[:500, 1]))).max()
    assert longest > 25, "it repeats itself at a peak"
    found = channel_doubts(replace(plate, force=force, moment=None), 1000.0)
    assert "stuck channel" not in {doubt.check for doubt in found}


def test_figures_of_a_known_stance():
    """The synthetic walk pushes forward and left by a tenth and a twentieth of the weight."""
    recording = walk(plates=BELTS, belt=1.2)
    forces, _ = assign_forces(recording, ProcessingSettings(), landmarks=LANDMARKS)
    stances = whole_stances(recording, forces)
    assert {(stance.side, stance.plate) for stance in stances} == {("right", "1"), ("left", "2")}
    pelvis = np.tile([0.2, 0.0, 1.0], (len(forces.force), 1))
    for stance in stances:
        assert (stance.end - stance.begin) / forces.rate == pytest.approx(STANCE * STRIDE, abs=0.02)
        figures = stance_figures(stance, forces, pelvis)
        sign = 1.0 if stance.side == "right" else -1.0
        assert figures.braking == pytest.approx(0.0, abs=2e-3)
        assert figures.inward == pytest.approx(sign * 0.05 * 0.7, abs=3e-3)
        assert figures.lean == pytest.approx(0.12, abs=2e-3)
        assert figures.twist == pytest.approx(3.0 / 700.0, rel=0.05)
        assert figures.late_twist == pytest.approx(3.0 / 700.0, rel=0.05)


def test_a_centre_of_pressure_that_is_nowhere_under_the_foot():
    assert not list(place_doubts("1", outside=2, used=3))
    (doubt,) = place_doubts("1", outside=3, used=2)
    assert "3 of 5" in doubt.message


@pytest.mark.parametrize(("raised", "names"), [(0.0, []), (0.05, ["R.Heel"]), (-0.05, ["R.Heel"])])
def test_a_marker_of_the_foot_that_is_higher_in_walking(raised, names):
    standing, walking = walk(2.0), walk(6.0)
    flat = np.tile(np.percentile(walking.markers, 15, axis=0), (len(standing.markers), 1, 1))
    walking.markers[:, walking.names.index("R.Heel"), 2] += raised
    found = foot_marker_doubts(standing.with_markers(standing.names, flat), walking, LANDMARKS)
    assert [doubt.where for doubt in found] == names


def test_the_last_plate_cannot_be_left_out():
    wrong = QualityFlag("check", "plate 2", 1.0, 0.0, "1", "is wrong", certain=True, plate="2")
    refuse_certain("walk.c3d", [replace(wrong, certain=False)], plates=1)
    for plates, ways in (
        (2, ("--no-plate 2", "--kinematics-only")),
        (1, ("--kinematics-only",)),
    ):
        with pytest.raises(RecordError, match=r"walk\.c3d: the forces cannot be right") as caught:
            refuse_certain("walk.c3d", [wrong], plates=plates)
        assert caught.value.goes_on == ways
