"""Numbers that a page of paper gives: of formulas, tables and limits all over the package."""

from types import SimpleNamespace
from xml.etree import ElementTree

import numpy as np
import pytest
from body_result import MODEL
from matplotlib.figure import Figure

from gaitval._internal.io.partial_files import own_folder
from gaitval.apps.balance import figures
from gaitval.apps.devices import device_walk
from gaitval.apps.export import mujoco_folder
from gaitval.apps.judge.moments import Band, speed_group
from gaitval.apps.patients.estimates import (
    EstimatedValue,
    leg_difference,
    leg_length,
    stride_time,
)
from gaitval.errors import RecordError
from gaitval.kinetics.musculature.person import muscle_volume
from gaitval.metrics import walk_muscles
from gaitval.metrics.balance_walk import BalanceWalk
from gaitval.metrics.foot_placement import Placement
from gaitval.model.tree import PARENTS
from gaitval.scaling.given_centres import GivenCentre, laid
from gaitval.session import average
from gaitval.session.measurement.second_sessions import at_once
from gaitval.subjects.prediction import ankles, speed
from gaitval.subjects.prediction.normal_form import normal_form
from gaitval.subjects.subject_file import load_subject


def test_muscles_have_the_volume_of_handsfields_regression():
    """47.05 cm³ for a kilogram times a metre, and 1289.6 cm³."""
    assert muscle_volume(75.0, 1.70) == pytest.approx(7288.475e-6)


def test_strides_take_as_long_as_fukuchis_walkers():
    """On a leg of g metres the unit of time is 1 s. A stride of 1.5 legs takes e^1.212, one
    of 3 legs 2^-0.737 times that; patients' strides take what those of 1.45 legs do."""
    leg = 9.81
    usual = stride_time(1.5 * leg, leg, patient=False)
    assert usual.value == pytest.approx(3.3602, abs=1e-4)
    assert usual.sd == pytest.approx(0.132 * 3.3602, abs=1e-4)
    assert stride_time(3.0 * leg, leg, patient=False).value == pytest.approx(3.3602 * 0.6, rel=1e-3)
    short = stride_time(0.7 * leg, leg, patient=True)
    assert short.value == pytest.approx(3.3602 * (1.45 / 1.5) ** -0.737, rel=1e-4)
    assert short.sd == pytest.approx(0.15 * short.value)
    assert EstimatedValue(2.0, 0.1, "").interval() == pytest.approx((1.8355, 2.1645))
    assert leg_difference({"right": 0.91, "left": 0.90})[:2] == pytest.approx(
        (0.01, 0.006 * 2.0**0.5)
    )
    unsure = leg_length(EstimatedValue(1.7, 0.048 * 1.7, ""), None)
    assert unsure.sd == pytest.approx(0.06 * unsure.value)  # 3.6 and 4.8 %


@pytest.mark.parametrize(
    ("group", "slowest", "fastest"),
    [
        ("very slow", 0.1, 0.70), ("slow", 0.72, 1.12), ("free", 1.14, 1.54),
        ("fast", 1.57, 1.96), ("very fast", 2.02, 3.0),
    ],
)  # fmt: skip
def test_groups_of_speed_are_schwartzs(group, slowest, fastest):
    """0.227, 0.363, 0.500 and 0.636 of sqrt(9.80665 · 0.98 m) = 3.100 m/s."""
    assert [speed_group(each, 0.98) for each in (slowest, fastest)] == [group, group]


def test_a_curve_is_as_many_times_the_band_as_it_is_larger_or_smaller():
    middle = np.sin(np.linspace(0.0, 6.0, 101))
    band = Band(middle - 0.3, middle + 0.3)
    assert (band.factor(2.5 * middle), band.factor(0.4 * middle)) == pytest.approx((2.5, 2.5))
    assert band.factor(-middle) == pytest.approx(100.0)


def test_one_curve_that_is_off_alike_is_within_the_normal_quantile():
    """1.96 SD; the larger of two sides, 2.24."""
    nothing, one = np.zeros(5), np.ones(5)
    assert at_once([{"a_r": one}], {"a_r": nothing}) == pytest.approx(1.960, abs=0.1)
    both = {"a_r": nothing, "a_l": nothing}
    assert at_once([{"a_r": one}, {"a_l": one}], both) == pytest.approx(2.236, abs=0.1)


