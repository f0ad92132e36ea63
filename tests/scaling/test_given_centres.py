"""Joint centres of an OpenSim model and of points in a file, laid on a standing person."""

import warnings
from dataclasses import replace

import numpy as np
import pytest
from scipy.spatial.transform import Rotation
from standing_person import standing_person

from gaitval.configuration import ContactSettings
from gaitval.errors import ScalingError
from gaitval.mocap.c3d_writing import write_c3d
from gaitval.mocap.centre_points import centre_points
from gaitval.mocap.reading import read_recording
from gaitval.mocap.recording import Plate, Recording
from gaitval.mocap.separate_forces import with_plates
from gaitval.mocap.trc_writing import write_trc
from gaitval.model.body import SEGMENTS
from gaitval.model.markers import ModelMarker
from gaitval.scaling.given_centres import laid, of_model, of_recording, with_centres
from gaitval.scaling.marker_sets import load_marker_set
from gaitval.scaling.opensim.model_file import read_model
from gaitval.session.opensim.osim import write_osim
from gaitval.session.read import named

SET = load_marker_set("opencap")
PLUG_IN_GAIT = load_marker_set("plug_in_gait")
SEGMENT = {"Hip": "thigh", "Knee": "shank", "Ankle": "foot"}
NAMES = [f"{side}.{joint}.Centre" for side in "RL" for joint in SEGMENT]


def true_centres(person):
    """The joints of a person in the laboratory, (3,) m."""
    return {
        name: person.frames[SEGMENTS.index(f"{SEGMENT[name[2:-7]]}_{name[0].lower()}"), :3, 3]
        for name in NAMES
    }


def model_of(person, folder, *, moved=None, markers=None):
    """A person's model as OpenSim's, with joints `moved`, m in the segment above, and markers."""
    places, local = person.markers(SET)
    worn = [ModelMarker(name, SET.segments[name], local[name]) for name in places]
    segments = tuple(
        replace(s, joint_position=s.joint_position + np.array((moved or {}).get(s.name, (0, 0, 0))))
        for s in person.model.segments
    )
    body = replace(person.model, segments=segments)
    write_osim(folder / "own.osim", body, worn if markers is None else markers, *FEET)
    return places, of_model(read_model(folder / "own.osim"), "own.osim", SET.renamed)


FEET = (ContactSettings(), 0.8)


def test_a_model_s_centres_are_where_the_person_s_joints_are(tmp_path):
    person = standing_person()
    places, given = model_of(person, tmp_path)
    found, refused = laid(given, places)
    assert not refused
    assert {each.name for each in found} == set(NAMES)
    for each in found:
        np.testing.assert_allclose(each.place, true_centres(person)[each.name], atol=1e-6)
        assert each.residual < 1e-6


def test_a_moved_joint_is_moved_along_the_axes_of_the_segment_above(tmp_path):
    """Forward, left and up of a model are those of the segment: hips on both sides, and a knee."""
    person = standing_person()
    moved = {
        "thigh_r": (-0.03, -0.01, 0.005),
        "thigh_l": (-0.03, 0.01, 0.005),
        "shank_r": (-0.008, 0.0, 0.0),
    }
    places, given = model_of(person, tmp_path, moved=moved)
    found = {each.name: each.place for each in laid(given, places)[0]}
    for name, above in (("R.Hip", "pelvis"), ("L.Hip", "pelvis"), ("R.Knee", "thigh_r")):
        frame = person.frames[SEGMENTS.index(above), :3, :3]
        seen = (found[f"{name}.Centre"] - true_centres(person)[f"{name}.Centre"]) @ frame
        segment = f"{SEGMENT[name[2:]]}_{name[0].lower()}"
        np.testing.assert_allclose(seen, moved[segment], atol=1e-6)


def of_simm_s_age(*, reverse=False):
    """A skeleton as OpenSim 3 wrote it, without turned frames, with a knee that glides."""

    def body(name, parent, at, gliding=False):
        coordinate = f"{name}_q"
        slide = "<SimmSpline><x>-1 -0.5 0 0.5 1</x><y>0.02 0.01 -0.006 0.01 0.02</y></SimmSpline>"
        glides = (
            f'<TransformAxis name="translation1"><coordinates>{coordinate}</coordinates>'
            f"<axis>1 0 0</axis><function>{slide}</function></TransformAxis>"
        )
        return (
            f'<Body name="{name}"><mass>5</mass><mass_center>0 0 0</mass_center><Joint>'
            f'<CustomJoint name="to_{name}"><parent_body>{parent}</parent_body>'
            f"<location_in_parent>{at}</location_in_parent><location>0 0.01 0</location>"
            f'<CoordinateSet><objects><Coordinate name="{coordinate}"/></objects></CoordinateSet>'
            f"<reverse>{str(reverse and name == 'femur_l').lower()}</reverse>"
            f"<SpatialTransform>{glides if gliding else ''}</SpatialTransform>"
            "</CustomJoint></Joint></Body>"
        )

    legs = "".join(
        body(f"femur_{side}", "pelvis", f"-0.07 -0.06 {out}")
        + body(f"tibia_{side}", f"femur_{side}", "0 -0.4 0", gliding=True)
        + body(f"talus_{side}", f"tibia_{side}", "0 -0.43 0")
        for side, out in (("r", 0.08), ("l", -0.08))
    )
    marker = (
        '<Marker name="r_knee"><body>femur_r</body><location>0.01 -0.41 0.05</location></Marker>'
    )
    return (
        '<OpenSimDocument Version="30000"><Model name="old"><BodySet><objects>'
        '<Body name="ground"><mass>0</mass><mass_center>0 0 0</mass_center></Body>'
        f"{body('pelvis', 'ground', '0 1 0')}{legs}</objects></BodySet>"
        f"<MarkerSet><objects>{marker}</objects></MarkerSet></Model></OpenSimDocument>"
    )


