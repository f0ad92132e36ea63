"""A regression sees people of other laboratories turned among each other, as nobody."""

import numpy as np
import pytest

from gaitval.subjects.prediction.deviations import (
    deviation,
    kinetics_of,
    learned_from,
    stored_fits,
    trial_of,
)
from gaitval.subjects.prediction.estimate import LEVERS, _levered, _through_all
from gaitval.subjects.prediction.laboratories import differences, of_rows, pooled, stored, to_rows
from gaitval.subjects.subject_file import builtin_subjects, load_subject

NAMES = ("2", "4", "6", "9")
LABORATORIES = ("one", "one", "one", "two")


@pytest.fixture(scope="module")
def people():
    """Five built-in people, of whom one's expected gait is drawn."""
    everybody = learned_from(load_subject("5"), builtin_subjects())
    return [each for each in everybody if each[0].person not in _persons()]


def _persons():
    return {load_subject(name).person for name in NAMES}


@pytest.fixture(scope="module")
def others():
    """Four more, as if they were of two other laboratories."""
    found = []
    for name in NAMES:
        subject = load_subject(name)
        fit = np.zeros_like(stored_fits()[f"{subject.identifier} {subject.trial}"])
        found.append(trial_of(subject, subject.record(), fit))
    return found


def test_a_row_differs_from_what_is_expected_as_its_person_does(people, others):
    for other in others[:2]:
        (row,) = differences(pooled([other], ["one"], people), people)
        truth = deviation(other, people)
        sign = np.sign(np.sum(row.kinetics * truth.kinetics))
        for name in ("sagittal", "other", "stride_time", "kinetics"):
            np.testing.assert_allclose(
                sign * getattr(row, name), getattr(truth, name), rtol=1e-9, atol=1e-9
            )
        # a lever's arm
        np.testing.assert_allclose(
            sign * row.step_width * row.usual, truth.step_width * truth.usual, atol=1e-9
        )


def test_turned_rows_say_what_the_people_say(people, others):
    subject = load_subject("5")
    trial = trial_of(subject, subject.record(), stored_fits()["S05 T05"])
    of = deviation(trial, people)
    turned = differences(pooled(others, LABORATORIES, people), people)
    home = [[deviation(trial, people) for trial in each] for each in people]
    plain = []
    for other, weight in zip(others, (1 / 6, 1 / 6, 1 / 6, 1 / 2), strict=True):
        each, root = deviation(other, people), np.sqrt(weight)
        plain.append(
            each._replace(
                sagittal=root * each.sagittal,
                other=root * each.other,
                stride_time=root * each.stride_time,
                kinetics=root * each.kinetics,
                usual=root * each.usual,
                pelvic_width=0.0,
            )
        )
    said = []
    for those in (turned, plain):
        _, rest = _levered([each for one in home for each in one], of, LEVERS, those)
        said.append(_through_all(home, those, rest, of))
    np.testing.assert_allclose(*said, atol=1e-9)
    assert np.abs(said[0]).max() > 0.01


def test_no_row_but_everybodys_mean_is_like_a_person(people, others):
    rows = pooled(others, LABORATORIES, people)
    own = np.array([kinetics_of(each.gait).ravel() for each in others])
    shapes = rows.kinetics.reshape(len(others), -1)
    own /= np.linalg.norm(own, axis=1, keepdims=True)
    shapes = shapes / np.linalg.norm(shapes, axis=1, keepdims=True)
    like = np.abs(shapes @ own.T).max(axis=1)
    assert np.delete(like, np.argmax(np.abs(rows.ones))).max() < 0.9


def test_those_that_come_with_the_package_weigh_as_much_as_one():
    found = stored()
    np.testing.assert_allclose(np.sum(found.ones**2), 1.0, atol=0.01)
    assert 0.2 < np.sum(found.ones * found.speeds) < 0.6  # mean speed
    np.testing.assert_array_equal(to_rows(of_rows(to_rows(found))), to_rows(found))
