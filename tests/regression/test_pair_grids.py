"""The grids of a walk before and now: the two means, the norm, and where they truly differ."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from gaitval.apps.regression import pair_grids
from gaitval.apps.regression.versions import StoredWalk, WalkPair, matched
from gaitval.metrics.results import metrics_from, read_metrics
from gaitval.reporting.grids import WITH_QUANTITIES

BASELINE = Path(__file__).parents[2] / "reports" / "S05" / "baseline"
PERCENT = np.arange(101)


@pytest.fixture(scope="module")
def pair() -> WalkPair:
    metrics = read_metrics(BASELINE)
    walks = [StoredWalk(folder=BASELINE, metrics=metrics, margins=None)]
    (found,) = matched(walks, [replace(walks[0])]).pairs
    return found


def strides(seed: int, count: int = 8, bump: float = 0.0) -> dict[str, np.ndarray]:
    """Smooth curves about one mean, with a bump between 40 and 60 % of the cycle."""
    random = np.random.default_rng(seed)
    waves = np.stack([f(2 * np.pi * k * PERCENT / 100) for k in (1, 2) for f in (np.sin, np.cos)])
    own = 20 * np.sin(2 * np.pi * PERCENT / 100) + random.normal(0, 0.5, (count, 4)) @ waves
    own += bump * np.exp(-(((PERCENT - 50) / 4) ** 2))
    vertical = np.where(PERCENT < 60, 100.0, 0.0) + random.normal(0, 0.1, (count, 101))
    return {
        "angles/knee_angle_r": own,
        "forces/forward_r": own,
        "forces/vertical_r": vertical,
    }


def test_a_difference_is_found_where_it_is_and_only_there() -> None:
    (found,) = pair_grids.differing(strides(0), strides(1, bump=6.0), "angles/knee_angle_r")
    first, last = found
    assert 38 < first < 50 < last < 62


def test_equal_walks_differ_in_one_of_twenty_at_most() -> None:
    """The test keeps its 5 %: 60 pairs, of which 3 are expected and 8 are beyond the 99th %."""
    seeds = range(100, 220, 2)
    wrong = sum(
        bool(pair_grids.differing(strides(i), strides(i + 1), "angles/knee_angle_r")) for i in seeds
    )
    assert wrong < 8


def test_forces_are_tested_in_stance_alone() -> None:
    late = strides(1)
    late["forces/forward_r"] = late["forces/forward_r"] + 6.0 * (PERCENT > 75)
    assert pair_grids.differing(strides(0), late, "forces/forward_r") == []
    assert pair_grids.differing(strides(0), late, "angles/knee_angle_r") == []


def test_a_single_stride_is_not_tested() -> None:
    assert pair_grids.differing(strides(0, 1), strides(1, bump=9.0), "angles/knee_angle_r") == []


def test_every_panel_has_both_walks_and_the_norm(pair: WalkPair) -> None:
    rows = pair_grids.panels(pair, {}, {})
    assert {name: (len(each), len(each[0])) for name, each in rows.items()} == {
        "kinematics": (5, 3), "kinetics": (len(WITH_QUANTITIES), 3), "forces": (1, 3),
        "muscles": (6, 3),
    }  # fmt: skip
    knee = rows["kinematics"][2][0]
    assert [(each.side, each.which) for each in knee.curves] == [
        ("right", "record"), ("right", "walk"), ("left", "record"), ("left", "walk"),
    ]  # fmt: skip
    mean = pair.now.metrics.walk.curves.angles["knee_angle_r"].mean
    np.testing.assert_allclose(knee.curves[1].mean, mean)
    assert knee.norm is not None
    assert not knee.regions
    assert rows["kinetics"][0][2].name == "power/hip_flexion"
    assert len(rows["kinetics"][0][2].curves) == 4
    # of stored walks that are older than the quantity
    tendon = rows["kinetics"][3][0]
    assert tendon.name == "tendon_force/achilles"
    assert len(tendon.curves) == 4


def test_stored_baselines_are_drawn_and_not_tested(pair: WalkPair) -> None:
    (found,) = pair_grids.pair_grids([pair])
    assert found["subject"] == "S05"
    assert found["strides"] == []
    assert set(found["figures"]) == set(pair_grids.GRIDS)
    assert all("<svg" in drawing for drawing in found["figures"].values())


def test_strides_are_drawn_and_counted(pair: WalkPair, monkeypatch: pytest.MonkeyPatch) -> None:
    made = iter([strides(0, 7), strides(1, 8, bump=6.0)])
    monkeypatch.setattr(pair_grids, "strides_of", lambda folder, metrics: next(made))
    (found,) = pair_grids.pair_grids([pair])
    assert found["strides"] == [7, 8]


def test_before_is_not_now_and_each_has_its_own_side(pair: WalkPair) -> None:
    """The walk before stands where a record does; the walk now has its strides and their SD."""
    old = pair.before.metrics.as_dict()
    walked = old["walks"][old["final"]]
    for key, curve in walked["curves"]["angles"].items():
        curve["mean"] = [value + (5.0 if key.endswith("_r") else 9.0) for value in curve["mean"]]
    before = replace(pair.before, metrics=metrics_from(old, "here"))
    own = {f"angles/knee_angle_{side}": strides(n)["angles/knee_angle_r"] for n, side in
           enumerate("rl")}  # fmt: skip
    rows = pair_grids.panels(replace(pair, before=before), {}, own)
    knee = next(panel for row in rows["kinematics"] for panel in row if "knee_angle" in panel.name)
    for each in knee.curves:
        key = f"knee_angle_{each.side[0]}"
        walk = (before if each.which == "record" else pair.now).metrics.walk.curves.angles[key]
        np.testing.assert_array_equal(each.mean, walk.mean)
        if each.which == "walk":
            np.testing.assert_array_equal(each.strides, own[f"angles/{key}"])
            np.testing.assert_allclose(each.sd, own[f"angles/{key}"].std(axis=0, ddof=1))
