"""What devices do to metabolic rate: bands of models and their sign; loads by share."""

from types import SimpleNamespace

import numpy as np
import pytest

from gaitval.apps.devices.costs import COMMON, PERSON, CostChange, cost_change, signed
from gaitval.apps.devices.results import MARGINS
from gaitval.errors import ConfigurationError
from gaitval.model.devices.composite import fitted
from gaitval.model.devices.loads import LOADS, trunk_load
from gaitval.quantities.metabolic_cost import JOINTS, MetabolicCost
from gaitval.scaling.scaling import scale_subject
from gaitval.subjects.subject_file import load_subject

MODELS = ("bhargava", "umberger", "uchida", JOINTS)


def _outcome(*changes, speed=1.2, fell=False):
    rates = np.add((4.0, 4.5, 3.4, 3.8), changes or 0.0)
    cost = MetabolicCost("S05", 60.0, speed, dict(zip(MODELS, rates.tolist(), strict=True)))
    return SimpleNamespace(cost=cost, curves=SimpleNamespace(speed=speed), fell=fell)


def _change(*changes):
    return cost_change(_outcome(), _outcome(*changes))


def test_a_change_is_the_mean_of_two_models_and_in_the_middle_of_its_bands():
    change = _change(0.4, 0.5, 0.3, 0.2)
    assert change.before == pytest.approx(3.9)
    assert change.middle == pytest.approx(0.3)
    assert change.percent == pytest.approx(100 * 0.3 / 3.9)
    for low, high in (change.band, change.person):
        assert (low + high) / 2 == pytest.approx(0.3)
    assert change.person[0] < change.band[0] < 0.3


def test_a_change_that_two_models_see_alike_is_as_large_as_they_say():
    assert CostChange(
        4.0, 4.3, {"bhargava": 0.3, JOINTS: 0.3, "uchida": 5.0}
    ).size == pytest.approx(0.3)
    # Of which they see nothing together is not known to be nothing.
    assert CostChange(4.0, 4.0, {"bhargava": 0.3, JOINTS: -0.3}).size == pytest.approx(0.3)


@pytest.mark.parametrize(("change", "sign"), [(0.9, 0), (1.2, 1), (-0.9, 0), (-1.2, -1)])
def test_a_change_within_what_a_rate_may_move_by_itself_has_no_sign(change, sign):
    by = change * MARGINS["W/kg"]
    found = _change(by, by, by, by)
    assert found.sign == sign
    assert found.agreed == np.sign(change)


def test_a_model_that_says_the_contrary_leaves_a_change_without_sign():
    assert _change(0.5, -0.1, 0.5, 0.5).sign == 0


def test_a_band_of_a_person_holds_people_who_change_unlike():
    random = np.random.default_rng(2)
    inside = 0
    for _ in range(4000):
        changes = {"bhargava": random.normal(), JOINTS: random.normal()}
        found = CostChange(4.0, 4.0 + np.mean(list(changes.values())), changes)
        mean = found.middle + COMMON * found.size * random.normal()
        low, high = found.person
        inside += low <= mean + PERSON * (random.normal() - random.normal()) <= high
    assert inside / 4000 == pytest.approx(0.90, abs=0.02)


def test_a_slower_or_fallen_walk_has_no_cost_beside_that_without():
    less = (-0.5, -0.5, -0.5, -0.5)
    assert cost_change(_outcome(), _outcome(*less, speed=1.1)) is None
    assert cost_change(_outcome(), _outcome(*less, fell=True)) is None
    assert _change(*less) is not None


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        ((0.5, 0.52, 0.48, 0.5), "costs more by every model."),
        ((-0.5, -0.52, -0.48, -0.5), "costs less by every model."),
        ((0.5, -0.3, 0.6, 0.1), "models do not agree"),
        ((-0.05, -0.02, -0.1, -0.04), "costs less by every model, but by so little"),
    ],
)
def test_a_change_is_said_with_its_sign_and_both_bands(changes, words):
    change = _change(*changes)
    said = change.words()
    assert words in said
    for shown in (signed(change.middle), *(signed(each) for each in change.band + change.person)):
        assert shown in said


@pytest.fixture(scope="module")
def model():
    return scale_subject(load_subject("S05")).model


def test_a_vest_is_a_share_of_the_body_around_its_trunk(model):
    load = trunk_load(20.0, model.mass)
    laden = fitted(model, [load])
    assert laden.mass == pytest.approx(1.2 * model.mass)
    before, after = model["torso"], laden["torso"]
    assert after.mass - before.mass == pytest.approx(0.2 * model.mass)
    place = (after.mass * after.centre_of_mass - before.mass * before.centre_of_mass) / (
        0.2 * model.mass
    )
    height = model["upper_arm_r"].joint_position[2]
    np.testing.assert_allclose(place[1:], [0.0, LOADS.along * height], atol=1e-12)


@pytest.mark.parametrize("percent", [0.0, -10.0, LOADS.largest + 1.0, float("nan")])
def test_a_load_that_nobody_was_measured_with_is_refused(percent):
    with pytest.raises(ConfigurationError, match=r"--load .*up to 40.*docs/how-to/devices"):
        trunk_load(percent, 60.0)
