"""Trials of one person together: their errors count as nearly one, and their intervals hold."""

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from body_result import made_up
from typer.testing import CliRunner

from gaitval.cli import app
from gaitval.identification.legs import LegDifference
from gaitval.identification.pooled import SAME, pooled, together
from gaitval.model.parameters import PARAMETERS

STORE = Path(__file__).parents[2] / "reports" / "identification" / "ten_shared.json"
THIGH = PARAMETERS.index("thigh_length")
COUNT = len(PARAMETERS) + 2


def known(sd, mean=0.0):
    """Mean and covariance of a posterior in prior SDs, of all parameters alike."""
    return np.full(COUNT, mean), sd**2 * np.eye(COUNT)


def test_one_trial_says_what_it_says():
    shift, joint = known(0.7, 0.4)
    mean, covariance = together([shift], [joint])
    np.testing.assert_allclose(mean, shift)
    np.testing.assert_allclose(covariance, joint)


def test_three_like_one_another_tell_what_means_of_correlated_numbers_tell():
    shift, joint = known(0.7, 0.4)
    mean, covariance = together(3 * [shift], 3 * [joint])
    information = 3 / (1 + 2 * SAME) * (1 / 0.7**2 - 1)
    np.testing.assert_allclose(covariance, np.eye(COUNT) / (1 + information), rtol=1e-4)
    # the estimate without the prior is as it was
    np.testing.assert_allclose(mean, 0.4 * (1 - 1 / (1 + information)) / (1 - 0.7**2), rtol=1e-4)


def test_a_trial_that_tells_nothing_takes_nothing():
    (shift, joint), (nothing, blind) = known(0.7, 0.4), known(0.999, 0.0)
    mean, covariance = together([nothing, shift], [blind, joint])
    np.testing.assert_allclose(mean, shift, rtol=1e-3)
    np.testing.assert_allclose(covariance, joint, rtol=1e-3, atol=1e-6)


def root(matrix):
    values, vectors = np.linalg.eigh(matrix)
    return vectors * np.sqrt(values.clip(0.0)) @ vectors.T


@pytest.mark.parametrize("same", [SAME, 1.0])
def test_intervals_hold_nine_tenths_of_people_whose_trials_err_alike(same):
    stored = json.loads(STORE.read_text())
    joints = [np.array(each["joint"]) for each in (*stored["alone"], *stored["trials"])[-3:]]
    random, fixed = np.random.default_rng(0), []
    for _ in range(100):
        truth, common = random.standard_normal((2, COUNT))
        shifts = []
        for joint in joints:
            new = random.standard_normal(COUNT)
            error = np.sqrt(same) * common + np.sqrt(1.0 - same) * new
            # of a posterior mean, what is error has the covariance C - C²
            shifts.append(truth - joint @ truth + root(joint - joint @ joint) @ error)
        mean, covariance = together(shifts, joints)
        fixed.append(np.abs(mean - truth) / np.sqrt(np.diag(covariance)) < 1.645)
    assert 0.86 < np.mean(fixed) < 0.94


def test_body_ends_of_the_sole_and_legs_are_pooled_and_the_record_s_errors_are_its_own():
    shift, joint = known(0.7, 0.4)
    one = made_up(0.7, 0.004)
    one = replace(
        one, posterior=replace(one.posterior, mean=one.posterior.prior_mean + 0.4
                               * one.posterior.prior_sd),
        shift=shift, joint=joint, values=np.full(len(one.values), 0.003),
    )  # fmt: skip
    other = replace(one, legs=LegDifference(0.006, 0.0036, 0.0086), values=0.0 * one.values)
    found = pooled([one, other])
    mean = found.posterior.mean[THIGH] - found.posterior.prior_mean[THIGH]
    assert mean == pytest.approx(0.4 * one.posterior.prior_sd[THIGH], rel=0.05)
    assert found.posterior.contraction[THIGH] == pytest.approx(0.69, abs=0.01)
    assert 0.004 < found.legs.found < 0.006
    assert 0.0034 < found.legs.found_sd < 0.0036
    np.testing.assert_array_equal(found.values[:-2], one.values[:-2])
    # a heel moves with its own shift, by SDs of 10 mm
    assert found.values[-2] == pytest.approx(0.003 + 0.01 * (found.shift[-2] - 0.4))


def test_a_person_with_one_trial_has_none_to_pool():
    ran = CliRunner().invoke(app, ["body", "2", "--trials"])
    assert ran.exit_code == 2
    assert "one trial" in ran.output + ran.stderr
