import numpy as np
import pytest

from gaitval.errors import ScalingError
from gaitval.scaling.joint_centres import SURFACE, locate, measure, pelvis_frame
from gaitval.scaling.landmarks import LANDMARKS
from gaitval.subjects.subject_file import load_subject


@pytest.fixture
def markers():
    return {name: np.array(place) for name, place in load_subject("S05").markers.items()}


def test_pelvis_frame_of_a_tilted_pelvis():
    # The front drops by 30 mm over 40 mm: x points down at atan(3/4).
    frame = pelvis_frame(
        np.array([0.04, -0.12, 0.97]), np.array([0.04, 0.12, 0.97]), np.array([0.0, 0.0, 1.0])
    )
    np.testing.assert_allclose(frame, [[0.8, 0, 0.6], [0, 1, 0], [-0.6, 0, 0.8]], atol=1e-15)


def test_lengths_of_a_leg_are_distances_between_joint_centres(markers):
    knee = (markers["R.Knee"] + markers["R.Knee.Medial"]) / 2
    ankle = (markers["R.Ankle"] + markers["R.Ankle.Medial"]) / 2
    right = measure(markers).right
    assert right.shank == pytest.approx(np.linalg.norm(knee - ankle))
    assert right.ankle_height == pytest.approx(ankle[2])


def test_place_and_heading_of_the_person_do_not_matter(markers):
    expected = measure(markers)
    c, s = np.cos(2.5), np.sin(2.5)
    turn = np.array([[c, -s, 0], [s, c, 0], [0, 0, 1]])
    moved = measure({name: turn @ place + [300.0, -200.0, 0.0] for name, place in markers.items()})
    assert moved.right.thigh == pytest.approx(expected.right.thigh, abs=1e-12)
    assert moved.pelvic_tilt == pytest.approx(expected.pelvic_tilt, abs=1e-12)
    np.testing.assert_allclose(moved.left.metatarsals, expected.left.metatarsals, atol=1e-12)
    np.testing.assert_allclose(moved.right.heel, expected.right.heel, atol=1e-12)


def test_a_mirrored_person_has_right_and_left_exchanged(markers):
    other = {"R": "L", "L": "R"}
    mirrored = {
        other[name[0]] + name[1:]: place * [1.0, -1.0, 1.0] for name, place in markers.items()
    }
    seen, expected = measure(mirrored), measure(markers)
    assert seen.right.thigh == pytest.approx(expected.left.thigh, abs=1e-12)
    assert seen.hip_half_width == pytest.approx(expected.hip_half_width, abs=1e-12)
    np.testing.assert_allclose(seen.right.metatarsals, expected.left.metatarsals, atol=1e-12)


def test_the_first_width_is_that_of_the_right_side(markers):
    for side in "RL":
        del markers[f"{side}.Knee.Medial"], markers[f"{side}.Ankle.Medial"]
    points = locate(markers, knee_width=(0.09, 0.11), ankle_width=(0.07, 0.06))
    for joint, widths in (("Knee", (0.09, 0.11)), ("Ankle", (0.07, 0.06))):
        for side, width in zip("RL", widths, strict=True):
            from_lateral = points[f"{side}.{joint}.Centre"] - markers[f"{side}.{joint}"]
            assert np.linalg.norm(from_lateral) == pytest.approx(width / 2 + SURFACE.marker_offset)


def test_a_known_hip_centre_replaces_the_regression_of_its_side_only(markers):
    by_regression = locate(markers)
    known = by_regression["R.Hip.Centre"] + np.array([0.01, -0.004, 0.02])
    points = locate(markers, centres={"R.Hip.Centre": known})
    np.testing.assert_allclose(points["R.Hip.Centre"], known, atol=1e-12)
    np.testing.assert_allclose(points["L.Hip.Centre"], by_regression["L.Hip.Centre"], atol=1e-12)
    seen, before = measure(markers, centres={"R.Hip.Centre": known}), measure(markers)
    assert seen.right.thigh == pytest.approx(np.linalg.norm(known - points["R.Knee.Centre"]))
    assert seen.left.thigh == before.left.thigh
    assert seen.hip_height == pytest.approx(before.hip_height + 0.01)


def test_markers_that_the_model_does_not_use_may_be_missing(markers):
    needed = {name: place for name, place in markers.items() if name[2:] in LANDMARKS}
    assert len(needed) < len(markers)
    ours, theirs = measure(needed), measure(markers)
    for side in ("right", "left"):
        assert getattr(ours, side).thigh == getattr(theirs, side).thigh
        assert getattr(ours, side).shank == getattr(theirs, side).shank


def exchanged(first, second):
    return lambda markers: markers | {first: markers[second], second: markers[first]}


def of_each(change):
    return lambda markers: {name: change(place) for name, place in markers.items()}


OTHER = {"R": "L", "L": "R"}


@pytest.mark.parametrize(
    ("change", "message"),
    [
        (lambda m: {n: p for n, p in m.items() if n not in ("R.Knee.Medial", "L.Heel")},
         r"missing.*R\.Knee\.Medial, L\.Heel"),
        (lambda m: m | {"L.Heel": np.array([np.nan, 0.0, 0.0])}, r"finite.*L\.Heel"),
        (lambda m: m | {"R.MT1": np.zeros(2)}, r"three numbers: R\.MT1"),
        (of_each(lambda p: 1000.0 * p), "looks like millimetres that are called m"),
        (of_each(lambda p: 100.0 * p), "looks like centimetres that are called m"),
        (lambda m: m | {"R.Heel": m["R.Heel"] + [30.0, 0.0, 0.0]},
         r"middle of the person: R\.Heel\. .*or the unit\.$"),
        (of_each(lambda p: p[[0, 2, 1]]), "z must point up"),
        (of_each(lambda p: p * [1, 1, -1]), "not upright"),
        (lambda m: {OTHER[n[0]] + n[1:]: p for n, p in m.items()}, "swapped.*ASIS, PSIS, Knee"),
        (exchanged("R.Heel", "L.Heel"), r"on the right\): Heel\."),
        (exchanged("R.Knee", "R.Knee.Medial"),
         r"medial and lateral.*: R\.Knee\.Medial and R\.Knee\."),
        (exchanged("L.Heel", "L.MT1"), r"L\."),
    ],
)  # fmt: skip
def test_markers_that_cannot_be_are_refused_by_name(markers, change, message):
    with pytest.raises(ScalingError, match=message):
        measure(change(markers))
