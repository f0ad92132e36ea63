"""Tables and rows of experiments.own_training, from studies whose figures are known."""

import math
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from experiments import own_training as own
from gaitval.artefacts import read_json

BASELINE = Path(own.ROOT / "reports" / "S05" / "baseline")


def study(person: str, seed: int, samples: int, error: float = 1.0, **more: Any) -> dict[str, Any]:
    names = ("push_survival phase 0", "falls walk")
    standing = {"survived": 90, "pushes": 96}
    return {
        "person": person,
        "seed": seed,
        "samples": samples,
        "angles": error,
        "moments": 0.05 * error,
        "vertical": 2.0 * error,
        "goals": {"angle_rmse hip_flexion_r": True, "push_survival phase 0": True},
        "limits": dict.fromkeys(names, True),
        "falls": 0,
        "of starts": 8,
        "pushes": 95,
        "of pushes": 100,
        "gain": {"start": standing, "trained": standing, "handed_on": "trained"},
    } | more


def of_people(factors: dict[str, list[float]]) -> list[dict[str, Any]]:
    """Studies whose trained walks err by a factor less, by person and seed."""
    return [
        study(person, seed, samples, 1.0 / each[seed] if samples else 1.0)
        for person, each in factors.items()
        for seed in range(len(each))
        for samples in (0, own.MOST)
    ]


def test_a_factor_that_all_share_is_found_without_an_interval():
    found = own.pairs(of_people({"a": [1.1, 1.1], "b": [1.1]}))
    for quantity in own.QUANTITIES:
        assert own.ratio(found, quantity) == pytest.approx((1.1, 1.1, 1.1))


def test_the_ratio_is_the_geometric_mean_over_people_and_of_each_over_seeds():
    # who was studied with more seeds counts no more
    found = own.pairs(of_people({"a": [1.2, 1.2, 1.2, 1.2], "b": [0.9]}))
    mean, low, high = own.ratio(found, "angles")
    assert mean == pytest.approx(math.sqrt(1.2 * 0.9))
    assert low == pytest.approx(0.9)
    assert high == pytest.approx(1.2)


def test_the_ratio_the_other_way_is_the_inverse():
    found = own.pairs(of_people({"a": [1.2, 1.1], "b": [0.9, 1.0], "c": [1.05, 1.0]}))
    turned = {person: [(b, a) for a, b in each] for person, each in found.items()}
    (mean, low, high), back = own.ratio(found, "angles"), own.ratio(turned, "angles")
    assert low < mean < high
    assert back.mean == pytest.approx(1.0 / mean)
    assert back.low == pytest.approx(1.0 / high)


def test_a_study_without_its_pair_is_not_compared():
    studies = [study("a", 0, own.MOST), study("a", 1, 0), study("b", 0, 0), study("b", 2, 4096)]
    assert own.pairs(studies) == {}
    assert own.pairs(studies, 4096) == {"b": [(studies[2], studies[3])]}


def test_where_the_start_is_handed_on_the_training_gives_nothing():
    start = {"start": {}, "trained": {}, "handed_on": "start"}
    without, trained = study("a", 0, 0, 1.0), study("a", 0, own.MOST, 0.5, gain=start)
    assert own.handed_on(without, trained) is without
    assert own.handed_on(without, study("a", 0, own.MOST, 0.5))["angles"] == 0.5


def test_only_what_holds_with_own_training_is_counted_and_only_what_begins_so():
    without = study("a", 0, 0, limits={"push 1": False, "push 2": True, "falls": False})
    trained = study("a", 0, own.MOST, limits={"push 1": True, "push 2": True, "falls": False})
    found = {"a": [(without, trained)]}
    assert own.kept(found, "limits") == (1, 2)
    assert own.kept(found, "limits", "push 1") == (0, 1)
    assert own.kept(found, "goals") == (2, 2)


def test_the_rows_say_how_many_studies():
    rows = own.measured(of_people({"a": [1.2, 1.2], "b": [1.2, 1.2]}))
    ratios = [row for row in rows if row.unit == "1"]
    assert [row.value for row in ratios] == pytest.approx([1.2] * 6)
    assert {row.n for row in ratios} == {4}
    assert {row.must for row in ratios} == {1.15}


