"""Joint centres where a marker set lacks landmarks, and measurements as data."""

import tomllib
from dataclasses import replace

import numpy as np
import pytest
import tomli_w
from standing_person import (
    ANKLE_WIDTH,
    ELBOW_WIDTH,
    HEADING,
    KNEE_WIDTH,
    PERSON,
    made_up_measurements,
    standing_person,
)

from gaitval.errors import ScalingError
from gaitval.kinetics.inverse.segment_lengths import lengths_of, with_lengths
from gaitval.scaling.foot_shape import FOOT_SHAPE, FOREFOOT, on_midfoot
from gaitval.scaling.joint_centres import locate, measure
from gaitval.scaling.joint_width import chord_centre
from gaitval.scaling.measurements import Measurements, with_fitted_lengths
from gaitval.scaling.scaling import build_body, measurements_from, scale_subject
from gaitval.scaling.stature import FOOT, FRACTIONS
from gaitval.subjects.subject_file import builtin_subjects, load_subject

WIDTHS = {"knee_width": KNEE_WIDTH, "ankle_width": ANKLE_WIDTH, "elbow_width": ELBOW_WIDTH}
PLUG_IN_GAIT = [
    "Sacrum",
    *(
        f"{side}.{name}"
        for side in "RL"
        for name in (
            *("ASIS", "Thigh", "Knee", "Shank", "Ankle", "Heel", "MT2"),
            *("Acromion", "Elbow", "Wrist.Radial", "Wrist.Ulnar"),
        )
    ),
]


def assert_equal(seen: Measurements, expected: Measurements, atol: float) -> None:
    for side in ("right", "left"):
        for name in (
            *("thigh", "shank", "ankle_height", "heel", "metatarsals"),
            *("upper_arm", "forearm"),
        ):
            np.testing.assert_allclose(
                getattr(getattr(seen, side), name),
                getattr(getattr(expected, side), name),
                atol=atol,
                err_msg=f"{side} {name}",
            )
    for name in ("hip_half_width", "pelvic_tilt"):
        np.testing.assert_allclose(getattr(seen, name), getattr(expected, name), atol=atol)


def test_lengths_of_a_made_up_person_come_back():
    person = standing_person()
    seen = measure(person.landmarks)
    assert_equal(seen, person.measured, atol=3e-4)  # the sole is level within 0.1 degrees
    assert seen.right.thigh == pytest.approx(person.measured.right.thigh, abs=1e-9)
    assert seen.shoulder_half_width == pytest.approx(0.165, abs=1e-4)
    assert seen.shoulder_height == pytest.approx(0.47, abs=1e-2)


def test_lengths_come_back_from_the_markers_of_plug_in_gait():
    person = standing_person()
    seen = measure({name: person.landmarks[name] for name in PLUG_IN_GAIT}, **WIDTHS)
    assert_equal(seen, person.measured, atol=3e-4)
    assert "width (Davis" in seen.sources["shank"]
    assert "from the second" in seen.sources["foot"]


def test_arms_are_left_to_the_mean_where_the_elbow_cannot_be_found():
    person = standing_person()
    seen = measure(
        {name: person.landmarks[name] for name in PLUG_IN_GAIT},
        knee_width=KNEE_WIDTH,
        ankle_width=ANKLE_WIDTH,
    )
    for limbs in (seen.right, seen.left):
        assert limbs.upper_arm is None
        assert limbs.forearm is None
    assert seen.shoulder_half_width == pytest.approx(0.165, abs=1e-4)


def test_raised_arms_do_not_show_the_shoulders():
    seen = measure(standing_person(raised=85.0).landmarks)
    assert seen.shoulder_half_width is None
    assert seen.shoulder_height is None
    np.testing.assert_allclose([seen.right.upper_arm, seen.left.upper_arm], 0.271, atol=1e-3)


