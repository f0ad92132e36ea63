"""Functional hips and knees of a made-up person, and of the recorded WBDS01."""

from dataclasses import replace

import numpy as np
import pytest
from made_up_session import SHORT, made_up_session
from recorded_sessions import wbds01_t01
from standing_person import PERSON, StandingPerson, standing_person

from gaitval.configuration import ProcessingSettings
from gaitval.coordinates import COORDINATES
from gaitval.errors import RecordError
from gaitval.kinetics.inverse.marked_body import marker_positions
from gaitval.mocap.given_axes import parse_axes
from gaitval.mocap.recording import Recording
from gaitval.mocap.trc_writing import write_trc
from gaitval.model.body import SEGMENTS
from gaitval.model.markers import ModelMarker
from gaitval.scaling.joint_centres import measure
from gaitval.scaling.marker_sets import load_marker_set
from gaitval.session.functional import (
    FunctionalHip,
    FunctionalKnee,
    chosen_hips,
    functional_joints,
)
from gaitval.session.importing.results import FunctionalResult
from gaitval.session.opensim.coordinates import TO_OPENSIM
from gaitval.session.read import SessionRecordings, read_session
from gaitval.session.request import Request

RATE = 100.0
PROCESSING = ProcessingSettings()
SET = load_marker_set("opencap")


def swings(person: StandingPerson, sides: str) -> np.ndarray:
    """Poses (T, 31): the hips swing forward, back and aside, and the knees bend."""
    time = np.arange(1200) / RATE
    poses = np.tile(person.pose, (len(time), 1))
    for number, side in enumerate(sides):
        for name, middle, size, rate in (
            ("hip_flexion", 20.0, 35.0, 0.5),
            ("hip_adduction", -12.0, 16.0, 0.37),
            ("knee_angle", 40.0, 30.0, 0.45),
        ):
            wave = middle + size * np.sin(2 * np.pi * rate * time + number)
            poses[:, COORDINATES.index(f"{name}_{side}")] = np.radians(wave)
    return poses


def session_of(folder, *, sides="rl", asis=0.0, noise=0.0):
    """A person, their session, and a request with a range-of-motion trial.

    `asis` : m, by which both ASIS markers are too far forward.
    """
    person = standing_person()
    places, local = person.markers(SET)
    legs = ("pelvis", "thigh", "shank", "foot")
    places = {n: at for n, at in places.items() if SET.segments[n].startswith(legs)}
    fitted = [ModelMarker(name, SET.markers[name].segment, local[name]) for name in places]
    if asis:
        pelvis = person.frames[SEGMENTS.index("pelvis")]
        for name in ("r.ASIS", "L.ASIS"):
            places[name] = places[name] + asis * pelvis[:3, 0]
        fitted = [
            replace(marker, position=marker.position + np.array([asis, 0.0, 0.0]))
            if marker.name.endswith("ASIS")
            else marker
            for marker in fitted
        ]
    standing = Recording(
        "stand", "project", tuple(places), np.tile(list(places.values()), (100, 1, 1)), RATE
    )
    markers = marker_positions(person.model, fitted, swings(person, sides))
    markers += np.random.default_rng(0).normal(0.0, noise, markers.shape)
    file = folder / "swing.trc"
    trial = Recording("swing", "project", tuple(m.name for m in fitted), markers, RATE)
    write_trc(file, trial.turned(TO_OPENSIM))
    session = SessionRecordings(SET, parse_axes("forward=+x up=+y"), standing, ())
    request = Request(
        static=folder / "stand.trc",
        trials=(folder / "walk.trc",),
        identifier=PERSON.identifier,
        mass=PERSON.mass_kg,
        height=PERSON.height_m,
        sex=PERSON.sex,
        functional=(file,),
        joint_centres="functional",
    )
    return person, session, request


def by_name(joints):
    return {(joint.side, joint.joint): joint for joint in joints}


def true_hip(person: StandingPerson, side: str) -> np.ndarray:
    return person.frames[SEGMENTS.index(f"thigh_{side[0]}"), :3, 3]


@pytest.mark.parametrize("side", ["right", "left"])
def test_a_swinging_leg_shows_the_hip_and_the_knee_of_the_body(tmp_path, side):
    person, session, request = session_of(tmp_path)
    joints = by_name(functional_joints(request, PROCESSING, session))
    hip, knee = joints[side, "hip"].found, joints[side, "knee"].found
    assert isinstance(hip, FunctionalHip)
    # TRC has 5 decimals of a millimetre; the markers are low-passed nowhere.
    np.testing.assert_allclose(hip.found.centre, true_hip(person, side), atol=1e-6)
    assert hip.error < 1e-6
    assert np.linalg.norm(hip.difference) < 1e-6  # the made-up hips are the regression's
    assert hip.to_ankle == pytest.approx(hip.regression_to_ankle, abs=1e-6)
    assert isinstance(knee, FunctionalKnee)
    flexion_axis = person.frames[SEGMENTS.index(f"shank_{side[0]}"), :3, 1]
    assert abs(knee.found.direction @ flexion_axis) == pytest.approx(1.0, abs=1e-9)
    assert knee.found.ranges[0] == pytest.approx(60.0, abs=1.0)
    assert knee.angle < 1e-4
    assert abs(knee.higher) < 1e-5


