"""Priors by how a body was measured, and what a posterior says of each parameter."""

import numpy as np
import pytest

from gaitval.identification.body_fit import BodyPosterior
from gaitval.identification.combinations import combinations, correlation, judged_combinations
from gaitval.identification.prior import measured_by, prior_sd
from gaitval.identification.verdicts import verdict_of
from gaitval.model.body import SEGMENTS
from gaitval.model.parameters import PARAMETERS, apply_parameters, nominal_parameters
from gaitval.subjects.subject_file import load_subject

THIGH, SHANK = (PARAMETERS.index(f"{name}_length") for name in ("thigh", "shank"))


def posterior(seed=0, shrink=0.5):
    """A posterior with correlations, narrower than its prior."""
    random = np.random.default_rng(seed)
    sd = np.linspace(0.01, 0.05, 14)
    mixed = np.linalg.qr(random.normal(size=(14, 14)))[0]
    inner = mixed @ np.diag(np.linspace(0.1, 1.0, 14)) @ mixed.T * shrink
    nominal = nominal_parameters()
    mean = nominal + 0.5 * sd * random.standard_normal(14)
    return BodyPosterior(mean, inner * np.outer(sd, sd), nominal, sd, np.zeros(2))


def test_the_prior_depends_on_how_the_body_was_measured():
    person = load_subject("S05")
    by_stature = person.model_copy(update={"markers": {}})
    by_tape = by_stature.model_copy(update={"tape": {"thigh": 0.36}})
    assert measured_by(person)["thigh_length"] == "markers"
    assert measured_by(by_stature)["shank_length"] == "stature"
    assert measured_by(by_tape) == {
        "thigh_length": "tape",
        "shank_length": "stature",
        "foot_length": "stature",
    }
    markers, stature, tape = (prior_sd(each) for each in (person, by_stature, by_tape))
    assert markers.shape == (14,)
    assert (stature[2:5] > markers[2:5]).all()
    np.testing.assert_array_equal(stature[5:], markers[5:])
    assert markers[THIGH] == tape[THIGH] < stature[THIGH]


@pytest.mark.parametrize(
    ("contraction", "verdict"),
    [(0.1, "identified"), (0.3, "identified"), (0.31, "weak"), (0.7, "weak"),
     (0.71, "not identified"), (1.0, "not identified")],
)  # fmt: skip
def test_the_verdict_follows_the_contraction(contraction, verdict):
    assert verdict_of(contraction) == verdict


def test_combinations_are_lengths_of_the_leg(task):
    """Their weights are how the lengths change with mu, by the model itself."""
    leg, reach = combinations(task.model)
    mu = nominal_parameters()
    mu[THIGH] += 0.02
    mu[SHANK] -= 0.01
    mu[PARAMETERS.index("knee_z")] += 0.004
    mu[PARAMETERS.index("ankle_z")] -= 0.003

    def joints(model):
        return [-model.segments[SEGMENTS.index(name)].joint_position[2] for name in
                ("shank_r", "foot_r")]  # fmt: skip

    before, after = joints(task.model), joints(apply_parameters(task.model, mu))
    away = mu - nominal_parameters()
    assert reach.weights @ away == pytest.approx(sum(after) - sum(before), abs=1e-9)
    assert leg.weights @ away == pytest.approx(0.02 * before[0] - 0.01 * before[1])


def test_a_combination_has_the_variance_of_its_sum(task):
    found = posterior()
    leg = judged_combinations(found, task.model)[0]
    weights = combinations(task.model)[0].weights
    draws = np.random.default_rng(1).multivariate_normal(found.mean, found.covariance, 200_000)
    assert leg.sd == pytest.approx(np.std(draws @ weights), rel=0.01)
    assert leg.mean == pytest.approx(np.mean((draws - found.prior_mean) @ weights), abs=3e-4)


def test_correlations_are_of_the_posterior():
    found = correlation(posterior())
    np.testing.assert_allclose(np.diag(found), 1.0)
    np.testing.assert_allclose(found, found.T)
    assert np.abs(found).max() <= 1.0 + 1e-12
