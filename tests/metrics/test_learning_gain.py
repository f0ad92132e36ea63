"""Which policy is handed on after a training, and which body after a round."""

import json

import pytest

from gaitval.metrics.curve_results import Epsilon
from gaitval.metrics.learning_gain import LearningGain, RoundErrors, Standing

BEFORE = Standing(
    walks=8, falls=1, pushes=96, survived=90, weakest_phase=92.3, epsilon=0.25,
    scatter=0.002,
)  # fmt: skip


def trained(**differences):
    return Standing(**BEFORE.model_dump() | differences)


@pytest.mark.parametrize(
    ("differences", "kept"),
    [
        ({}, True),
        ({"falls": 0, "survived": 96, "epsilon": 0.2}, True),
        ({"falls": 2, "survived": 96, "epsilon": 0.2}, False),
        ({"falls": 0, "survived": 60, "epsilon": 0.4}, True),
        ({"survived": 89, "epsilon": 0.2}, False),
        ({"survived": 91, "epsilon": 0.3125}, True),
        ({"survived": 91, "epsilon": 0.3126}, False),
        ({"survived": 91, "epsilon": None, "scatter": None}, False),
        ({"epsilon": 0.2501}, False),
        ({"epsilon": 0.2499}, True),
        ({"epsilon": None, "scatter": None}, False),
    ],
)
def test_falls_count_first_then_pushes_and_then_the_distance(differences, kept):
    found = LearningGain.of(500, BEFORE, trained(**differences))
    assert found.trained_is_handed_on is kept
    assert found.as_dict()["handed_on"] == ("trained" if kept else "start")
    assert ("the start is handed on" in found.in_words()) is not kept
    assert LearningGain.model_validate(json.loads(json.dumps(found.as_dict()))) == found


def test_a_start_that_does_not_walk_a_cycle_is_never_kept_for_its_epsilon():
    fell = trained(epsilon=None, scatter=None)
    assert LearningGain.of(500, fell, BEFORE).trained_is_handed_on
    assert LearningGain.of(500, fell, fell).trained_is_handed_on


@pytest.mark.parametrize(
    ("differences", "needs"),
    [
        ({"falls": 0}, False),
        ({"falls": 1}, True),
        ({"falls": 0, "weakest_phase": 80.0}, False),
        ({"falls": 0, "weakest_phase": 79.9}, True),
        # those from behind are not judged
        ({"falls": 0, "survived": 45}, False),
    ],
)
def test_a_start_that_falls_or_is_pushed_over_too_often_needs_training(differences, needs):
    assert trained(**differences).needs_training(80.0) is needs


def test_without_a_need_the_start_is_handed_on_and_the_limit_is_said():
    found = LearningGain.none_needed(trained(falls=0), 80.0)
    assert not found.trained_is_handed_on
    assert found.samples == 0
    assert "80 %" in found.rule
    assert found.in_words().startswith("No training was needed: epsilon 0.2500, 90 of 96 pushes")


def test_what_was_learned_from_nothing_is_handed_on():
    found = LearningGain.of(500, None, trained(falls=8, survived=0, epsilon=None))
    assert found.trained_is_handed_on
    assert "from nothing" in found.in_words()


def errors(nominal: float | None, identified: float | None) -> RoundErrors:
    """Of a round whose walks have these epsilons; None for one that fell."""
    first, second = (
        None if total is None else Epsilon(angles=0.1, moments=0.1, forces=0.1, total=total)
        for total in (nominal, identified)
    )
    return RoundErrors(nominal=first, identified=second, scatter=None, floor=0.1)


@pytest.mark.parametrize(
    ("nominal", "identified", "expected"),
    [(0.3, 0.2, True), (0.3, 0.3, False), (0.2, 0.3, False)],
)
def test_the_walk_must_come_nearer_to_the_record(nominal, identified, expected):
    assert errors(nominal, identified).supported == expected


def test_a_walk_that_falls_supports_nothing():
    assert not errors(0.5, None).supported
    assert errors(None, 0.5).supported


def test_a_walk_that_fell_is_infinitely_far_from_the_record():
    assert errors(0.5, None).total == float("inf")
