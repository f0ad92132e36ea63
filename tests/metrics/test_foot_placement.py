"""The analysis of foot placement against a pendulum that walks by a known law, on both sides."""

import numpy as np
import pytest
from walking_pendulum import BACK, DT, OUT, RATE, SIGN, STEP_TIME, pendulum

from gaitval.metrics.foot_placement import (
    ankle_answer,
    answered,
    placements,
    step_delay,
    steps_to_recover,
)

EACH = round(STEP_TIME / DT)
KICK = 0.2  # m/s


def beside(kicks, *, law=None, first=0, **others):
    pushed = pendulum(kicks, first=first, law=law, **others)
    plain = pendulum(first=first)
    return pushed, plain, list(placements(pushed, plain, ends=DT))


def where_it_was(first):
    """The law of one who does not react: feet as in the undisturbed walk."""
    plain = pendulum(first=first)
    feet = {n: plain.feet[step.strike, step.column, :2] for n, step in enumerate(plain.steps, 1)}
    return lambda extrapolated, column, number: feet[number]


@pytest.mark.parametrize("first", [0, 1])
@pytest.mark.parametrize("left", [KICK, -KICK])
def test_a_foot_that_keeps_its_distance_has_no_change_of_it_and_shifts_with_the_fall(first, left):
    row = 4 * EACH + 12
    pushed, _, found = beside([(row, 0.0, left)], first=first)
    expected = left / RATE * np.exp(RATE * (5 * EACH - row) * DT)
    assert found[0].foot == pytest.approx([0.0, expected], abs=1e-9)
    assert found[0].offset == pytest.approx([0.0, 0.0], abs=1e-9)
    assert found[0].lead == pytest.approx((5 * EACH - row) * DT)
    assert steps_to_recover(found) == 0
    assert found[0].guess == pytest.approx([0.0, expected], rel=1e-6)
    assert pushed.offset(pushed.steps[0]) == pytest.approx([BACK, OUT])


@pytest.mark.parametrize("first", [0, 1])
@pytest.mark.parametrize("left", [KICK, -KICK])
def test_without_reaction_the_fall_is_outward_of_one_foot_and_inward_of_the_other(first, left):
    row = 4 * EACH + 40
    _, _, found = beside([(row, 0.0, left)], first=first, law=where_it_was(first))
    one, two = found[:2]
    assert one.foot == pytest.approx([0.0, 0.0], abs=1e-12)
    # fallen to the left: less room outward of a left foot, more of a right one
    assert one.offset[1] == pytest.approx(-SIGN[one.column] * one.extrapolated[1])
    assert np.sign(one.extrapolated[1]) == np.sign(left)
    assert np.sign(two.offset[1]) == -np.sign(one.offset[1])
    assert steps_to_recover(found) is None


@pytest.mark.parametrize("forward", [KICK, -KICK])
def test_a_push_forward_lengthens_the_step_that_keeps_its_distance(forward):
    _, _, found = beside([(4 * EACH + 6, forward, 0.0)])
    assert np.sign(found[0].foot[0]) == np.sign(forward)
    assert found[0].offset == pytest.approx([0.0, 0.0], abs=1e-9)


def test_a_late_push_is_corrected_by_the_step_after():
    def late(extrapolated, column, number):
        if number == 5:
            return feet[number]
        return extrapolated + np.array([BACK, SIGN[column] * OUT])

    plain = pendulum()
    feet = {n: plain.feet[step.strike, step.column, :2] for n, step in enumerate(plain.steps, 1)}
    _, _, found = beside([(5 * EACH - 8, 0.0, 3 * KICK)], law=late)
    assert found[0].lead == pytest.approx(0.08)
    assert answered(found, 0.3) == found[1]
    assert found[1].offset == pytest.approx([0.0, 0.0], abs=1e-9)
    assert steps_to_recover(found) == 1


@pytest.mark.parametrize("left", [KICK, -KICK])
@pytest.mark.parametrize("first", [0, 1])
def test_the_ankle_answers_towards_the_fall_when_the_pressure_moves_there(left, first):
    row, late = 4 * EACH + 4, 20

    def shift(at):
        return 0.01 * np.sign(left) if row + late <= at < 5 * EACH else 0.0

    pushed, plain, _ = beside([(row, 0.0, left)], first=first, pressure_shift=shift)
    found = ankle_answer(pushed, plain)
    assert found.shift == pytest.approx(0.01)
    assert found.delay == pytest.approx(late * DT)
    away = pendulum([(row, 0.0, left)], first=first, pressure_shift=lambda at: -shift(at))
    assert ankle_answer(away, plain).shift == pytest.approx(-0.01)


def test_a_pressure_that_the_push_moves_the_other_way_first_is_no_answer():
    row, late = 4 * EACH + 4, 20

    def shift(at):
        if row <= at < row + 5:
            return -0.008
        return 0.01 if row + late <= at < 5 * EACH else 0.0

    pushed, plain, _ = beside([(row, 0.0, KICK)], pressure_shift=shift)
    assert ankle_answer(pushed, plain).delay == pytest.approx(late * DT)


def test_the_shortest_time_for_a_step_is_where_feet_begin_to_follow():
    def slow(extrapolated, column, number):
        keeps = extrapolated + np.array([BACK, SIGN[column] * OUT])
        return keeps if number != 5 or lead >= 0.3 else feet[number]

    plain = pendulum()
    feet = {n: plain.feet[step.strike, step.column, :2] for n, step in enumerate(plain.steps, 1)}
    found = []
    for lead in np.arange(0.1, 0.5, 0.02):
        row = 5 * EACH - round(lead / DT)
        found += beside([(row, 0.0, KICK)], law=slow)[2][:1]
    assert step_delay(found) == pytest.approx(0.3, abs=0.03)
    assert step_delay(found[:2]) is None
