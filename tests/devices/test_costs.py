"""What devices do to metabolic rate: bands of models, who decides the sign, loads by share."""

from types import SimpleNamespace

import numpy as np
import pytest

from gaitval.apps.devices.costs import (
    COMMON,
    PERSON,
    change_of,
    cost_changes,
    in_words,
    person_band,
    rate_in_words,
    signed,
    size,
    unknown_in_words,
)
from gaitval.apps.devices.results import MARGINS
from gaitval.datasets.subject_file import load_subject
from gaitval.errors import ConfigurationError
from gaitval.model.devices.composite import fitted
from gaitval.model.devices.loads import LOADS, trunk_load
from gaitval.quantities.metabolic_cost import JOINTS, MetabolicCost
from gaitval.scaling.scaling import scale_subject

MODELS = ("bhargava", "umberger", "uchida", JOINTS)


def _outcome(assumption, rates, *, speed=1.2, fell=False):
    gross = dict(zip(MODELS, rates, strict=True))
    return SimpleNamespace(
        assumption=assumption,
        cost=MetabolicCost("S05", 60.0, speed, gross),
        curves=SimpleNamespace(speed=speed),
        fell=fell,
    )


WITHOUT = _outcome("without", (4.0, 4.5, 3.4, 3.8))


def _with(assumption, *changes, **options):
    rates = np.add((4.0, 4.5, 3.4, 3.8), changes)
    return _outcome(assumption, rates, **options)


def test_a_change_is_the_mean_of_two_models_and_in_the_middle_of_its_bands():
    change = change_of(_with("kinematics kept", 0.4, 0.5, 0.3, 0.2), WITHOUT)
    assert change.before == pytest.approx(3.9)
    assert change.middle == pytest.approx(0.3)
    assert change.percent == pytest.approx(100 * 0.3 / 3.9)
    for low, high in (change.band, change.person):
        assert (low + high) / 2 == pytest.approx(0.3)
    assert change.person[0] < change.band[0] < 0.3


def test_a_change_that_two_models_see_alike_is_as_large_as_they_say():
    assert size({"bhargava": 0.3, JOINTS: 0.3, "uchida": 5.0}) == pytest.approx(0.3)
    # Of which they see nothing together is not known to be nothing.
    assert size({"bhargava": 0.3, JOINTS: -0.3}) == pytest.approx(0.3)


@pytest.mark.parametrize(("change", "sign"), [(0.9, 0), (1.2, 1), (-0.9, 0), (-1.2, -1)])
def test_a_change_within_what_a_rate_may_move_by_itself_has_no_sign(change, sign):
    by = change * MARGINS["W/kg"]
    found = change_of(_with("kinematics kept", by, by, by, by), WITHOUT)
    assert found.sign == sign
    assert found.agreed == np.sign(change)


def test_a_model_that_says_the_contrary_leaves_a_change_without_sign():
    assert change_of(_with("kinematics kept", 0.5, -0.1, 0.5, 0.5), WITHOUT).sign == 0


def _true(random, changes):
    """What people's mean change may be, of changes by model."""
    middle = (changes["bhargava"] + changes[JOINTS]) / 2
    return middle + COMMON * size(changes) * random.normal()


def test_a_band_of_a_person_holds_people_who_change_unlike():
    random = np.random.default_rng(2)
    inside = 0
    for _ in range(4000):
        changes = {"bhargava": random.normal(), JOINTS: random.normal()}
        change = _true(random, changes) + PERSON * (random.normal() - random.normal())
        low, high = person_band(changes)
        inside += low <= change <= high
    assert inside / 4000 == pytest.approx(0.90, abs=0.02)


def test_a_slower_or_fallen_walk_has_no_cost_beside_that_without():
    slower = _with("moments kept", -0.5, -0.5, -0.5, -0.5, speed=1.1)
    fallen = _with("learned", -0.5, -0.5, -0.5, -0.5, fell=True)
    kept = _with("kinematics kept", -0.1, -0.1, -0.1, -0.1)
    assert [each.assumption for each in cost_changes([WITHOUT, kept, slower, fallen])] == [
        "kinematics kept"
    ]


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        ([(0.5, 0.52, 0.48, 0.5), (0.3, 0.31, 0.29, 0.3)], "costs more, by every assumption"),
        ([(-0.5, -0.52, -0.48, -0.5)], "costs less, by every assumption"),
        ([(0.5, 0.5, 0.5, 0.5), (-0.5, -0.5, -0.5, -0.5)], "assumption decides the sign"),
        ([(0.5, -0.3, 0.6, 0.1)], "models decide the sign, not the device"),
        ([(-0.05, -0.02, -0.1, -0.04)], "costs less by every model if the motion is kept, but"),
        ([(0.5, 0.5, 0.5, 0.5), (-0.6, 0.3, -0.6, -0.1)], "the assumptions do not agree either"),
        ([], ""),
    ],
)
def test_the_page_says_who_decides_the_sign(changes, words):
    names = ("kinematics kept", "moments kept")
    found = [
        change_of(_with(name, *each), WITHOUT) for name, each in zip(names, changes, strict=False)
    ]
    said = in_words(found)
    assert words in said
    assert bool(said) == bool(words)


def test_a_change_is_said_with_both_bands():
    change = change_of(_with("kinematics kept", -0.4, -0.5, -0.3, -0.2), WITHOUT)
    said = rate_in_words(change)
    for shown in ("−0.30 W/kg", "−8 %", *(signed(each) for each in change.band + change.person)):
        assert shown in said


def test_why_no_change_is_known_is_said():
    kept = _with("kinematics kept", -0.1, -0.1, -0.1, -0.1)
    assert unknown_in_words([WITHOUT, kept]) == ""
    kept.cost = None
    assert "muscles" in unknown_in_words([WITHOUT, kept])
    slower = _with("kinematics kept", -0.1, -0.1, -0.1, -0.1, speed=1.0)
    assert "speed" in unknown_in_words([WITHOUT, slower])


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
