"""Learning never hands on a policy that is worse than its start."""

import json
import math

import numpy as np
import pytest
from simulation_fixtures import changed, random_policy

from gaitval.metrics.learning_gain import (
    LearningGain,
    Standing,
    between,
    handed_on,
    learning_gain,
    standing_of,
)
from gaitval.model.parameters import nominal_parameters
from gaitval.study.run import general_walker

MU = nominal_parameters()
BEFORE = Standing(walks=8, falls=1, pushes=96, survived=90, epsilon=0.25, scatter=0.002)


def trained(**differences):
    return Standing(**{**BEFORE.__dict__, **differences})


@pytest.mark.parametrize(
    ("differences", "kept"),
    [
        ({}, True),
        ({"falls": 0, "survived": 96, "epsilon": 0.2}, True),
        ({"falls": 2, "survived": 96, "epsilon": 0.2}, False),
        ({"falls": 0, "survived": 89, "epsilon": 0.2}, False),
        ({"falls": 0, "survived": 96, "epsilon": 0.2501}, False),
        ({"epsilon": None, "scatter": None}, False),
    ],
)
def test_what_is_worse_in_anything_is_not_handed_on(differences, kept):
    found = LearningGain(500, BEFORE, trained(**differences))
    assert found.trained_is_handed_on is kept
    assert found.as_dict()["handed_on"] == ("trained" if kept else "start")
    assert ("the start is handed on" in found.in_words()) is not kept
    json.dumps(found.as_dict())


def test_a_start_that_does_not_walk_a_cycle_is_never_kept_for_its_epsilon():
    fell = trained(epsilon=None, scatter=None)
    assert LearningGain(500, fell, BEFORE).trained_is_handed_on


def test_what_was_learned_from_nothing_is_handed_on():
    found = LearningGain(500, None, trained(falls=8, survived=0, epsilon=None))
    assert found.trained_is_handed_on
    assert "from nothing" in found.in_words()


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
    gain = learning_gain([short], walking, worse, MU, samples=1000)
    assert gain.start is not None
    assert gain.start.epsilon is not None
    assert gain.start.falls == 0
    assert gain.trained.falls == gain.trained.walks == 2
    kept = handed_on(gain, walking, worse)
    assert kept.key == walking.key
    assert kept.about["samples"] == 0
    assert kept.about["model_hash"] == worse.about["model_hash"]
    better = learning_gain([short], worse, walking, MU, samples=1000)
    assert handed_on(better, worse, walking) is walking


def test_the_result_does_not_depend_on_the_number_of_workers(short, walking):
    two = changed(short, training={"workers": 2})
    assert standing_of([short], walking, MU) == standing_of([two], walking, MU)


def test_several_tasks_count_together(short, walking):
    one, both = standing_of([short], walking, MU), standing_of([short, short], walking, MU)
    assert (both.walks, both.pushes) == (2 * one.walks, 2 * one.pushes)
    assert both.survived == 2 * one.survived
    assert math.isclose(both.epsilon, one.epsilon)
