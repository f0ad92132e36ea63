"""Warnings that Newton's law gives: forces that the motion of the body does not need."""

import re

import numpy as np
import pytest

from gaitval.constants import STANDARD_GRAVITY
from gaitval.findings import look
from gaitval.findings.laboratory import Laboratory
from gaitval.findings.motion import LEG_SHARE, Balance, Swings
from gaitval.mocap.recording import Event, FootForces

MASS = 70.0
WEIGHT = MASS * STANDARD_GRAVITY
RATE = 100.0
STEP = 0.5
"""s, on each foot in turn, without double support."""


def found(needed, loads):
    flags = look(Balance(needed, loads, MASS)).flags
    return [each for each in flags if each.check != "weight"]


def weight_warnings(needed, loads):
    flags = look(Balance(needed, loads, MASS)).flags
    return [each for each in flags if each.check == "weight"]


def walked(seconds=4.0):
    """Forces on both feet, at the frames of the markers: each foot carries the body in turn."""
    time = np.arange(round(seconds * RATE)) / RATE
    into = time % STEP / STEP
    body = WEIGHT * np.column_stack(
        [
            -0.15 * np.cos(np.pi * into),
            0.05 * np.where(time % (2 * STEP) < STEP, 1.0, -1.0),
            1.0 + 0.2 * np.sin(2 * np.pi * into),
        ]
    )
    right = (time % (2 * STEP) < STEP)[:, None]
    force = np.stack([np.where(right, body, 0.0), np.where(right, 0.0, body)], axis=1)
    valid = np.ones((len(time), 2), dtype=bool)
    return FootForces(RATE, 10.0, force, np.full_like(force, np.nan), 0.0 * force, valid)


def needs(loads):
    """What the motion needs where the plates are right."""
    return loads.force.sum(axis=1)


def test_forces_that_the_motion_needs():
    loads = walked()
    assert not found(needs(loads), loads)
    assert not list(weight_warnings(needs(loads), loads))


@pytest.mark.parametrize(
    ("carried", "limit"), [(1.25, 1.2), (1.19, None), (0.81, None), (0.75, 0.8)]
)
def test_plates_that_carry_another_weight(carried, limit):
    """The vertical force alone says so; the limit named is the one that was passed."""
    loads = walked()
    needed = needs(loads) / carried
    warnings = list(weight_warnings(needed, loads))
    assert [each.limit for each in warnings] == ([] if limit is None else [pytest.approx(limit)])
    for each in warnings:
        assert each.value == pytest.approx(carried)


@pytest.mark.parametrize(("shown", "judged"), [(0.29, False), (0.31, True)])
def test_of_less_than_0_3_s_nothing_is_concluded(shown, judged):
    """0.1 s at each edge of the known part is not used, at an end of the trial all of it is."""
    loads = walked()
    loads.valid[:] = False
    loads.valid[100 : 120 + round(shown * RATE)] = True
    twice = 0.5 * needs(loads)
    assert len(list(weight_warnings(twice, loads))) == judged
    loads.valid[:] = False
    loads.valid[: 10 + round(shown * RATE)] = True
    assert len(list(weight_warnings(twice, loads))) == judged


def test_both_feet_must_be_known():
    loads = walked()
    loads.valid[:, 1] = False
    assert not list(weight_warnings(0.5 * needs(loads), loads))
    assert not found(0.5 * needs(loads), loads)


def with_rate(loads, ratio):
    """What markers need whose vertical acceleration is `ratio` times the true one."""
    needed = needs(loads)
    needed[:, 2] = WEIGHT + ratio * (needed[:, 2] - WEIGHT)
    return needed


