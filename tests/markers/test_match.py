"""What an assignment is judged by besides each marker's own place."""

import numpy as np
import pytest

from gaitval.scaling.marker_sets import builtin_marker_sets
from gaitval.scaling.markers.body import populations
from gaitval.scaling.markers.forefeet import FOREFEET, forefeet_excess
from gaitval.scaling.markers.match import BESIDE, FOREFOOT, SCORES, _Search
from gaitval.scaling.markers.names import computed


@pytest.mark.parametrize("degrees", [-50.0, -10.0, 0.0, 35.0])
def test_the_way_a_body_faces_is_found_from_its_places(degrees):
    people = populations()["arms hang"]
    angle = np.radians(degrees)
    turn = np.array([[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]])
    points = people.mean.copy()
    points[:, :2] = points[:, :2] @ turn.T + [0.3, -0.2]
    chosen = np.arange(len(points))
    assert np.isclose(_Search(points, people, None, None).yaw(chosen), angle)


def test_forefeet_are_half_as_known_sets_have_them_and_half_as_chance():
    alone = np.log([0.5 / 0.5, 0.4 / 0.6, 0.75 / 0.25, 0.3 / 0.7])
    bits = (np.arange(16)[:, None] >> np.arange(4)) & 1
    chance = np.exp(bits @ alone) / np.exp(bits @ alone).sum()
    share = chance * np.exp(forefeet_excess(alone))
    share /= share.sum()
    for index in range(16):
        names = tuple(name for bit, name in enumerate(FOREFOOT) if index >> bit & 1)
        seen = FOREFEET.count(names) / len(FOREFEET)
        assert np.isclose(share[index], 0.5 * (seen + chance[index]))
    assert forefeet_excess(alone)[0] == 0.0
    # One marker alone is sooner between the toes or on the outer side than by chance.
    for other in (2, 4):
        assert share[other] / share[1] > 1.5 * chance[other] / chance[1]


def test_heads_nod_on_trunks_and_are_above_the_shoulders():
    for people in populations().values():
        places = {site.label: k for k, site in enumerate(people.sites)}
        heads = [k for k, site in enumerate(people.sites) if site.part == "head"]
        shoulders = [places["R.Acromion"], places["L.Acromion"]]
        assert people.mean[heads, 2].min() > people.mean[shoulders, 2].max()
        front, back = (people.mean[places[f"R.{name}"], 0] for name in ("Forehead", "Occiput"))
        # Rings of four head markers are 15 to 17 cm from front to back.
        assert 0.13 < front - back < 0.19


def test_points_that_plug_in_gait_constructs_are_no_markers():
    made = ["LCVM", "RVWM", "LMWP", "RHO", "HC", "OT", "C7o", "midFH", "midFront", "R_toe_proj"]
    made += ["USERMO0", "USERMO14"]
    assert computed([*made, "LELB", "RHEE", "MIDF", "LTOE"]) == frozenset(made)


@pytest.mark.parametrize(("place", "other"), BESIDE.items())
def test_a_place_beside_another_is_unlikely_without_it(place, other):
    people = populations()["arms hang"]
    where = {site.label: k for k, site in enumerate(people.sites)}
    search = _Search(people.mean, people, None, None)

    def prior(*names):
        sided = [where[f"{side}.{name}"] for side in "RL" for name in names]
        return search._sided(np.array([where["Sacrum"], *sided]))

    assert prior(place) == pytest.approx(2 * SCORES.without)
    assert prior(place, other) == 0.0


