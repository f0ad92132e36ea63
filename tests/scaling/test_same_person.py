import numpy as np
import pytest

from gaitval.errors import RecordError
from gaitval.mocap.c3d import read_c3d
from gaitval.scaling.marker_sets import load_marker_set, recognise
from gaitval.scaling.same_person import check_same_person, displaced, marker_distances


def markers(recording):
    marker_set = recognise(recording.names)
    renamed = marker_set.renamed(recording.names)
    return {marker: recording.marker(name) for name, marker in renamed.items()}


@pytest.fixture(scope="module")
def walking(gait_data):
    return markers(read_c3d(gait_data / "wbds/raw/WBDS01walkT01.c3d"))


def test_a_marker_of_the_foot_that_was_put_on_anew_is_named(gait_data, walking):
    """20 mm back in the walk alone, as robustness.md 5 has it; all others stay."""
    wbds = load_marker_set("wbds")
    standing = markers(read_c3d(gait_data / "wbds/raw/WBDS01static1.c3d"))
    assert not displaced(marker_distances(standing, walking, wbds), wbds)
    heel, head = (walking[name] for name in ("L.Heel", "L.MT5"))
    back = (heel - head) / np.linalg.norm(heel - head, axis=1)[:, None]
    for marker, by in (("L.MT5", 0.020), ("L.MT5", 0.010)):
        moved = walking | {marker: walking[marker] + by * back}
        found = displaced(marker_distances(standing, moved, wbds), wbds)
        assert all(marker in each.markers for each in found)
        assert bool(found) is (by > 0.015)
    # On the thigh skin moves more.
    thigh = walking | {"L.GTR": walking["L.GTR"] + [0.0, 0.0, 0.012]}
    assert not displaced(marker_distances(standing, thigh, wbds), wbds)


def test_distances_are_medians_of_one_segment_over_the_frames_seen():
    wbds = load_marker_set("wbds")
    standing = {"R.ASIS": np.zeros((1, 3)), "L.ASIS": np.array([[0, 0.25, 0]])}
    walking = {
        "R.ASIS": np.zeros((4, 3)),
        "L.ASIS": np.array([[0, 0.26, 0], [0, 0.27, 0], [0, 0.9, 0], [np.nan] * 3]),
        "R.Knee": np.ones((4, 3)),
    }
    (distance,) = marker_distances(standing, walking, wbds)
    assert set(distance.markers) == {"R.ASIS", "L.ASIS"}
    assert distance.change == pytest.approx(0.02)
    # One distance does not distinguish two people.
    assert check_same_person(standing, walking, wbds) == (distance,)


def test_a_person_of_nearly_the_same_size_is_refused_and_told_by_how_much():
    marker_set = load_marker_set("wbds")
    rng = np.random.default_rng(3)
    places = {name: rng.normal(0.0, 0.1, (1, 3)) for name in marker_set.markers}
    other = {name: 1.03 * at for name, at in places.items()}
    with pytest.raises(RecordError, match=r"by \d\.\d mm in the median.* \d\.\d ± \d\.\d mm"):
        check_same_person(places, other, marker_set)


def test_two_markers_that_were_moved_do_not_make_another_person():
    marker_set = load_marker_set("wbds")
    rng = np.random.default_rng(3)
    places = {name: rng.normal(0.0, 0.1, (1, 3)) for name in marker_set.markers}
    moved = dict(places)
    for name in ("R.Heel", "L.ASIS"):
        moved[name] = places[name] + 0.06
    assert check_same_person(places, moved, marker_set)
