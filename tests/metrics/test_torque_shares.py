"""The parts of a joint moment, on walks whose servo and policy are known."""

from dataclasses import replace

import numpy as np
import pytest
from simulation_fixtures import random_policy

from gaitval.coordinates import ACTUATED
from gaitval.metrics.cycles import GaitCycles
from gaitval.metrics.results import PARTS
from gaitval.metrics.torque_shares import moment_parts, torque_shares
from gaitval.model.parameters import PARAMETERS, nominal_parameters
from gaitval.policy.environment import WalkingEnvironment
from gaitval.policy.rollouts import record_rollout
from gaitval.walk.simulation.servo import servo_stiffness


def _walk(task, scale, **mu):
    parameters = nominal_parameters()
    for name, value in mu.items():
        parameters[PARAMETERS.index(name)] = value
    return record_rollout(
        WalkingEnvironment(task),
        random_policy(task, scale=scale),
        mu=parameters,
        start_phase=0.2,
        cycles=0.4,
    )


def _cycles(walk):
    """All rows as one right cycle."""
    whole = {"right": np.array([0]), "left": np.array([], dtype=int)}
    ends = {"right": np.array([len(walk.time) - 1]), "left": np.array([], dtype=int)}
    return GaitCycles(starts=whole, ends=ends, events={})


def test_the_parts_add_up_to_the_moment(task):
    walk = _walk(task, 0.2)
    parts = moment_parts(walk, task)
    assert tuple(parts) == PARTS
    np.testing.assert_allclose(sum(parts.values()), walk.moments[:-1], atol=1e-9)


def test_without_a_policy_its_part_is_nothing(task):
    """Whatever the phase, the pace and the passive damping."""
    walk = _walk(task, 0.0, damping=2.0)
    parts = moment_parts(walk, task)
    assert np.abs(parts["policy"]).max() < 1e-8 * np.abs(walk.moments).max()
    rates = np.diff(walk.positions[:, 6:], axis=0) / (walk.time[1] - walk.time[0])
    np.testing.assert_allclose(parts["passive"], -2.0 * rates)


def test_the_policy_moves_the_targets_in_straight_lines(task):
    """Its offset changes linearly during an action, so k a has a kink at its ends alone."""
    walk = _walk(task, 0.2)
    stiffness = servo_stiffness(task.configuration.servo, task.model.mass)
    offset = moment_parts(walk, task)["policy"] / stiffness
    steps = task.configuration.environment.steps_per_action
    bend = np.diff(offset, n=2, axis=0)
    kinks = np.arange(len(bend)) % steps == steps - 3
    assert np.abs(bend[~kinks]).max() < 1e-9
    assert np.abs(bend[kinks]).max() > 1e-4


def test_the_fed_forward_part_follows_its_setting(task):
    settings = task.configuration.servo.model_copy(update={"feed_forward": 0.0})
    configuration = task.configuration.model_copy(update={"servo": settings})
    without = replace(task, configuration=configuration)
    parts = moment_parts(_walk(without, 0.0), without)
    assert not parts["feed_forward"].any()


def test_shares_are_of_variance_and_per_kilogram(task):
    walk = _walk(task, 0.0)
    parts = moment_parts(walk, task)
    knee = ACTUATED.index("knee_angle_l")
    # a walk in which the fed-forward moment is all there is, and a constant is added
    moments = np.vstack([parts["feed_forward"] + 3.0, np.zeros(25)])
    found = torque_shares(replace(walk, moments=moments), _cycles(walk), task)["knee_angle_l"]
    part = parts["feed_forward"][:, knee]
    assert found["feed_forward"].rms == pytest.approx(np.sqrt(np.mean(part**2)) / task.model.mass)
    assert found["feed_forward"].r_squared == pytest.approx(1.0 - 9.0 / part.var())


def test_without_a_cycle_nothing_is_said(task):
    none = {"right": np.array([], dtype=int), "left": np.array([], dtype=int)}
    assert torque_shares(_walk(task, 0.0), GaitCycles(none, none, {}), task) is None
