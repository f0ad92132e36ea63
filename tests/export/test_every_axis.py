"""Every axis, sign and unit of what is exported: against the body's own kinematics, against physics
and by hand, on both sides of the body.

Each format is read by a library that is not gaitval's. What only one format has is beside it.
"""

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import dartpy
import ezc3d
import mujoco
import numpy as np
import pytest
from opensim_peer import OpenSimModel

from gaitval.apps.export.c3d_file import CAMERA_STEPS, write_c3d_file
from gaitval.apps.export.walked import ExportedWalk
from gaitval.configuration import ContactSettings
from gaitval.constants import GRAVITY
from gaitval.coordinates import ACTUATED, RANGES
from gaitval.mocap.recording import FootForces, Recording
from gaitval.model.body import SEGMENTS
from gaitval.model.ground import Ground
from gaitval.model.measured_ranges import MEASURED_RANGES
from gaitval.model.tree import segment_frames
from gaitval.model.urdf import write_urdf
from gaitval.session.opensim.coordinates import TO_OPENSIM
from gaitval.session.opensim.motion import write_ground_reaction, write_markers
from gaitval.session.opensim.osim import write_osim

Frames = Callable[[np.ndarray], np.ndarray]
"""Of the joints' angles (25,) rad, the segments' frames (14, 4, 4) m."""
Ranges = dict[str, tuple[float, float]]
UNDER_LOAD_N = 200.0


def of_mujoco(walked: ExportedWalk, folder: Path) -> tuple[Frames, Ranges, np.ndarray]:
    """Of the files of a person for plain MuJoCo."""
    from gaitval.apps.export.mujoco_folder import person_xml

    model = mujoco.MjModel.from_xml_string(person_xml(walked))
    data = mujoco.MjData(model)

    def frames(angles: np.ndarray) -> np.ndarray:
        data.qpos[:] = [0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, *np.zeros(25)]
        for name, angle in zip(ACTUATED, angles, strict=True):
            data.qpos[model.joint(name).qposadr[0]] = angle
        mujoco.mj_kinematics(model, data)
        found = np.tile(np.eye(4), (len(SEGMENTS), 1, 1))
        for frame, name in zip(found, SEGMENTS, strict=True):
            frame[:3, :3] = data.body(name).xmat.reshape(3, 3)
            frame[:3, 3] = data.body(name).xpos
        return found

    ranges = {name: tuple(model.joint(name).range) for name in ACTUATED}
    return frames, ranges, model.opt.gravity


def of_urdf(walked: ExportedWalk, folder: Path) -> tuple[Frames, Ranges, None]:
    write_urdf(walked.body, folder / "person.urdf")
    skeleton = dartpy.utils.DartLoader().parseSkeleton(str(folder / "person.urdf"))

    def frames(angles: np.ndarray) -> np.ndarray:
        skeleton.resetPositions()
        for name, angle in zip(ACTUATED, angles, strict=True):
            skeleton.getDof(name).setPosition(angle)
        nodes = (skeleton.getBodyNode(name) for name in SEGMENTS)
        return np.array([each.getWorldTransform().matrix() for each in nodes])

    dofs = {name: skeleton.getDof(name) for name in ACTUATED}
    ranges = {
        name: (dof.getPositionLowerLimit(), dof.getPositionUpperLimit())
        for name, dof in dofs.items()
    }
    return frames, ranges, None  # a URDF has no gravity


def of_osim(walked: ExportedWalk, folder: Path) -> tuple[Frames, Ranges, np.ndarray]:
    write_osim(folder / "person.osim", walked.body, (), ContactSettings(), 0.8)
    peer = OpenSimModel(folder / "person.osim")

    def frames(angles: np.ndarray) -> np.ndarray:
        peer.pose(np.concatenate([np.zeros(6), angles]))
        return peer.frames()

    each = {name: peer.coordinates.get(name) for name in ACTUATED}
    ranges = {name: (of.getRangeMin(), of.getRangeMax()) for name, of in each.items()}
    return frames, ranges, peer.model.getGravity().to_numpy() @ TO_OPENSIM


BODIES_OF = {"mujoco": of_mujoco, "urdf": of_urdf, "osim": of_osim}


@pytest.fixture(scope="module", params=list(BODIES_OF))
def body(request, walked: ExportedWalk, tmp_path_factory: pytest.TempPathFactory):
    return BODIES_OF[request.param](walked, tmp_path_factory.mktemp(request.param))


