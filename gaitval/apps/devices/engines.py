"""The body with devices in four programs: its mass, centre, inertia and energy in a motion.

`compiled` has the parts merged into the segments (`composite`). yourdfpy, DART and MuJoCo read the
URDF file in which every part is a link of its own (`device_urdf`) and weld it themselves.
"""

import io
import xml.etree.ElementTree as ElementTree
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any, Final, NamedTuple

import numpy as np
from scipy.spatial.transform import Rotation

from gaitval import file_gate
from gaitval.arrays import Array
from gaitval.coordinates import ACTUATED, COORDINATES
from gaitval.errors import ModelError
from gaitval.model.body import SEGMENTS, BodyModel
from gaitval.model.devices.composite import fitted, united
from gaitval.model.devices.device import Device
from gaitval.model.devices.device_urdf import write_device_urdf
from gaitval.model.safe_xml import parse_xml
from gaitval.model.tree import (
    ACTUATED_COUNT,
    COORDINATE_COUNT,
    DOF_COUNT,
    FIRST_DOF,
    PARENT,
    SEGMENT_COUNT,
    Tree,
    empty_frames,
    forward,
    tree_arrays,
    velocities,
)
from gaitval.model.urdf import LARGEST_FILE
from gaitval.simulation.dynamics import accelerations, dynamics_workspace, integrate

MASSLESS: Final = "1e-12"
"""kg and kg m²: MuJoCo takes no body without mass. The links between coordinates get this."""


class Whole(NamedTuple):
    """The whole body in T states; world axes.

    Attributes
    ----------
    mass : kg.
    centre : (T, 3) m, centre of mass.
    inertia : (T, 3, 3) kg m², about it.
    energy : (T,) J, of the motion of all parts.
    """

    mass: float
    centre: Array
    inertia: Array
    energy: Array


def passive_motion(
    model: BodyModel, *, seed: int, seconds: float = 10.0, step: float = 0.002, rows: int = 51
) -> tuple[Array, Array]:
    """Positions and velocities (rows, 31) of a `model` that flies with loose joints, without
    gravity, from a random state. Its joints have dampers of 0.5 Nms/rad.
    """
    tree, frames = tree_arrays(model), empty_frames()
    work, forces = dynamics_workspace(), np.zeros(COORDINATE_COUNT)
    random = np.random.default_rng(seed)
    state = np.zeros((2, COORDINATE_COUNT))
    state[0, 6:] = random.uniform(-0.3, 0.3, ACTUATED_COUNT)
    state[0, :3] = random.uniform(-0.3, 0.3, 3)
    state[1] = random.uniform(-1.0, 1.0, COORDINATE_COUNT)
    stiffness, damping = np.zeros(ACTUATED_COUNT), np.full(ACTUATED_COUNT, 0.5)
    found, acceleration = [state.copy()], np.empty(COORDINATE_COUNT)
    for _ in range(rows - 1):
        for _ in range(round(seconds / step / (rows - 1))):
            forward(tree.joint_position, state[0], frames, SEGMENT_COUNT)
            velocities(state[1], frames, SEGMENT_COUNT)
            _without_weight(tree, frames, forces)
            accelerations(tree, frames, state, forces, stiffness, damping, step, work, acceleration)
            integrate(state, acceleration, step)
        found.append(state.copy())
    positions, rates = np.array(found).transpose(1, 0, 2)
    return positions, rates


def _without_weight(tree: Tree, frames: Any, forces: Array) -> None:
    """Generalised `forces` (31,) that carry each segment's weight, so that nothing falls."""
    place = frames.origin + np.einsum("sij,sj->si", frames.rotation, tree.centre_of_mass)
    forces[:] = 0.0
    for s in range(SEGMENT_COUNT):
        force = -tree.mass[s] * tree.gravity
        forces[3:6] += force
        forces[0:3] += np.cross(place[s] - frames.origin[0], force)
        at = s
        while at > 0:
            moment = np.cross(place[s] - frames.origin[at], force)
            for d in range(FIRST_DOF[at], FIRST_DOF[at] + DOF_COUNT[at]):
                forces[d] += frames.axes[d] @ moment
            at = PARENT[at]


