import numpy as np
import pytest
from scipy.spatial.transform import Rotation
from standing_person import (
    ANKLE_WIDTH,
    ELBOW_WIDTH,
    KNEE_WIDTH,
    PERSON,
    UP,
    standing_person,
)

from gaitval.coordinates import COORDINATES
from gaitval.kinetics.inverse.marked_body import marker_positions
from gaitval.kinetics.inverse.marker_placement import place_markers, placement_checks
from gaitval.mocap.trc import read_trc
from gaitval.model.body import SEGMENTS
from gaitval.model.tree import segment_frames
from gaitval.scaling.joint_centres import SURFACE, locate, measure
from gaitval.scaling.marker_sets import load_marker_set, recognise
from gaitval.scaling.scaling import build_body

TO_PROJECT = {
    "wbds": np.array([[1.0, 0, 0], [0, 0, -1], [0, 1, 0]]),  # ISB: x forward, y up, z right
    "rajagopal": np.array([[0, 0, 1.0], [1, 0, 0], [0, 1, 0]]),  # x left, y up, z forward
}


def standing_trial(recording):
    """Marker set and mean positions by its names, project axes, of a recorded standing trial."""
    marker_set = recognise(recording.names)
    turned = recording.turned(TO_PROJECT[marker_set.name])
    places = {
        marker: np.nanmean(turned.marker(name), axis=0)
        for name, marker in marker_set.renamed(recording.names).items()
    }
    return marker_set, places


@pytest.mark.parametrize(
    ("name", "widths"),
    [
        ("wbds", {}),
        ("rajagopal", {}),
        (
            "plug_in_gait",
            {"knee_width": KNEE_WIDTH, "ankle_width": ANKLE_WIDTH, "elbow_width": ELBOW_WIDTH},
        ),
    ],
)
def test_a_made_up_person_is_placed_back_on_both_sides(name, widths):
    person, marker_set = standing_person(), load_marker_set(name)
    places, local = person.markers(marker_set)
    if name == "plug_in_gait":
        places = {n: at for n, at in places.items() if not marker_set.markers[n].static_only}
    placement = place_markers(person.model, person.measured, places, marker_set, **widths)
    assert [marker.name for marker in placement.markers] == [
        name for name in marker_set.markers if name in places
    ]
    for marker in placement.markers:
        np.testing.assert_allclose(marker.position, local[marker.name], atol=1e-3)
    shown = [i for i, c in enumerate(COORDINATES) if "arm" not in c and "elbow" not in c]
    if name != "wbds":
        shown = list(range(31))
    np.testing.assert_allclose(
        np.degrees(placement.standing[shown]), np.degrees(person.pose[shown]), atol=0.3
    )
    assert all(check.passed for check in placement.checks)
    assert placement.moved == ()


def test_the_model_has_its_markers_where_they_were_measured():
    person, marker_set = standing_person(), load_marker_set("rajagopal")
    places, _ = person.markers(marker_set)
    # A person whose sides differ: the symmetric model cannot have both, the markers can.
    places["L.Knee"] = places["L.Knee"] + [0.0, 0.004, 0.008]
    placement = place_markers(person.model, person.measured, places, marker_set)
    at = marker_positions(person.model, placement.markers, placement.standing[None])[0]
    for marker, place in zip(placement.markers, at, strict=True):
        np.testing.assert_allclose(place, places[marker.name], atol=1e-12)
    right, left = (
        next(m for m in placement.markers if m.name == n).position for n in ("R.Knee", "L.Knee")
    )
    assert np.abs(right * [1, -1, 1] - left).max() > 0.003


