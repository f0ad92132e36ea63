import numpy as np
import pytest

from gaitval.datasets.subject_file import load_subject
from gaitval.errors import ScalingError
from gaitval.scaling.hip_regressions import hip_joint_centre
from gaitval.scaling.joint_centres import (
    MARKER_OFFSET,
    locate,
    measure,
    pelvis_frame,
    unused_widths,
)
from gaitval.scaling.landmarks import LANDMARKS


@pytest.fixture
def markers():
    return {name: np.array(place) for name, place in load_subject("S05").markers.items()}


def test_hip_joint_centre_of_a_worked_example():
    # Harrington 2007 for a pelvis 240 mm wide and 150 mm deep:
    # -0.24*150 - 9.9, -(0.33*240 + 7.3), -0.30*240 - 10.9.
    np.testing.assert_allclose(hip_joint_centre(0.240, 0.150), [-0.0459, -0.0865, -0.0829])


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
            assert np.linalg.norm(from_lateral) == pytest.approx(width / 2 + MARKER_OFFSET)


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


def test_missing_markers_are_all_named(markers):
    del markers["R.Knee.Medial"], markers["L.Heel"]
    with pytest.raises(ScalingError, match=r"missing.*R\.Knee\.Medial, L\.Heel"):
        measure(markers)


def test_markers_that_the_model_does_not_use_may_be_missing(markers):
    needed = {name: place for name, place in markers.items() if name[2:] in LANDMARKS}
    assert len(needed) < len(markers)
    ours, theirs = measure(needed), measure(markers)
    for side in ("right", "left"):
        assert getattr(ours, side).thigh == getattr(theirs, side).thigh
        assert getattr(ours, side).shank == getattr(theirs, side).shank


def test_gaps_are_named(markers):
    markers["L.Heel"] = np.array([np.nan, 0.0, 0.0])
    with pytest.raises(ScalingError, match=r"finite.*L\.Heel"):
        measure(markers)


def test_markers_of_another_shape_are_named(markers):
    markers["R.MT1"] = np.zeros(2)
    with pytest.raises(ScalingError, match=r"three numbers: R\.MT1"):
        measure(markers)


@pytest.mark.parametrize(("factor", "unit"), [(1000.0, "millimetres"), (100.0, "centimetres")])
def test_other_units_than_metres_are_recognised(markers, factor, unit):
    with pytest.raises(ScalingError, match=f"looks like {unit} that are called m"):
        measure({name: place * factor for name, place in markers.items()})


def test_a_marker_astray_is_named_and_no_other_unit_is_suspected(markers):
    markers["R.Heel"] = markers["R.Heel"] + [30.0, 0.0, 0.0]
    with pytest.raises(ScalingError, match=r"middle of the person: R\.Heel\. .*or the unit\.$"):
        measure(markers)


def test_y_up_is_recognised(markers):
    with pytest.raises(ScalingError, match="z must point up"):
        measure({name: place[[0, 2, 1]] for name, place in markers.items()})


def test_upside_down_is_recognised(markers):
    with pytest.raises(ScalingError, match="not upright"):
        measure({name: place * [1, 1, -1] for name, place in markers.items()})


def test_left_and_right_swapped_is_recognised(markers):
    other = {"R": "L", "L": "R"}
    with pytest.raises(ScalingError, match=r"swapped.*ASIS, PSIS, Knee"):
        measure({other[name[0]] + name[1:]: place for name, place in markers.items()})


def test_a_single_swapped_pair_is_named(markers):
    markers["R.Heel"], markers["L.Heel"] = markers["L.Heel"], markers["R.Heel"]
    with pytest.raises(ScalingError, match=r"on the right\): Heel\."):
        measure(markers)


def test_medial_and_lateral_swapped_is_named(markers):
    markers["R.Knee"], markers["R.Knee.Medial"] = markers["R.Knee.Medial"], markers["R.Knee"]
    with pytest.raises(ScalingError, match=r"medial and lateral.*: R\.Knee\.Medial and R\.Knee\."):
        measure(markers)


def test_heel_before_toes_is_named(markers):
    markers["L.Heel"], markers["L.MT1"] = markers["L.MT1"], markers["L.Heel"]
    with pytest.raises(ScalingError, match=r"L\."):
        measure(markers)


@pytest.mark.parametrize(
    ("lost", "unused"),
    [
        ((), ["knee", "ankle", "elbow"]),
        (("R.Knee.Medial",), ["ankle", "elbow"]),
        (("R.Elbow.Medial",), ["knee", "ankle"]),
        (("R.Elbow.Medial", "L.Elbow"), ["knee", "ankle", "elbow"]),
    ],
)
def test_a_width_of_which_nothing_is_made_is_said(lost, unused):
    names = [f"{s}.{joint}{m}" for s in "RL" for joint in ("Knee", "Ankle", "Elbow")
             for m in ("", ".Medial")]  # fmt: skip
    seen = {*names, *(f"{s}.{joint}" for s in "RL" for joint in ("Acromion", "Wrist"))} - {*lost}
    widths = {"knee_width": 0.1, "ankle_width": (0.07, 0.07), "elbow_width": 0.07}
    assert [text.split()[0] for text in unused_widths(seen, widths)] == unused
    nothing = dict.fromkeys(widths)
    assert unused_widths(seen, nothing) == []
