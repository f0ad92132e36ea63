"""Start and trained policy on walks that were not used for learning."""

import math

import numpy as np
import pytest
from simulation_fixtures import changed, random_policy

from gaitval.metrics.policy_comparison import (
    between,
    handed_on,
    learning_gain,
    standing_of,
)
from gaitval.metrics.tolerances import push_limit
from gaitval.model.parameters import nominal_parameters
from gaitval.study.stored_policy import general_walker

MU = nominal_parameters()


def test_pushes_of_the_comparison_are_not_those_of_the_validation():
    assert between((0.0, 0.25, 0.5, 0.75)) == (0.125, 0.375, 0.625, 0.875)
    assert between((0.5,)) == (0.0,)
    np.testing.assert_allclose(between((0.1, 0.4)), (0.25, 0.75))
    assert not set(between((0.0, 0.3, 0.35))) & {0.0, 0.3, 0.35}


@pytest.fixture(scope="module")
def short(task):
    """A task whose walks and pushes take a second."""
    return changed(
        task,
        validation={
            "start_phases": (0.0, 0.5),
            "cycles": 3,
            "settling_cycles": 1,
            "consecutive_cycles": 4,
        },
        pushes={"phases": (0.0,), "cycles": 1.0},
        training={"workers": 1},
    )


@pytest.fixture(scope="module")
def walking(short):
    """A policy that walks."""
    return general_walker(short.configuration.environment)


def test_a_policy_that_makes_the_walker_fall_is_not_handed_on(short, walking):
    worse = random_policy(short, scale=30.0)
    walked = standing_of([short], walking, MU)
    assert not walked.needs_training(push_limit())
    gain = learning_gain([short], walked, worse, MU, samples=1000)
    assert gain.start is not None
    assert gain.trained.needs_training(push_limit())
    assert gain.start.epsilon is not None
    assert gain.start.falls == 0
    assert gain.trained.falls == gain.trained.walks == 2
    kept = handed_on(gain, walking, worse)
    assert kept.key == walking.key
    assert kept.about["samples"] == 0
    assert kept.about["model_hash"] == worse.about["model_hash"]
    better = learning_gain([short], gain.trained, walking, MU, samples=1000)
    assert handed_on(better, worse, walking) is walking


def test_the_result_does_not_depend_on_the_number_of_workers(short, walking):
    two = changed(short, training={"workers": 2})
    assert standing_of([short], walking, MU) == standing_of([two], walking, MU)


def test_several_tasks_count_together(short, walking):
    one, both = standing_of([short], walking, MU), standing_of([short, short], walking, MU)
    assert (both.walks, both.pushes) == (2 * one.walks, 2 * one.pushes)
    assert both.survived == 2 * one.survived
    assert both.weakest_phase == one.weakest_phase
    assert math.isclose(both.epsilon, one.epsilon)


def test_the_weakest_phase_counts_and_only_pushes_that_are_judged(short, walking, monkeypatch):
    task = changed(short, pushes={"phases": (0.0, 0.5)})  # compared at 0.25 and 0.75

    def stands(group, tried):
        pushes = [each.push for each in tried]
        return [
            # at 0.25 all but straight ahead and one behind, at 0.75 all but one behind
            not (each.phase == 0.25 and math.isclose(each.direction, 0.0))
            and not math.isclose(abs(each.direction), math.pi)
            for each in pushes
        ]

    monkeypatch.setattr("gaitval.metrics.policy_comparison.survive_together", stands)
    found = standing_of([task], walking, MU)
    assert (found.pushes, found.survived) == (48, 45)
    # of 24 directions, 13 are not behind
    assert math.isclose(found.weakest_phase, 100.0 * 12 / 13)