def test_every_joint_turns_the_same_segments_the_same_way(walked: ExportedWalk, body) -> None:
    """One by one, which shows the axis and its sign, and all at once, which shows their order."""
    frames = body[0]
    poses = [0.3 * one for one in np.eye(len(ACTUATED))]
    poses += list(np.random.default_rng(0).uniform(-0.5, 0.5, (3, len(ACTUATED))))
    for angles in poses:
        expected = segment_frames(walked.body, np.concatenate([np.zeros(6), angles])[None])[0]
        turned = ACTUATED[int(np.argmax(np.abs(angles)))]
        np.testing.assert_allclose(frames(angles), expected, atol=1e-9, err_msg=turned)


def test_ranges_are_of_the_joint_in_its_direction_in_radians(body, request) -> None:
    # those that a person's joints are measured in, but for the walker's own file
    ranges = RANGES if request.node.callspec.params["body"] == "urdf" else MEASURED_RANGES
    assert set(body[1]) == set(ranges)
    for name, ends in ranges.items():
        assert body[1][name] == pytest.approx(ends, abs=1e-9), name


def test_gravity_pulls_down(body) -> None:
    if body[2] is not None:
        np.testing.assert_allclose(body[2], [0.0, 0.0, -GRAVITY], atol=1e-12)


@pytest.mark.slow
@pytest.mark.parametrize("name", ["mujoco", "osim"])
def test_on_a_slope_gravity_is_that_of_its_axes(name, walked: ExportedWalk, tmp_path: Path) -> None:
    """Up 10 % and to the left 4 %: every program gets the vector, in its own axes."""
    ground, before = Ground(10.0, 4.0), walked.stored.configuration
    sloped = before.record.model_copy(update={"slope": 10.0, "cross_slope": 4.0})
    there = ExportedWalk(
        replace(walked.stored, configuration=before.model_copy(update={"record": sloped}))
    )
    found = BODIES_OF[name](there, tmp_path)[2]
    np.testing.assert_allclose(found, ground.gravity, atol=1e-12)
    assert found[0] < -0.5
    assert found[1] < -0.2


# ---- Markers and forces, by hand. ----


def test_a_trc_is_in_millimetres_forward_up_and_right(tmp_path: Path) -> None:
    markers = np.array([[[1.0, 2.0, 3.0], [-0.001, -0.25, 0.5]]])
    write_markers(tmp_path / "one.trc", Recording("here", "project", ("A", "B"), markers, 100.0))
    lines = (tmp_path / "one.trc").read_text(encoding="utf-8").splitlines()
    messages = dict(zip(lines[1].split("\t"), lines[2].split("\t"), strict=True))
    assert messages["Units"] == "mm"
    assert float(messages["DataRate"]) == 100.0
    numbers = [float(each) for each in lines[-1].split("\t")[2:]]
    assert numbers == pytest.approx([1000.0, 3000.0, -2000.0, -1.0, 500.0, 250.0])


def test_the_ground_reaction_of_each_foot_is_forward_up_and_right(tmp_path: Path) -> None:
    """In N, m and Nm; a free moment that turns to the left is about OpenSim's upward axis."""
    force = np.array([[[10.0, 20.0, 700.0], [-30.0, -40.0, 300.0]]])
    point = np.array([[[0.1, -0.2, 0.0], [0.4, 0.3, 0.0]]])
    twist = np.array([[[0.0, 0.0, 5.0], [0.0, 0.0, -7.0]]])
    two = [np.repeat(each, 2, axis=0) for each in (force, point, twist)]
    known = np.ones((2, 2), dtype=bool)
    write_ground_reaction(tmp_path / "grf.mot", FootForces(100.0, 0.0, *two, known))
    names, first = (
        line.split("\t")
        for line in (tmp_path / "grf.mot").read_text(encoding="utf-8").splitlines()[6:8]
    )
    found = dict(zip(names, map(float, first), strict=True))
    expected = {
        "ground_force_r_v": (10.0, 700.0, -20.0), "ground_force_r_p": (0.1, 0.0, 0.2),
        "ground_torque_r_": (0.0, 5.0, 0.0), "ground_force_l_v": (-30.0, 300.0, 40.0),
        "ground_force_l_p": (0.4, 0.0, -0.3), "ground_torque_l_": (0.0, -7.0, 0.0),
    }  # fmt: skip
    for name, values in expected.items():
        assert [found[name + axis] for axis in "xyz"] == pytest.approx(values), name


# ---- The C3D file, as ezc3d reads its plates. ----

BEGINS_AT = {
    "HJC": "thigh", "KJC": "shank", "AJC": "foot", "MTP": "toes", "SJC": "upper_arm",
    "EJC": "forearm",
}  # fmt: skip
"""The segment whose origin is a joint's centre."""


