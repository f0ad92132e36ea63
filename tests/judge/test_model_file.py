"""Models read from `.osim` files and posed, against OpenSim's own wheel."""

import re
from dataclasses import replace
from pathlib import Path

import numpy as np
import opensim
import osim_samples as samples
import pytest

from gaitval.errors import ModelError, RecordError
from gaitval.mocap.mot_writing import StorageTable
from gaitval.scaling.opensim.model import OsimModel
from gaitval.scaling.opensim.model_file import read_model
from gaitval.scaling.opensim.placing import centre_of_mass, marker_places, motion_of, place

opensim.Logger.setLevelString("Off")
opensim.Logger.removeFileSink()

SIX = ((0, 1, 2, 0, 0, 1), (0, 1, 2, 1, 2, 2))
"""Where a matrix has xx, yy, zz, xy, xz and yz."""
TENTH_OF_A_MM = 1e-4
KINDS = {1: "rotational", 2: "translational", 3: "coupled"}


def written(folder: Path, text: str) -> Path:
    path = folder / "model.osim"
    path.write_text(text)
    return path


def random_values(model: OsimModel, count: int = 4) -> dict[str, np.ndarray]:
    """Also beyond the ranges, where splines go straight on."""
    random = np.random.default_rng(1)
    values = {name: random.uniform(-2.0, 2.0, count) for name in model.coordinates}
    for coupler in model.couplers:
        values[coupler.dependent] = coupler.function(values[coupler.independent])
    return values


def largest_difference(path: Path) -> float:
    """m (and, of rotations, 1) between our poses and markers and the wheel's, in random poses."""
    model = read_model(path)
    values = random_values(model)
    poses = place(model, values)
    ours = marker_places(model, poses, [marker.name for marker in model.markers])
    peer = opensim.Model(str(path))
    coordinates = peer.updCoordinateSet()
    for i in range(coordinates.getSize()):
        coordinates.get(i).set_clamped(False)
        coordinates.get(i).set_locked(False)
    state = peer.initSystem()
    assert coordinates.getSize() == len(model.coordinates)
    worst = 0.0
    for frame in range(4):
        for i in range(coordinates.getSize()):
            one = coordinates.get(i)
            one.setValue(state, float(values[one.getName()][frame]), False)
            assert KINDS[one.getMotionType()] == model.coordinates[one.getName()].motion
        peer.realizePosition(state)
        for name, (rotation, origin) in poses.items():
            if name == "ground":
                continue
            found = peer.getBodySet().get(name).getTransformInGround(state)
            turn = np.array([[found.R().get(i, j) for j in range(3)] for i in range(3)])
            worst = max(worst, np.abs(origin[frame] - found.p().to_numpy()).max())
            worst = max(worst, np.abs(rotation[frame] - turn).max())
        for column, marker in enumerate(model.markers):
            theirs = peer.getMarkerSet().get(marker.name).getLocationInGround(state).to_numpy()
            worst = max(worst, np.abs(ours[frame, column] - theirs).max())
        centre = peer.calcMassCenterPosition(state).to_numpy()
        worst = max(worst, np.abs(centre_of_mass(model, poses)[frame] - centre).max())
    assert model.mass == pytest.approx(peer.getTotalMass(state), rel=1e-12)
    return worst


# ---- Against OpenSim. ----


@pytest.mark.parametrize("function", samples.FUNCTIONS)
def test_a_joint_moves_by_its_function_as_in_opensim(tmp_path, function):
    assert largest_difference(written(tmp_path, samples.version_4(function))) < 1e-12


@pytest.mark.parametrize("kind", samples.SIMPLE_JOINTS)
def test_every_kind_of_joint_moves_as_in_opensim(tmp_path, kind):
    assert largest_difference(written(tmp_path, samples.with_joint(kind))) < 1e-12


@pytest.mark.parametrize("reverse", [False, True])
def test_a_file_of_opensim_3_is_read_as_opensim_reads_it(tmp_path, reverse):
    # OpenSim rounds when it turns the file into one of version 4.
    path = written(tmp_path, samples.version_3(reverse=reverse))
    assert largest_difference(path) < 1e-9