@pytest.mark.parametrize("side", [1.0, -1.0])
def test_chord_of_a_worked_example(side):
    # The axis of the joint is along y; hip 0.4 m straight above, marker 60 mm to the side.
    lateral = np.array([0.1, 0.06 * side, 0.5])
    wand = np.array([0.1, 0.09 * side, 0.7])
    centre = chord_centre(np.array([0.1, 0.0, 0.9]), lateral, wand, 0.06)
    np.testing.assert_allclose(centre, [0.1, 0.0, 0.5], atol=1e-15)


def test_a_chord_sees_marker_and_joint_above_at_a_right_angle():
    random = np.random.default_rng(3)
    for _ in range(20):
        proximal, lateral, wand = random.normal(size=(3, 3))
        half = 0.3 * np.linalg.norm(proximal - lateral)
        centre = chord_centre(proximal, lateral, wand, half)
        assert np.linalg.norm(centre - lateral) == pytest.approx(half)
        assert (centre - lateral) @ (centre - proximal) == pytest.approx(0.0, abs=1e-12)
        normal = np.cross(proximal - lateral, wand - lateral)
        assert (centre - lateral) @ normal == pytest.approx(0.0, abs=1e-12)


def test_without_wands_the_knee_axis_lies_across_the_pelvis():
    person = standing_person()
    markers = {n: p for n, p in person.landmarks.items() if "Medial" not in n}
    del markers["R.Thigh"], markers["L.Thigh"]
    found = locate(markers, **WIDTHS)
    c, s = np.cos(np.radians(HEADING)), np.sin(np.radians(HEADING))
    axis = found["R.Knee.Centre"] - found["R.Knee"]
    assert np.degrees(np.arctan2(-axis[0], axis[1])) == pytest.approx(HEADING, abs=1.0)
    assert np.linalg.norm(axis) == pytest.approx(KNEE_WIDTH / 2 + 0.010)
    assert axis @ [-s, c, 0.0] > 0  # towards the midline


def test_a_wand_in_front_of_the_thigh_is_refused():
    person = standing_person()
    markers = {name: person.landmarks[name] for name in PLUG_IN_GAIT}
    thigh = person.frames[1]
    markers["R.Thigh"] = thigh[:3, 3] + thigh[:3, :3] @ [0.1, -0.045, -0.2]
    with pytest.raises(ScalingError, match=r"R\.Thigh is not lateral to the knee"):
        measure(markers, **WIDTHS)


def test_a_device_on_the_knee_shows_its_axis_where_the_wand_does_not():
    person = standing_person()
    markers = {n: np.array(p) for n, p in person.landmarks.items() if "Medial" not in n}
    expected = locate(markers, **WIDTHS)
    for side in "RL":
        outwards = expected[f"{side}.Knee"] - expected[f"{side}.Knee.Centre"]
        markers[f"{side}.Knee.Axis"] = expected[f"{side}.Knee"] + 2 * outwards
        markers[f"{side}.Thigh"] += [0.04, 0.0, 0.0]
        found = locate(markers, **WIDTHS)
        for joint in ("Knee.Centre", "Ankle.Centre"):
            np.testing.assert_allclose(
                found[f"{side}.{joint}"], expected[f"{side}.{joint}"], atol=1e-9
            )


def test_a_device_on_the_wrong_side_of_the_knee_is_named():
    person = standing_person()
    markers = {n: np.array(p) for n, p in person.landmarks.items() if "Medial" not in n}
    markers["R.Knee.Axis"] = markers["R.Knee"] + [0.0, 0.1, 0.0]
    with pytest.raises(ScalingError, match=r"R\.Knee\.Axis is not lateral to the knee"):
        locate(markers, **WIDTHS)


