import numpy as np
import pytest

from gaitval_devices import experiments, learning
from gaitval_devices.experiments import ASSUMED, condition, effects, measured, quantities, within
from gaitval_devices.study import Wearer


def test_every_quantity_has_a_source_a_device_and_a_band_around_its_value():
    found = quantities()
    assert len(found) == 10
    for quantity in found:
        assert condition(quantity.device).mass > 0.0
        assert quantity.band[0] <= quantity.value <= quantity.band[1]
        assert any(
            year in quantity.source for year in ("2007", "2011", "2014", "2016", "2020", "2021")
        )


def test_a_mean_is_in_a_band_or_not():
    quantity = quantities()[0]
    assert within(quantity, [0.1, 0.3])
    assert not within(quantity, [0.1, 0.1])


def test_effects_of_a_person(person, monkeypatch):
    """Without learning: all quantities of the motion that is kept, and signs that are certain."""
    monkeypatch.setattr(experiments, "adapt", lambda task, policy, samples: policy)
    monkeypatch.setattr(experiments, "CYCLES", 8.0)
    chosen = tuple(q for q in quantities() if q.device in ("elastic", "foot_4kg"))
    monkeypatch.setattr(experiments, "quantities", lambda: chosen)
    who = Wearer("S05", person.task, person.policy, person.mu)
    found = effects(who, samples=1)
    assert set(found) == set(ASSUMED)
    kept = found["kinematics kept"]
    assert set(kept) == {q.name for q in chosen}
    elastic, own, foot = (kept[q.name] for q in chosen)
    assert elastic > 0.0 > own
    assert foot > 0.0


def test_stance_is_compared_between_sides():
    class Curves:
        stance = {"left": 0.64, "right": 0.60}  # noqa: RUF012

    assert measured("sound_stance", Curves(), Curves(), (1.0, 1.0), 1.0) == pytest.approx(4.0)
    assert learning.SAMPLES > 0
    assert np.isfinite(experiments.CYCLES)
