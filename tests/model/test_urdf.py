from dataclasses import replace

import dartpy
import numpy as np
import pytest
import yourdfpy

from gaitval.coordinates import ACTUATED
from gaitval.errors import ModelError
from gaitval.model.body import SEGMENTS, BodyModel, Segment
from gaitval.model.ground import Ground
from gaitval.model.urdf import model_hash, read_urdf, template_folder, write_urdf
from gaitval.scaling.scaling import scale_subject
from gaitval.subjects.subject_file import BUILTIN, load_subject


@pytest.fixture(scope="module")
def model():
    return scale_subject(load_subject("S05")).model


@pytest.fixture(scope="module")
def path(model, tmp_path_factory):
    path = tmp_path_factory.mktemp("urdf") / "model.urdf"
    write_urdf(model, path)
    return path


@pytest.fixture(scope="module")
def skeleton(path):
    return dartpy.utils.DartLoader().parseSkeleton(str(path))


@pytest.fixture(scope="module")
def robot(path):
    return yourdfpy.URDF.load(str(path))


def changed(path, tmp_path, old, new):
    """A copy of the URDF with one piece of text replaced."""
    text = path.read_text()
    assert old in text
    copy = tmp_path / "changed.urdf"
    copy.write_text(text.replace(old, new, 1))
    return copy


def assert_equal(first, second):
    assert first.name == second.name
    for a, b in zip(first.segments, second.segments, strict=True):
        assert (a.name, a.mass) == (b.name, b.mass)
        np.testing.assert_array_equal(a.joint_position, b.joint_position)
        np.testing.assert_array_equal(a.centre_of_mass, b.centre_of_mass)
        np.testing.assert_array_equal(a.inertia, b.inertia)
    for a, b in zip(first.spheres, second.spheres, strict=True):
        assert (a.name, a.segment, a.radius) == (b.name, b.segment, b.radius)
        np.testing.assert_array_equal(a.position, b.position)


@pytest.mark.parametrize("identifier", list(BUILTIN))
def test_a_model_survives_writing_and_reading_bit_for_bit(identifier, tmp_path):
    model = scale_subject(load_subject(identifier)).model
    write_urdf(model, tmp_path / "model.urdf")
    assert_equal(read_urdf(tmp_path / "model.urdf"), model)


@pytest.mark.parametrize("name", ["$(find x)", "${1+1}", "a\nb", 'a"b', "a\\b", "a#ü b"])
def test_a_folder_s_name_is_never_evaluated(model, tmp_path, name):
    folder = tmp_path / name
    folder.mkdir()
    write_urdf(model, folder / "model.urdf")
    assert model_hash(read_urdf(folder / "model.urdf")) == model_hash(model)
    assert [path.name for path in folder.iterdir()] == ["model.urdf"]


def test_a_folder_may_have_an_apostrophe(model, tmp_path):
    folder = tmp_path / "the dean's"
    folder.mkdir()
    write_urdf(model, folder / "model.urdf")
    assert read_urdf(folder / "model.urdf").name == model.name


def test_equal_models_give_equal_files_without_traces_of_the_machine(model, path, tmp_path):
    write_urdf(model, tmp_path / "again.urdf")
    assert (tmp_path / "again.urdf").read_bytes() == path.read_bytes()
    assert str(template_folder()) not in path.read_text()


def test_dart_finds_thirty_one_degrees_of_freedom_and_the_whole_mass(skeleton, model):
    names = {skeleton.getDof(index).getName() for index in range(skeleton.getNumDofs())}
    assert skeleton.getNumDofs() == 31
    assert set(ACTUATED) <= names
    assert skeleton.getMass() == pytest.approx(model.mass, abs=1e-12)


def test_dart_and_yourdfpy_agree_on_mass_centre_and_inertia(skeleton, robot, model):
    for name, link in robot.link_map.items():
        inertia = skeleton.getBodyNode(name).getInertia()
        assert inertia.getMass() == link.inertial.mass
        np.testing.assert_allclose(inertia.getMoment(), link.inertial.inertia, atol=1e-15)
        if name in SEGMENTS:
            np.testing.assert_array_equal(inertia.getLocalCOM(), link.inertial.origin[:3, 3])
    assert sum(link.inertial.mass for link in robot.link_map.values()) == pytest.approx(
        model.mass, abs=1e-12
    )


