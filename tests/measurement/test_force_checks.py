"""Warnings about the forces of plates: channels, and what walking never shows."""

from dataclasses import replace

import numpy as np
import pytest
from synthetic_recording import BELTS, walk

from gaitval.findings import look
from gaitval.findings.plates import Plates
from gaitval.findings.stances import Stance, stance_figures, stances_of, whole_stances
from gaitval.mocap.force_plates import plate_axes
from gaitval.mocap.recording import FootForces, Plate, Recording


def channel_warnings(plate, rate):
    return look(Plates((plate,), rate, {}, {})).flags


def place_warnings(plate, outside, used):
    counts = {plate.name: used}, {plate.name: outside}
    flags = look(Plates((plate,), 500.0, *counts)).flags
    return [each for each in flags if each.check == "centre of pressure under the foot"]


def force_warnings(recording, forces, pelvis):
    return look(stances_of(recording, forces, pelvis)).flags


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
    assert not list(channel_warnings(waves(), 500.0))


def test_a_dead_vertical_channel():
    plate = waves()
    plate.force[:, 2] *= 1e-3
    (warning,) = channel_warnings(plate, 500.0)
    assert warning.certain
    assert "the vertical force hardly changes" in warning.message


def test_a_plate_that_nobody_steps_on():
    plate = waves()
    assert not list(channel_warnings(replace(plate, force=0.01 * plate.force), 500.0))


@pytest.mark.parametrize(("step", "clipped"), [(0.0, False), (0.5, False), (None, True)])
def test_a_clipped_force_but_not_one_stored_in_steps(step, clipped):
    plate = waves(rate=1000.0)
    vertical = plate.force[:, 2]
    if step is None:
        plate.force[:, 2] = np.minimum(vertical, 650.0)
    elif step:
        plate.force[:, 2] = np.round(vertical / step) * step
    found = [d for d in channel_warnings(plate, 1000.0) if d.check == "saturated channel"]
    assert len(found) == clipped
    assert len(list(channel_warnings(plate, 1000.0))) == clipped


def test_a_centre_of_pressure_that_is_nowhere_under_the_foot():
    down = np.array([[0.5, 1.0, 0.0], [-0.5, 1.0, 0.0], [-0.5, -1.0, 0.0], [0.5, -1.0, 0.0]])[::-1]
    assert plate_axes(down)[2, 2] == -1.0
    plate = replace(waves(), corners=down)
    assert not list(place_warnings(plate, outside=2, used=3))
    (warning,) = place_warnings(plate, outside=3, used=2)
    assert "3 of 5" in warning.message
    assert "CORNERS" not in warning.message
    (warning,) = place_warnings(replace(plate, corners=down[::-1]), outside=3, used=2)
    assert "FORCE_PLATFORM:CORNERS" in warning.message


NO_CORNERS = np.full((4, 3), np.nan)
PELVIS = np.array([0.0, 0.0, 1.0])
"""m, above the origin; the feet of `stepped` stand 0.1 m beside it."""


def stepped(
    side="right",
    early=-0.1,
    late=0.1,
    sideways=0.0,
    inward=0.05,
    twist=0.004,
    steps=1,
    where=0.1,
):
    """A plate with contacts of 100 samples of constant vertical force, and what it shows of a foot.

    Parameters
    ----------
    early, late : fore-aft force in the first and last 40 samples, over the vertical one.
    sideways : change of the sideways force, to the left, from the first to the last 40 samples.
    inward : mean sideways force, towards the other foot.
    twist : m, free moment over vertical force, inwards.
    """
    column, sign = (0, 1.0) if side == "right" else (1, -1.0)
    one = np.zeros((100, 3))
    one[:, 2] = 700.0
    one[:40, 0], one[60:, 0] = 700.0 * early, 700.0 * late
    one[:, 1] = 700.0 * sign * inward
    one[60:, 1] += 700.0 * sideways / 2
    one[:40, 1] -= 700.0 * sideways / 2
    moment = np.zeros((100, 3))
    moment[:, 2] = 700.0 * sign * twist
    rest = np.zeros((60, 3))
    force = np.concatenate([rest, *[np.concatenate([one, rest]) for _ in range(steps)]])
    free = np.concatenate([rest, *[np.concatenate([moment, rest]) for _ in range(steps)]])
    on = force[:, 2] > 0.0
    point = np.where(on[:, None], [0.0, -sign * where, 0.0], np.nan)
    both = {"force": force, "point": point, "free": free}
    both = {
        name: np.stack([values if i == column else empty for i in (0, 1)], axis=1)
        for name, values in both.items()
        for empty in [np.full_like(values, np.nan) if name == "point" else 0.0 * values]
    }
    forces = FootForces(
        200.0, 0.0, both["force"], both["point"], both["free"],
        np.ones((len(force), 2), dtype=bool),
    )  # fmt: skip
    return Plate("1", NO_CORNERS, force, point, free), forces