def _compiled(
    model: BodyModel, devices: Sequence[Device], _: Path, positions: Array, rates: Array
) -> Whole:
    body = fitted(model, devices)
    tree, frames = tree_arrays(body), empty_frames()
    centres, inertias, energies = [], [], []
    for q, qd in zip(positions, rates, strict=True):
        forward(tree.joint_position, q, frames, SEGMENT_COUNT)
        velocities(qd, frames, SEGMENT_COUNT)
        arm = np.einsum("sij,sj->si", frames.rotation, tree.centre_of_mass)
        turned = frames.rotation @ tree.inertia @ frames.rotation.transpose(0, 2, 1)
        speed = frames.linear + np.cross(frames.angular, arm)
        _mass, centre, inertia = united(tree.mass, frames.origin + arm, turned)
        spin = np.einsum("si,sij,sj->", frames.angular, turned, frames.angular)
        centres.append(centre)
        inertias.append(inertia)
        energies.append(0.5 * (tree.mass @ (speed**2).sum(axis=1) + spin))
    return Whole(body.mass, np.array(centres), np.array(inertias), np.array(energies))


def _moved(q: Array, qd: Array, time: float) -> Array:
    """The state a `time` s later along its velocity; the root's is an angular velocity."""
    later = q + time * qd
    turn = Rotation.from_rotvec(time * qd[:3]) * Rotation.from_rotvec(q[:3])
    later[:3] = turn.as_rotvec()
    return later


def _yourdfpy(
    _: BodyModel, __: Sequence[Device], path: Path, positions: Array, rates: Array
) -> Whole:
    import yourdfpy

    content = file_gate.read_bytes(path, ModelError, largest=LARGEST_FILE)
    robot = yourdfpy.URDF.load(io.BytesIO(content), load_meshes=False, build_scene_graph=True)
    links = [link for link in robot.robot.links if link.inertial and link.inertial.mass > 0.0]
    masses = [float(link.inertial.mass) for link in links]
    times = 2e-3 * np.array([-2.0, -1.0, 1.0, 2.0])

    def frames(q: Array) -> Array:
        robot.update_cfg(dict(zip(ACTUATED, q[6:], strict=True)))
        pelvis = np.eye(4)
        pelvis[:3, :3], pelvis[:3, 3] = Rotation.from_rotvec(q[:3]).as_matrix(), q[3:6]
        return np.array(
            [pelvis @ robot.get_transform(each.name, "pelvis") @ _origin(each) for each in links]
        )

    centres, inertias, energies = [], [], []
    for q, qd in zip(positions, rates, strict=True):
        now, *around = (frames(_moved(q, qd, t)) for t in (0.0, *times))
        turned = np.array(
            [
                f[:3, :3] @ link.inertial.inertia @ f[:3, :3].T
                for f, link in zip(now, links, strict=True)
            ]
        )
        # yourdfpy knows no velocities: differences of fourth order, of places and of rotations from
        # now on, far enough apart for its rounding (1e-9).
        weights = np.array([1.0, -8.0, 8.0, -1.0]) / (12.0 * times[2])
        speed = np.einsum("t,tsi->si", weights, [f[:, :3, 3] for f in around])
        turns = [
            Rotation.from_matrix(f[:, :3, :3] @ now[:, :3, :3].transpose(0, 2, 1)).as_rotvec()
            for f in around
        ]
        spin = np.einsum("t,tsi->si", weights, turns)
        _mass, centre, inertia = united(masses, now[:, :3, 3], turned)
        centres.append(centre)
        inertias.append(inertia)
        turning = np.einsum("si,sij,sj->", spin, turned, spin)
        energies.append(0.5 * (np.array(masses) @ (speed**2).sum(axis=1) + turning))
    return Whole(sum(masses), np.array(centres), np.array(inertias), np.array(energies))


def _origin(link: Any) -> Array:
    found: Array = np.eye(4) if link.inertial.origin is None else link.inertial.origin
    return found


def _dart(_: BodyModel, __: Sequence[Device], path: Path, positions: Array, rates: Array) -> Whole:
    import dartpy

    skeleton = dartpy.utils.DartLoader().parseSkeleton(str(path))
    names = [skeleton.getDof(i).getName() for i in range(skeleton.getNumDofs())]
    # The loader's root has names of its own; its six come first, in the project's order.
    order = [*range(6), *(COORDINATES.index(name) for name in names[6:])]
    nodes = [skeleton.getBodyNode(i) for i in range(skeleton.getNumBodyNodes())]
    nodes = [node for node in nodes if node.getMass() > 0.0]
    centres, inertias, energies = [], [], []
    for q, qd in zip(positions, rates, strict=True):
        skeleton.setPositions(q[order])
        skeleton.setVelocities(qd[order])
        turned = []
        for node in nodes:
            rotation = node.getWorldTransform().matrix()[:3, :3]
            turned.append(rotation @ node.getInertia().getMoment() @ rotation.T)
        _mass, _centre, inertia = united(
            [node.getMass() for node in nodes], [node.getCOM() for node in nodes], turned
        )
        centres.append(skeleton.getCOM())
        inertias.append(inertia)
        energies.append(skeleton.computeKineticEnergy())
    return Whole(skeleton.getMass(), np.array(centres), np.array(inertias), np.array(energies))