@pytest.mark.parametrize("seed", range(5))
def test_dart_and_yourdfpy_agree_on_kinematics(skeleton, robot, model, seed):
    rng = np.random.default_rng(seed)
    pose = {
        joint.name: rng.uniform(joint.limit.lower, joint.limit.upper)
        for joint in robot.robot.joints
    }
    robot.update_cfg(pose)
    for name, angle in pose.items():
        skeleton.getDof(name).setPosition(angle)
    pelvis = skeleton.getBodyNode("pelvis").getWorldTransform().matrix()
    centre = np.zeros(3)
    for name, link in robot.link_map.items():
        expected = skeleton.getBodyNode(name).getWorldTransform().matrix()
        seen = pelvis @ robot.get_transform(name, "pelvis")
        np.testing.assert_allclose(seen, expected, atol=1e-9)
        if name in SEGMENTS:
            place = seen @ [*model[name].centre_of_mass, 1.0]
            centre += link.inertial.mass * place[:3] / model.mass
    np.testing.assert_allclose(skeleton.getCOM(), centre, atol=1e-9)


# Coordinate; segment and point of it that moves; direction in which it moves (the point's
# displacement along an axis is positive). Left coordinates mirror the right ones.
POSITIVE_DIRECTIONS = [
    ("hip_flexion_r", "thigh_r", (0, 0, -0.3), (1, 0, 0)),
    ("hip_adduction_r", "thigh_r", (0, 0, -0.3), (0, 1, 0)),
    ("hip_rotation_r", "thigh_r", (0.3, 0, 0), (0, 1, 0)),
    ("knee_angle_r", "shank_r", (0, 0, -0.3), (-1, 0, 0)),
    ("ankle_angle_r", "foot_r", (0.2, 0, 0), (0, 0, 1)),
    ("subtalar_angle_r", "foot_r", (0, 0, -0.1), (0, 1, 0)),
    ("mtp_angle_r", "toes_r", (0.1, 0, 0), (0, 0, 1)),
    ("lumbar_extension", "torso", (0, 0, 0.3), (-1, 0, 0)),
    ("lumbar_bending", "torso", (0, 0, 0.3), (0, -1, 0)),
    ("lumbar_rotation", "torso", (0.3, 0, 0), (0, 1, 0)),
    ("arm_flex_r", "upper_arm_r", (0, 0, -0.3), (1, 0, 0)),
    ("arm_add_r", "upper_arm_r", (0, 0, -0.3), (0, 1, 0)),
    ("arm_rot_r", "upper_arm_r", (0.3, 0, 0), (0, 1, 0)),
    ("elbow_flex_r", "forearm_r", (0, 0, -0.3), (1, 0, 0)),
]
MIRRORED_DIRECTIONS = [
    (name[:-1] + "l", segment[:-1] + "l", point, (x, -y, z))
    for name, segment, point, (x, y, z) in POSITIVE_DIRECTIONS
    if name.endswith("_r")
]


@pytest.mark.parametrize(
    ("name", "segment", "point", "direction"), POSITIVE_DIRECTIONS + MIRRORED_DIRECTIONS
)
def test_positive_angles_move_as_the_coordinates_say(skeleton, name, segment, point, direction):
    skeleton.resetPositions()
    body = skeleton.getBodyNode(segment)
    before = body.getWorldTransform().matrix() @ [*point, 1.0]
    skeleton.getDof(name).setPosition(0.1)
    after = body.getWorldTransform().matrix() @ [*point, 1.0]
    skeleton.resetPositions()
    assert (after - before)[:3] @ direction > 0.005


def test_every_segment_is_drawn(robot):
    for name in SEGMENTS:
        assert robot.link_map[name].visuals
    drawn = {visual.name for link in robot.link_map.values() for visual in link.visuals}
    assert {"head", "hand_r", "hand_l"} <= drawn