@pytest.mark.parametrize(("height", "seen"), [(0.0200, False), (0.0225, True)])
def test_markers_within_a_centimetre_of_a_line_show_no_turn(height, seen):
    """Of a triangle of this height the RMS distance from the line is √2 / 3 of it: 9.4, 10.6 mm."""
    at = {"A": [0.0, 0.0, 0.0], "B": [0.1, 0.0, 0.0], "C": [0.05, height, 0.0]}
    markers = {name: np.array([place]) for name, place in at.items()}
    shift = np.array([1.0, 2.0, 3.0])
    standing = {name: place[0] + shift for name, place in markers.items()}
    centre = GivenCentre("R.Hip.Centre", "x", markers, np.array([[0.0, 0.0, 0.2]]), one_frame=False)
    found, refused = laid([centre], standing)
    assert (len(found), len(refused)) == (seen, not seen)
    for each in found:
        np.testing.assert_allclose(each.place, shift + np.array([0.0, 0.0, 0.2]))
        assert each.residual == pytest.approx(0.0, abs=1e-12)


def test_a_folder_of_this_second_is_not_taken_for_abandoned(tmp_path):
    (tmp_path / "gaitval-x-abcdefgh").mkdir()
    with own_folder(tmp_path, "gaitval-x-"):
        pass
    assert [each.name for each in tmp_path.iterdir()] == ["gaitval-x-abcdefgh"]


def test_a_foot_with_less_than_20_n_is_off_the_ground(monkeypatch):
    """At 1000 Hz every tenth sample is taken: muscles are found 100 times a second."""
    still = np.zeros((2000, 2, 3))
    force, free = still.copy(), np.full((2000, 2), 0.7)
    force[:, 0, 2], force[:, 1, 2] = 19.0, 21.0
    walk = SimpleNamespace(
        time=np.arange(2000) / 1000.0, positions=np.zeros((2000, 31)), ground_reaction=force,
        centre_of_pressure=still + np.array([1.0, 2.0, 0.0]), free_moment=free,
    )  # fmt: skip
    monkeypatch.setattr(walk_muscles, "inverse_dynamics", lambda *given: given)
    (_, time, positions, found, point, moment), _ = walk_muscles.walk_dynamics(walk, None)
    np.testing.assert_allclose(time, np.arange(200) / 100.0)
    assert len(positions) == len(found) == 200
    assert np.isnan(point[:, 0]).all()
    np.testing.assert_allclose(point[:, 1], np.tile([1.0, 2.0, 0.0], (200, 1)), atol=1e-9)
    np.testing.assert_allclose(moment, np.tile([0.0, 0.0, 0.7], (200, 2, 1)), atol=1e-9)
    tone = np.sin(2.0 * np.pi * 10.0 * walk.time)[:, None]  # its amplitude falls to √½
    walk.positions = np.tile(tone, 31)
    _, slow = walk_muscles.walk_dynamics(walk, None)
    assert np.std(slow[50:150]) == pytest.approx(0.5, abs=0.01)


def test_first_steps_are_drawn_over_milliseconds():
    step = Placement(
        1, 1, 0.65, *(np.array(each) for each in ([0.0, 0.06], [0.0, 0.12])), *2 * [None]
    )
    small = step._replace(extrapolated=np.array([0.5, 0.005]))
    axes = Figure().subplots()
    figures._shares(axes, [step, small])
    drawn = [line.get_xydata() for line in axes.lines]
    np.testing.assert_allclose(np.concatenate(drawn[:2]), [[650.0, 0.5]])
    assert drawn[2][0][0] == pytest.approx(300.0)


def test_an_ankle_that_moves_as_usual_has_the_usual_moment():
    trials, found = ankles.ankle_trials(), ankles._through(frozenset())
    powers = np.array([1.0, 0.35, 0.1225])
    usual = trials.angle_mean + powers @ found.angles @ trials.angle_shapes
    other = usual + 0.1 * trials.angle_shapes[0]
    change = ankles.ankle_moment(np.array([usual, other]), 0.35).change
    np.testing.assert_allclose(change[0], 0.0, atol=1e-6)
    np.testing.assert_allclose(change[1], 0.1 * found.slopes[0] @ trials.moment_shapes, atol=1e-6)