def test_an_arm_with_a_hand_has_an_elbow_and_a_pelvis_has_a_back():
    people = populations()["arms hang"]
    where = {site.label: k for k, site in enumerate(people.sites)}
    search = _Search(people.mean, people, None, None)

    def prior(*names):
        return search._sided(np.array([where[name] for name in names]))

    shoulders = ("R.Acromion", "L.Acromion")
    # A shoulder is no reason for a hand: with wands on the thighs there are shoulders too.
    assert prior(*shoulders, "R.Hand", "L.Hand") == pytest.approx(2 * SCORES.hand_alone)
    assert prior("R.Elbow", "L.Elbow", "R.Hand", "L.Hand") == 0.0
    assert prior("Pelvis") == pytest.approx(SCORES.no_back)
    assert prior("R.ASIS", "L.ASIS") == pytest.approx(SCORES.no_back)
    assert prior("Pelvis", "Sacrum") == 0.0
    assert prior("Pelvis", "R.PSIS", "L.PSIS") == 0.0


@pytest.mark.parametrize(("higher", "likely"), [(-0.1, 0.0), (0.02, 0.0), (0.1, SCORES.above)])
def test_what_is_above_the_neck_is_not_on_the_trunk(higher, likely):
    people = populations()["arms hang"]
    where = {site.label: k for k, site in enumerate(people.sites)}
    chosen = np.array([where[name] for name in ("C7", "R.Acromion", "L.Acromion", "Torso")])
    points = people.mean[chosen].copy()
    points[3, 2] = points[:3, 2].max() + higher
    search = _Search(points, people, None, None)
    assert search._above(np.arange(4), chosen) == likely
    # Without a neck or a shoulder nothing says where the trunk ends.
    assert search._above(np.array([3]), chosen[3:]) == 0.0


def test_the_lower_spine_is_the_trunks_and_lies_between_the_chest_and_the_sacrum():
    for people in populations().values():
        height = {site.label: people.mean[k, 2] for k, site in enumerate(people.sites)}
        assert height["Sacrum"] < height["Lumbar"] < height["Thoracic"]
    assert {site.segment for site in people.sites if site.name == "Lumbar"} == {"torso"}


@pytest.mark.parametrize("marker_set", builtin_marker_sets(), ids=lambda each: each.name)
def test_built_in_sets_have_no_place_without_the_one_beside_it(marker_set):
    landmarks = {marker.landmark for marker in marker_set.markers.values()}
    assert landmarks & {"R.PSIS", "Sacrum"}
    for place, other in BESIDE.items():
        for side in "RL":
            assert f"{side}.{place}" not in landmarks or f"{side}.{other}" in landmarks


def test_a_few_changed_markers_are_as_likely_as_in_the_whole_distribution():
    people = populations()["arms hang"]
    random = np.random.default_rng(5)
    singles = [k for k, site in enumerate(people.sites) if not site.many]
    chosen = random.choice(singles, 30, replace=False)
    points = people.mean[chosen] + 0.02 * random.standard_normal((30, 3))
    chosen[27:] = -1
    search = _Search(points, people, None, None)
    near = search.nearby(chosen)
    free = np.setdiff1d(singles, chosen)
    changes = {
        "none": chosen,
        "one to another place": np.r_[free[0], chosen[1:]],
        "one to none": np.r_[-1, chosen[1:]],
        "one from none": np.r_[chosen[:27], free[1], -1, -1],
        "two exchanged": np.r_[chosen[1], chosen[0], chosen[2:]],
        "four at once": np.r_[free[2], free[3], chosen[2:26], -1, free[4], -1, -1],
    }
    for what, changed in changes.items():
        who = np.flatnonzero(changed >= 0)
        whole = search._density(who, changed[who])
        assert near.log_density(changed) == pytest.approx(whole, abs=1e-6), what
    # Each marker alone on each place: the same densities, less that of all the others.
    for marker in (0, 28):
        there = chosen.copy()
        there[marker] = -1
        others = np.flatnonzero(there >= 0)
        rest = search._density(others, there[others])
        for place in free[:5]:
            there[marker] = place
            who = np.flatnonzero(there >= 0)
            alone = search._density(who, there[who]) - rest
            assert near.everywhere(marker)[place] == pytest.approx(alone, abs=1e-6)
