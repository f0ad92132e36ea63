"""Wrenches of the ground: the walk's own forces again, about the same centre of pressure."""

import numpy as np
import pytest
from simulation_fixtures import random_policy

from gaitval.model.parameters import nominal_parameters
from gaitval.policy.environment import WalkingEnvironment
from gaitval.policy.rollouts import record_rollout
from gaitval.simulation.ground_wrenches import ground_wrenches


@pytest.fixture(scope="module")
def walk(task):
    policy = random_policy(task, scale=0.1)
    return record_rollout(
        WalkingEnvironment(task), policy, mu=nominal_parameters(), start_phase=0.25, cycles=0.4
    )


def test_forces_are_those_of_the_walk(task, walk):
    """But at first: what the feet carried before it is not in the record of a walk."""
    found = ground_wrenches(walk, task)[..., :3]
    assert not found[0].any()
    np.testing.assert_allclose(found[20:], walk.ground_reaction[20:], atol=0.5)  # N


def test_moments_are_about_the_walks_centre_of_pressure(task, walk):
    found = ground_wrenches(walk, task)[20:]
    force, moment = found[..., :3], found[..., 3:]
    loaded = force[..., 2] > 50.0
    assert loaded.any()
    free = moment - np.cross(walk.centre_of_pressure[20:], force)
    np.testing.assert_allclose(free[loaded][:, :2], 0.0, atol=0.1)  # Nm
