"""Statistics of whole curves of a walk."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.spatial.transform import Rotation
from synthetic_walk import MODEL, perfect_walk, sharp_filter, synthetic_record

from gaitval.gait.cycle_curves import Curves, recorded_curves
from gaitval.gait.record import GaitRecord
from gaitval.metrics.comparison import foot_progression
from gaitval.metrics.curve_results import CurveStatistics, Region, WalkStatistics, by_kind
from gaitval.metrics.cycles import find_cycles
from gaitval.metrics.norms import adult_bands, bands_beside, healthy_bands
from gaitval.metrics.origin import everything
from gaitval.metrics.walk_statistics import _tested, walk_statistics

RECORD = synthetic_record()
RECORDED = everything("recorded")
CYCLES = 8


def _scattered(shift: float = 0.0) -> Curves:
    """Cycles about the record with an SD of a hundredth of each curve's range; the right knee is
    off by `shift` rad from 20 to 40 %."""
    random = np.random.default_rng(1)
    found = recorded_curves(RECORD)
    for kind in (found.angles, found.moments, found.forces):
        for name, curve in kind.items():
            smooth = np.cumsum(random.standard_normal((CYCLES, 101)), axis=1) / 10.0
            kind[name] = curve + 0.01 * np.ptp(curve) * (smooth - smooth.mean(axis=0))
    found.angles["knee_angle_r"][:, 20:41] += shift
    return found


def _feet() -> dict[str, np.ndarray]:
    return {f"foot_progression_{side}": np.zeros((CYCLES, 101)) for side in "rl"}


def _statistics(curves: Curves, record: GaitRecord = RECORD, age_years: float | None = None):
    recorded = by_kind(recorded_curves(record))
    found = walk_statistics(curves, _feet(), record, recorded, RECORDED, age_years=age_years)
    return None if found is None else found.as_dict()


def test_a_walk_about_the_record_differs_nowhere():
    found = _statistics(_scattered())
    for kind in found["curves"].values():
        for name, curve in kind.items():
            assert curve["regions"] == [], name
            assert curve["multiple_correlation"] > 0.999, name
            assert curve["repeatability"] > 0.9, name


def test_a_part_that_is_off_is_found():
    (region,) = _statistics(_scattered(0.05))["curves"]["angles"]["knee_angle_r"]["regions"]
    assert (region["first"], region["last"]) == (20, 40)
    assert region["p"] == 1.0 / 128.0  # of all 2^8 / 2 permutations


def test_record_and_walk_are_scored_from_the_same_angles():
    found = _statistics(_scattered(np.radians(30.0)))["profiles"]
    assert "foot_progression" not in found["variables"]  # the made-up record has none
    assert len(found["variables"]) == 8
    changed = {
        name
        for name, score in found["walk"]["scores"].items()
        if score != pytest.approx(found["record"]["scores"][name], abs=1e-6)
    }
    assert changed == {"knee_angle_r"}


@pytest.mark.parametrize(("age", "bands"), [(31, adult_bands()), (9, healthy_bands())])
def test_shares_within_the_bands_are_counted(age, bands):
    curves = _scattered()
    mean, spread = bands["angles"]["knee_angle"]
    inside = np.where(np.arange(101) < 50, 1.9, 2.1) * spread
    curves.angles["knee_angle_l"] = np.radians(np.tile(mean + inside, (CYCLES, 1)))
    found = _statistics(curves, age_years=age)["bands"]["angles"]["knee_angle_l"]
    assert found["walk"] == pytest.approx(50 / 101)


def test_adults_are_held_against_adults_where_there_are_any():
    """The children's bands are 5 degrees off at an adult's hip and knee."""
    for age in (31.0, 18.0, None):
        bands, people = bands_beside(age)
        assert people == {"angles": "adults", "moments": "children"}
        assert bands["angles"] is adult_bands()["angles"]
        assert bands["moments"] is healthy_bands()["moments"]
    bands, people = bands_beside(17.0)
    assert people == {"angles": "children", "moments": "children"}
    assert bands == healthy_bands()
    apart = adult_bands()["angles"]["knee_angle"][0] - healthy_bands()["angles"]["knee_angle"][0]
    assert np.sqrt(np.mean(apart**2)) > 4.0


def test_a_stored_file_that_does_not_say_whose_bands_had_the_childrens():
    found = _statistics(_scattered())
    assert found["band_people"] == {"angles": "adults", "moments": "children"}
    del found["band_people"]
    read = WalkStatistics.model_validate(found)
    assert (read.band_people.angles, read.band_people.moments) == ("children", "children")


def test_one_cycle_has_no_statistics():
    one = Curves(
        *({name: curve[:1] for name, curve in kind.items()} for kind in vars(_scattered()).values())
    )
    assert _statistics(one) is None


def test_feet_turn_with_the_walk():
    """Both feet of a walk that is turned to the left by 0.2 rad point 0.2 rad more to the left,
    which is towards the midline for the right one only, while they are flat on the ground."""
    configuration = sharp_filter(cycles=5, start_phases=(0.0,))
    walk = perfect_walk(RECORD, cycles=8.0)
    cycles = find_cycles(walk, configuration).first(4)
    turn = Rotation.from_rotvec([0.0, 0.0, 0.2])
    positions = walk.positions.copy()
    positions[:, :3] = (turn * Rotation.from_rotvec(positions[:, :3])).as_rotvec()
    straight = foot_progression(walk, cycles, MODEL)
    turned = foot_progression(replace(walk, positions=positions), cycles, MODEL)
    for side, sign in (("r", 1.0), ("l", -1.0)):
        key = f"foot_progression_{side}"
        assert np.allclose((turned[key] - straight[key])[:, 15:25], sign * 0.2, atol=0.02)


def test_forces_are_tested_where_walk_or_record_stands():
    """The record is in per cent, the walk in body weights: 1.5 % of it in swing is no stance."""
    percent = np.arange(101)
    walked = np.tile(np.where(percent < 60, 1.0, 0.0), (CYCLES, 1))
    recorded = np.where(percent < 62, 100.0, 1.5)
    curves = Curves({}, {}, {"vertical_r": walked})
    where = _tested("forces", "forward_r", curves, {"forces": {"vertical_r": recorded}})
    np.testing.assert_array_equal(where, percent < 62)
    assert _tested("angles", "knee_angle_r", curves, {}).all()


def of(*regions, p=0.01):
    return CurveStatistics(
        multiple_correlation=None,
        repeatability=0.9,
        threshold=3.0,
        normal_threshold=None,
        p=p,
        regions=[Region(first=first, last=last, p=0.01) for first, last in regions],
    )


def test_the_share_counts_the_points_of_all_regions_with_their_ends():
    assert of((0, 0)).share == pytest.approx(100.0 / 101.0)
    assert of((10, 19), (90, 100)).share == pytest.approx(100.0 * 21 / 101)
    assert of().share == 0.0
    assert of((0, 100)).share == 100.0
    assert of(p=None).share is None
