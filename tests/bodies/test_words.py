"""Sentences on a body: their numbers, and what they say of legs that differ."""

import numpy as np
import pytest

from gaitval.datasets.subject_file import load_subject
from gaitval.identification.body_fit import BodyPosterior
from gaitval.identification.prior import prior_sd
from gaitval.model.parameters import nominal_parameters
from gaitval.reference.dynamic_fit import Solution
from gaitval.scaling.scaling import scale_subject
from gaitval_bodies.legs import LegDifference
from gaitval_bodies.shared_errors import NAMES, Shared
from gaitval_bodies.words import NEXT, next_trials, sentences

SUBJECT = load_subject("S05")
MODEL = scale_subject(SUBJECT).model


def shared(contraction: float, difference: float) -> Shared:
    """A result whose lengths are this much narrower than the prior, 1 % longer."""
    sd, mean = prior_sd(SUBJECT), nominal_parameters()
    mean[3:5] *= 1.01
    none = np.zeros(0)
    posterior = BodyPosterior(
        mean=mean, covariance=np.diag((contraction * sd) ** 2), prior_mean=nominal_parameters(),
        prior_sd=sd, log_posterior=0.0, plates=np.zeros(2), extended_mean=none, extended_sd=none,
    )  # fmt: skip
    zeros = np.zeros(len(NAMES))
    solution = Solution(np.zeros((31, 49)), none, np.zeros((0, 0)), 0.0)
    legs = LegDifference(difference, 0.0036, 0.0086)
    return Shared(posterior, zeros, zeros, solution, 0.0, none, none, legs, 1, 0.0)


def test_the_legs_are_said_in_centimetres_before_and_after():
    said = sentences(shared(0.5, 0.004), MODEL)
    length = 100 * MODEL.leg_length
    assert f"Legs: {1.01 * length:.1f} ± " in said
    assert f"scaled: {length:.1f} ± " in said
    assert "left leg is longer by 4 ± 4 mm: within what people's legs differ" in said
    assert "next to nothing" not in said


def test_a_record_that_tells_nothing_is_said_to():
    assert "the record adds next to nothing" in sentences(shared(0.95, 0.0), MODEL)


def test_legs_that_differ_are_said_with_what_else_it_may_be():
    said = sentences(shared(0.5, -0.022), MODEL)
    assert "The right leg is longer by 25 ± 4 mm: more than people's legs differ" in said
    assert "hip centre" in said


def test_a_range_of_motion_trial_tells_most_of_the_thigh():
    header, own, again, moved = next_trials(shared(0.8, 0.0), MODEL)
    assert [own[0], again[0], moved[0]] == list(NEXT)
    thigh = header.index("thigh_length")
    assert float(own[thigh]) == pytest.approx(0.8)
    assert float(moved[thigh]) < float(again[thigh]) < float(own[thigh])
