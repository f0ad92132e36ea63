"""A study's identification by another method: its bounds decide nothing, its body is shrunk."""

import numpy as np

from gaitval.configuration import load_configuration
from gaitval.datasets.subject_file import load_subject
from gaitval.identification.prior import prior_sd
from gaitval.model.parameters import PARAMETERS, nominal_parameters
from gaitval_bodies.methods import WIDE, _bounded

CONFIGURATION = load_configuration()
SD = prior_sd(load_subject("S05"))


def test_a_thigh_two_sds_longer_is_within_its_bounds():
    mu = nominal_parameters()
    thigh = PARAMETERS.index("thigh_length")
    mu[thigh] += 2.0 * SD[thigh]
    found = _bounded(mu, SD, CONFIGURATION)
    assert found.identified[thigh] == mu[thigh]
    assert not any(found.on_bound)


def test_what_is_beyond_the_wide_bounds_is_cut_and_said_to_be():
    mu = nominal_parameters()
    hip = PARAMETERS.index("hip_y")
    mu[hip] -= 3.0 * SD[hip]
    found = _bounded(mu, SD, CONFIGURATION)
    np.testing.assert_allclose(found.identified[hip], nominal_parameters()[hip] - WIDE * SD[hip])
    assert [name for name, at in zip(PARAMETERS, found.on_bound, strict=True) if at] == ["hip_y"]
    assert set(found.verdicts) == {"not identified"}
