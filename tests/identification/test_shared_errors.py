"""Errors that angles share are found as such: their derivatives, and what remains without them."""

from copy import copy
from dataclasses import replace

import numpy as np
import pytest

from gaitval.configuration import load_configuration
from gaitval.identification.body_fit import BodyFit
from gaitval.identification.prior import prior_sd
from gaitval.identification.shared_errors import NAMES, SharedFit, identified, tempered
from gaitval.model.parameters import PARAMETERS, nominal_parameters
from gaitval.scaling.scaling import scale_subject
from gaitval.subjects.subject_file import load_subject
from gaitval.walk.reference.dynamic_fit import weighted_laws

CONFIGURATION = load_configuration()


@pytest.fixture(scope="module")
def fit():
    subject = load_subject("S07").by_stature()
    return BodyFit(
        subject.record(), scale_subject(subject).model, CONFIGURATION.contact, CONFIGURATION.noise,
        prior_sd=prior_sd(subject),
    )  # fmt: skip


@pytest.fixture(scope="module")
def fixed(fit):
    return fit.solve(fixed=nominal_parameters())


@pytest.mark.slow
@pytest.mark.parametrize("name", ["thigh's skin by hip, both", "belt", "left leg", "heel forward"])
def test_laws_change_with_an_error_as_its_derivatives_say(fit, fixed, name):
    shared = SharedFit(fit)
    common = np.concatenate([fixed.common, np.zeros(len(NAMES))])
    index = len(fixed.common) + NAMES.index(name)
    laws = shared._linearised(shared._at(common), fixed.change, common)
    away = np.zeros_like(common)
    away[index] = 1e-3
    above, below = (
        weighted_laws(shared._at(common + sign * away), fixed.change, common + sign * away, 1.0)[0]
        for sign in (1, -1)
    )
    expected = (above - below) / 2e-3
    scale = np.abs(expected).max()
    assert scale > 1e-3
    # The contact of a sole that just touches is steep; the rest agrees to rounding.
    off = np.abs(laws.lever[:, :, index] - expected) > 0.02 * scale
    assert off.mean() < 0.002


def test_the_heel_is_behind_the_ankle_and_no_ball_behind_the_toes_axis(fit):
    """A ball that goes with the toes may lie behind their joint, from which it is counted."""
    tree, law = fit.problem.bodies(np.zeros(len(fit.problem.prior)))
    behind = tree.sphere_position - 0.005 * np.eye(3)[0]
    moved = tree._replace(sphere_position=behind)
    other = copy(fit)
    other.problem = fit.problem._replace(bodies=lambda _: (moved, law))
    names = [sphere.name for sphere in fit._model.spheres]
    heels = [name.startswith("contact_heel") for name in names]
    for each in (fit, other):
        np.testing.assert_array_equal(SharedFit(each)._heel, heels)


@pytest.mark.slow  # two fits
def test_without_shared_errors_it_is_the_plain_posterior(fit, fixed):
    none = SharedFit(fit, np.zeros(len(NAMES)))
    found, mode = none.solve(fixed), fit.mode(fixed)
    assert found.cost == pytest.approx(mode.cost, abs=0.3)
    plain = fit.posterior(mode)
    assert np.abs((found.posterior.mean - plain.mean) / plain.prior_sd).max() < 0.3
    assert found.legs.found == found.legs.prior_sd == 0.0


@pytest.fixture(scope="module")
def found(fit, fixed):
    return identified(fit, fixed)


@pytest.mark.slow
def test_with_shared_errors_a_record_tells_less_of_the_legs(fit, fixed, found):
    plain = fit.posterior(fit.mode(fixed))
    thigh = PARAMETERS.index("thigh_length")
    assert found.posterior.contraction[thigh] > plain.contraction[thigh]
    assert (found.posterior.contraction < 1.02).all()
    assert found.left < 0.5


@pytest.mark.slow  # a second record of the same person is fitted
def test_a_belt_that_runs_fast_and_a_small_hip_move_the_leg_by_less_than_one_sd(found):
    """4 % less excursion of the hip and a belt that is 1 % off: the plain leg moves by 2 cm."""
    subject = load_subject("S07").by_stature()
    record = subject.record()
    angles = dict(record.angles)
    for side in "rl":
        hip = angles[f"hip_flexion_{side}"]
        angles[f"hip_flexion_{side}"] = type(hip)(
            hip.mean,
            tuple(0.96 * each for each in hip.cosine),
            tuple(0.96 * each for each in hip.sine),
        )
    wrong = replace(record, angles=angles, speed=1.01 * record.speed)
    model = scale_subject(subject).model
    fit = BodyFit(
        wrong, model, CONFIGURATION.contact, CONFIGURATION.noise, prior_sd=prior_sd(subject)
    )
    again = identified(fit, fit.solve(fixed=nominal_parameters()))
    lengths = slice(3, 5)
    moved = (again.posterior.mean - found.posterior.mean)[lengths]
    assert np.abs(moved / found.posterior.sd[lengths]).max() < 1.0


def test_of_a_record_s_information_a_share_counts():
    """As if the record were so many of as many: a likelihood to a power."""
    prior = np.array([1.0, 2.0, 1.0])
    said = np.array([[3.0, 0.5, 0.0], [0.5, 1.0, 0.2], [0.0, 0.2, 0.0]])
    score = np.array([1.0, -0.4, 0.1])

    def posterior(share):
        covariance = np.linalg.inv(np.diag(prior**2) + share * said)
        return covariance @ (share * score), covariance

    whole = posterior(1.0)
    for share in (1.0, 0.6, 0.0):
        mean, covariance = tempered(*whole, prior, share)
        np.testing.assert_allclose(mean, posterior(share)[0], atol=1e-12)
        np.testing.assert_allclose(covariance, posterior(share)[1], atol=1e-12)
    np.testing.assert_allclose(tempered(*whole, prior, 0.0)[0], 0.0, atol=1e-12)
