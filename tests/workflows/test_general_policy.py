"""The general policy that is stored in the repository: it walks everybody, and is no result."""

import pytest
from simulation_fixtures import task_of_subject

from gaitval.configuration import Configuration
from gaitval.datasets.subject_file import BUILTIN
from gaitval.errors import PolicyError
from gaitval.model.parameters import nominal_parameters
from gaitval.policy.environment import WalkingEnvironment
from gaitval.policy.storage import load_policy, load_start
from gaitval.study.run import general_policy
from gaitval_devices.scores import score_rollout

WALKED = ("S05",)
"""Whom it walks in every run of the tests; all of them in CI."""


@pytest.mark.parametrize(
    "name",
    [pytest.param(name, marks=() if name in WALKED else pytest.mark.slow) for name in BUILTIN],
)
def test_it_walks_every_built_in_body_before_any_training(name):
    folder = general_policy()
    assert folder is not None
    policy = load_start(folder, Configuration().environment)
    task = task_of_subject(name)
    score = score_rollout(
        WalkingEnvironment(task),
        policy,
        mu=nominal_parameters(),
        start_phase=0.0,
        seconds=11 * task.reference.stride_time,
    )
    assert not score.fell
    # Its pace before the correction, within what one action may change it by; the stored walks hold
    # the limit of 5 %.
    pace = Configuration().environment.pace_scale
    assert 10.0 < score.cycles == pytest.approx(11.0, rel=0.5 * pace)


def test_no_result_may_be_walked_with_it():
    folder = general_policy()
    assert folder is not None
    with pytest.raises(PolicyError, match="general policy"):
        load_policy(folder)
