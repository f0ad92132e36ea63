"""The body model in MuJoCo: another engine, fed from the same segments, joints and spheres."""

from typing import Any

import mujoco
import numpy as np
from scipy.spatial.transform import Rotation

from gaitval.constants import GRAVITY
from gaitval.coordinates import AXES, COORDINATES
from gaitval.model.body import JOINT_COORDINATES, PARENTS, BodyModel, Segment


def _numbers(values: Any) -> str:
    return " ".join(repr(float(v)) for v in values)


def mjcf(model: BodyModel, *, option: str = "", floor: bool = False) -> str:
    """The model in MuJoCo's own format: several hinges of one body turn in their order, the
    first one outermost. Inertia as xx yy zz xy xz yz.

    Parameters
    ----------
    option : attributes of MuJoCo's <option>.
    floor : with the ground and the feet's spheres, which touch it alone.
    """

    def body(segment: Segment) -> str:
        inertia = segment.inertia
        full = [inertia[i] for i in ((0, 0), (1, 1), (2, 2), (0, 1), (0, 2), (1, 2))]
        joints = "".join(
            f'<joint name="{name}" type="hinge" axis="{_numbers(AXES[name])}"/>'
            for name in JOINT_COORDINATES.get(segment.name, ())
        )
        spheres = "".join(
            f'<geom type="sphere" size="{sphere.radius!r}" pos="{_numbers(sphere.position)}" '
            'contype="0" conaffinity="1"/>'
            for sphere in model.spheres
            if floor and sphere.segment == segment.name
        )
        children = "".join(body(s) for s in model.segments if PARENTS.get(s.name) == segment.name)
        return (
            f'<body name="{segment.name}" pos="{_numbers(segment.joint_position)}">'
            f"{joints or '<freejoint/>'}"
            f'<inertial mass="{segment.mass!r}" pos="{_numbers(segment.centre_of_mass)}" '
            f'fullinertia="{_numbers(full)}"/>{spheres}{children}</body>'
        )

    ground = '<geom type="plane" size="0 0 1" contype="1" conaffinity="0"/>' if floor else ""
    return (
        f'<mujoco><compiler angle="radian"/><option gravity="0 0 {-GRAVITY}" {option}/>'
        f"<worldbody>{ground}{body(model.segments[0])}</worldbody></mujoco>"
    )


class MujocoPeer:
    """A body in MuJoCo. Arrays go in and out in the order of `coordinates.COORDINATES`.

    MuJoCo's free joint has the place first, then the orientation, and its angular velocity in the
    pelvis's axes: v = T q̇ with T made of identities and Rᵀ. T's rate adds nothing to the
    acceleration, for Ṙᵀ ω = -Rᵀ (ω × ω) = 0.
    """

    def __init__(self, model: BodyModel, *, option: str = "", floor: bool = False) -> None:
        self.model = mujoco.MjModel.from_xml_string(mjcf(model, option=option, floor=floor))
        self.data = mujoco.MjData(self.model)
        joints = [self.model.joint(name) for name in COORDINATES[6:]]
        self.places = np.array([joint.qposadr[0] for joint in joints])
        self.rates = np.array([joint.dofadr[0] for joint in joints])

    def set(self, q: np.ndarray, qd: np.ndarray) -> None:
        rotation = Rotation.from_rotvec(q[:3])
        self.transform = np.zeros((31, 31))
        self.transform[0:3, 3:6] = np.eye(3)
        self.transform[3:6, 0:3] = rotation.as_matrix().T
        self.transform[self.rates, np.arange(6, 31)] = 1.0
        self.data.qpos[0:3] = q[3:6]
        self.data.qpos[3:7] = rotation.as_quat(scalar_first=True)
        self.data.qpos[self.places] = q[6:]
        self.data.qvel[:] = self.transform @ qd

    def accelerations(self, forces: np.ndarray) -> np.ndarray:
        """(31,) for generalised forces (31,), which pair with velocities: f = Tᵀ f_mujoco."""
        self.data.qfrc_applied[:] = np.linalg.solve(self.transform.T, forces)
        mujoco.mj_forward(self.model, self.data)
        return np.linalg.solve(self.transform, self.data.qacc)

    def mass_matrix(self) -> np.ndarray:
        """(31, 31), after `accelerations`."""
        full = np.zeros((31, 31))  # symmetric
        for row, unit in zip(full, np.eye(31), strict=True):
            mujoco.mj_mulM(self.model, self.data, row, unit)
        return self.transform.T @ full @ self.transform