def test_a_marker_on_the_midfoot_shows_where_the_foot_points_and_not_its_length():
    person = standing_person()
    markers = {name: np.array(person.landmarks[name]) for name in PLUG_IN_GAIT}
    full = measure(markers, **WIDTHS)
    for side in "RL":
        heel = markers[f"{side}.Heel"]
        markers[f"{side}.MT2"] = heel + 0.65 * (markers[f"{side}.MT2"] - heel) + [0.0, 0.0, 0.03]
    found = measure(markers, **WIDTHS)
    assert "midfoot" in found.sources["foot"]
    assert "midfoot" not in full.sources["foot"]
    for seen, whole in ((found.right, full.right), (found.left, full.left)):
        # The foot of a stature scatters by 5 %.
        assert seen.foot_length == pytest.approx(whole.foot_length, rel=0.1)
        np.testing.assert_allclose(seen.metatarsals[:, 2], whole.metatarsals[:, 2], atol=0.015)
    build_body(PERSON, found)


def test_the_foot_expected_for_the_hips_is_that_of_the_mean_body():
    ahead = FOOT["MT1"][0] - FOOT["heel"][0]
    mean = FRACTIONS["foot"] / FRACTIONS["hip_height"] * ahead
    assert pytest.approx(mean, abs=5e-5) == FOREFOOT.head_by_hips
    assert pytest.approx(FOOT["MT5"][2] / ahead, abs=5e-5) == FOREFOOT.head_height


def test_second_heads_of_the_built_in_feet_are_on_no_midfoot():
    shares = []
    for subject in builtin_subjects():
        found = locate(subject.markers)
        seen = {n: found[n] for n in found if "Hip" in n or n[2:] in ("Heel", "MT2")}
        assert not on_midfoot(seen)
        # Moved back to the heel, they are.
        expected = on_midfoot(seen | {f"{side}.MT2": seen[f"{side}.Heel"] for side in "RL"})
        for side in "RL":
            along = (found[f"{side}.MT2"] - found[f"{side}.Heel"])[:2]
            shares.append(np.hypot(*along) / expected)
    np.testing.assert_allclose([min(shares), max(shares)], [0.96, 1.15], atol=0.005)


def test_foot_shape_is_the_mean_of_the_built_in_feet():
    shapes = {pair: [] for pair in FOOT_SHAPE}
    for subject in builtin_subjects():
        for side, medial in (("R", 1.0), ("L", -1.0)):
            heel = np.array(subject.markers[f"{side}.Heel"])
            for head, other in FOOT_SHAPE:
                to_head, to_other = (
                    np.array(subject.markers[f"{side}.{name}"]) - heel for name in (head, other)
                )
                place = complex(*to_head[:2]) / complex(*to_other[:2])
                up = (to_head - to_other)[2] / np.hypot(*to_other[:2])
                shapes[head, other].append((place.real, medial * place.imag, up))
    for pair, found in shapes.items():
        np.testing.assert_allclose(FOOT_SHAPE[pair], np.mean(found, axis=0), atol=6e-5)
        lengths = np.hypot(*np.array(found).T[:2])
        # What the docstring says of the scatter.
        message = {("MT1", "MT5"): 3.5, ("MT1", "MT2"): 1.4, ("MT5", "MT2"): 2.8}[pair]
        assert 100 * lengths.std(ddof=1) / lengths.mean() == pytest.approx(message, abs=0.06)


def test_foot_of_a_real_person_without_the_first_metatarsal():
    # 5 % is 1.4 standard deviations of what the fifth head leaves open.
    for subject in builtin_subjects():
        markers = {n: at for n, at in subject.markers.items() if not n.endswith("MT1")}
        seen, full = measure(markers), measure(subject.markers)
        assert seen.right.foot_length == pytest.approx(full.right.foot_length, rel=0.08)
        assert seen.right.thigh == full.right.thigh


