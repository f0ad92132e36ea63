"""What other people's gait says, on made-up people whose gait is a known function of speed."""

from dataclasses import replace

import numpy as np
import pytest

from gaitval.subjects.prediction.normal_form import combined, normal_form
from gaitval.subjects.prediction.population import (
    change_with_speed,
    expected,
    gaits_of,
    on_the_line,
    other_people,
)
from gaitval.subjects.prediction.speed_line import line_weights
from gaitval.subjects.subject_file import builtin_subjects, load_subject

SUBJECTS = builtin_subjects()
BASE = normal_form(SUBJECTS[0].record(), SUBJECTS[0].leg_length_m)
RISE = replace(BASE, speed=1.0, forces=np.ones_like(BASE.forces))


def at(speed: float, offset: float = 0.0):
    """A gait on the line, or beside it."""
    gait = combined([BASE, RISE], np.array([1.0, speed - BASE.speed]))
    return replace(gait, speed=speed, forces=gait.forces + offset)


def test_the_line_through_gaits_on_a_line_is_that_line():
    people = [[at(0.2)], [at(0.3)], [at(0.45)]]
    np.testing.assert_allclose(on_the_line(people, 0.37).forces, at(0.37).forces)
    np.testing.assert_allclose(expected(people, 0.37).forces, at(0.37).forces)


def test_weights_of_a_line_add_up_to_one_and_reproduce_the_speed():
    speeds = np.array([0.2, 0.3, 0.31, 0.5])
    weights = line_weights(speeds, 0.44)
    assert weights.sum() == pytest.approx(1.0)
    assert weights @ speeds == pytest.approx(0.44)


def test_the_change_within_people_is_not_spoiled_by_the_differences_between_them():
    """Faster people have lower forces here, but each person's rise with speed."""
    people = [[at(speed, -5.0 * speed), at(speed + 0.1, -5.0 * speed)] for speed in (0.2, 0.3, 0.4)]
    change = change_with_speed(people)
    np.testing.assert_allclose(change.forces, 1.0)
    assert change.speed == pytest.approx(1.0)
    assert change_with_speed([[at(0.2)], [at(0.3)]]) is None


def test_a_long_step_of_speed_says_more_of_the_change_than_a_short_one():
    """Least squares through the origin: one person is 0.05 off after 0.1, one right after 0.3."""
    people = [[at(0.2), at(0.3, 0.05)], [at(0.2), at(0.5)]]
    slope = (0.1 * 0.15 + 0.3 * 0.3) / (0.1**2 + 0.3**2)
    np.testing.assert_allclose(change_with_speed(people).forces, slope)


def test_people_with_several_trials_are_the_built_in_ones_that_have_them():
    counts = {each.identifier: len(gaits_of(each)) for each in SUBJECTS}
    assert {name for name, count in counts.items() if count > 1} == {"S01", "S04", "S05"}
    assert counts["S05"] == 3


def test_nobody_is_among_the_others_under_another_name():
    person = load_subject("S05")
    renamed = person.model_copy(update={"identifier": "mine"})
    assert person.is_person_of(renamed)
    assert len(other_people(renamed, SUBJECTS)) == 9
    stranger = renamed.model_copy(update={"person": "P14"})
    assert len(other_people(stranger, SUBJECTS)) == 10
    elsewhere = renamed.model_copy(update={"laboratory": "another"})
    assert len(other_people(elsewhere, SUBJECTS)) == 10