def test_feet_turned_outwards_do_not_pull_the_knees_off_the_middle_of_their_epicondyles():
    """By 18 degrees against the shank, which the model's knee and ankle cannot be: the knees would
    be 8 mm in front of their middle.
    """
    person, marker_set = standing_person(), load_marker_set("rajagopal")
    places, _ = person.markers(marker_set)
    for name, definition in marker_set.markers.items():
        if definition.segment.startswith(("foot", "toes")):
            end = definition.segment[-1]
            ankle = person.frames[SEGMENTS.index(f"foot_{end}"), :3, 3]
            outwards = Rotation.from_rotvec(np.radians(-18.0 if end == "r" else 18.0) * UP)
            places[name] = ankle + outwards.apply(places[name] - ankle)
    placement = place_markers(person.model, person.measured, places, marker_set)
    frames = segment_frames(person.model, placement.standing[None])[0]
    centres = locate(marker_set.on_landmarks(places))
    for end in "rl":
        knee = frames[SEGMENTS.index(f"shank_{end}"), :3, 3]
        away = knee - centres[f"{end.upper()}.Knee.Centre"]
        assert abs(away @ frames[SEGMENTS.index(f"thigh_{end}"), :3, 0]) < 0.001
    # The landmarks are still judged all alike, and the feet do not fit the shanks.
    assert placement.distances["R.Knee"] > 0.005


def test_raised_arms_move_to_the_model_shoulders():
    person, marker_set = standing_person(raised=85.0), load_marker_set("rajagopal")
    places, local = person.markers(marker_set)
    placement = place_markers(person.model, person.measured, places, marker_set)
    placed = {marker.name: marker.position for marker in placement.markers}
    for name, definition in marker_set.markers.items():
        if definition.segment.startswith(("upper_arm", "forearm")):
            np.testing.assert_allclose(placed[name], local[name], atol=1e-3)
    moved = {n for n, d in marker_set.markers.items() if "arm" in d.segment}
    assert set(placement.moved) == moved | {"R.Shoulder", "L.Shoulder"}
    shoulder = person.model["upper_arm_l"].joint_position
    above = 2 * SURFACE.acromion_to_shoulder * shoulder[1]
    np.testing.assert_allclose(placed["L.Shoulder"], shoulder + above * UP)


def test_limits_name_what_is_beyond_them():
    pose = np.zeros(31)
    pose[COORDINATES.index("ankle_angle_l")] = np.radians(-7.0)
    pose[COORDINATES.index("hip_flexion_r")] = np.radians(23.0)
    rows = placement_checks(pose, np.radians(12.0), {"R.Knee": 0.025, "L.Knee": 0.001})
    failed = {row.name: row.value for row in rows if not row.passed}
    assert failed == pytest.approx(
        {
            "largest distance of a landmark (R.Knee)": 0.025,
            "RMS distance of the landmarks": np.sqrt((0.025**2 + 0.001**2) / 2),
            "right hip flexion in standing, from the standing pelvis": 11.0,
            "left hip flexion in standing, from the standing pelvis": 12.0,
            "left ankle angle in standing": 7.0,
        }
    )
    assert all("OpenSim" in row.source for row in rows)


def test_joint_centres_of_the_rajagopal_trial(gait_data):
    trial = read_trc(gait_data / "opensim_rajagopal/ExpData/static_walk_1.trc")
    marker_set, places = standing_trial(trial)
    measured = measure(marker_set.on_landmarks(places))
    turned = trial.turned(TO_PROJECT["rajagopal"])
    given = {name: np.nanmean(turned.marker(name), axis=0) for name in trial.names}
    # The trial's own computed joints: midpoints as ours, and a hip found by another method.
    for side, leg in (("R", measured.right), ("L", measured.left)):
        shank = np.linalg.norm(given[f"{side}.KneeJoint"] - given[f"{side}.AnkleJoint"])
        thigh = np.linalg.norm(given[f"{side}_HJC"] - given[f"{side}.KneeJoint"])
        assert leg.shank == pytest.approx(shank, abs=1e-3)
        assert leg.thigh == pytest.approx(thigh, abs=0.010)
    person = type(PERSON)(
        identifier="R", sex="M", age_years=None, mass_kg=85.0668, height_m=1.829, markers={}
    )
    placement = place_markers(build_body(person, measured).model, measured, places, marker_set)
    # The left knee stands in 6 degrees of valgus, which the model's hinge does not have.
    failed = [check.name for check in placement.checks if not check.passed]
    assert failed == ["largest distance of a landmark (L.Knee)"]
    assert placement.distances["L.Knee"] < 0.025
