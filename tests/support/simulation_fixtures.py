"""Peers, poses and simple bodies that the tests of kinematics, simulation and policy share."""

from collections.abc import Mapping
from dataclasses import replace
from functools import cache
from pathlib import Path
from typing import Any

import dartpy
import mujoco
import numpy as np

from gaitval.configuration import Configuration, ContactSettings
from gaitval.coordinates import ACTUATED, COORDINATES, ROOT, SIDES, mirrored
from gaitval.gait.record import GaitRecord, PeriodicCurve
from gaitval.kinetics.inverse.newton_euler import empty_dynamics, newton_euler
from gaitval.model.body import SEGMENTS, BodyModel, ContactSphere, Segment
from gaitval.model.tree import (
    Frames,
    empty_frames,
    forward,
    tree_arrays,
    velocities,
    whole_body_centre_of_mass,
)
from gaitval.model.urdf import model_hash, write_urdf
from gaitval.policy.environment import action_size
from gaitval.policy.observation import OBSERVATION_SIZES
from gaitval.policy.storage import NETWORK, Policy
from gaitval.scaling.scaling import scale_subject
from gaitval.subjects.subject_file import load_subject
from gaitval.walk.reference.motion import END_EFFECTORS, ReferenceMotion
from gaitval.walk.simulation.mujoco_body import MujocoBody
from gaitval.walk.simulation.walker import WalkingTask

GRAVITY = 9.81

PREDSIM = ContactSettings(
    stiffness=1e6,
    dissipation=2.0,
    dynamic_to_static=1.0,
    viscous_friction=0.5,
    transition_velocity=0.2,
)
"""Published by Falisse et al. 2022 for spheres of 32 mm; whatever the default is."""


def random_state(seed: int) -> tuple[np.ndarray, np.ndarray]:
    """Positions and velocities (31,) far from any gait, but with the root's rotation below 180
    degrees, where its rotation vector is unique."""
    random = np.random.default_rng(seed)
    q = random.uniform(-1.2, 1.2, 31)
    turn = random.standard_normal(3)
    q[:3] = turn / np.linalg.norm(turn) * random.uniform(0.0, 3.0)
    q[3:6] = random.uniform(-2.0, 2.0, 3)
    return q, random.uniform(-5.0, 5.0, 31)


def standing_moments(model: BodyModel, q: np.ndarray, column: int, place: Any) -> np.ndarray:
    """Generalised forces (31,) of a body at rest at `q` (31,) with its weight on the right (0) or
    left (1) foot, by inverse dynamics; the force is vertical and acts at `place` (3,), m."""
    tree, still = tree_arrays(model), np.zeros(31)
    force, point = np.zeros((2, 3)), np.full((2, 3), np.nan)
    force[column] = [0.0, 0.0, model.mass * GRAVITY]
    point[column] = place
    out = np.empty(31)
    newton_euler(
        tree, q, still, still, force, point, np.zeros((2, 3)), empty_dynamics(), out,
    )  # fmt: skip
    return out


class DartPeer:
    """The skeleton that DART's own URDF loader makes: one-axis joints with massless links
    between them. Arrays go in and out in the order of `coordinates.COORDINATES`."""

    def __init__(self, model: BodyModel, folder: Path) -> None:
        path = folder / "model.urdf"
        write_urdf(model, path)
        self.path = path
        self.skeleton = dartpy.utils.DartLoader().parseSkeleton(str(path))
        names = [self.skeleton.getDof(i).getName() for i in range(31)]
        root = [f"rootJoint_{kind}_{axis}" for kind in ("rot", "pos") for axis in "xyz"]
        self.order = np.array([names.index(name) for name in (*root, *ACTUATED)])

    def _sorted(self, values: np.ndarray) -> np.ndarray:
        mixed = np.empty(31)
        mixed[self.order] = values
        return mixed

    def set(self, q: np.ndarray, qd: np.ndarray | None = None) -> None:
        self.skeleton.setPositions(self._sorted(q))
        self.skeleton.setVelocities(self._sorted(np.zeros(31) if qd is None else qd))

    def mass_matrix(self) -> np.ndarray:
        return self.skeleton.getMassMatrix()[np.ix_(self.order, self.order)]

    def bias_forces(self) -> np.ndarray:
        return self.skeleton.getCoriolisAndGravityForces()[self.order]

    def accelerations(self, forces: np.ndarray) -> np.ndarray:
        self.skeleton.setForces(self._sorted(forces))
        self.skeleton.computeForwardDynamics()
        return self.skeleton.getAccelerations()[self.order]

    def set_accelerations(self, qdd: np.ndarray) -> None:
        self.skeleton.setAccelerations(self._sorted(qdd))

    def body(self, name: str) -> Any:
        return self.skeleton.getBodyNode(name)

    def point_jacobian(self, segment: str, place: np.ndarray) -> np.ndarray:
        """(3, 31) of the world velocity of the segment's material point now at `place`."""
        body = self.body(segment)
        local = np.linalg.inv(body.getWorldTransform().matrix()) @ [*place, 1.0]
        return self.skeleton.getLinearJacobian(body, local[:3])[:, self.order]


