"""The share of a policy's action bias that brings the walk nearest to its reference."""

import numpy as np
import pytest
from simulation_fixtures import random_policy

from gaitval.correction import centring
from gaitval.correction.centring import centred
from gaitval.metrics.curve_results import Epsilon
from gaitval.model.parameters import nominal_parameters


def test_walks_that_fall_choose_nothing(task):
    policy = random_policy(task, scale=5.0)
    assert centred(task, policy, nominal_parameters()) == 0.5


@pytest.mark.parametrize("best", [0.25, 1.0])
def test_the_share_with_the_least_error_is_chosen(task, monkeypatch, best):
    shares = []

    class Walked:
        fell = np.zeros(1)

    def walk(environment, *_, **__):
        shares.append(environment.constants.centring)
        return Walked()

    def error(*_):
        return Epsilon(angles=0.0, moments=0.0, forces=0.0, total=abs(shares[-1] - best))

    monkeypatch.setattr(centring, "record_rollout", walk)
    monkeypatch.setattr(centring, "find_cycles", lambda *_: None)
    monkeypatch.setattr(centring, "curves_of", lambda *_, **__: None)
    monkeypatch.setattr(centring, "epsilon", error)
    assert centred(task, None, nominal_parameters()) == best
    assert shares == list(centring.SHARES)
