"""What the tests of the interface share: a stored walker, its reference motion built once."""

from collections.abc import Iterator
from functools import cache

import pytest

import gaitval as gv
from gaitval.study.stored_policy import StoredPolicy
from gaitval.walk.simulation.simulated_walk import SimulatedWalk


@pytest.fixture(scope="session")
def _one_policy_each() -> Iterator[None]:
    """`gv.load_policy` gives the same policy each time, in examples too: they change none."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(gv, "load_policy", cache(gv.load_policy))
        yield


@pytest.fixture(scope="session")
def policy(_one_policy_each: None) -> StoredPolicy:
    return gv.load_policy(5)


@pytest.fixture(scope="session")
def walk(policy: StoredPolicy) -> SimulatedWalk:
    return gv.rollout(policy, cycles=6)