def inverse_dynamics(peer: DartPeer, q: np.ndarray, qd: np.ndarray, after: np.ndarray, step: float):
    """Generalised forces (31,) that turn velocities `qd` into `after` in one semi-implicit
    Euler step: M(q) (after - qd) / step + C(q, qd) q̇ + g(q)."""
    peer.set(q, qd)
    return peer.mass_matrix() @ (after - qd) / step + peer.bias_forces()


def kinematics(model: BodyModel, q: np.ndarray, qd: np.ndarray, segments: int = 14) -> Frames:
    """All outputs of the compiled forward kinematics at one state."""
    frames = empty_frames()
    forward(tree_arrays(model).joint_position, q, frames, segments)
    velocities(qd, frames, segments)
    return frames


@cache
def task_of_subject(name: str) -> WalkingTask:
    """The walking task of a built-in subject; its reference takes seconds to fit."""
    subject = load_subject(name)
    return WalkingTask.of(scale_subject(subject).model, subject.record(), Configuration())


def changed(task: WalkingTask, **sections: Mapping[str, Any]) -> WalkingTask:
    """The task with some constants changed, the reference as it is:
    `changed(task, environment={"observation": "paper"})`."""
    values = task.configuration.model_dump()
    for section, settings in sections.items():
        values[section] |= settings
    return replace(task, configuration=Configuration.model_validate(values))


def constant_reference(model: BodyModel, q: np.ndarray) -> ReferenceMotion:
    """A reference that stays at one pose."""
    tree = tree_arrays(model)
    frames = kinematics(model, q, np.zeros(31))
    com = whole_body_centre_of_mass(tree, frames)
    effectors = frames.origin[[SEGMENTS.index(name) for name in END_EFFECTORS]]
    count = 4
    return ReferenceMotion(
        phase=np.arange(count) / count,
        positions=np.tile(q, (count, 1)),
        velocities=np.zeros((count, 31)),
        moments=np.zeros((count, 25)),
        ground_reaction=np.zeros((count, 2, 3)),
        centre_of_mass=np.tile(com, (count, 1)),
        end_effectors=np.tile(effectors, (count, 1, 1)),
        offsets=np.zeros(25),
        stride_time=1.0,
        speed=0.0,
    )


def random_policy(task: WalkingTask, *, scale: float, seed: int = 0, units: int = 16) -> Policy:
    """A policy with random weights; actions of the size of `scale`, zero for a scale of 0."""
    random = np.random.default_rng(seed)
    size = OBSERVATION_SIZES[task.configuration.environment.observation]
    actions = action_size(task.configuration.environment)
    shapes = [(units, size), (units,), (units, units), (units,), (actions, units), (actions,)]
    tensors = {
        name: random.normal(0.0, 1.0 / np.sqrt(shape[-1]), shape).astype(np.float32)
        for name, shape in zip(NETWORK, shapes, strict=True)
    }
    tensors["action_net.weight"] *= np.float32(scale)
    tensors["action_net.bias"] *= np.float32(scale)
    tensors["observation_mean"] = random.normal(0.0, 0.1, size)
    tensors["observation_variance"] = random.uniform(0.5, 2.0, size)
    about = {
        "subject": "S05",
        "model_hash": model_hash(task.model),
        "observation": task.configuration.environment.observation,
        "configuration": task.configuration.model_dump(mode="json"),
        "action_scale": task.configuration.environment.action_scale,
    }
    return Policy(tensors, about)


ROOT_ROWS = slice(0, len(ROOT))
JOINT_ROWS = slice(len(ROOT), len(COORDINATES))


