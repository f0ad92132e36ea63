"""What each parameter does to a walk, and the extended ones."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from gaitval.apps.virtual.screen_command import _shown
from gaitval.apps.virtual.screening import KINDS, NAMES, UNITS, Screened, effects_of, table
from gaitval.configuration import load_configuration
from gaitval.datasets.subject_file import load_subject
from gaitval.identification.body_fit import BodyFit
from gaitval.identification.prior import prior_sd
from gaitval.model.extended import EXTENDED, extended_body
from gaitval.model.parameters import PARAMETERS, nominal_parameters
from gaitval.policy.storage import load_start
from gaitval.reference.dynamic_fit import Solution, weighted_laws
from gaitval.scaling.scaling import scale_subject

CONFIGURATION = load_configuration()
GENERAL = Path(__file__).parents[2] / "reports" / "general"
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


@pytest.mark.slow  # a whole walk for each parameter
def test_effects_of_a_walk(task):
    """Longer legs change it, and by more the larger the step; the same seed gives the same."""
    policy = load_start(GENERAL, CONFIGURATION.environment)
    subject = load_subject("S05")
    task = replace(task, configuration=CONFIGURATION)
    sd = np.array([*prior_sd(subject), *(each.prior_sd for each in EXTENDED)])
    seen = []
    small, again = (
        effects_of(task, policy, size * sd, trajectories=1, on_progress=lambda *at: seen.append(at))
        for size in (0.25, 0.25)
    )
    for name, one, other in zip(NAMES, small, again, strict=True):
        np.testing.assert_array_equal(one, other, err_msg=name)
        assert one.shape == (1, len(KINDS))
    thigh = small[PARAMETERS.index("thigh_length")][0]
    assert 0.02 < thigh[0] < 1.0  # degrees
    assert seen[-1] == (len(NAMES) + 1, len(NAMES) + 1)


def test_the_table_has_a_row_for_each_parameter_and_says_when_all_fell():
    some = Screened("thigh_length", 0.04, np.array([[1.0, 0.1, 2.0], [3.0, 0.3, 4.0]]), 0.6)
    none = Screened("friction", 0.1, np.zeros((0, 3)), 1.0)
    once = Screened("hip_x", 0.008, np.array([[1.0, 0.1, 2.0]]), 0.9)
    header, first, second, third = table([some, none, once])
    assert len(header) == len(first) == 11
    sd = "1.41"  # of two, their difference over the root of two
    assert first == ["thigh_length", "0.04", "1", "2", "2", sd, "0.2", "0.141", "3", sd, "0.6"]
    assert second[3:-1] == ["0"] + ["nan"] * 6
    assert third[1:4] == ["0.008", "m", "1"]
    assert third[4:-1] == ["1", "nan", "0.1", "nan", "2", "nan"]  # no spread of one
    assert _shown(third)[1:4] == ["0.008 m", "1", "1"]
    assert _shown(first)[1:4] == ["0.04", "2", "2 ± 1.4"]
    assert _shown(second)[3] == "falls"
    assert set(UNITS) == set(NAMES)
