"""The extended parameters, of sole, feet and legs."""

import numpy as np
import pytest

from gaitval.configuration import load_configuration
from gaitval.datasets.subject_file import load_subject
from gaitval.identification.body_fit import BodyFit
from gaitval.identification.prior import prior_sd
from gaitval.model.extended import EXTENDED, extended_body
from gaitval.model.parameters import nominal_parameters
from gaitval.reference.dynamic_fit import Solution, weighted_laws
from gaitval.scaling.scaling import scale_subject

CONFIGURATION = load_configuration()
INDEX = {each.name: index for index, each in enumerate(EXTENDED)}


def at(name: str, value: float) -> np.ndarray:
    values = np.zeros(len(EXTENDED))
    values[INDEX[name]] = value
    return values


@pytest.fixture(scope="module")
def model():
    return scale_subject(load_subject("S05")).model


def test_nothing_changes_at_zero(model):
    body, contact = extended_body(model, CONFIGURATION.contact, np.zeros(len(EXTENDED)))
    assert contact == CONFIGURATION.contact
    for old, new in zip(model.spheres, body.spheres, strict=True):
        np.testing.assert_array_equal(old.position, new.position)
    for old, new in zip(model.segments, body.segments, strict=True):
        np.testing.assert_array_equal(old.joint_position, new.joint_position)


@pytest.mark.parametrize("name", ["contact_stiffness", "contact_dissipation"])
def test_the_sole_gets_stiffer_by_a_factor(model, name):
    _, contact = extended_body(model, CONFIGURATION.contact, at(name, np.log(2.0)))
    field = name.removeprefix("contact_")
    assert getattr(contact, field) == pytest.approx(2.0 * getattr(CONFIGURATION.contact, field))


@pytest.mark.parametrize(("name", "moved"), [("heel_x", {"heel"}), ("forefoot_x", {"midfoot",
                         "ball", "toes"})])  # fmt: skip
def test_heel_and_forefoot_move_forward_on_both_sides(model, name, moved):
    body, _ = extended_body(model, CONFIGURATION.contact, at(name, 0.01))
    for old, new in zip(model.spheres, body.spheres, strict=True):
        away = [0.01 if old.name.split("_")[1] in moved else 0.0, 0.0, 0.0]
        np.testing.assert_allclose(new.position - old.position, away, atol=1e-15)


def test_one_leg_gets_longer_by_what_the_other_loses(model):
    body, _ = extended_body(model, CONFIGURATION.contact, at("left_leg", 0.02))

    def length(of, side):
        return -sum(of[f"{name}_{side}"].joint_position[2] for name in ("shank", "foot"))

    for side, factor in (("l", 1.02), ("r", 0.98)):
        assert length(body, side) == pytest.approx(factor * length(model, side))
    assert body.leg_length == pytest.approx(model.leg_length)


@pytest.fixture(scope="module")
def fit(model):
    subject = load_subject("S05")
    return BodyFit(
        subject.record(), model, CONFIGURATION.contact, CONFIGURATION.noise,
        prior_sd=prior_sd(subject), extended=True,
    )  # fmt: skip


@pytest.fixture(scope="module")
def fixed(fit):
    return fit.solve(fixed=nominal_parameters())


@pytest.mark.slow
def test_a_held_mu_leaves_the_extended_parameters_free(fit, fixed):
    np.testing.assert_allclose(fixed.common[3:17], 0.0, atol=1e-9)
    found = fit.posterior(fixed)
    assert (np.abs(found.extended_mean) > 0.0).all()
    ratio = found.extended_sd / [each.prior_sd for each in EXTENDED]
    assert (ratio < 0.75).all()  # each of them earns its place
    assert ratio[INDEX["left_leg"]] < 0.4
    residual, _ = weighted_laws(fit.problem, fixed.change, fixed.common, 1.0)
    assert np.isfinite(residual).all()


def test_a_posterior_is_in_the_units_of_its_parameters(fit):
    """Numbers of a fit are in SDs of the prior; here all are known to 0.3 of one."""
    common = np.linspace(-1.0, 1.0, len(fit.problem.prior))
    covariance = 0.3**2 * np.eye(len(common))
    found = fit.posterior(Solution(np.zeros((31, 1)), common, covariance, 10.0))
    sizes = np.array([each.prior_sd for each in EXTENDED])
    np.testing.assert_allclose(found.sd, 0.3 * fit.prior_sd)
    np.testing.assert_allclose(found.mean, nominal_parameters() + fit.prior_sd * common[3:17])
    np.testing.assert_allclose(found.extended_sd, 0.3 * sizes)
    np.testing.assert_allclose(found.extended_mean, sizes * common[-len(EXTENDED) :])
    assert found.log_posterior == -5.0
