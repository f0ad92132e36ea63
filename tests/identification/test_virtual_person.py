"""Virtual people: bodies and sizes are spread as said."""

import numpy as np
import pytest

from gaitval.identification.prior import prior_sd
from gaitval.identification.virtual_person import VIRTUAL, drawn_parameters, of_another_size
from gaitval.model.parameters import nominal_parameters
from gaitval.scaling.scaling import scale_subject
from gaitval.subjects.prediction.speed_line import dimensionless_speed
from gaitval.subjects.subject_file import load_subject, parse_subject


def test_bodies_are_drawn_from_the_prior():
    sd = prior_sd(load_subject("S05"))
    random = np.random.default_rng(3)
    z = np.array([(drawn_parameters(sd, random) - nominal_parameters()) / sd for _ in range(2000)])
    assert np.abs(z).max() <= 2.5
    np.testing.assert_allclose(z[:, 2:].mean(axis=0), 0.0, atol=0.08)
    np.testing.assert_allclose(z[:, 2:].std(axis=0), 0.96, atol=0.06)


def test_somebody_of_another_size_walks_alike():
    person = load_subject("S05")
    random = np.random.default_rng(0)
    drawn = [of_another_size(person, random) for _ in range(300)]
    sizes = np.array([each.height_m for each in drawn]) / person.height_m
    masses = np.array([each.mass_kg for each in drawn]) / person.mass_kg
    assert sizes.std() == pytest.approx(VIRTUAL.stature_sd, rel=0.15)
    assert (masses / sizes**2).std() == pytest.approx(VIRTUAL.build_sd, rel=0.15)
    assert np.abs(np.corrcoef(sizes, masses / sizes**2)[0, 1]) < 0.15
    for each in drawn:
        assert dimensionless_speed(each) == pytest.approx(dimensionless_speed(person))
        stride = each.walking_speed_m_s * each.stride_time_s
        own = person.walking_speed_m_s * person.stride_time_s
        assert stride / each.leg_length_m == pytest.approx(own / person.leg_length_m)
    for each in drawn[:10]:
        parse_subject(each.to_toml(), "drawn")
        assert scale_subject(each).model.mass == pytest.approx(each.mass_kg)
        assert each.by_stature() == each
        assert not each.trials