def test_measurements_survive_toml():
    for measured in (made_up_measurements(), measure(load_subject("S07").markers)):
        text = tomli_w.dumps({"measurements": measured.to_dict()})
        again = measurements_from(tomllib.loads(text)["measurements"])
        assert again.to_dict() == measured.to_dict()
        first, second = (build_body(PERSON, m).model for m in (measured, again))
        for a, b in zip(first.segments, second.segments, strict=True):
            np.testing.assert_array_equal(a.joint_position, b.joint_position)
            np.testing.assert_array_equal(a.inertia, b.inertia)


def test_stored_measurements_count_more_than_markers():
    subject = load_subject("S05")
    stored = made_up_measurements().to_dict()
    person = type(PERSON)(**vars(PERSON), measurements=stored)
    person.markers = subject.markers
    scaled = scale_subject(person)
    assert scaled.model["forearm_r"].joint_position[2] == pytest.approx(-0.271)
    empty = type(PERSON)(**vars(PERSON), measurements={})
    empty.markers, empty.sex, empty.height_m = subject.markers, subject.sex, subject.height_m
    thigh = measure(subject.markers).right.thigh + measure(subject.markers).left.thigh
    assert scale_subject(empty).model["shank_r"].joint_position[2] == pytest.approx(-thigh / 2)


def test_all_problems_of_stored_measurements_are_listed():
    stored = made_up_measurements().to_dict()
    del stored["thigh_right"], stored["thigh_left"]
    stored |= {"heel_left": [0.1, 0.2], "shank_left": "long", "thihg_right": 0.4}
    with pytest.raises(ScalingError) as error:
        measurements_from(stored)
    for problem in (
        "thigh: missing",
        "thihg_right: unknown",
        "heel_left = [0.1, 0.2]: must be three numbers",
        "shank_left = 'long': must be a number",
    ):
        assert problem in str(error.value)


def test_a_body_of_fitted_lengths_has_the_joints_of_the_fitted_model():
    measured = made_up_measurements()
    model = build_body(PERSON, measured).model
    change = np.random.default_rng(1).uniform(-0.01, 0.01, 20)
    fitted = {n: v + d for (n, v), d in zip(lengths_of(model).items(), change, strict=False)}
    expected = with_lengths(model, fitted)
    body = build_body(PERSON, with_fitted_lengths(measured, fitted, "joint fit"))
    for seen, wanted in zip(body.model.segments, expected.segments, strict=True):
        np.testing.assert_allclose(
            seen.joint_position, wanted.joint_position, atol=1e-12, err_msg=seen.name
        )
    # The origin of the pelvis is between its hips, so its mass moves the other way; its own length
    # follows the stature above the hips.
    np.testing.assert_allclose(
        body.model["pelvis"].centre_of_mass, expected["pelvis"].centre_of_mass, atol=1e-3
    )
    assert with_fitted_lengths(measured, {"hip_up": 0.012}, "fit").hip_height == pytest.approx(
        measured.hip_height + 0.012
    )
    assert body.table[0].source.startswith("joint fit")
    assert body.table[0].length_m == pytest.approx(fitted["thigh"])
    with pytest.raises(ScalingError, match="cannot be fitted: shoe"):
        with_fitted_lengths(measured, {"shoe": 0.3})


def test_measured_arms_are_in_the_table_and_the_model():
    measured = made_up_measurements()
    measured = replace(
        measured,
        right=replace(measured.right, upper_arm=0.275),
        left=replace(measured.left, upper_arm=0.267),
    )
    scaled = build_body(PERSON, measured)
    row = next(row for row in scaled.table if row.segment == "upper arm")
    assert (row.right_m, row.left_m) == (0.275, 0.267)
    assert row.length_m == pytest.approx(0.271)
    assert scaled.model["upper_arm_l"].joint_position[1] == pytest.approx(0.165)


def test_implausible_hips_and_shoulders_are_named():
    measured = replace(made_up_measurements(), hip_half_width=-0.09, shoulder_half_width=0.3)
    with pytest.raises(ScalingError, match=r"hips: -0\.090 m from(.|\n)*shoulders: 0\.300 m from"):
        build_body(PERSON, measured)