@pytest.mark.parametrize("reverse", [False, True])
def test_a_model_of_simm_s_age_whose_knee_glides(tmp_path, reverse):
    """OpenSim 3 has joints in the bodies; at 0 the knee is 6 mm behind where its frame is."""
    (tmp_path / "old.osim").write_text(of_simm_s_age(reverse=reverse))
    given = of_model(read_model(tmp_path / "old.osim"), "old.osim", SET.renamed)
    centres = {each.name: each.centre[0] for each in given}
    np.testing.assert_allclose(centres["R.Hip.Centre"], [-0.07, -0.06, 0.08], atol=1e-12)
    np.testing.assert_allclose(centres["L.Hip.Centre"], [-0.07, -0.06, -0.08], atol=1e-12)
    np.testing.assert_allclose(centres["R.Knee.Centre"], [-0.006, -0.4, 0.0], atol=1e-12)
    # In the shank's body, whose joint is 10 mm above its origin.
    np.testing.assert_allclose(centres["R.Ankle.Centre"], [0.0, -0.43, 0.0], atol=1e-12)
    knee = next(each for each in given if each.name == "R.Knee.Centre")
    np.testing.assert_allclose(knee.markers["r_knee"], [[0.01, -0.41, 0.05]])


def plug_in_gait_file(folder, ending, *, frames=9):
    """A person with Plug-in Gait's markers who turns and moves, with the ends of the bones as
    points, in mm, and the standing places of the markers.
    """
    person = standing_person()
    every, _ = person.markers(PLUG_IN_GAIT)
    landmarks = {name: PLUG_IN_GAIT.markers[name].landmark or "" for name in every}
    places = {name: at for name, at in every.items() if "Medial" not in landmarks[name]}
    centres = true_centres(person)
    ends = {
        f"{side}{point}": centres[f"{side}.{joint}.Centre"]
        for side in "RL"
        for point, joint in (("FEP", "Hip"), ("FEO", "Knee"), ("TIO", "Ankle"))
    }
    # As Vicon writes them: the ends of a bone are two of its four points.
    axes = {f"{s}FE{a}": ends[f"{s}FEP"] for s in "RL" for a in "AL"}
    points = places | ends | axes
    poses = Rotation.from_rotvec(np.outer(np.linspace(0.2, 1.2, frames), [0.0, 0.0, 1.0]))
    there = np.array(list(points.values()))
    moved = [pose.apply(there) + np.array([0.1 * i, 0.0, 0.2]) for i, pose in enumerate(poses)]
    trial = Recording("walk", "project", tuple(points), np.array(moved), 100.0)
    write = {"c3d": write_c3d, "trc": write_trc}[ending]
    write(folder / f"walk.{ending}", trial)
    return centres, places, read_recording(folder / f"walk.{ending}")


@pytest.mark.parametrize("frames", [1, 9])
@pytest.mark.parametrize("ending", ["c3d", "trc"])
def test_points_of_plug_in_gait_are_laid_by_two_markers_and_the_centre_above(
    tmp_path, ending, frames
):
    centres, places, recording = plug_in_gait_file(tmp_path, ending, frames=frames)
    assert set(recording.centres) == set(NAMES)
    assert {each.source for each in recording.centres.values()} == {"Plug-in Gait"}
    given = of_recording(named(recording, PLUG_IN_GAIT), PLUG_IN_GAIT.segments)
    assert {len(each.markers) for each in given if "Hip" not in each.name} == {2}
    found, refused = laid(given, places)
    assert not refused
    for each in found:
        np.testing.assert_allclose(each.place, centres[each.name], atol=2e-6)


def test_points_are_cut_with_the_part_that_counts(tmp_path):
    _, _, recording = plug_in_gait_file(tmp_path, "trc")
    part = recording.between((0.02, 0.05), "--trial-time")
    assert {len(each.places) for each in part.centres.values()} == {len(part.markers)}


