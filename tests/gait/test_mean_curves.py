"""Mean curves as series: stance, weight, and what is refused, at curves made by hand."""

import numpy as np
import pytest

from gaitval.errors import RecordError
from gaitval.gait.mean_curves import (
    TOLERANCES,
    fit_curve,
    fit_force,
    mean_vertical_force,
    stance_fraction,
)
from gaitval.gait.record import fit_periodic

PHASE = np.arange(101) / 100.0


def test_stance_ends_where_the_line_between_two_rows_falls_to_20_n_at_68_kg():
    vertical = np.zeros(101)
    vertical[:62] = 1.0
    vertical[62], vertical[63] = 0.05, 0.01
    assert stance_fraction(vertical) == pytest.approx(0.625)
    vertical[62] = TOLERANCES.stance_threshold
    assert stance_fraction(vertical) == pytest.approx(0.62)
    vertical[62], vertical[63] = 0.0, 0.0
    assert stance_fraction(vertical) == pytest.approx(0.61 + 0.97 / 100)
    vertical[75:80] = 0.1  # the foot drags in swing
    assert stance_fraction(vertical) == pytest.approx(0.61 + 0.97 / 100)
    vertical[62:89] = 1.0
    vertical[89] = 0.04
    assert stance_fraction(vertical) == pytest.approx(0.89 + 0.01 / 0.04 / 100)
    vertical[62:90], vertical[90:] = 0.0, 1.0
    assert 0.6 < stance_fraction(vertical) < 0.63, "the next strike is none of this stance"


def test_the_mean_weight_is_over_one_cycle_of_both_feet():
    right, left = np.zeros((101, 3)), np.zeros((101, 3))
    right[:60, 2], left[50:, 2] = 1.0, 0.8
    right[100, 2], left[100, 2] = 9.0, 9.0  # of the next cycle
    assert mean_vertical_force({"right": right, "left": left}) == pytest.approx(0.6 + 0.5 * 0.8)


def test_a_curve_takes_the_fewest_harmonics_and_a_noisy_one_is_refused():
    values = 0.3 + 0.2 * np.cos(2 * np.pi * PHASE) - 0.1 * np.sin(4 * np.pi * PHASE)
    curve = fit_curve("knee_angle", PHASE[:-1], values[:-1], 1e-6, "a.csv")
    assert (len(curve.cosine), len(curve.sine)) == (2, 2)
    assert curve.mean == pytest.approx(0.3)
    noise = np.random.default_rng(0).normal(0.0, 1.0, 100)
    with pytest.raises(
        RecordError, match=r"a\.csv: with \d+ harmonics the curve of knee_angle"
    ) as one:
        fit_curve("knee_angle", PHASE[:-1], noise, 0.01, "a.csv")
    assert "(allowed 0.03)" in str(one.value)


@pytest.mark.parametrize(("tolerances", "refused"), [(2.95, False), (3.05, True)])
def test_up_to_three_tolerances_may_be_left(tolerances, refused):
    noise = np.random.default_rng(0).normal(0.0, 1.0, 100)
    _, most = fit_periodic(PHASE[:-1], noise, 1e-9)
    if refused:
        with pytest.raises(RecordError):
            fit_curve("a", PHASE[:-1], noise, most / tolerances, "a.csv")
    else:
        fit_curve("a", PHASE[:-1], noise, most / tolerances, "a.csv")


def stance_force(stance=0.62):
    """Smooth forces in stance, zero in swing, the next strike at row 100."""
    force = np.zeros((101, 3))
    rows = np.arange(int(stance * 100) + 1)
    into = rows / 100.0
    force[rows, 0] = 0.1 * np.sin(2 * np.pi * into)
    force[rows, 1] = 0.05 + 0.01 * np.cos(2 * np.pi * into)
    force[rows, 2] = 0.8 + 0.2 * np.cos(4 * np.pi * into)
    force[100] = force[0]
    return force


def test_a_force_is_fitted_over_stance_by_component_and_swing_does_not_count():
    force = stance_force()
    fitted = fit_force(force, 0.62, "a.csv")
    rows = np.append(np.arange(63), 100)
    for series, column in zip((fitted.forward, fitted.left, fitted.up), range(3), strict=True):
        turn = 2 * np.pi * np.outer(rows / 100.0, np.arange(1, len(series.cosine) + 1))
        values = series.mean + np.cos(turn) @ series.cosine + np.sin(turn) @ series.sine
        np.testing.assert_allclose(values, force[rows, column], atol=TOLERANCES.force_tolerance)
    noisy = force.copy()
    noisy[64:100] = 5.0
    again = fit_force(noisy, 0.62, "a.csv")
    assert again == fitted


def test_over_ground_the_strike_that_ends_the_cycle_is_the_one_that_began_it():
    force = stance_force()
    over_ground = force.copy()
    over_ground[100] = 0.0
    assert fit_force(over_ground, 0.62, "a.csv") == fit_force(force, 0.62, "a.csv")


def test_two_strikes_that_differ_are_closed_half_way():
    """One cycle, whose ends were timed some samples apart: no closed curve is near both."""
    force = stance_force()
    force[0, 2], force[100, 2] = 0.18, 0.32
    fitted = fit_force(force, 0.62, "a.csv").up
    assert fitted.mean + np.sum(fitted.cosine) == pytest.approx(
        0.25, abs=TOLERANCES.force_tolerance
    )
