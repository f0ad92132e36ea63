"""The stored walker of subject 5, on which devices are put."""

from typing import NamedTuple

import numpy as np
import pytest

import gaitval
from gaitval.policy.storage import Policy
from gaitval.walk.simulation.walker import WalkingTask


class Person(NamedTuple):
    task: WalkingTask
    policy: Policy
    mu: np.ndarray


@pytest.fixture(scope="session")
def person() -> Person:
    """Its reference takes seconds, once."""
    stored = gaitval.load_policy("5")
    return Person(stored.corrected_task, stored.network, stored.identified)
