"""References between those that are known."""

import numpy as np
import pytest

from gaitval.apps.live.blending import Blend
from gaitval.policy.environment import WalkingEnvironment


@pytest.fixture
def environments(person):
    return [WalkingEnvironment(task) for task in person.tasks]


@pytest.fixture
def own(person):
    """That the tables are written into."""
    return WalkingEnvironment(person.tasks[0])


@pytest.mark.parametrize("number", range(3))
def test_at_a_known_speed_it_is_that_reference(person, environments, own, number):
    blend = Blend(environments)
    targets = blend.at(person.speeds[number], own.yardstick.targets, own.walker.tables)
    known = environments[number]
    for mine, theirs in zip(targets, known.yardstick.targets, strict=True):
        np.testing.assert_allclose(mine, theirs, rtol=1e-12, atol=1e-12)
    for mine, theirs in zip(own.walker.tables, known.walker.tables, strict=True):
        np.testing.assert_allclose(mine, theirs, rtol=1e-12, atol=1e-12)
    assert blend.now.stride_time == pytest.approx(person.tasks[number].reference.stride_time)


def test_between_two_the_velocity_is_the_derivative_of_the_position(person, environments, own):
    blend = Blend(environments)
    speed = 0.5 * (person.speeds[1] + person.speeds[2])
    blend.at(speed, own.yardstick.targets, own.walker.tables)
    tables = own.walker.tables
    count = len(tables.positions) - 1
    rate = (np.roll(tables.positions[:-1], -1, 0) - np.roll(tables.positions[:-1], 1, 0)) / 2
    rate *= count / blend.now.stride_time
    largest = np.abs(tables.velocities).max()
    np.testing.assert_allclose(tables.velocities[:-1], rate, atol=0.01 * largest)
    assert blend.now.stride_length / blend.now.stride_time == pytest.approx(speed)


def test_beyond_what_is_known_it_is_the_nearest(person, environments, own):
    blend = Blend(environments)
    blend.at(9.0, own.yardstick.targets, own.walker.tables)
    assert blend.now.speed == person.speeds[-1] == blend.fastest
    blend.at(0.01, own.yardstick.targets, own.walker.tables)
    assert blend.now.speed == person.speeds[0] == blend.slowest


def test_one_reference_is_enough(environments, own):
    blend = Blend(environments[:1])
    blend.at(5.0, own.yardstick.targets, own.walker.tables)
    assert blend.now.speed == blend.slowest == blend.fastest
