import numpy as np
import pytest

from gaitval.errors import ArtefactError, ConfigurationError
from gaitval_devices import search
from gaitval_devices.device import load_devices
from gaitval_devices.search import Aim, search_spline, spline_of, steepest
from gaitval_devices.study import Wearer


def quadratic(x):
    target = np.array([0.3, 0.2, 0.2, 0.3, 0.7, 0.2, 0.2, -0.3])
    return 0.5 + float(np.sum((x - target) ** 2))


def searched(folder, generations, cost=quadratic, seed=0):
    about = {"joint": "hip_flexion"}
    return search._searched(cost, folder, seed, generations, 10.0, 2.0, lambda *_: None, about)


def test_it_finds_what_is_best(tmp_path):
    found = searched(tmp_path, 40)
    assert found.best == pytest.approx(2.0 * 0.5, rel=0.02)
    assert found.bumps[0][3] == pytest.approx(3.0, abs=0.8)


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
    assert searched(tmp_path / "b", 8) == whole
    with pytest.raises(ArtefactError, match="another aim or seed"):
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


def test_two_generations_with_a_person(person, tmp_path, monkeypatch):
    monkeypatch.setattr(search, "POPULATION", 4)
    monkeypatch.setattr(search, "CYCLES", 8.0)
    who = Wearer("S05", person.task, person.policy, person.mu)
    device = load_devices("hip_exo")[0]
    found = search_spline(who, device, Aim(joint="hip_flexion"), tmp_path, generations=2)
    assert found.walks == 8
    assert 0.0 < found.best < 2.0 * found.without
