import re
from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
from made_curves import made_curves
from newton_walk import newton_walk
from scipy.stats import ttest_rel

from gaitval.apps.devices import experiments, learning
from gaitval.apps.devices.experiments import (
    ASSUMED,
    Paired,
    com_work_rate,
    condition,
    effects,
    measured,
    quantities,
    within,
)
from gaitval.apps.devices.study import Wearer
from gaitval.coordinates import SIDES


def test_every_quantity_has_a_source_a_device_and_a_band_around_its_value():
    found = quantities() + quantities("experiments_above_knee")
    assert len(found) == 11
    for quantity in found:
        assert condition(quantity.device).mass > 0.0
        assert quantity.band[0] <= quantity.value <= quantity.band[1]
        assert re.search(r"\b20\d\d\b", quantity.source)


def test_an_interval_follows_from_the_means_and_p_of_the_paper():
    paired = [quantity for quantity in quantities() if quantity.kind == "interval"]
    assert [quantity.device for quantity in paired] == ["hip_exo"]
    for quantity in paired:
        assert quantity.band == pytest.approx(quantity.paired.band(), abs=0.05)
        change = 100.0 * (quantity.paired.after / quantity.paired.before - 1.0)
        assert quantity.value == pytest.approx(change, abs=0.05)


def test_an_interval_is_that_of_the_paired_t_test():
    random = np.random.default_rng(3)
    before = random.normal(1.2, 0.2, 9)
    after = before + random.normal(-0.1, 0.1, 9)
    found = ttest_rel(after, before)
    low, high = found.confidence_interval(0.95)
    paired = Paired(n=9, p=float(found.pvalue), before=before.mean(), after=after.mean())
    expected = 100.0 * np.array([low, high]) / before.mean()
    assert paired.band() == pytest.approx(tuple(expected))


def test_a_mean_is_in_a_band_or_not():
    quantity = quantities()[0]
    assert within(quantity, [0.1, 0.3])
    assert not within(quantity, [0.1, 0.1])


def test_effects_of_a_person(person, monkeypatch):
    """Without learning: all quantities of the motion that is kept, and signs that are certain."""
    monkeypatch.setattr(experiments, "adapt", lambda task, policy, **_: policy)
    monkeypatch.setattr(experiments, "CYCLES", 8.0)
    chosen = tuple(q for q in quantities() if q.device in ("elastic", "foot_4kg"))
    monkeypatch.setattr(experiments, "quantities", lambda _: chosen)
    who = Wearer("S05", person.task, person.policy, person.mu)
    found = effects(who, samples=1)
    assert set(found) == set(ASSUMED)
    kept = found["kinematics kept"]
    assert set(kept) == {q.name for q in chosen}
    elastic, own, foot = (kept[q.name] for q in chosen)
    assert elastic > 0.0 > own
    assert foot > 0.0


@pytest.mark.parametrize(("fitted", "sign"), [("right", 1.0), ("left", -1.0)])
def test_the_sound_side_is_the_one_without_the_prosthesis(fitted, sign):
    curves = made_curves(stance=(0.60, 0.64), force=(0.9, 1.1))  # right, left
    found = [
        measured(name, curves, curves, (1.0, 1.0), 1.0, fitted)
        for name in ("sound_stance", "sound_impulse")
    ]
    assert found == pytest.approx([sign * 4.0, sign * 20.0])
    assert learning.SAMPLES > 0


def test_work_on_the_centre_of_mass_is_of_each_kg_of_load():
    """30 W without a load and 44 W with 10 kg: 1.4 W more for each."""
    curves = made_curves(stance=(0.6, 0.6), force=(1.0, 1.0))
    assert measured("com_work", curves, curves, (44.0, 30.0), 10.0) == pytest.approx(1.4)


def test_each_leg_does_its_own_work_on_the_centre_of_mass(monkeypatch):
    """At 1 m/s the right leg pushes with 100 N and the left one brakes with 60 N: 100 W, and not
    the 40 W of both together."""
    walk = newton_walk(np.zeros(3), seconds=1.0)
    walk = replace(
        walk,
        ground_reaction=np.tile([[100.0, 0.0, 0.0], [-60.0, 0.0, 0.0]], (len(walk.time), 1, 1)),
        centre_of_mass=walk.time[:, None] * [1.0, 0.0, 0.0],
    )
    whole = SimpleNamespace(rows=lambda: slice(0, len(walk.time)))
    monkeypatch.setattr(experiments, "find_cycles", lambda *_: whole)
    assert com_work_rate(SimpleNamespace(rollout=walk), None) == pytest.approx(100.0)


def test_the_hip_in_swing_is_that_after_the_stance():
    """2 Nm/kg in stance and 0.5 in swing, of 0.4 before: a quarter more."""
    curves = [made_curves(moment=2.0) for _ in range(2)]
    for each, swing in zip(curves, (0.5, 0.4), strict=True):
        for side in SIDES:
            each.own["hip_flexion", side][62:] = swing
    assert measured("swing_hip", *curves, (1.0, 1.0), 1.0) == pytest.approx(25.0)
