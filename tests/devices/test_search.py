from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
from made_curves import made_curves

from gaitval.apps.devices import search
from gaitval.apps.devices.search import (
    asymmetry,
    lost_after_pushes,
    search_spline,
    spline_of,
    steepest,
    tuned,
    value,
)
from gaitval.apps.devices.study import Wearer
from gaitval.errors import ArtefactError, ConfigurationError
from gaitval.model.devices.aim import Aim
from gaitval.model.devices.device import load_devices
from gaitval.policy.environment import WalkingEnvironment
from gaitval.policy.storage import NETWORK, Policy


def quadratic(x):
    target = np.array([0.3, 0.2, 0.2, 0.3, 0.7, 0.2, 0.2, -0.3])
    return 0.5 + float(np.sum((x - target) ** 2))


def searched(folder, generations, cost=quadratic, seed=0):
    aim = Aim(joint="hip_flexion", generations=generations, seed=seed)
    about = aim.model_dump(exclude={"generations"})
    return search._searched(cost, folder, aim, about, lambda *_: None)


def test_it_finds_what_is_best(tmp_path):
    x, best, history = searched(tmp_path, 40)
    assert best == pytest.approx(0.5, rel=0.02)
    assert x[3] == pytest.approx(0.3, abs=0.08)
    assert len(history) == 40


def test_another_seed_searches_elsewhere(tmp_path):
    first, other = (searched(tmp_path / str(seed), 2, seed=seed) for seed in (0, 1))
    assert not np.array_equal(first[0], other[0])
    assert first[2] != other[2]


def test_an_angle_beyond_the_range_costs_ten_for_each_radian(person, tmp_path, monkeypatch):
    """The walks are made up: the joint goes 0.05 rad further than it may, on both sides, or not."""
    aim, device = Aim(joint="hip_flexion", generations=1, range_rad=0.2), load_devices("hip_exo")[0]
    who = Wearer("S05", person.task, person.policy, person.mu)
    rollout = SimpleNamespace(fell=[0.0], phase=[search.CYCLES])
    monkeypatch.setattr(search, "DeviceEnvironment", lambda _, pace: None)
    monkeypatch.setattr(search, "walk_with", lambda *_, **__: SimpleNamespace(rollout=rollout))
    monkeypatch.setattr(search, "_without", lambda *_: (made_curves(), None, 1.0))  # all at 0.1 rad
    best = []
    for angle in (0.1, 0.3, 0.35, -0.15):
        fitted = made_curves()
        for side in ("right", "left"):
            fitted.angles["hip_flexion", side][50] = angle
        monkeypatch.setattr(search, "walk_curves", lambda *_, fitted=fitted: fitted)
        found = search_spline(who, device, aim, tmp_path / str(angle))
        best.append(found.best / found.without)
    assert best[1] == best[0]
    assert best[2:] == pytest.approx([best[0] + 2 * 0.5] * 2)


def test_a_search_that_was_ended_comes_to_the_same_place(tmp_path):
    whole = searched(tmp_path / "a", 8)
    walks = 0

    def dies(x):
        nonlocal walks
        walks += 1
        if walks > 40:
            raise KeyboardInterrupt
        return quadratic(x)

    with pytest.raises(KeyboardInterrupt):
        searched(tmp_path / "b", 8, dies)
    for ours, other in zip(searched(tmp_path / "b", 8), whole, strict=True):
        np.testing.assert_array_equal(ours, other)
    with pytest.raises(ArtefactError, match="device, aim or seed"):
        searched(tmp_path / "b", 8, seed=5)
    (tmp_path / "b" / search.STATE).write_text("{}")
    with pytest.raises(ArtefactError, match="Delete it"):
        searched(tmp_path / "b", 8)


def test_the_steepest_slope_is_that_of_the_cubic():
    spline = spline_of(np.array([0.5, 0.2, 0.1, 0.5, 0.9, 0.1, 0.1, 0.0]), 20.0)
    assert steepest(spline, 1.0) == pytest.approx(1.5 * 10.0 / 0.1)


