"""Periodic curves: exact periodicity and derivative, and what the fit promises."""

import numpy as np
import pytest

from gaitval.gait.record import HARMONICS, GaitRecord, PeriodicCurve, fit_periodic, periodic_through

CURVE = PeriodicCurve(0.3, (0.2, -0.1, 0.05), (0.4, 0.0, -0.02))
PHASE = np.arange(101) / 100


def test_periodic():
    phase = np.linspace(-1, 1, 57)
    np.testing.assert_allclose(CURVE(phase), CURVE(phase + 3), atol=1e-12)


def test_derivative_is_that_of_central_differences():
    phase, step = np.linspace(0, 1, 40), 1e-5
    differences = (CURVE(phase + step) - CURVE(phase - step)) / (2 * step)
    # Truncation h²/6 f''' is below 1e-8 here; rounding eps/h about 1e-11.
    np.testing.assert_allclose(CURVE.derivative(phase), differences, atol=1e-7)


def test_fit_recovers_a_series_with_its_own_number_of_harmonics():
    fitted, residual = fit_periodic(PHASE, CURVE(PHASE), 1e-4)
    assert len(fitted.cosine) == 3
    assert residual <= 1e-4
    np.testing.assert_allclose(fitted(PHASE), CURVE(PHASE), atol=1e-4)


def test_fit_passes_between_unequal_ends_and_states_it():
    values = CURVE(PHASE) + np.where(PHASE == 1, 0.004, 0.0)
    fitted, residual = fit_periodic(PHASE, values, 0.0021)
    assert fitted(0.0) == pytest.approx(float(CURVE(0.0)) + 0.002, abs=1e-3)
    assert residual == pytest.approx(0.002, abs=1e-3)


def test_fit_stays_bounded_where_samples_are_left_out():
    trusted = PHASE < 0.6
    fitted, residual = fit_periodic(PHASE[trusted], np.sin(3 * np.pi * PHASE[trusted]), 0.01)
    assert residual <= 0.01
    assert np.abs(fitted(PHASE)).max() < 5


def test_fit_of_a_jump_reports_its_residual():
    fitted, residual = fit_periodic(PHASE, PHASE, 0.01)
    assert len(fitted.cosine) == HARMONICS.harmonics_cap
    assert residual > 0.4


def test_ground_reaction_is_zero_in_swing():
    always = PeriodicCurve(1.0, (), ())
    record = GaitRecord(
        speed=1.0,
        stride_time=1.0,
        left_phase=0.5,
        stance_fraction={"right": 0.6, "left": 0.65},
        angles={},
        moments={},
        forces={"right": (always, always, always), "left": (always, always, always)},
    )
    force = record.ground_reaction("right", np.array([[0.0, 0.59], [0.61, 1.3]]))
    assert force.shape == (2, 2, 3)
    np.testing.assert_array_equal(force[..., 2], [[1, 1], [0, 1]])
    assert record.ground_reaction("left", 0.62).tolist() == [1, 1, 1]


def test_a_series_through_samples_is_theirs():
    """Mean, cosines and sines of a cycle, without the harmonics that are not asked for."""
    phase = np.arange(64) / 64
    whole = PeriodicCurve(0.7, (1.0, -0.5, 0.25), (0.1, 0.2, -0.4))
    for harmonics in (3, 5):
        found = periodic_through(whole(phase), harmonics)
        assert len(found.cosine) == len(found.sine) == harmonics
        np.testing.assert_allclose(found(phase), whole(phase), atol=1e-12)
    first = PeriodicCurve(0.7, (1.0,), (0.1,))
    np.testing.assert_allclose(periodic_through(whole(phase), 1)(phase), first(phase), atol=1e-12)


def test_both_ends_of_a_cycle_count_as_one_instant():
    """0.3 at one of 20 instants, given at both ends, is 0.3/20 of the mean and 2/20 of a cosine."""
    phase = np.linspace(0.0, 1.0, 21)
    found, _ = fit_periodic(phase, np.where(np.arange(21) % 20 == 0, 0.3, 0.0), 1.0)
    assert found.mean == pytest.approx(0.015, abs=1e-6)
    np.testing.assert_allclose(found.cosine, [0.03], atol=1e-6)
    np.testing.assert_allclose(found.sine, [0.0], atol=1e-6)
