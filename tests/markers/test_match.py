"""What an assignment is judged by besides each marker's own place."""

import numpy as np
import pytest

from gaitval_markers.body import populations
from gaitval_markers.match import FOREFEET, FOREFOOT, _forefeet, _Search
from gaitval_markers.names import computed


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
    share = chance * np.exp(_forefeet(alone))
    share /= share.sum()
    for index in range(16):
        names = tuple(name for bit, name in enumerate(FOREFOOT) if index >> bit & 1)
        seen = FOREFEET.count(names) / len(FOREFEET)
        assert np.isclose(share[index], 0.5 * (seen + chance[index]))
    assert _forefeet(alone)[0] == 0.0
    # One marker alone is sooner the second metatarsal's than by chance.
    assert share[2] / share[4] > 3.0 * chance[2] / chance[4]


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
    assert computed([*made, "LELB", "RHEE", "MIDF", "LTOE"]) == frozenset(made)
