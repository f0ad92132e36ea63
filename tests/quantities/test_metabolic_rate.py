"""Metabolic rate of the joints, and rates over the walking speed."""

import numpy as np
import pytest

from gaitval.gait.cycle_curves import Curves
from gaitval.kinetics.musculature.metabolics import METABOLISM
from gaitval.metrics.walk_quantities import found_quantities, quantity_results
from gaitval.quantities import METABOLIC_JOINTS
from gaitval.quantities.joint_power import JOINT_POWER, JOINTS
from gaitval.quantities.metabolic_rate import (
    EFFICIENCY,
    HEAT,
    RETURNED,
    expected_rate,
    joint_rates,
    leg_rate,
)

CONCENTRIC, ECCENTRIC = EFFICIENCY.values()

TIMES = {"r": 1.1, "l": 1.1}
PHASE = np.linspace(0.0, 1.0, 101)


def _curves(angle, moment):
    names = [f"{joint}_{side}" for joint in JOINTS for side in "rl"]
    return Curves(dict.fromkeys(names, angle), dict.fromkeys(names, moment), {})


def test_a_held_moment_costs_heat_alone():
    found = joint_rates(_curves(np.zeros(101), np.full(101, -0.5)), TIMES)
    for side in "rl":
        np.testing.assert_allclose(found.curves[f"leg_{side}"], 3 * HEAT * 0.5)
        net = found.figures["net"][f"body_{side}"]
        assert net == pytest.approx(2 * 3 * HEAT * 0.5)
        assert found.figures["gross"][f"body_{side}"] == pytest.approx(METABOLISM.rest + net)


def test_work_that_is_absorbed_alone_costs_little_and_gives_none_back():
    angle = np.sin(2 * np.pi * PHASE)
    rate = 2 * np.pi / 1.1 * np.cos(2 * np.pi * PHASE)
    along, against = (joint_rates(_curves(angle, sign * rate), TIMES) for sign in (1.0, -1.0))
    heat = 3 * HEAT * np.abs(rate)[:-1].mean()
    work = 3 * (rate**2)[:-1].mean()
    net = {name: found.figures["net"]["body_r"] for name, found in
           (("along", along), ("against", against))}  # fmt: skip
    assert net["along"] == pytest.approx(2 * (heat + work / CONCENTRIC), rel=0.01)
    assert net["against"] == pytest.approx(2 * (heat + work / ECCENTRIC), rel=0.01)


def test_work_that_was_absorbed_before_is_returned_in_part():
    # As much is absorbed as is done: a held moment over a joint that swings.
    size, done = np.full(100, 0.5), 0.5 * np.clip(np.sin(2 * np.pi * PHASE[:-1]), 0.0, None)
    absorbed = np.roll(done, 50)
    heat, work = HEAT * 0.5, done.mean()
    lost = (1.0 - RETURNED) * work
    expected = heat + lost / CONCENTRIC + lost / ECCENTRIC
    assert leg_rate(size, done, absorbed).mean() == pytest.approx(expected)
    # Lifting was never stored: the same work without any absorbed costs all of it.
    assert leg_rate(size, done, 0 * done).mean() == pytest.approx(heat + work / CONCENTRIC)
    # What is absorbed downhill is not all stored: no more comes back than if as much was done.
    braked = expected + 4.0 * work / ECCENTRIC
    assert leg_rate(size, done, 5 * absorbed).mean() == pytest.approx(braked)


def test_lifting_the_body_costs_four_times_its_work():
    """Each further W of positive work, be it that less was absorbed before it or not."""
    size, done = np.full(100, 0.5), np.full(100, 1.0)
    level, up = (leg_rate(size, done + more, 0.8 * done).mean() for more in (0.0, 0.6))
    assert up - level == pytest.approx(0.6 / 0.25)


def test_a_joint_that_was_not_measured_leaves_it_out():
    whole = _curves(np.zeros(101), np.ones(101))
    del whole.moments["knee_angle_l"]
    assert joint_rates(whole, TIMES) is None


def test_of_a_load_that_moments_are_divided_by_the_rate_is_still_of_the_person():
    """A fifth more mass: the same moments are larger by the kg of the person, who rests alone."""
    curves = _curves(np.zeros(101), np.full(101, -0.5))
    alone, laden = (found_quantities(curves, TIMES, speed=1.0, laden=by) for by in (1.0, 1.2))
    net = alone[METABOLIC_JOINTS.name].figures["net"]["body_r"]
    gross = laden[METABOLIC_JOINTS.name].figures["gross"]["body_r"]
    assert gross == pytest.approx(METABOLISM.rest + 1.2 * net)
    power = [found[JOINT_POWER.name].figures["generated"] for found in (alone, laden)]
    assert power[0] == power[1]


@pytest.mark.parametrize("speed", [None, float("nan"), 0.0])
def test_without_a_speed_there_is_no_cost_of_a_metre(speed):
    found = found_quantities(_curves(np.zeros(101), np.ones(101)), TIMES, speed=speed)
    assert "per_metre" not in found[METABOLIC_JOINTS.name].figures


def test_files_have_the_cost_of_a_metre():
    found = found_quantities(_curves(np.zeros(101), np.ones(101)), TIMES, speed=1.25)
    stored = quantity_results(found)[METABOLIC_JOINTS.name]
    for side in "rl":
        gross = stored.figures["gross"][f"body_{side}"]
        assert stored.figures["per_metre"][f"body_{side}"] == pytest.approx(gross / 1.25)
    assert stored.figure_units == {"gross": "W/kg", "net": "W/kg", "per_metre": "J/kg/m"}


@pytest.mark.parametrize(
    ("speed", "measured"), [(0.75, 3.36), (1.0, 3.54), (1.25, 4.47), (1.5, 4.91), (1.75, 6.56)]
)
def test_people_who_were_measured_need_what_is_expected_of_their_speed(speed, measured):
    """Means of 13 or 22 adults of Slade et al. (2021), Nat Commun 12:4312, W/kg."""
    assert expected_rate(speed) == pytest.approx(measured, rel=0.08)


def test_pages_have_one_rate_of_the_body_which_is_the_mean_of_what_each_leg_says():
    """Two rates of a body side by side would be added up."""
    (table, _) = METABOLIC_JOINTS.tables
    figures = {"gross": {"body_r": 4.0, "body_l": 3.8}, "net": {"body_r": 2.8}}
    assert table.columns == ("body",)
    assert table.figure(figures, "gross", "body", "body") == pytest.approx(3.9)
    assert table.figure(figures, "net", "body", "body") == pytest.approx(2.8)
    assert table.figure({}, "gross", "body", "body") is None
