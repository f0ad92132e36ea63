"""The body model in MuJoCo: a second physics engine, fed from the same segments and joints.

It is the second-engine check: a walk should not depend on the engine it was learned in. Mass
matrix, Coriolis forces and integrator are MuJoCo's own, with a quarter of the step; only the
contact law, which MuJoCo does not have, is the same code.
"""

from typing import Any

import mujoco
import numpy as np
from scipy.spatial.transform import Rotation

from gaitval.arrays import Array
from gaitval.coordinates import AXES, COORDINATES
from gaitval.model.body import JOINT_COORDINATES, PARENTS, BodyModel, Segment
from gaitval.model.tree import COORDINATE_COUNT


def _numbers(values: Any) -> str:
    return " ".join(repr(float(v)) for v in values)


def mjcf(model: BodyModel, *, option: str = "", floor: bool = False) -> str:
    """`model` in MuJoCo's own format: several hinges of one body turn in their order, the first one
    outermost. `option` has attributes of MuJoCo's <option>; `floor` adds the ground and the feet's
    spheres, which touch it alone.
    """

    def body(segment: Segment) -> str:
        inertia = segment.inertia
        # MuJoCo's order: xx yy zz xy xz yz.
        full = [inertia[i] for i in ((0, 0), (1, 1), (2, 2), (0, 1), (0, 2), (1, 2))]
        joints = "".join(
            f'<joint name="{name}" type="hinge" axis="{_numbers(AXES[name])}"/>'
            for name in JOINT_COORDINATES.get(segment.name, ())
        )
        spheres = "".join(
            f'<geom type="sphere" size="{sphere.radius!r}" pos="{_numbers(sphere.position)}" '
            # A pair touches if one's contype meets the other's conaffinity: spheres the ground,
            # never each other.
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
        f'<mujoco><compiler angle="radian"/>'
        f'<option gravity="{_numbers(model.ground.gravity)}" {option}/>'
        f"<worldbody>{ground}{body(model.segments[0])}</worldbody></mujoco>"
    )


class MujocoBody:
    """A body in MuJoCo. Arrays go in and out in the order of `coordinates.COORDINATES`.

    MuJoCo's free joint has the place first, then the orientation, and its angular velocity in the
    pelvis's axes: v = T q̇ with T made of identities and Rᵀ. T's rate adds nothing to the
    acceleration, for Ṙᵀ ω = -Rᵀ (ω × ω) = 0.

    Attributes
    ----------
    model, data : MuJoCo's own.
    places, rates : (25,) where MuJoCo has the position and the velocity of each joint.
    """

    def __init__(self, model: BodyModel, *, option: str = "", floor: bool = False) -> None:
        self._option, self._floor = option, floor
        self.configure(model)

    def configure(self, model: BodyModel) -> None:
        """Become another body, without servos."""
        text = mjcf(model, option=self._option, floor=self._floor)
        self.model = mujoco.MjModel.from_xml_string(text)
        self.data = mujoco.MjData(self.model)
        joints = [self.model.joint(name) for name in COORDINATES[6:]]
        self.places = np.array([joint.qposadr[0] for joint in joints])
        self.rates = np.array([joint.dofadr[0] for joint in joints])
        # Our order is that of its bodies, so that parts of MuJoCo's own arrays are slices of ours.
        assert np.array_equal(self.places, np.arange(7, 32)), self.places
        assert np.array_equal(self.rates, np.arange(6, 31)), self.rates
        qpos, qvel, applied = self.data.qpos, self.data.qvel, self.data.qfrc_applied
        # place, orientation and angles; linear and angular velocity and rates; the forces likewise
        self._at = qpos[:3], qpos[3:7], qpos[7:]
        self._moving = qvel[:3], qvel[3:6], qvel[6:]
        self._applied = applied[:3], applied[3:6], applied[6:]
        # where `set` or `advance` left the pelvis
        self._turned = self._rotation()

    def set_servo(self, stiffness: Array, damping: Array) -> None:
        """Springs about zero and dampers (25,) at the joints, Nm/rad and Nms/rad."""
        hinges = np.array([self.model.joint(name).id for name in COORDINATES[6:]])
        self.model.jnt_stiffness[hinges] = stiffness
        self.model.dof_damping[self.rates] = damping

    def set(self, q: Array, qd: Array) -> None:
        """Place the body at positions and velocities (31,)."""
        rotation = Rotation.from_rotvec(q[:3])
        self.data.qpos[0:3] = q[3:6]
        self.data.qpos[3:7] = rotation.as_quat(scalar_first=True)
        self.data.qpos[self.places] = q[6:]
        self.data.qvel[:] = self._transform() @ qd
        self._turned = self._rotation()

    def state(self) -> tuple[Array, Array]:
        """Positions and velocities (31,)."""
        return self._state(self._rotation())

    def _state(self, rotation: Array) -> tuple[Array, Array]:
        place, orientation, angles = self._at
        linear, angular, rates = self._moving
        q, qd = np.empty(COORDINATE_COUNT), np.empty(COORDINATE_COUNT)
        # The velocity that turns the body in a second from the world's axes to its own.
        mujoco.mju_quat2Vel(q[:3], orientation, 1.0)
        q[3:6], q[6:] = place, angles
        qd[:3], qd[3:6], qd[6:] = rotation @ angular, linear, rates
        return q, qd

    def advance(self, forces: Array) -> tuple[Array, Array]:
        """Advance by MuJoCo's time step under generalised forces (31,), which pair with velocities:
        f = Tᵀ f_mujoco; positions and velocities (31,).
        """
        self._apply(forces, self._turned)
        mujoco.mj_step(self.model, self.data)
        self._turned = self._rotation()
        return self._state(self._turned)

    def accelerations(self, forces: Array) -> Array:
        """(31,) for generalised forces (31,)."""
        self._apply(forces, self._rotation())
        mujoco.mj_forward(self.model, self.data)
        return np.linalg.solve(self._transform(), self.data.qacc)

    def _rotation(self) -> Array:
        """(3, 3) from the pelvis's axes to the world's."""
        matrix = np.empty(9)
        mujoco.mju_quat2Mat(matrix, self._at[1])
        return matrix.reshape(3, 3)

    def _transform(self) -> Array:
        transform = np.zeros((COORDINATE_COUNT, COORDINATE_COUNT))
        transform[0:3, 3:6] = np.eye(3)
        transform[3:6, 0:3] = self._rotation().T
        transform[self.rates, np.arange(6, COORDINATE_COUNT)] = 1.0
        return transform

    def _apply(self, forces: Array, rotation: Array) -> None:
        force, moment, joints = self._applied
        # f_mujoco = T⁻ᵀ f; T is orthogonal, so its blocks are only exchanged and turned.
        force[:] = forces[3:6]
        moment[:] = rotation.T @ forces[:3]
        joints[:] = forces[6:]