def rigid_sled(mass: float) -> BodyModel:
    """A plate on twelve contact spheres. All mass lies at its middle, half of it in the pelvis
    and a quarter in each foot, so that every foot's contact moves half of the sled and all goes
    through the whole simulation. Its origin is `SLED_HEIGHT` above its lowest points."""
    share = {"pelvis": 0.5, "foot_r": 0.25, "foot_l": 0.25}
    segments = [
        Segment(
            name=name,
            joint_position=np.zeros(3),
            mass=mass * share.get(name, 1e-6),
            centre_of_mass=np.zeros(3),
            inertia=(1.0 if name == "pelvis" else 1e-3) * np.eye(3),
        )
        for name in SEGMENTS
    ]
    places = [(x, y, -0.02) for x in (-0.3, -0.1, 0.1, 0.3) for y in (-0.2, 0.0, 0.2)]
    spheres = [
        ContactSphere(f"sphere_{i}", "pelvis", np.array(place), SLED_RADIUS)
        for i, place in enumerate(places)
    ]
    return BodyModel("sled", tuple(segments), tuple(spheres))


SLED_RADIUS = 0.032
SLED_HEIGHT = 0.02 + SLED_RADIUS


def task_of(model: BodyModel, task: WalkingTask, q: np.ndarray, **sections: Any) -> WalkingTask:
    """A task to hold the pose `q` with another body; `sections` as in `changed`."""
    fixed = replace(task, model=model, reference=constant_reference(model, q))
    return changed(fixed, **sections)


def mirror_image(values: np.ndarray) -> np.ndarray:
    """Positions, velocities or generalised forces (…, 31) seen in the mirror y → -y."""
    signs = np.ones(31)
    signs[[0, 2, 4]] = -1.0  # turning about x and z, place to the left
    signs[[COORDINATES.index(name) for name in ("lumbar_bending", "lumbar_rotation")]] = -1.0
    twins = [COORDINATES.index(mirrored(name)) for name in COORDINATES]
    return (signs * values)[..., twins]


def symmetric(model: BodyModel, record: GaitRecord) -> tuple[BodyModel, GaitRecord]:
    """A person whose left is the mirror image of the right, half a cycle later."""
    flip = np.array([1.0, -1.0, 1.0])
    middle = np.array([1.0, 0.0, 1.0])

    def from_right(curves: Mapping[str, PeriodicCurve]) -> dict[str, PeriodicCurve]:
        return {name: curves[name[:-1] + "r"] for name in curves}

    forward_force, left_force, up_force = record.forces["right"]
    mirrored_force = PeriodicCurve(
        -left_force.mean,
        tuple(-c for c in left_force.cosine),
        tuple(-s for s in left_force.sine),
    )
    record = replace(
        record,
        left_phase=0.5,
        angles=from_right(record.angles),
        moments=from_right(record.moments),
        stance_fraction=dict.fromkeys(SIDES, record.stance_fraction["right"]),
        forces={
            "right": record.forces["right"],
            "left": (forward_force, mirrored_force, up_force),
        },
    )

    def half(segment: Segment) -> Segment:
        if segment.name.endswith("_r"):
            return segment
        if segment.name.endswith("_l"):
            twin = model[mirrored(segment.name)]
            return Segment(
                segment.name,
                twin.joint_position * flip,
                twin.mass,
                twin.centre_of_mass * flip,
                twin.inertia * np.outer(flip, flip),
            )
        return replace(
            segment,
            joint_position=segment.joint_position * middle,
            centre_of_mass=segment.centre_of_mass * middle,
            inertia=0.5 * segment.inertia * (1.0 + np.outer(flip, flip)),
        )

    right = [sphere for sphere in model.spheres if sphere.segment.endswith("_r")]
    left = [
        ContactSphere(mirrored(s.name), mirrored(s.segment), s.position * flip, s.radius)
        for s in right
    ]
    segments = tuple(half(segment) for segment in model.segments)
    return replace(model, segments=segments, spheres=(*right, *left)), record


def mujoco_mass_matrix(body: MujocoBody) -> np.ndarray:
    """(31, 31) of the project's coordinates, after `accelerations`."""
    full = np.zeros((31, 31))
    for row, unit in zip(full, np.eye(31), strict=True):  # it is symmetric
        mujoco.mj_mulM(body.model, body.data, row, unit)
    transform = body._transform()
    return transform.T @ full @ transform