def _mujoco(
    _: BodyModel, __: Sequence[Device], path: Path, positions: Array, rates: Array
) -> Whole:
    import mujoco

    content = file_gate.read_bytes(path, ModelError, largest=LARGEST_FILE)
    robot = parse_xml(path, content, root="robot", kind="a URDF")
    # MuJoCo fixes a URDF's root to the world; here it floats.
    ElementTree.SubElement(robot, "link", name="world")
    joint = ElementTree.SubElement(robot, "joint", name="root", type="floating")
    ElementTree.SubElement(joint, "parent", link="world")
    ElementTree.SubElement(joint, "child", link=SEGMENTS[0])
    extension = ElementTree.SubElement(robot, "mujoco")
    ElementTree.SubElement(
        extension, "compiler", fusestatic="false", discardvisual="true",
        boundmass=MASSLESS, boundinertia=MASSLESS,
    )  # fmt: skip
    model = mujoco.MjModel.from_xml_string(ElementTree.tostring(robot, encoding="unicode"))
    model.opt.enableflags |= mujoco.mjtEnableBit.mjENBL_ENERGY
    data = mujoco.MjData(model)
    joints = [model.joint(name) for name in ACTUATED]
    places = [each.qposadr[0] for each in joints]
    turns = [each.dofadr[0] for each in joints]
    root = model.joint("root")
    start, first = root.qposadr[0], root.dofadr[0]
    centres, inertias, energies = [], [], []
    for q, qd in zip(positions, rates, strict=True):
        rotation = Rotation.from_rotvec(q[:3])
        data.qpos[start : start + 3] = q[3:6]
        data.qpos[start + 3 : start + 7] = rotation.as_quat(scalar_first=True)
        data.qpos[places] = q[6:]
        data.qvel[first : first + 3] = qd[3:6]
        data.qvel[first + 3 : first + 6] = rotation.inv().apply(qd[:3])
        data.qvel[turns] = qd[6:]
        mujoco.mj_forward(model, data)
        frames = data.ximat.reshape(-1, 3, 3)[1:]
        turned = np.einsum("sij,sj,skj->sik", frames, model.body_inertia[1:], frames)
        _mass, _centre, inertia = united(model.body_mass[1:], data.xipos[1:], turned)
        centres.append(data.subtree_com[1].copy())
        inertias.append(inertia)
        energies.append(float(data.energy[1]))
    mass = float(model.body_subtreemass[1])
    return Whole(mass, np.array(centres), np.array(inertias), np.array(energies))


Reader = Callable[[BodyModel, Sequence[Device], Path, Array, Array], Whole]
ENGINES: Final[Mapping[str, Reader]] = {
    "compiled": _compiled,
    "yourdfpy": _yourdfpy,
    "DART": _dart,
    "MuJoCo": _mujoco,
}


def in_engines(
    model: BodyModel,
    devices: Sequence[Device],
    folder: Path,
    *,
    seed: int = 0,
    seconds: float = 10.0,
    rows: int = 51,
) -> dict[str, Whole]:
    """The person `model` with `devices` in every program, over `seconds` of passive motion, of
    which as many states as `rows` are compared. `folder` receives `device.urdf`; `seed` is of the
    state that the motion starts from.
    """
    path = Path(folder) / "device.urdf"
    write_device_urdf(model, devices, path)
    motion = passive_motion(fitted(model, devices), seed=seed, seconds=seconds, rows=rows)
    return {name: read(model, devices, path, *motion) for name, read in ENGINES.items()}


def differences(found: Mapping[str, Whole]) -> dict[str, float]:
    """Largest difference of any program from the compiled engine, relative: of the mass; of the
    centre, in parts of the body's radius of gyration; of the inertia and of the energy, each in
    parts of its largest value.
    """
    ours = found["compiled"]
    radius = np.sqrt(np.trace(ours.inertia[0]) / 2.0 / ours.mass)
    scale = {
        "mass": ours.mass,
        "centre": float(radius),
        "inertia": float(np.abs(ours.inertia).max()),
        "energy": float(ours.energy.max()),
    }
    return {
        name: max(
            float(np.max(np.abs(np.asarray(getattr(each, name)) - getattr(ours, name)))) / size
            for each in found.values()
        )
        for name, size in scale.items()
    }