def test_who_falls_without_own_training_is_counted_and_has_no_ratio():
    fallen = {"angles": None, "moments": None, "vertical": None, "falls": 8}
    goals = dict.fromkeys(study("b", 0, 0)["goals"], False)
    studies = of_people({"a": [1.2], "b": [1.0]})
    studies[2] |= fallen | {"goals": goals}
    rows = {row.what.partition(": ")[2]: row for row in own.measured(studies)}
    assert rows["who walks 100 cycles from 8 starts without it"].value == 50.0
    ratios = [row for row in rows.values() if row.unit == "1"]
    assert [(row.value, row.n) for row in ratios] == [(pytest.approx(1.2), 1)] * 6
    assert rows["goals kept without it, of those with 2 M samples"].value == 50.0
    assert "no whole cycle" in own._line("b", 0, [studies[2]])


def test_every_study_is_done_once_and_after_that_whose_body_it_has():
    found = list(own.jobs(own.PEOPLE, own.SEEDS))
    people = len(own.PEOPLE)
    assert len(found) == len(set(found))
    assert sum(number == own.MOST for _, _, number in found) == people * own.SEEDS
    assert sum(number == 0 for _, _, number in found) == people * own.SCATTER
    for place, (name, seed, number) in enumerate(found):
        if number:
            assert (name, 0, 0) in found[:place], (name, seed, number)
    assert {number for _, _, number in found[: people * (own.SEEDS + 1)]} == {0, own.MOST}


def test_a_study_that_is_under_way_is_left_alone(tmp_path):
    with own.claimed(tmp_path / "a") as first, own.claimed(tmp_path / "a") as second:
        assert (first, second) == (True, False)
    with own.claimed(tmp_path / "a") as again, own.claimed(tmp_path / "b") as other:
        assert again
        assert other


def test_a_study_that_is_finished_is_not_done_again(tmp_path, monkeypatch):
    done = []
    monkeypatch.setattr(own, "by_name", lambda name: {"name": name})
    monkeypatch.setattr(own, "imported", lambda *_: None)
    monkeypatch.setattr(own, "study", lambda *given: done.append(given[2:5]))
    finished = own.place(tmp_path, "lux", 0, 0) / "0" / own.FINISHED
    finished.parent.mkdir(parents=True)
    finished.write_text("{}")
    arguments = type("", (), {"people": ["lux"], "seeds": 2, "clones": None, "work": tmp_path})
    own.run(arguments)
    of_body = own.place(tmp_path, "lux", 0, 0)
    assert done[:2] == [(0, own.MOST, None), (1, own.MOST, of_body)]
    assert (0, 0, None) not in done
    assert (1, 0, None) in done


def test_the_figures_of_a_stored_study_are_those_of_its_metrics():
    metrics, gain = (read_json(BASELINE / name) for name in ("metrics.json", "policy/gain.json"))
    found = own.figures(metrics, gain)
    values = {
        (row["measure"], row["target"]): row["value"]
        for row in metrics["tolerances"]
        if row["role"] == "acceptance"
    }
    joints = [
        f"{name}_{side}" for name in ("hip_flexion", "knee_angle", "ankle_angle") for side in "rl"
    ]
    for quantity, measure in (("angles", "angle_rmse"), ("moments", "moment_rmse")):
        expected = np.mean([values[measure, joint] for joint in joints])
        assert found[quantity] == pytest.approx(expected, rel=1e-5)
    vertical = np.mean([values["force_rmse", f"vertical_{side}"] for side in "rl"])
    assert found["vertical"] == pytest.approx(vertical, rel=1e-5)
    assert sum(found["goals"].values()) == metrics["summary"]["goals_reached"]
    assert sum(found["limits"].values()) == metrics["summary"]["accepted"]
    assert found["falls"] == 0
    assert found["of starts"] == 8


def test_the_table_has_a_line_for_each_number_of_samples_and_the_ratios_below():
    studies = [
        study(own.PEOPLE[0], seed, samples, 1.2 if samples == 0 else 1.0)
        for seed in range(3)
        for samples in (0, 4_096, own.MOST)
    ]
    lines = own.table(studies).splitlines()
    assert sum(line.startswith(f"| {own.PEOPLE[0]} |") for line in lines) == 3
    assert sum("1.200 (1.200 to 1.200)" in line for line in lines) == 2


def test_one_study_has_no_scatter():
    lines = own.table([study(own.PEOPLE[0], 0, samples) for samples in (0, own.MOST)])
    assert "±" not in lines
    assert "| 1.000 | 1.000 | 1.000 |" in lines