def test_a_device_without_a_motor_there_is_refused(person, tmp_path):
    who = Wearer("S05", person.task, person.policy, person.mu)
    with pytest.raises(ConfigurationError, match="no motor at hip_flexion"):
        search_spline(who, load_devices("ankle_exo")[0], Aim(joint="hip_flexion"), tmp_path)


@pytest.mark.slow
def test_two_generations_with_a_person(person, tmp_path, monkeypatch):
    monkeypatch.setattr(search, "POPULATION", 4)
    monkeypatch.setattr(search, "CYCLES", 8.0)
    who = Wearer("S05", person.task, person.policy, person.mu)
    device = load_devices("hip_exo")[0]
    found = search_spline(who, device, Aim(joint="hip_flexion", generations=2), tmp_path)
    assert found.walks == 8
    assert 0.0 < found.best < 2.0 * found.without
    # Nobody else gets its strategy, not even under the same name.
    mu, (first, *_) = person.mu.copy(), NETWORK
    mu[2] += 0.01
    tensors = person.policy.tensors
    trained = Policy({**tensors, first: 1.01 * tensors[first]}, person.policy.about)
    reference = replace(person.task.reference, positions=1.001 * person.task.reference.positions)
    corrected = replace(person.task, reference=reference)
    for other in (replace(who, mu=mu), replace(who, policy=trained), replace(who, task=corrected)):
        with pytest.raises(ArtefactError, match="another person, walker, device"):
            search_spline(other, device, Aim(joint="hip_flexion", generations=2), tmp_path)


def test_aims_are_of_both_sides_together():
    for sides in ((0.3, 0.1), (0.1, 0.3)):
        curves = made_curves(work=sides, moment=(-sides[0], sides[1]))
        assert value(Aim(joint="knee_angle"), curves) == pytest.approx(0.4)
        assert value(Aim(joint="knee_angle", quantity="moment"), curves) == pytest.approx(0.4)
        assert value(Aim(joint="knee_angle", quantity="legs"), curves) == pytest.approx(1.2)


def test_asymmetry_is_the_same_for_either_side():
    even = made_curves()
    assert asymmetry(even) == 0.0
    for name, sides in (("stance", (0.5, 0.7)), ("force", (1.0, 1.4)), ("work", (0.1, 0.14))):
        index = abs(sides[0] - sides[1]) / (0.5 * sum(sides))
        for given in (sides, sides[::-1]):
            found = asymmetry(made_curves(**{name: given}))
            assert found == pytest.approx(index / 3.0), name
    assert value(Aim(joint="knee_angle", quantity="asymmetry"), even) == 0.0


def test_harder_pushes_cost_more_strides(person):
    who = Wearer("S05", person.task, person.policy, person.mu)
    bare = WalkingEnvironment(person.task)
    lost = [lost_after_pushes(bare, who, force) for force in (20.0, 1500.0)]
    assert lost[0] == 0.0
    assert 0.5 < lost[1] <= 1.0


@pytest.mark.parametrize(
    "quantity", ["legs", "asymmetry", pytest.param("pushes", marks=pytest.mark.slow)]
)
def test_a_generation_for_every_aim(person, tmp_path, monkeypatch, quantity):
    monkeypatch.setattr(search, "POPULATION", 2)
    monkeypatch.setattr(search, "CYCLES", 8.0)
    who = Wearer("S05", person.task, person.policy, person.mu)
    aim = Aim(joint="hip_flexion", quantity=quantity, generations=1)
    device = load_devices("hip_exo")[0].model_copy(update={"search": aim})
    messages = []
    (fitted,), (found,) = tuned(who, [device], tmp_path, say=messages.append)
    assert fitted.search is None
    assert fitted.hinges[0].controller.bumps == found.bumps
    assert found.without > 0.0
    assert quantity in messages[-1]
    assert tuned(who, [device], tmp_path)[1][0] == found  # from its state


def test_a_device_without_a_search_is_worn_as_it_is(person, tmp_path):
    who = Wearer("S05", person.task, person.policy, person.mu)
    devices = load_devices("afo")
    assert tuned(who, devices, tmp_path) == (list(devices), [])
    assert not list(tmp_path.iterdir())