def test_points_are_cut_with_the_markers_where_forces_begin_later(tmp_path):
    _, _, recording = plug_in_gait_file(tmp_path, "trc", frames=30)
    still = np.zeros((28, 3))
    unloaded = Plate("P", np.full((4, 3), np.nan), still, np.full((28, 3), np.nan), still)
    both = with_plates(recording, tmp_path / "f.mot", (unloaded,), rate=100.0, start=0.01)
    np.testing.assert_array_equal(both.markers, recording.markers[1:29])
    assert both.start == pytest.approx(0.01)
    for name, each in both.centres.items():
        np.testing.assert_array_equal(each.places, recording.centres[name].places[1:29])


def test_a_number_that_a_program_writes_for_a_gap_is_no_place_of_a_joint(tmp_path):
    """Beside most frames of 9999 the median would be there."""
    _, _, recording = plug_in_gait_file(tmp_path, "trc")
    filled = recording.markers.copy()
    filled[2:, recording.names.index("RFEP")] = 9.999
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        write_trc(tmp_path / "filled.trc", recording.with_markers(recording.names, filled))
        found = read_recording(tmp_path / "filled.trc").centres["R.Hip.Centre"].places
    assert np.isnan(found[2:]).all()
    np.testing.assert_allclose(found[:2], recording.centres["R.Hip.Centre"].places[:2], atol=1e-5)


def test_names_of_points():
    def found(*names):
        points = np.ones((2, len(names), 3)) * np.arange(len(names))[:, None]
        return {
            name: (each.source, each.places[0, 0])
            for name, each in centre_points(names, points).items()
        }

    assert found("RHJC", "L_KJC", "Anna:RAJC", "RHJC_study", "R_HJC_reg") == {
        "R.Hip.Centre": ("the file's points", 0.0),
        "L.Knee.Centre": ("the file's points", 1.0),
        "R.Ankle.Centre": ("the file's points", 2.0),
    }
    # the moments of Plug-in Gait are about its own
    assert found("LHJC", "LFEP", "LEFT_HIP") == {"L.Hip.Centre": ("Plug-in Gait", 1.0)}
    assert found("LEFT_HIP") == {"L.Hip.Centre": ("Visual3D", 0.0)}
    # key points of a video, markers, other bones
    assert found("RHip", "RKnee", "RTIB", "RHEE", "RFOO", "RTOO", "HJC") == {}


def test_a_point_that_is_never_seen_is_none():
    points = np.full((3, 1, 3), np.nan)
    assert centre_points(["RHJC"], points) == {}


def test_two_markers_are_not_enough_and_are_named(tmp_path):
    person = standing_person()
    places, local = person.markers(SET)
    few = ("r.ASIS", "L.ASIS", "r.PSIS", "r_knee", "r_mknee")
    markers = [ModelMarker(name, SET.segments[name], local[name]) for name in few]
    _, given = model_of(person, tmp_path, markers=markers)
    found, refused = laid(given, places)
    assert [each.title for each in found] == ["right hip", "left hip"]
    assert any("right knee" in each and "r_knee, r_mknee" in each for each in refused)
    assert any("left ankle" in each and "there are none" in each for each in refused)


def test_markers_on_a_line_do_not_show_a_turn(tmp_path):
    person = standing_person()
    places, local = person.markers(SET)
    markers = [
        ModelMarker(name, "thigh_r", np.array([0.0, 0.0, -0.1 * number]))
        for number, name in enumerate(("r_thigh1", "r_thigh2", "r_thigh3"))
    ]
    markers += [ModelMarker(n, "pelvis", local[n]) for n in ("r.ASIS", "L.ASIS", "r.PSIS")]
    _, given = model_of(person, tmp_path, markers=markers)
    _, refused = laid(given, places)
    assert any("right knee" in each and "not on a line" in each for each in refused)


def test_a_model_without_legs_says_what_it_has(tmp_path):
    person = standing_person()
    model_of(person, tmp_path)
    text = (tmp_path / "own.osim").read_text().replace("tibia_l", "wheel")
    (tmp_path / "own.osim").write_text(text)
    with pytest.raises(ScalingError, match=r"no body tibia_l .*it has pelvis"):
        of_model(read_model(tmp_path / "own.osim"), "own.osim", SET.renamed)


def test_centres_go_with_the_markers_of_the_segment_above():
    person = standing_person()
    places, _ = person.markers(SET)
    turn = Rotation.from_euler("xyz", [5.0, -8.0, 40.0], degrees=True)
    shift = np.array([1.0, 2.0, 0.1])
    moved = turn.apply(np.array(list(places.values()))) + shift
    walking = Recording("walk", "project", tuple(places), moved[None], 100.0)
    centres = true_centres(person)
    seen = with_centres(walking, SET.segments, places, centres)
    for name, at in centres.items():
        np.testing.assert_allclose(seen.marker(name)[0], turn.apply(at) + shift, atol=1e-9)