def test_beyond_trials_a_third_of_a_unit_apart_own_and_others_change_count_alike():
    """Others' by 0.8 of what it is: people differ."""
    own = normal_form(load_subject("S05").record(), load_subject("S05").leg_length_m)
    level = [speed.replace(own, speed=at, angles=np.full((18, 100), at)) for at in (0.2, 0.5)]
    others = speed.replace(own, angles=np.full((18, 100), 3.0))
    found = speed._moved(level, 0.6, others)
    np.testing.assert_allclose(found.angles, 0.5 + 0.1 * (0.5 * 0.8 * 3.0 + 0.5 * 1.0))
    between = speed._moved(level, 0.3, others)
    np.testing.assert_allclose(between.angles, 0.3)
    alone = speed._moved(level[1:], 0.6, others)
    np.testing.assert_allclose(alone.angles, 0.5 + 0.1 * 0.8 * 3.0)
    assert alone.stride_time / own.stride_time == pytest.approx(1.2**-0.47)


def test_a_head_of_20_cm_is_drawn_20_cm_above_the_shoulders():
    root = ElementTree.Element("mujoco")
    for segment in MODEL.segments:
        ElementTree.SubElement(root, "body", name=segment.name)
    mujoco_folder._limbs(root, MODEL)
    head = root.find(".//geom[@name='head']")
    place = [float(each) for each in head.attrib["pos"].split()]
    shoulders = [s.joint_position for s in MODEL.segments if PARENTS.get(s.name) == "torso"]
    np.testing.assert_allclose(place, np.mean(shoulders, axis=0) + np.array([0.0, 0.0, 0.2]))
    assert float(head.attrib["size"]) == 0.1
    shank = root.find(".//geom[@name='thigh_r_0']").attrib
    np.testing.assert_allclose(
        [float(each) for each in shank["fromto"].split()],
        [0.0] * 3 + [*MODEL["shank_r"].joint_position],
    )
    assert float(shank["size"]) == 0.065


@pytest.mark.parametrize(
    ("carried", "refused"), [(77.7, False), (79.1, True), (62.3, False), (60.9, True)]
)
def test_plates_may_carry_12_percent_more_or_less_than_the_mass(monkeypatch, carried, refused):
    force = np.tile([0.0, 0.0, 9.80665 * carried], (80, 1))
    monkeypatch.setattr(average, "total_forces", lambda _: [(None, None, force)])
    request = SimpleNamespace(mass_kg=70.0, aid=None)
    if refused:
        with pytest.raises(RecordError, match=rf"carry {carried} kg"):
            average.check_mass(request, [])
    else:
        assert average.check_mass(request, []) == pytest.approx(carried / 70.0)


@pytest.mark.parametrize(("column", "outward"), [(0, 0.3), (1, -0.3)])
def test_a_foot_is_beside_the_extrapolated_centre_of_mass(column, outward):
    """Hof: of a pendulum of 0.981 m, 1 m/s is √0.1 m; the foot is 0.3 m to the right of that."""
    walk = SimpleNamespace(
        centre=np.ones((1, 3)), velocity=np.full((1, 3), 10.0**0.5), pendulum=0.981,
        feet=np.full((1, 2, 3), [2.4, 1.7, 0.0]),
    )  # fmt: skip
    walk.rate = BalanceWalk.rate.fget(walk)
    walk.extrapolated = BalanceWalk.extrapolated.fget(walk)
    np.testing.assert_allclose(walk.extrapolated, [[2.0, 2.0]])
    step = SimpleNamespace(strike=0, column=column)
    np.testing.assert_allclose(BalanceWalk.offset(walk, step), [0.4, outward])


def test_torques_of_a_device_are_those_after_a_state_and_rates_the_mean_of_two_steps():
    log = np.array([[[1.0, 2, 3, 10, 4]], [[5.0, 6, 7, 20, 8]], [[9.0, 9, 9, 30, 20]]])
    expected = [[[5.0, 6, 7, 10, 6]], [[9.0, 9, 9, 20, 14]]]
    np.testing.assert_array_equal(device_walk.at_states(log), expected)
