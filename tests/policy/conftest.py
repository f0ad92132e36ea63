"""Walking environments that several test files of this folder look at."""

import pytest
from simulation_fixtures import changed

from gaitval.policy.environment import WalkingEnvironment


@pytest.fixture(scope="module")
def paper(task):
    return WalkingEnvironment(changed(task, environment={"observation": "paper"}))


@pytest.fixture(scope="module")
def extended(task):
    return WalkingEnvironment(changed(task, environment={"mirror": False}))


@pytest.fixture(params=["paper", "extended"])
def environment(request, paper, extended):
    environment = {"paper": paper, "extended": extended}[request.param]
    environment.difficulty = 1.0
    return environment
