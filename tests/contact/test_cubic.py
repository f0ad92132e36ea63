"""The cubic spring against its published formula."""

import numpy as np
import pytest

from gaitval.configuration import ContactSettings
from gaitval.walk.contact.cubic import Cubic
from gaitval.walk.contact.law import contact_law, sphere_force

R = 0.02
CONTACT = ContactSettings(law="cubic", cubic_stiffness=4e7, cubic_dissipation=0.9)
LAW = contact_law(CONTACT, 0.7)


def published(depth, velocity):
    """Ackermann and van den Bogert 2010, with friction against the slip in any direction."""
    x, v = depth, -velocity[2]
    slip = np.hypot(velocity[0], velocity[1])
    normal = 4e7 * x**3 * (1 + 0.9 * v) if x > 0 and v > -1 / 0.9 else 0.0
    along = 0.7 * normal * (2 / (1 + np.exp(-slip / 0.05)) - 1)
    direction = np.array(velocity[:2]) / slip if slip else np.zeros(2)
    return np.array([*(-along * direction), normal])


def force(depth, velocity=(0.0, 0.0, 0.0)):
    out = np.full(3, np.nan)
    slopes = sphere_force(LAW, R, R - depth, np.array(velocity), out)
    return out, slopes


def test_the_setting_chooses_it():
    assert isinstance(LAW, Cubic)
    assert Cubic(stiffness=4e7, dissipation=0.9, friction=0.7, friction_velocity=0.05) == LAW


@pytest.mark.parametrize("seed", range(50))
def test_a_sphere_feels_the_published_force(seed):
    random = np.random.default_rng(seed)
    depth, velocity = random.uniform(-0.01, 0.03), random.uniform(-2.0, 2.0, 3)
    np.testing.assert_allclose(
        force(depth, velocity)[0], published(depth, velocity), rtol=1e-9, atol=1e-9
    )


def test_nothing_acts_above_the_ground_or_on_a_foot_that_leaves_fast():
    assert not force(-0.001, (1.0, 1.0, -3.0))[0].any()
    assert not force(0.01, (0.3, 0.0, 1.2))[0].any()


@pytest.mark.parametrize("depth", [0.004, 0.015])
def test_slopes_are_those_of_the_force_at_rest(depth):
    """Against central differences in the penetration rate and in the slip."""
    _, (normal, friction) = force(depth)
    h = 1e-6
    down, up = (force(depth, (0.0, 0.0, v))[0][2] for v in (-h, h))
    assert normal == pytest.approx((down - up) / (2 * h), rel=1e-6)
    for rate in (-0.8, 0.8, 3.0):  # of the foot that moves too
        assert force(depth, (0.0, 0.0, rate))[1][0] == normal
    right, left = (force(depth, (v, 0.0, 0.0))[0][0] for v in (h, -h))
    assert friction == pytest.approx((left - right) / (2 * h), rel=1e-3)


def test_the_slope_in_the_depth_is_that_of_a_cubic_and_has_no_jump():
    h = 1e-6
    for depth in (0.0, 0.01):
        below, above = (force(depth + d)[0][2] for d in (-h, h))
        expected = 3 * 4e7 * depth**2
        assert (above - below) / (2 * h) == pytest.approx(expected, abs=1e-3)


def test_a_foot_at_rest_is_carried_by_the_static_force():
    depth = np.array([0.003, 0.012])
    expected = [force(d)[0][2] for d in depth]
    np.testing.assert_allclose(LAW.static_force(np.full(2, R), depth), expected, rtol=1e-12)


def test_friction_reaches_its_coefficient_and_opposes_the_slip():
    (x, y, load), _ = force(0.01, (0.8, -0.6, 0.0))
    assert np.hypot(x, y) == pytest.approx(0.7 * load, rel=1e-6)
    assert (x, y) == pytest.approx((-0.8 * 0.7 * load, 0.6 * 0.7 * load), rel=1e-6)
