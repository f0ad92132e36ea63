"""Where feet are placed after pushes, for the figure of a report."""

import math

import numpy as np
import pytest

from gaitval.configuration import PushSettings
from gaitval.metrics.pushed_steps import PHASES, forces_of, placed_feet, pushes_aside
from gaitval.metrics.results import PlacedFoot
from gaitval.model.parameters import nominal_parameters
from gaitval.reporting.balance_figure import (
    answered_pushes,
    foot_placement,
    kept_distance,
)
from gaitval.study.stored_policy import general_walker


def test_both_sides_are_pushed_at_every_phase_with_different_forces():
    pushes = pushes_aside([200.0, 100.0])
    assert len(pushes) == 2 * PHASES
    for phase in {each.phase for each in pushes}:
        left, right = (
            next(p for p in pushes if p.phase == phase and math.sin(p.direction) * side > 0)
            for side in (1, -1)
        )
        assert {left.force, right.force} == {100.0, 200.0}
    assert {each.force for each in pushes if each.direction > 0} == {100.0, 200.0}


def test_who_weighs_less_than_an_adult_is_pushed_less():
    full, child = (forces_of(PushSettings(), mass) for mass in (70.0, 23.0))
    assert full == [200.0, 100.0]
    assert child == pytest.approx([0.5 * each for each in full])


@pytest.fixture(scope="module")
def placed(task):
    return placed_feet(task, general_walker(task.configuration.environment), nominal_parameters())


def test_feet_follow_the_push_and_have_had_the_time_for_it(placed):
    assert len(placed) == 2 * PHASES
    stepped = [each for each in placed if each.side is not None]
    assert len(stepped) >= PHASES
    for each in stepped:
        assert each.lead >= 0.3
        assert np.sign(each.foot) == np.sign(each.extrapolated) == np.sign(each.direction)
        assert 0.005 < abs(each.foot) < 0.4


def foot(extrapolated, shift, **changes):
    values = {
        "phase": 0.25, "direction": 90.0, "force": 200.0, "fell": False, "side": "left",
        "lead": 0.4, "foot": shift, "extrapolated": extrapolated, "pendulum": None,
    }  # fmt: skip
    return PlacedFoot(**(values | changes))


FELL = foot(None, None, fell=True, side=None, lead=None)


def test_the_distance_is_what_the_foot_lacks_or_has_too_much():
    found = kept_distance([foot(0.10, 0.115), foot(-0.12, -0.10, side="right"), FELL])
    assert found == pytest.approx({"count": 2, "shift": 11.5, "within": 2.0, "people": 2.0})
    assert kept_distance([FELL]) is None
    rows, sides = answered_pushes([foot(0.1, 0.1), FELL])
    assert rows.shape == (1, 3)
    assert np.isnan(rows[0, 2])
    assert sides == ["left"]


def test_a_figure_of_two_people_has_one_scale_and_both_names():
    text = foot_placement({"old": [foot(0.1, 0.1)], "young": [foot(-0.2, -0.2), FELL]})
    assert text.startswith("<svg")
