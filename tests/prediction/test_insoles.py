"""An estimate and insoles, each as heavy as it is sure."""

import numpy as np
import pytest

from gaitval.gait.insoles import InsoleForces
from gaitval.subjects.prediction.deviations import KINETICS
from gaitval.subjects.prediction.estimate import Estimate
from gaitval.subjects.prediction.insoles import with_insoles
from gaitval.subjects.prediction.normal_form import SAMPLES

PERCENT = np.arange(SAMPLES) / SAMPLES
STANCE = np.where(PERCENT < 0.62, np.sin(np.pi * PERCENT / 0.62), 0.0)
LEFT = np.array([1.0, 0.9, 0.8, 0.9, 0.9, 0.95, 0.0])
COUNT = len(KINETICS)
LANDING = 0.015 / 1.96
"""s: 95 % of landings by markers are within 15 ms."""


@pytest.fixture
def found() -> Estimate:
    """Arms of 0.1 beside the vertical force."""
    kinetics = np.tile(0.1 * STANCE, (2, COUNT, 1))
    kinetics[:, -1] = STANCE
    zero = np.zeros_like(kinetics)
    return Estimate(
        kinetics, kinetics, np.full((COUNT, SAMPLES), 0.1), np.zeros(COUNT), zero, zero, True,
        LEFT,
    )  # fmt: skip


def insoles(share: float, error: float) -> InsoleForces:
    """Of somebody who carries that much more, on a stride so long that landings do not matter."""
    return InsoleForces("walk.csv", np.tile(share * STANCE, (2, 1)), 1.0, (9, 9), 1e6, error)


def test_exact_ones_are_believed_and_no_more_of_the_others_than_people_show(found):
    after = with_insoles(found, insoles(1.2, 1e-9))
    np.testing.assert_allclose(after.kinetics[:, -1], np.tile(1.2 * STANCE, (2, 1)), atol=1e-6)
    assert after.half_width[-1].max() < 1e-6
    on = STANCE > 0.5
    for i, left in enumerate(LEFT[:-1]):
        # arms stay, less a little where the force is small
        grows = 1.0 if left == 1.0 else 1.2
        curves = 0.1 * grows * found.kinetics[:, -1, on]
        np.testing.assert_allclose(after.kinetics[:, i, on], curves, rtol=0.01)
        np.testing.assert_allclose(after.half_width[i], 0.1 * left, rtol=1e-6)


def test_as_sure_as_the_estimate_they_count_half(found):
    sure = 0.1 / 1.6449
    after = with_insoles(found, insoles(1.2, sure))
    np.testing.assert_allclose(after.kinetics[0, -1], 1.1 * STANCE, atol=1e-4)
    np.testing.assert_allclose(after.half_width[-1], 0.1 / np.sqrt(2.0), rtol=1e-3)


def test_bad_ones_change_nothing(found):
    after = with_insoles(found, insoles(1.5, 50.0))
    np.testing.assert_allclose(after.kinetics, found.kinetics, atol=1e-5)
    np.testing.assert_allclose(after.half_width, found.half_width, rtol=1e-5)


def test_bands_hold_what_they_say():
    """Estimates and insoles with errors of these sizes: nine points in ten."""
    rng, inside = np.random.default_rng(84), []
    for _ in range(300):
        truth = np.tile(STANCE, (2, 1))
        kinetics = np.tile(truth[:, None], (1, COUNT, 1))
        kinetics[:, -1] += 0.1 / 1.6449 * rng.normal(size=(2, 1))
        zero = np.zeros_like(kinetics)
        before = Estimate(
            kinetics, kinetics, np.full((COUNT, SAMPLES), 0.1), np.zeros(COUNT), zero, zero, True,
            LEFT,
        )  # fmt: skip
        walk = insoles(1.0, 0.05)
        seen = walk._replace(vertical=walk.vertical + 0.05 * rng.normal(size=(2, 1)))
        after = with_insoles(before, seen)
        inside.append(np.abs(after.kinetics[:, -1] - truth) <= after.half_width[-1])
    assert np.mean(inside) == pytest.approx(0.9, abs=0.03)


def test_a_landing_that_is_off_counts_by_how_fast_the_force_rises(found):
    """A force that rises by one body weight a second is off by LANDING body weights where landings
    are by LANDING seconds (SD), and so is the mean that both make of it.
    """
    rises = np.tile(np.arange(SAMPLES) / SAMPLES, (2, 1))
    walk = InsoleForces("walk.csv", rises, 1.0, (9, 9), 1.0, 1e-9)
    after = with_insoles(found, walk)
    own = 0.1 / 1.6449
    sure = own * LANDING / np.hypot(own, LANDING)
    np.testing.assert_allclose(after.half_width[-1, 50], 1.6449 * sure, rtol=1e-4)
    slower = with_insoles(found, walk._replace(stride_time=2.0))
    sure = own * 0.5 * LANDING / np.hypot(own, 0.5 * LANDING)
    np.testing.assert_allclose(slower.half_width[-1, 50], 1.6449 * sure, rtol=1e-4)