def test_the_ground_is_part_of_the_file_and_of_the_hash(model, path, tmp_path):
    """Level ground leaves no trace, so files and hashes of before stay as they are."""
    assert "<ground" not in path.read_text("utf-8")
    sloped = replace(model, ground=Ground(5.0, -2.5))
    write_urdf(sloped, tmp_path / "sloped.urdf")
    again = read_urdf(tmp_path / "sloped.urdf")
    assert again.ground == Ground(5.0, -2.5)
    assert (
        len({model_hash(each) for each in (model, sloped, replace(model, ground=Ground(5.0)))}) == 3
    )
    assert model_hash(again) == model_hash(sloped)
    broken = (tmp_path / "sloped.urdf").read_text("utf-8").replace('slope="5.0"', 'slope="nan"')
    (tmp_path / "sloped.urdf").write_text(broken, "utf-8")
    with pytest.raises(ModelError, match=r"ground.*not finite"):
        read_urdf(tmp_path / "sloped.urdf")


def test_the_hash_is_of_the_numbers(model, path):
    assert model_hash(read_urdf(path)) == model_hash(model)
    renamed = BodyModel("other", model.segments, model.spheres)
    assert model_hash(renamed) == model_hash(model)

    def with_mass(mass):
        first = model.segments[0]
        heavier = Segment(
            first.name, first.joint_position, mass, first.centre_of_mass, first.inertia
        )
        return BodyModel(model.name, (heavier, *model.segments[1:]), model.spheres)

    assert model_hash(with_mass(model["pelvis"].mass + 1e-3)) != model_hash(model)
    # The last bit may differ between processors.
    assert model_hash(with_mass(np.nextafter(model["pelvis"].mass, 9.0))) == model_hash(model)


def test_a_name_that_xacro_could_evaluate_is_refused(model, tmp_path):
    for name in ("${1+1}", "$(env HOME)", "<x>", ""):
        with pytest.raises(ModelError, match="cannot be used in a URDF"):
            write_urdf(BodyModel(name, model.segments, model.spheres), tmp_path / "model.urdf")


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        ('<link name="thigh_r">', '<link name="thigh">', "link thigh_r: missing"),
        ('name="knee_angle_r"', 'name="knee"', "joint knee_angle_r: missing"),
        (
            '<axis xyz="0.0 1.0 0.0"/>',
            '<axis xyz="0.0 -1.0 0.0"/>',
            r"joint knee_angle_r: axis .*not \(0, 1, 0\)",
        ),
        ('type="revolute"', 'type="fixed"', "hip_flexion_r: fixed, not revolute"),
        ('<parent link="thigh_r"/>', '<parent link="thigh_l"/>', "knee_angle_r: lead from thigh_l"),
        ('<origin xyz="0 0 0"/>', '<origin xyz="0 0 0.1"/>', "hip_adduction_r: moved away"),
        ('<origin xyz="0 0 0"/>', '<origin xyz="0 0 0" rpy="1 0 0"/>', "hip_adduction_r: rotated"),
        ('<mass value="0"/>', '<mass value="1"/>', "link thigh_r_flexion: has mass"),
        ('<mass value="8', '<mass value="-8', "link pelvis: mass -8"),
        ('<mass value="8', '<mass value="nan" was="8', "link pelvis: numbers that are not finite"),
        ('<inertia ixx="0.0', '<inertia ixx="9.0', "link pelvis: principal moments"),
        ('<sphere radius="0.02"/>', '<box size="1 1 1"/>', "link foot_r: a <collision>"),
        ('<sphere radius="0.02"/>', '<sphere radius="0"/>', "contact_heel_r: position or radius"),
        ("</robot>", "", "not XML"),
        ("<robot", "<!DOCTYPE robot><robot", "document type"),
        (
            "<robot",
            '<!DOCTYPE robot [<!ENTITY x SYSTEM "file:///etc/passwd">]><robot',
            "document type",
        ),
        ('<box size="', '<mesh filename="../../x.stl" size="', "mesh"),
        ('<mass value="8', '<mass value="eight', "cannot be read as URDF"),
    ],
)
def test_another_urdf_is_refused_with_the_place(path, tmp_path, old, new, message):
    with pytest.raises(ModelError, match=message):
        read_urdf(changed(path, tmp_path, old, new))


def test_a_missing_file_is_refused(tmp_path):
    with pytest.raises(ModelError, match=r"no such file\. Check the path"):
        read_urdf(tmp_path / "none.urdf")