def doubts_of(plate, forces, pelvis=PELVIS):
    """Those about whole stances, but for that of their edges, which are steep here."""
    recording = Recording(
        "w", "project", ("A",), np.zeros((len(forces.force) // 2, 1, 3)), 100.0, plates=(plate,),
        force_rate=200.0,
    )  # fmt: skip
    found = force_warnings(recording, forces, np.tile(pelvis, (len(forces.force), 1)))
    return [each for each in found if "channel" not in each.check]


@pytest.mark.parametrize("side", ["right", "left"])
def test_figures_of_a_stance_of_constant_parts(side):
    """Impulses of parts of a stance, over the vertical impulse of all of it."""
    plate, forces = stepped(side, early=-0.2, late=0.1, sideways=0.06, twist=0.008)
    (stance,) = whole_stances(
        Recording("w", "project", ("A",), np.zeros((10, 1, 3)), 100.0, plates=(plate,)), forces
    )
    assert stance == Stance(side, "1", 60, 160)
    figures = stance_figures(stance, forces, np.tile(PELVIS, (len(forces.force), 1)))
    assert figures.braking == pytest.approx(0.4 * (0.1 + 0.2))
    assert figures.sideways == pytest.approx(0.4 * 0.06)
    # samples 15 to 84: 25 early and 25 late ones, whose changes cancel
    assert figures.inward == pytest.approx(0.7 * 0.05)
    assert figures.lean == pytest.approx(0.1)
    assert figures.twist == pytest.approx(0.008)
    high = stance_figures(stance, forces, np.tile([0.0, 0.0, 2.0], (len(forces.force), 1)))
    assert high.lean == pytest.approx(0.1 / 2.0)
    assert not doubts_of(plate, forces)


def test_a_stance_counts_from_heel_strike_to_toe_off_on_valid_plates():
    plate, forces = stepped(steps=3)
    recording = Recording("w", "project", ("A",), np.zeros((10, 1, 3)), 100.0, plates=(plate,))
    assert [each.begin for each in whole_stances(recording, forces)] == [60, 220, 380]
    forces.valid[230, 0] = False
    assert [each.begin for each in whole_stances(recording, forces)] == [60, 380]
    for cut, begins in ((slice(61, None), [159, 319]), (slice(0, 479), [60])):
        part = replace(
            forces, force=forces.force[cut], valid=forces.valid[cut],
            centre_of_pressure=forces.centre_of_pressure[cut],
            free_moment=forces.free_moment[cut],
        )  # fmt: skip
        found = [each.begin for each in whole_stances(recording, part)]
        assert found == [each for each in begins if part.valid[each : each + 100].all()]


def braking(change, **other):
    return {"early": -change / 0.8, "late": change / 0.8} | other


PUSH, SIDEWAYS = "push towards the middle line", "fore-aft and sideways force"
BRAKING, TWIST = "braking before propulsion", "size of the free moment"
NAMES = [
    (braking(0.03), None, 0.0, False),
    # hardly any may be a person who shuffles
    (braking(0.015), BRAKING, 0.015, False),
    (braking(-0.015), BRAKING, -0.015, False),
    (braking(-0.03), BRAKING, -0.03, True),
    ({"inward": 0.01 / 0.7}, None, 0.0, False),
    ({"inward": -0.01 / 0.7}, PUSH, -0.01, False),
    ({"inward": -0.025 / 0.7}, PUSH, -0.025, True),
    # the body is not certainly inward of the foot
    ({"inward": -0.025 / 0.7, "where": 0.01}, PUSH, -0.025, False),
    # turned round it were 0.05 with the body 0.1 inwards
    ({"inward": -0.003 / 0.7}, None, 0.0, False),
    ({"inward": -0.003 / 0.7, "where": 0.01}, PUSH, -0.003, False),
    ({"twist": 0.029}, None, 0.0, False),
    ({"twist": 0.031}, TWIST, 0.031, False),
    ({"twist": 0.2}, TWIST, 0.2, True),
    # by more than 3 %, and twice what the fore-aft force changes
    (braking(0.025, sideways=0.06 / 0.4), SIDEWAYS, 0.06, True),
    (braking(0.025, sideways=-0.06 / 0.4), SIDEWAYS, 0.06, True),
    (braking(-0.025, sideways=0.06 / 0.4), SIDEWAYS, 0.06, True),
    (braking(0.025, sideways=0.045 / 0.4), None, 0.0, False),
    (braking(0.005, sideways=0.032 / 0.4), SIDEWAYS, 0.032, True),
]
"""A stance, and the only finding of it, its value and whether it cannot be right."""


@pytest.mark.parametrize("side", ["right", "left"])
@pytest.mark.parametrize(("made", "check", "value", "certain"), NAMES)
def test_what_walking_never_shows_is_named(side, made, check, value, certain):
    found = doubts_of(*stepped(side, **made))
    assert [(each.check, each.certain) for each in found] == (
        [] if check is None else [(check, certain)]
    )
    for each in found:
        assert each.value == pytest.approx(value)


@pytest.mark.parametrize(
    ("braking", "fall", "words"),
    [(0.015, 0.03, None), (0.015, 0.1, "no wrong sign"), (0.0, 0.06, "no wrong sign"),
     (-0.015, 0.03, "wrong sign or axis"), (-0.015, -0.03, "wrong sign or axis")],
)  # fmt: skip
def test_a_childs_small_braking_is_no_wrong_sign(braking, fall, words):
    """Who falls little over the foot needs little; hardly any of what is needed is told as such."""
    plate, forces = stepped(early=-braking / 0.8, late=braking / 0.8)
    pelvis = np.tile(PELVIS, (len(forces.force), 1))
    # A lean of the whole ends of the stance, over the pelvis' height.
    pelvis[60:100, 0], pelvis[120:160, 0] = (
        PELVIS[0] + sign * PELVIS[2] * fall / 0.8 for sign in (-1.0, 1.0)
    )
    recording = Recording(
        "w", "project", ("A",), np.zeros((len(forces.force) // 2, 1, 3)), 100.0, plates=(plate,),
        force_rate=200.0,
    )  # fmt: skip
    (stance,) = whole_stances(recording, forces)
    assert stance_figures(stance, forces, pelvis).fall == pytest.approx(fall, abs=1e-3)
    found = [
        each
        for each in force_warnings(recording, forces, pelvis)
        if each.check == "braking before propulsion"
    ]
    assert len(found) == (words is not None)
    for each in found:
        assert words in each.message


def test_without_a_pelvis_nothing_is_certain_of_an_outward_push():
    (warning,) = doubts_of(*stepped(inward=-0.05), pelvis=np.full(3, np.nan))
    assert not warning.certain


def test_stances_of_both_feet_on_a_plate_count_together():
    """A sign is wrong for a plate, not for a foot: one that brakes twice as much makes up for one
    that does not brake."""
    plate, forces = stepped(early=0.0, late=0.0, steps=2)
    forces.force[220:320, 1] = forces.force[220:320, 0]
    forces.force[220:320, 1, 0] = np.repeat([-140.0, 0.0, 140.0], [40, 20, 40])
    forces.force[220:320, 1, 1] *= -1.0
    forces.centre_of_pressure[220:320, 1] = -forces.centre_of_pressure[220:320, 0]
    forces.free_moment[220:320, 1] = -forces.free_moment[220:320, 0]
    forces.force[220:320, 0] = 0.0
    assert not doubts_of(plate, forces)
    forces.force[220:320, 1, 0] = 0.0
    (warning,) = doubts_of(plate, forces)
    assert warning.where == "plate 1 (right and left foot, 2 stances)"


@pytest.mark.parametrize(
    ("kind", "limit", "impossible"),
    [("fore-aft", 0.01, 0.002), ("sideways", 0.01, 0.002), ("first", 0.005, 0.001),
     ("second", 0.005, 0.001), ("vertical moment", 0.003, 0.0005)],
)  # fmt: skip
def test_the_range_below_which_a_channel_is_dead(kind, limit, impossible):
    """Of forces and the moment over the weight, of the centre of pressure in m."""
    for size, certain in ((1.1 * limit, None), (0.9 * limit, False), (0.9 * impossible, True)):
        plate = waves()
        loaded = plate.force[:, 2] > 100.0  # N
        weight = np.percentile(plate.force[loaded, 2], 95.0)
        sweep = np.linspace(-0.5, 0.5, loaded.sum()) * size
        force, point, moment = (
            values.copy() for values in (plate.force, plate.centre_of_pressure, plate.moment)
        )
        if kind in ("fore-aft", "sideways"):
            force[loaded, ("fore-aft", "sideways").index(kind)] = weight * sweep
        elif kind in ("first", "second"):
            axes = np.asarray(plate_axes(plate.corners))
            own = (point[loaded] - plate.corners.mean(axis=0)) @ axes
            own[:, ("first", "second").index(kind)] = sweep
            point[loaded] = own @ axes.T + plate.corners.mean(axis=0)
        else:
            about = moment - np.cross(plate.corners.mean(axis=0), force)
            moment[loaded, 2] += weight * sweep - about[loaded, 2]
        bent = replace(plate, force=force, centre_of_pressure=point, moment=moment)
        warnings = [each for each in channel_warnings(bent, 500.0) if "dead channel" in each.check]
        warnings = [each for each in warnings if kind in each.message]
        assert [each.certain for each in warnings] == ([] if certain is None else [certain])
        for each in warnings:
            assert each.value == pytest.approx(size, rel=0.02)
            assert each.limit == limit


@pytest.mark.parametrize("sign", [1.0, -1.0])
@pytest.mark.parametrize(("milliseconds", "warned"), [(22, False), (28, True)])
@pytest.mark.parametrize("axis", [0, 1])
def test_a_horizontal_force_that_stays_at_either_end_for_25_ms(axis, sign, milliseconds, warned):
    plate = waves(rate=1000.0)
    plate.force[100 : 100 + milliseconds, axis] = sign * 200.0
    found = [each for each in channel_warnings(plate, 1000.0) if "saturated" in each.check]
    assert len(found) == warned
    for each in found:
        assert each.value == pytest.approx(0.001 * milliseconds)