def test_a_misplaced_asis_moves_the_regression_and_not_the_functional_centre(tmp_path):
    person, session, request = session_of(tmp_path, asis=0.012, noise=0.001)
    messages = []
    joints = functional_joints(
        request, PROCESSING, session, lambda *message: messages.append(message)
    )
    for side in ("right", "left"):
        hip = by_name(joints)[side, "hip"].found
        assert np.linalg.norm(hip.found.centre - true_hip(person, side)) < 0.002
        # The regression follows the ASIS by 12 mm, less 0.24 of the deeper pelvis.
        np.testing.assert_allclose(1000 * hip.difference, [-9.1, 0.0, 0.0], atol=2.0)
        error = abs(hip.to_ankle - np.linalg.norm(true_hip(person, side) - ankle(session, side)))
        assert error < 3 * hip.to_ankle_error + 0.0005
    assert any("-9 mm forward" in text and "hip centre to ankle" in text for _, text in messages)
    # Chosen, they give the body back its hips; by default they do not.
    chosen = chosen_hips(request, joints, lambda *message: messages.append(message))
    assert set(chosen) == {"R.Hip.Centre", "L.Hip.Centre"}
    assert chosen_hips(request.model_copy(update={"joint_centres": "harrington"}), joints) == {}
    points = SET.on_landmarks({n: session.standing.marker(n)[0] for n in session.standing.names})
    by_regression, by_function = measure(points), measure(points, centres=chosen)
    assert by_function.right.thigh == pytest.approx(person.measured.right.thigh, abs=0.002)
    assert by_function.hip_half_width == pytest.approx(person.measured.hip_half_width, abs=0.002)
    assert abs(by_regression.hip_height - by_function.hip_height) < 0.005
    assert by_function.sources["thigh"] == "markers, hip functional (Ehrig 2006)"
    assert "thigh" not in by_regression.sources


def ankle(session, side):
    letter = "r" if side == "right" else "L"
    ends = [session.standing.marker(f"{letter}_{name}")[0] for name in ("ankle", "mankle")]
    return np.mean(ends, axis=0)


def test_a_leg_that_rests_is_not_found_and_keeps_the_regression(tmp_path):
    _, session, request = session_of(tmp_path, sides="l")
    joints = functional_joints(request, PROCESSING, session)
    rested = by_name(joints)["right", "hip"]
    assert rested.found is None
    assert "turned by 0.0° and 0.0°" in rested.refused
    assert by_name(joints)["left", "hip"].found is not None
    messages = []
    assert set(chosen_hips(request, joints, lambda *message: messages.append(message))) == {
        "L.Hip.Centre"
    }
    assert any(text.startswith("right hip centre: by regression") for _, text in messages)


def test_the_sign_of_the_knee_axis_is_internal_rotation_on_both_sides(tmp_path):
    """Lateral knee markers too far back: the axis is turned inwards against the line of them."""
    _, session, request = session_of(tmp_path)
    places = dict(zip(session.standing.names, session.standing.markers[0].copy(), strict=True))
    heading = places["r.ASIS"] + places["L.ASIS"] - places["r.PSIS"] - places["L.PSIS"]
    heading[2] = 0.0
    for name in ("r_knee", "L_knee"):
        places[name] = places[name] - 0.01 * heading / np.linalg.norm(heading)
    moved = replace(
        session,
        standing=replace(session.standing, markers=np.tile(list(places.values()), (100, 1, 1))),
    )
    joints = by_name(functional_joints(request, PROCESSING, moved))
    for side in ("right", "left"):
        knee = joints[side, "knee"].found
        assert 3.0 < np.degrees(knee.rotation) < 9.0
        assert knee.angle == pytest.approx(abs(knee.rotation), abs=0.04)


def test_the_record_and_the_rows_say_what_was_found(tmp_path):
    _, session, request = session_of(tmp_path, sides="l", noise=0.001)
    joints = functional_joints(request, PROCESSING, session)
    results = [FunctionalResult.model_validate(joint.record()) for joint in joints]
    assert [(r.side, r.joint, bool(r.refused), r.hip is None, r.knee is None) for r in results] == [
        ("right", "hip", True, True, True),
        ("right", "knee", True, True, True),
        ("left", "hip", False, False, True),
        ("left", "knee", False, True, False),
    ]
    hip = results[2].hip
    assert hip.standard_error_m < 0.002
    assert 0.6 < hip.to_ankle_m < 0.9
    rows = [joint.row() for joint in joints]
    assert rows[0].refused
    assert "by regression" in rows[2].to_ankle
    assert rows[3].error.endswith("°")


def test_a_functional_hip_without_a_trial_is_refused(tmp_path):
    request = made_up_session(tmp_path, noise=0.0, **SHORT).request
    request = request.model_copy(update={"joint_centres": "functional"})
    with pytest.raises(RecordError, match="functional = "):
        read_session(request, PROCESSING)


def test_the_walk_of_wbds01_shows_knee_axes_and_no_hips(gait_data):
    request = wbds01_t01(gait_data)
    request = request.model_copy(update={"functional": request.trials})
    session = read_session(request, PROCESSING)
    joints = by_name(functional_joints(request, PROCESSING, session))
    for side in ("right", "left"):
        # Trochanter and epicondyle are all that WBDS puts on the thigh in walking.
        assert "markers in both trials: 2;" in joints[side, "hip"].refused
        knee = joints[side, "knee"].found
        assert 50.0 < knee.found.ranges[0] < 65.0
        assert np.degrees(knee.angle) < 12.0
        assert np.degrees(knee.found.standard_error) < 3.0