@pytest.mark.parametrize("text", [samples.version_3(), samples.version_4()])
def test_what_a_file_leaves_out_is_as_opensim_has_it(tmp_path, text):
    """Of OpenSim 3, 1 kg m² about each axis, where we had none; coordinates from -10 to 10."""
    path = written(tmp_path, re.sub("<(inertia_zz|inertia|range)>[^<]*</[^>]*>", "", text))
    ours, peer = read_model(path), opensim.Model(str(path))
    for body in peer.getBodySet():
        six = [body.get_inertia().get(i) for i in range(6)]
        np.testing.assert_array_equal(ours.bodies[body.getName()].inertia[SIX], six)
    for one in peer.getCoordinateSet():
        assert ours.coordinates[one.getName()].range == (one.getRangeMin(), one.getRangeMax())


@pytest.mark.parametrize(
    "name",
    [
        "opensim_rajagopal/Rajagopal2016.osim",
        "opensim_rajagopal/RajagopalLaiUhlrich2023.osim",
        "wbds/raw/GenericScaledModel_sample.osim",
    ],
)
def test_markers_of_published_models_are_where_opensim_has_them(gait_data, name):
    assert len(read_model(gait_data / name).markers) > 50
    assert largest_difference(gait_data / name) < TENTH_OF_A_MM


# ---- Motions. ----


def test_only_rotational_coordinates_are_in_degrees(tmp_path):
    model = read_model(written(tmp_path, samples.version_4()))
    columns = (*(f"q{i}" for i in range(6)), "knee_angle_r", "beta_r")
    values = np.array([[10.0, 0, 0, 1.0, 2.0, 3.0, 90.0, 5.0]])
    table = StorageTable(columns, np.zeros(1), values, in_degrees=True)
    motion = motion_of(model, table, "ik.mot")
    assert motion.values["q0"][0] == pytest.approx(np.deg2rad(10.0))
    assert motion.values["q3"][0] == 1.0
    assert motion.values["knee_angle_r"][0] == pytest.approx(np.pi / 2)
    assert "hip_flexion_r" not in motion.given
    assert motion.values["hip_flexion_r"][0] == 0.0


def test_a_coupled_coordinate_follows_and_its_error_is_told(tmp_path):
    model = read_model(written(tmp_path, samples.version_4()))
    columns = (*(f"q{i}" for i in range(6)), "knee_angle_r", "beta_r")
    table = StorageTable(columns, np.zeros(1), np.array([[0.0] * 6 + [0.2, 0.5]]))
    motion = motion_of(model, table, "ik.mot")
    assert motion.values["beta_r"][0] == pytest.approx(-0.02)  # a knot of the spline
    assert motion.coupler_errors == {"beta_r": pytest.approx(0.52)}


@pytest.mark.parametrize("beta", [-0.02, np.rad2deg(-0.02)], ids=["of OpenSim 4", "of OpenSim 3.3"])
def test_a_coupled_coordinate_is_in_the_unit_that_its_numbers_show(tmp_path, beta):
    model = read_model(written(tmp_path, samples.version_4()))
    beta_r = replace(model.coordinates["beta_r"], motion="coupled")
    model = replace(model, coordinates={**model.coordinates, "beta_r": beta_r})
    columns = (*(f"q{i}" for i in range(6)), "knee_angle_r", "beta_r")
    values = np.array([[0.0] * 6 + [np.rad2deg(0.2), beta]])
    motion = motion_of(model, StorageTable(columns, np.zeros(1), values, in_degrees=True), "ik.mot")
    assert motion.coupler_errors == {"beta_r": pytest.approx(0.0, abs=1e-6)}


