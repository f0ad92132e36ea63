"""The general policy that is stored in the repository: it walks everybody, and is no result."""

from dataclasses import replace

import numpy as np
import pytest
from scored import score_rollout
from simulation_fixtures import task_of_subject

from experiments.delayed_policy import SETTINGS as LATE
from experiments.delayed_policy import taught, with_memory
from experiments.placing_feet import Law, PlacingFeet, tried
from experiments.slow_policy import SETTINGS, TRIED, fell, task_of
from gaitval.configuration import SENSES, Configuration, load_configuration
from gaitval.coordinates import ACTUATED
from gaitval.errors import PolicyError
from gaitval.model.parameters import nominal_parameters
from gaitval.policy.environment import WalkingEnvironment
from gaitval.policy.storage import load_policy, load_start
from gaitval.policy.walking_group import WalkingGroup
from gaitval.study.stored_policy import DELAYED, SLOW, SLOW_STRIDE, general_policy
from gaitval.subjects.subject_file import BUILTIN, load_subject

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


def test_slow_strides_have_a_policy_that_learned_on_them():
    slow = replace(load_subject("S09").record(), stride_time=2.5)
    folder = general_policy(slow, 0.9)
    assert folder == general_policy() / SLOW == general_policy(slow, 0.8)
    # One 2.7 m tall has legs on which that is a usual stride: 4.5 √(leg length/g).
    assert general_policy(slow, 3.0) == general_policy()
    policy = load_start(folder, Configuration().environment)
    assert policy.about["general"]
    with pytest.raises(PolicyError, match="general policy"):
        load_policy(folder)


@pytest.mark.slow
def test_a_body_that_is_felt_late_has_a_policy_that_learned_it_and_walks_from_the_start():
    settings = load_configuration(settings=list(LATE)).environment
    folder = general_policy(environment=settings)
    assert folder == general_policy() / DELAYED
    policy = load_start(folder, settings)
    task = task_of_subject("S05").with_environment(
        **{name: getattr(settings, name) for name in SENSES}
    )
    environment = WalkingEnvironment(task)
    score = score_rollout(
        environment, policy, mu=nominal_parameters(), start_phase=0.0,
        seconds=11 * task.reference.stride_time,
    )  # fmt: skip
    assert not score.fell
    with pytest.raises(PolicyError, match="observes 204 numbers"):
        load_start(folder, Configuration().environment)


@pytest.mark.slow
@pytest.mark.parametrize(("slow", "falls"), [(False, 8), (True, 0)])
def test_a_slow_virtual_person_falls_with_the_general_policy_alone(slow, falls):
    task, stride = task_of((TRIED[0], "S06", 2, load_configuration(settings=list(SETTINGS))))
    assert stride > SLOW_STRIDE
    policy = load_start(general_policy() / (SLOW if slow else ""), Configuration().environment)
    assert fell(policy, task) == falls


def test_who_is_taught_begins_as_the_teacher_and_comes_nearer_to_it(task):
    settings = load_configuration(settings=list(LATE)).environment
    late = task.with_environment(**{name: getattr(settings, name) for name in SENSES})
    teacher = load_start(general_policy(), Configuration().environment)
    seen = np.random.default_rng(0).normal(size=(4, 204)).astype(np.float32)
    begun = with_memory(teacher, settings)
    assert begun.act(seen) == pytest.approx(teacher.act(seen[:, :126]), abs=1e-5)
    said = []
    learned = taught([late], teacher, said.append, actions=60, shares=(0.5, 0.0), steps=(20, 200))
    assert learned.about["general"]
    assert learned.about["samples"] == 8 * 60
    assert learned.about["configuration"]["environment"]["action_memory"] == 0.15
    losses = [float(text.split("loss ")[1].split(",")[0]) for text in said]
    assert losses[1] < losses[0]


def test_a_teacher_of_placing_moves_the_hip_of_the_swinging_leg_alone(task):
    policy = load_start(general_policy(), Configuration().environment)
    group = WalkingGroup([task] * 8)
    teacher = PlacingFeet(policy, Law(), group)
    # A fifth of the cycle before the right heel strike; the left foot carries the body.
    options = {"phase": 0.8, "mu": nominal_parameters(), "noise": 0.0, "push": None}
    seen = np.array([group.reset(e, seed=0, options=options) for e in range(8)])
    np.testing.assert_array_equal(teacher(), policy.act(seen))  # it knows no movement yet
    group.step(policy.act(seen), seen)
    moved = teacher() - policy.act(seen)
    right = ACTUATED.index("hip_adduction_r")
    assert (moved[:, right] != 0.0).all()
    assert (np.delete(moved, right, axis=1) == 0.0).all()


def test_feet_that_a_teacher_places_keep_their_distance_from_the_extrapolated_centre_of_mass(task):
    policy = load_start(general_policy(), Configuration().environment)
    alone, taught = (tried(task, policy, law, phases=2) for law in (None, Law(gain=10.0)))
    assert alone.falls == taught.falls == 0
    assert taught.offset < 0.7 * alone.offset
