"""Measures of one side, of walks where they are known."""

from dataclasses import replace

import numpy as np
import pytest
from synthetic_walk import MASS, perfect_walk, sharp_filter, synthetic_record

from gaitval.constants import GRAVITY
from gaitval.coordinates import SIDES
from gaitval.gait.cycle_curves import Curves, recorded_curves
from gaitval.metrics.comparison import low_pass_of, simulated_curves
from gaitval.metrics.curve_results import mean_curves
from gaitval.metrics.cycles import find_cycles
from gaitval.metrics.origin import QUANTITIES_OF
from gaitval.metrics.side_measures import SIDE_MEASURES, pressure_arm, side_values
from gaitval.metrics.tolerances import WALK_UNITS, load_registry

RECORD = synthetic_record()
RECORDED = recorded_curves(RECORD)
WALK = perfect_walk(RECORD, cycles=6)
CYCLES = find_cycles(WALK, sharp_filter())


def measured(walk=WALK):
    filters = low_pass_of(RECORD, 100.0)
    walked = simulated_curves(walk, CYCLES, mass=MASS, filters=filters)
    return {(name, side): value for name, side, value in side_values(mean_curves(walked), RECORDED)}


def test_what_is_declared_is_known_everywhere():
    """A row of the table gives the unit and what the walk is compared with."""
    margins = {each.measure for each in load_registry().margin}
    for each in SIDE_MEASURES:
        assert WALK_UNITS[each.name] == each.unit
        assert QUANTITIES_OF[each.name] == each.quantities
        assert each.name in margins


def test_a_walk_that_does_what_the_record_says_has_no_error():
    found = measured()
    assert found.keys() == {(each.name, side) for each in SIDE_MEASURES for side in SIDES}
    assert max(found.values()) < 0.05


@pytest.mark.parametrize(("column", "side"), [(0, "right"), (1, "left")])
def test_a_foot_that_lands_harder_is_seen(column, side):
    ground = WALK.ground_reaction.copy()
    ground[:, column, 2] *= 1.1
    found = measured(replace(WALK, ground_reaction=ground))
    peak = RECORDED.forces[f"vertical_{side[0]}"][:31].max()
    assert found["loading_peak_error", side] == pytest.approx(10.0 * peak, rel=0.02)
    other = {"right": "left", "left": "right"}[side]
    assert found["loading_peak_error", other] < 0.05


def test_a_side_without_mean_curves_is_not_measured():
    parts = (RECORDED.angles, RECORDED.moments, RECORDED.forces)
    walked = Curves(*({n: curve for n, curve in part.items() if n[-1] == "l"} for part in parts))
    values = list(side_values(walked, RECORDED))
    assert {value for _, side, value in values if side == "right"} == {None}
    assert {value for _, side, value in values if side == "left"} == {0.0}


def test_the_arm_is_that_of_the_part_of_the_cycle_in_which_the_foot_is_loaded():
    """12 to 52 % of it, both included; a larger plantarflexion moment is further ahead."""
    percent = np.arange(101.0)
    np.testing.assert_allclose(pressure_arm(-GRAVITY * percent, np.ones(101)), np.arange(12, 53))


@pytest.mark.parametrize(("side", "ahead"), [("right", 0.010), ("left", -0.010)])
def test_measures_are_in_the_units_that_they_say(side, ahead):
    """80 % of the weight 50 mm ahead of the ankle, then 10 mm further or nearer, and 3 % more."""
    end, force = f"_{side[0]}", np.full(101, 0.8)
    recorded, walked = (
        Curves(
            {},
            {f"ankle_angle{end}": -GRAVITY * 0.8 * arm * np.ones(101)},
            {f"vertical{end}": force + more},
        )
        for arm, more in ((0.05, 0.0), (0.05 + ahead, 0.0))
    )
    found = {(name, of): value for name, of, value in side_values(walked, recorded)}
    assert found["pressure_arm_rmse", side] == pytest.approx(10.0)  # mm
    walked.forces[f"vertical{end}"] += 0.03
    found = {(name, of): value for name, of, value in side_values(walked, recorded)}
    assert found["loading_peak_error", side] == pytest.approx(3.0)  # % of body weight