def test_states_have_paths_for_names(tmp_path):
    model = read_model(written(tmp_path, samples.version_4()))
    columns = (
        *(f"/jointset/ground_pelvis/q{i}/value" for i in range(6)),
        "/jointset/knee_r/knee_angle_r/value",
        "/jointset/knee_r/knee_angle_r/speed",
    )
    table = StorageTable(columns, np.zeros(1), np.array([[0.0] * 6 + [0.7, 9.0]]))
    assert motion_of(model, table, "states.sto").values["knee_angle_r"][0] == 0.7


@pytest.mark.parametrize(
    ("columns", "message"),
    [(("fish", "bird"), "none of the model's coordinates"), (("knee_angle_r",), "lacks q0")],
)
def test_a_motion_of_another_model_is_refused(tmp_path, columns, message):
    model = read_model(written(tmp_path, samples.version_4()))
    table = StorageTable(columns, np.zeros(1), np.zeros((1, len(columns))))
    with pytest.raises(RecordError, match=message):
        motion_of(model, table, "ik.mot")


# ---- What is refused. ----

SAMPLE = samples.version_4()


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("", "not XML"),
        ("<robot/>", "outermost element is <robot>"),
        (
            SAMPLE.replace(
                "<OpenSimDocument",
                '<!DOCTYPE a [<!ENTITY x SYSTEM "file:///etc/passwd">]><OpenSimDocument',
            ).replace("0.04 -0.2", "&x; -0.2"),
            "document type",
        ),
        ("<OpenSimDocument Version='40000'>" + "<a>" * 5000 + "</a>" * 5000, "in each other"),
        ('<OpenSimDocument Version="40000"><Model/></OpenSimDocument>', "no body"),
        ('<OpenSimDocument Version="40000"><Tool/></OpenSimDocument>', "no <Model>, but <Tool>"),
        (re.sub("<mass>[^<]*</mass>", "", SAMPLE), "<mass> is missing"),
        (re.sub("<mass>[^<]*</mass>", "<mass>-5</mass>", SAMPLE), "of -5 kg.* refuses it too"),
        (SAMPLE.replace("40000", "10905"), "another version"),
        (SAMPLE.replace("0.04 -0.2", "nan -0.2"), "not finite"),
        (SAMPLE.replace("0.04 -0.2", "0.04"), "must be 3 numbers"),
        (SAMPLE.replace("PinJoint", "EllipsoidJoint"), "EllipsoidJoint .*not understood"),
        (SAMPLE.replace("SimmSpline", "GCVSpline"), "GCVSpline.* not understood"),
        (SAMPLE.replace("-1 -0.3 0.2", "-1 0.2 -0.3"), "do not increase"),
        (SAMPLE.replace("<axis>0 0 2</axis>", "<axis>0 0 0</axis>"), "no length"),
        (SAMPLE.replace(">/bodyset/tibia_r<", ">/bodyset/nowhere<"), "'nowhere'"),
        (SAMPLE.replace('"knee_angle_r"', '"hip_flexion_r"'), "name of its own|one coordinate"),
        (
            SAMPLE.replace("offset_c</socket_parent", "/bodyset/tibia_r</socket_parent"),
            "no joint to",
        ),
        (SAMPLE.replace(">beta_r<", ">gamma_r<"), "must join two coordinates"),
    ],
)  # fmt: skip
def test_what_is_not_a_model_is_refused(tmp_path, text, message):
    path = written(tmp_path, text)
    with pytest.raises(ModelError, match=message) as refused:
        read_model(path)
    assert str(path) in str(refused.value)


def test_a_folder_and_a_missing_file_are_refused(tmp_path):
    with pytest.raises(ModelError, match="is a folder"):
        read_model(tmp_path)
    with pytest.raises(ModelError, match=r"no such file\. Check the path"):
        read_model(tmp_path / "none.osim")


def test_names_with_colons_are_read(tmp_path):
    """OpenSim writes HuntCrossleyForce::ContactParameters, at which ElementTree stops."""
    extra = "<ForceSet><objects><A::B name='x'><A::C/></A::B></objects></ForceSet>"
    assert read_model(written(tmp_path, samples.version_4(extra=extra))).mass > 0