@pytest.mark.parametrize(
    ("ratio", "limit", "certain"),
    [(4.0, 1.8, True), (2.0, 1.8, False), (1.7, None, False), (0.55, None, False),
     (0.45, 0.5, False), (0.25, 0.5, True), (-1.0, None, False)],
)  # fmt: skip
def test_a_frame_rate_changes_accelerations_by_its_square(ratio, limit, certain):
    loads = walked()
    warnings = [each for each in found(with_rate(loads, ratio), loads) if "rate" in each.check]
    if limit is None:
        assert not warnings
        return
    (warning,) = warnings
    assert (warning.limit, warning.certain) == (limit, certain)
    assert warning.value == pytest.approx(ratio)


def test_a_wrong_frame_rate_is_the_only_warning_and_a_wrong_mass_is_none():
    loads = walked()
    needed = with_rate(loads, 4.0) + np.array([0.1 * WEIGHT, 0.0, 0.0])
    assert [each.check for each in found(needed, loads)] == ["frame rate"]
    heavy = needs(loads) + np.array([0.0, 0.0, 0.15 * WEIGHT])
    assert not found(heavy, loads)


def test_no_frame_rate_from_forces_that_have_nothing_to_do_with_the_motion():
    """Nor from a foot that no plate shows: the other one's force hardly changes."""
    loads = walked()
    needed = needs(loads)
    needed[:, 2] = WEIGHT * (1.0 + 0.1 * np.sin(2 * np.pi * 3.3 * loads.time))
    assert "frame rate" not in {each.check for each in found(needed, loads)}
    loads.force[:, 1] = 0.0
    assert "frame rate" not in {each.check for each in found(with_rate(loads, 4.0), loads)}


@pytest.mark.parametrize(("off", "words"), [(-0.5, "50 % of the body weight less"),
                                            (0.5, "50 % of the body weight more")])  # fmt: skip
def test_a_plate_that_is_silent_for_a_moment(off, words):
    """12.00 s on the recording's clock, which began at 10 s."""
    loads = walked()
    needed = needs(loads)
    loads.force[197:204, 0, 2] += off * WEIGHT
    (warning,) = [each for each in found(needed, loads) if "vertical" in each.check]
    assert warning.value == pytest.approx(0.5)
    assert words in warning.message
    assert re.search(r"at (12\.0[01]|11\.99) s", warning.message)


def swings(*lengths, side="right"):
    """Events of one foot whose swings take so long, s, a second apart."""
    return [
        event
        for number, length in enumerate(lengths)
        for event in (
            Event(float(number), side, "toe_off"),
            Event(number + length, side, "heel_strike"),
        )
    ]


@pytest.mark.parametrize(
    ("relative", "words"),
    [(0.97, "too high"), (1.03, None), (2.15, None), (2.25, "too low")],
)
def test_a_swing_of_a_pendulum(relative, words):
    """A leg of 0.53 of the stature swings in 1 to 2.2 times the root of its length over g."""
    height = 1.75
    swing = relative * np.sqrt(LEG_SHARE * height / STANDARD_GRAVITY)
    warnings = list(look(Swings(swings(swing), height)).flags)
    assert len(warnings) == (words is not None)
    for each in warnings:
        assert each.value == pytest.approx(relative)
        assert each.limit == (1.0 if relative < 1.0 else 2.2)
        assert words in each.message
    with_forces = list(look(Swings(swings(swing), height, forces=True)).flags)
    assert len(with_forces) == (relative < 1.0)


@pytest.mark.parametrize(
    ("belt", "feet", "warned"),
    [
        (1.2, 1.16, False),  # flat feet roll
        (1.2, 1.1, True),
        (1.2, 1.3, True),
        (1.2, -1.2, True),  # the other way
        (0.4, 0.375, False),
        (0.4, 0.36, True),  # 10 %: more than 5 %, and than 3 cm/s
        (0.2, 0.18, False),
        (0.0, 0.0, False),
        (1.2, 0.0, True),  # over ground
    ],
)
def test_a_belt_at_another_speed_than_the_feet(belt: float, feet: float, warned: bool) -> None:
    warnings = list(look(Laboratory(belt, feet)).flags)
    assert len(warnings) == warned
    for warning in warnings:
        assert f"move back at {feet:.3f} m/s" in str(warning)