@pytest.fixture(scope="module")
def c3d(walked: ExportedWalk, tmp_path_factory: pytest.TempPathFactory) -> dict:
    (path,) = write_c3d_file(tmp_path_factory.mktemp("c3d"), walked)
    return ezc3d.c3d(str(path), extract_forceplat_data=True)


def test_c3d_says_its_units_and_has_joints_in_millimetres(walked: ExportedWalk, c3d: dict) -> None:
    points = c3d["parameters"]["POINT"]
    assert points["UNITS"]["value"] == ["mm"]
    assert c3d["parameters"]["ANALOG"]["UNITS"]["value"] == (["N"] * 3 + ["Nmm"] * 3) * 2
    step = walked.walk.time[1] - walked.walk.time[0]
    assert c3d["parameters"]["ANALOG"]["RATE"]["value"] == pytest.approx([1.0 / step])
    assert points["RATE"]["value"] == pytest.approx([1.0 / step / CAMERA_STEPS])
    shown = walked.walk.positions[walked.rows][::CAMERA_STEPS]
    frames = segment_frames(walked.body, shown)[: c3d["data"]["points"].shape[2]]
    sided = {f"{side}{name}": f"{segment}_{side.lower()}" for side in "RL"
             for name, segment in BEGINS_AT.items()}  # fmt: skip
    for name, segment in (sided | {"LUMBAR": "torso", "MIDHIP": "pelvis"}).items():
        seen = c3d["data"]["points"][:3, points["LABELS"]["value"].index(name)].T
        expected = 1e3 * frames[: len(seen), SEGMENTS.index(segment), :3, 3]
        np.testing.assert_allclose(seen, expected, atol=2e-3, err_msg=name)


def test_markers_of_a_joint_are_on_its_side(walked: ExportedWalk, c3d: dict) -> None:
    """And each below the joint above it, in the mean of a walk forward."""
    labels = c3d["parameters"]["POINT"]["LABELS"]["value"]
    mean = {name: c3d["data"]["points"][:3, labels.index(name)].mean(axis=1) for name in labels}
    for name in BEGINS_AT:
        assert mean[f"L{name}"][1] > mean["MIDHIP"][1] > mean[f"R{name}"][1], name
    for side in "RL":
        heights = [mean[f"{side}{name}"][2] for name in ("SJC", "EJC", "HJC", "KJC", "AJC", "MTP")]
        assert (np.diff(heights) < 0.0).all()


@pytest.mark.parametrize("column", [0, 1])
def test_ezc3d_finds_force_centre_of_pressure_and_twist_of_each_foot(
    walked: ExportedWalk, c3d: dict, column: int
) -> None:
    from gaitval.apps.export.opensim_folder import foot_forces

    plate, expected = c3d["data"]["platform"][column], foot_forces(walked)
    assert (plate["unit_force"], plate["unit_moment"], plate["unit_position"]) == ("N", "Nmm", "mm")
    count = plate["force"].shape[1]
    force = expected.force[:count, column]
    on = force[:, 2] > UNDER_LOAD_N
    np.testing.assert_allclose(plate["force"].T[on], force[on], atol=0.01)
    point = 1e3 * expected.centre_of_pressure[:count, column]
    np.testing.assert_allclose(plate["center_of_pressure"].T[on], point[on], atol=0.1)
    twist = 1e3 * expected.free_moment[:count, column]
    np.testing.assert_allclose(plate["Tz"].T[on], twist[on], atol=20.0)
    assert np.abs(twist[on, 2]).max() > 1000.0


def test_the_plates_carry_the_person_and_each_lies_under_its_foot(
    walked: ExportedWalk, c3d: dict
) -> None:
    """Newton over whole strides: the weight upwards and nothing else; the feet push apart."""
    plates = c3d["data"]["platform"]
    total = sum(each["force"] for each in plates).mean(axis=1)
    weight = walked.stored.subject.mass_kg * GRAVITY
    np.testing.assert_allclose(total / weight, [0.0, 0.0, 1.0], atol=0.02)
    labels = c3d["parameters"]["POINT"]["LABELS"]["value"]
    for plate, side, inward in zip(plates, "RL", (1.0, -1.0), strict=True):
        up = plate["force"][2, ::CAMERA_STEPS]
        on = up > UNDER_LOAD_N
        assert inward * plate["force"][1, ::CAMERA_STEPS][on].mean() > 0.0
        toes = c3d["data"]["points"][:3, labels.index(f"{side}MTP")]
        away = (plate["center_of_pressure"][:, ::CAMERA_STEPS] - toes)[:2, on]
        assert np.abs(away[1]).max() < 80.0  # mm, across
        assert -260.0 < away[0].min() < away[0].max() < 100.0  # from the heel to the toes
