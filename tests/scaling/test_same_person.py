import re

import numpy as np
import pytest

from gaitval.errors import RecordError
from gaitval.mocap.c3d import read_c3d
from gaitval.mocap.trc import read_trc
from gaitval.mocap.wbds_text import read_wbds_markers
from gaitval.scaling.marker_sets import load_marker_set, recognise
from gaitval.scaling.same_person import SAME, check_same_person, displaced, marker_distances
from gaitval.subjects.subject_file import BUILTIN, load_subject


def markers(recording):
    marker_set = recognise(recording.names)
    renamed = marker_set.renamed(recording.names)
    return {marker: recording.marker(name) for name, marker in renamed.items()}


@pytest.fixture(scope="module")
def walking(gait_data):
    return markers(read_c3d(gait_data / "wbds/raw/WBDS01walkT01.c3d"))


def test_the_same_person_passes_with_room(gait_data, walking):
    wbds = load_marker_set("wbds")
    standing = markers(read_c3d(gait_data / "wbds/raw/WBDS01static1.c3d"))
    overground = markers(read_wbds_markers(gait_data / "wbds/raw/WBDS01walkO01Cmkr.txt"))
    folder = gait_data / "opensim_rajagopal/ExpData"
    trials = [
        (standing, walking, wbds),
        (standing, overground, wbds),
        (
            markers(read_trc(folder / "static_walk_1.trc")),
            markers(read_trc(folder / "motion_capture_walk.trc")),
            load_marker_set("rajagopal"),
        ),
    ]
    for first, second, marker_set in trials:
        distances = check_same_person(first, second, marker_set)
        assert len(distances) >= 25
        assert np.median([abs(d.change) for d in distances]) < 0.8 * SAME.largest_median


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


@pytest.mark.parametrize("identifier", [name for name in BUILTIN if name != "S01"])
def test_every_other_person_is_refused(identifier, walking):
    standing = {name: np.array([at]) for name, at in load_subject(identifier).markers.items()}
    with pytest.raises(RecordError, match=r"WBDS.* and T01 do not show the same person"):
        check_same_person(
            standing, walking, load_marker_set("wbds"), names=(f"WBDS {identifier}", "T01")
        )


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


def test_the_mean_change_and_its_standard_error_are_of_the_distances_without_the_worst_marker():
    """In mm: SD (n - 1) over the root of the number of distances that are left."""
    marker_set = load_marker_set("wbds")
    rng = np.random.default_rng(5)
    places = {name: rng.normal(0.0, 0.1, (1, 3)) for name in list(marker_set.markers)[:9]}
    other = {name: at + rng.normal(0.0, 0.03, (1, 3)) for name, at in places.items()}
    with pytest.raises(RecordError) as refused:
        check_same_person(places, other, marker_set)
    words = re.search(
        r": (\d+) distances .*? by ([\d.]+) mm .*? without (\S+), by ([\d.]+) ± ([\d.]+) mm",
        str(refused.value).replace("\n", " "),
    )
    distances = marker_distances(places, other, marker_set)
    firm = [d for d in distances if marker_set.markers[d.markers[0]].segment != "torso"]
    left = np.array([1000.0 * abs(d.change) for d in firm if words[3] not in d.markers])
    assert 1 < len(left) < len(firm) == int(words[1])
    every = [1000.0 * abs(d.change) for d in firm]
    assert float(words[2]) == pytest.approx(np.median(every), abs=0.051)
    assert float(words[4]) == pytest.approx(left.mean(), abs=0.051)
    squares = ((left - left.mean()) ** 2).sum()
    error = np.sqrt(squares / (len(left) - 1) / len(left))
    assert abs(error - np.sqrt(squares) / len(left)) > 0.11  # n in its place would be seen
    assert float(words[5]) == pytest.approx(error, abs=0.051)


def test_two_markers_that_were_moved_do_not_make_another_person():
    marker_set = load_marker_set("wbds")
    rng = np.random.default_rng(3)
    places = {name: rng.normal(0.0, 0.1, (1, 3)) for name in marker_set.markers}
    moved = dict(places)
    for name in ("R.Heel", "L.ASIS"):
        moved[name] = places[name] + 0.06
    assert check_same_person(places, moved, marker_set)
