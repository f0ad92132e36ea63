"""Many walkers at once on an accelerator: gaitval's physics step in MuJoCo Warp.

MuJoCo's Euler step with implicit damping D' and springs K solves

    (M + h D') (q̇⁺ - q̇) = h (f - c - D' q̇ - K q),   q⁺ = q + h q̇⁺.

With D' = D + h K it is the step of `simulation.dynamics`, springs implicit as well:

    (M + h D + h² K) (q̇⁺ - q̇) = h (f - c - D q̇ - K (q + h q̇)),

so MuJoCo is given that damping, and its step is ours: to 1e-13 rad after 500 steps where both
compute in double precision, and to single precision here (tests/accelerator). Servos and contact
are kernels of our own (`kernels`).
"""

from collections.abc import Sequence
from typing import Any

import mujoco
import mujoco_warp
import numpy as np
import warp as wp
from scipy.spatial.transform import Rotation

from gaitval.apps.accelerator import kernels
from gaitval.arrays import Array
from gaitval.contact.hunt_crossley import HuntCrossley
from gaitval.errors import ConfigurationError
from gaitval.model.parameters import apply_parameters
from gaitval.model.tree import ACTUATED_COUNT, COORDINATE_COUNT
from gaitval.simulation.mujoco_body import MujocoBody
from gaitval.simulation.walker import Walker

_OF_A_BODY = (
    *("body_pos", "body_ipos", "body_iquat", "body_mass", "body_inertia", "body_subtreemass"),
    *("jnt_stiffness", "dof_damping"),
)
"""Fields of MuJoCo's model that differ between bodies and servos."""


_WarpNumbers = Array | wp.array2d[float] | wp.array1d[float]
"""In the processor's memory or the device's."""


class AcceleratedWalkers:
    """Walkers that take their physics steps together on a `device` of Warp, such as `cuda:0` or
    `cpu`; Warp's choice if None: a GPU where there is one. There are N `walkers`, with
    Hunt-Crossley contact; ConfigurationError for another law.

    Their bodies, gaits, contact and servos may differ; the physics step and the number of spheres
    are the same for all. They keep their arrays: `enter` takes a walker's state from them, `leave`
    brings it back, and in between all is on the device.
    """

    def __init__(self, walkers: Sequence[Walker], device: str | None = None) -> None:
        self.walkers = list(walkers)
        self.device = wp.get_device(device)
        first, count = self.walkers[0], len(self.walkers)
        laws = [walker.law for walker in self.walkers]
        for law in laws:
            if not isinstance(law, HuntCrossley):
                raise ConfigurationError(
                    f"contact.law: {type(law).__name__} cannot be computed on an accelerator, "
                    "only hunt_crossley. Set contact.law=hunt_crossley, or walk on the processor."
                )
        assert all(walker.physics_step == first.physics_step for walker in self.walkers)
        self._steps = first.steps_per_action
        self._share = 1.0 / self._steps
        bodies = _bodies(self.walkers)
        peer = bodies[0]
        names = [segment.name for segment in first.task.model.segments]
        body = {name: peer.model.body(name).id for name in names}
        self._pelvis = body[names[0]]
        self._places, self._rates = self._integers(peer.places), self._integers(peer.rates)
        self._peer = peer
        with wp.ScopedDevice(self.device):
            self.model = mujoco_warp.put_model(peer.model)
            self.data = mujoco_warp.make_data(peer.model, nworld=count, nconmax=0, njmax=0)
        # The equations have the damping in them (`kernels.implicit_equations`).
        self.model.opt.disableflags |= int(mujoco.mjtDisableBit.mjDSBL_EULERDAMP)
        for name in _OF_A_BODY:
            values = np.array([getattr(each.model, name) for each in bodies])
            setattr(self.model, name, self._array(values, getattr(self.model, name).dtype))
        tasks = list({id(walker.task): walker for walker in self.walkers}.values())
        order = [id(walker.task) for walker in tasks]
        self._which = self._integers([order.index(id(walker.task)) for walker in self.walkers])
        self._tables = [
            self._array(np.array(tables))
            for tables in zip(*(walker.tables for walker in tasks), strict=True)
        ]
        parts = [walker.body for walker in self.walkers]
        trees = [part.tree for part in parts]
        self._stiffness = self._array([part.stiffness for part in parts])
        self._damping = self._array([part.damping for part in parts])
        self._total_damping = self._array([part.total_damping for part in parts])
        self._lag = self._array([part.lag for part in parts])
        self._law = self._array(laws)
        self._sphere_body = self._integers([body[names[s]] for s in trees[0].sphere_segment])
        self._sphere_place = self._array([tree.sphere_position for tree in trees], wp.vec3)
        self._sphere_radius = self._array([tree.sphere_radius for tree in trees])
        self._phase_step = self._array([part.phase_step for part in parts], wp.float64)
        spheres, joints = len(trees[0].sphere_radius), (count, ACTUATED_COUNT)
        self._phase = self._array(np.zeros(count), wp.float64)
        self._pace = self._array(np.ones(count))
        self._memory, self._plain = (
            self._array(np.zeros((count, spheres, 3)), wp.vec3) for _ in range(2)
        )
        self._mean_ground = self._array(np.zeros((count, 2, 3)), wp.vec3)
        self._commanded, self._slope, self._target = (
            self._array(np.zeros(joints)) for _ in range(3)
        )
        self._command, self._mean_moments, self._mean_squares = (
            self._array(np.zeros(joints)) for _ in range(3)
        )
        self._root_force = self._array(np.zeros((count, 6)))
        self._graph: Any = None
        self._compiled = False
        self.enter()

    def enter(self) -> None:
        """Take state, phase, offset and contact forces of all walkers to the device."""
        states = np.array([walker.state for walker in self.walkers])
        positions, velocities = states[:, 0], states[:, 1]
        turned = Rotation.from_rotvec(positions[:, :3])
        qpos = np.zeros((len(states), self._peer.model.nq))
        qpos[:, :3], qpos[:, 3:7] = positions[:, 3:6], turned.as_quat(scalar_first=True)
        qpos[:, self._peer.places] = positions[:, 6:]
        qvel = np.zeros((len(states), COORDINATE_COUNT))
        qvel[:, :3], qvel[:, 3:6] = velocities[:, 3:6], turned.inv().apply(velocities[:, :3])
        qvel[:, self._peer.rates] = velocities[:, 6:]
        self.data.qpos.assign(qpos)
        self.data.qvel.assign(qvel)
        self._phase.assign(np.array([walker.phase for walker in self.walkers]))
        self._memory.assign(np.array([walker._memory for walker in self.walkers]))
        self._commanded.assign(np.array([walker.offset for walker in self.walkers]))

    def leave(self) -> None:
        """Bring state, phase, offset, contact forces and means of the last action back."""
        positions, velocities = self.states()
        phase, memory, offset = self._phase.numpy(), self._memory.numpy(), self._commanded.numpy()
        ground = self._mean_ground.numpy()
        moments, squares = self._mean_moments.numpy(), self._mean_squares.numpy()
        for i, walker in enumerate(self.walkers):
            walker.state[0], walker.state[1] = positions[i], velocities[i]
            walker.phase = float(phase[i])
            walker._memory[:], walker.offset[:] = memory[i], offset[i]
            walker.mean_ground_reaction[:] = ground[i]
            walker.mean_moments[:], walker.mean_square_moments[:] = moments[i], squares[i]

    def states(self) -> tuple[Array, Array]:
        """Positions and velocities (N, 31) after the last physics step."""
        qpos = self.data.qpos.numpy().astype(float)
        qvel = self.data.qvel.numpy().astype(float)
        turned = Rotation.from_quat(qpos[:, 3:7], scalar_first=True)
        positions, velocities = np.empty_like(qvel), np.empty_like(qvel)
        positions[:, :3], positions[:, 3:6] = turned.as_rotvec(), qpos[:, :3]
        positions[:, 6:] = qpos[:, self._peer.places]
        velocities[:, :3], velocities[:, 3:6] = turned.apply(qvel[:, 3:6]), qvel[:, :3]
        velocities[:, 6:] = qvel[:, self._peer.rates]
        return positions, velocities

    def advance(self, offset: _WarpNumbers, root_force: _WarpNumbers, pace: _WarpNumbers) -> None:
        """Advance all by one action, as `Walker.step` does one: `offset` (N, 25) rad, `root_force`
        (N, 6) external moment Nm and force N on the pelvis, world, and `pace` (N,), how fast to go
        through the gait cycle, 1 as fast as the reference.

        What is on the device already is not brought there again, as the output of a policy that is
        computed there (`wp.from_torch`).
        """
        wp.copy(self._target, self._commanded)
        self._commanded.assign(offset)
        self._root_force.assign(root_force)
        self._pace.assign(pace)
        if self._graph is not None:
            wp.capture_launch(self._graph)
        elif self.device.is_cuda and self._compiled:
            # Some dozen launches a step: recorded once, a GPU repeats them without Python.
            with wp.ScopedCapture(self.device) as capture:
                self._action()
            self._graph = capture.graph
            wp.capture_launch(self._graph)
        else:
            self._action()
            self._compiled = True

    def synchronize(self) -> None:
        """Wait until the device has done what it was asked for."""
        wp.synchronize_device(self.device)

    def _action(self) -> None:
        for mean in (self._mean_ground, self._mean_moments, self._mean_squares):
            mean.zero_()
        with wp.ScopedDevice(self.device):
            wp.launch(
                kernels.slopes_of, self._slope.shape, [self._commanded, self._target, self._share],
                [self._slope],
            )  # fmt: skip
            for _ in range(self._steps):
                self._step()

    def _step(self) -> None:
        model, data, share = self.model, self.data, self._share
        count = len(self.walkers)
        # MuJoCo's step without what is not in ours (constraints, actuators, sensors), and with one
        # factorisation, of what is solved.
        for part in (
            mujoco_warp.kinematics, mujoco_warp.com_pos, mujoco_warp.crb, mujoco_warp.com_vel,
            mujoco_warp.passive, mujoco_warp.rne,
        ):  # fmt: skip
            part(model, data)
        wp.launch(
            kernels.command_servos,
            (count, ACTUATED_COUNT),
            [
                *self._tables, self._which, self._phase, self._pace, self._slope,
                self._stiffness, self._damping, self._rates,
            ],
            [self._target, self._command, data.qfrc_applied],
        )  # fmt: skip
        wp.launch(
            kernels.push, count, [self._root_force, data.xmat, self._pelvis], [data.qfrc_applied]
        )
        wp.launch(
            kernels.touch_ground,
            (count, 2),
            [
                data.xpos, data.xmat, data.xipos, data.cvel, data.subtree_com, self._pelvis,
                self._sphere_body, self._sphere_place, self._sphere_radius, self._law, self._lag,
                share,
            ],
            [self._plain, self._memory, self._mean_ground, data.xfrc_applied],
        )  # fmt: skip
        wp.launch(
            kernels.implicit_equations,
            (count, COORDINATE_COUNT),
            [
                data.qfrc_applied, data.qfrc_passive, data.qfrc_bias, model.dof_damping,
                self.walkers[0].physics_step, model.M_rownnz, model.M_rowadr,
            ],
            [data.qfrc_smooth, data.M],
        )  # fmt: skip
        mujoco_warp.xfrc_accumulate(model, data, data.qfrc_smooth)
        mujoco_warp.factor_m(model, data)
        mujoco_warp.solve_m(model, data, data.qacc, data.qfrc_smooth)
        mujoco_warp.euler(model, data)
        wp.launch(
            kernels.enter,
            (count, ACTUATED_COUNT),
            [
                self._command, self._stiffness, self._total_damping, self._places, self._rates,
                data.qpos, data.qvel, self._pace, self._phase_step, share,
            ],
            [self._phase, self._mean_moments, self._mean_squares],
        )  # fmt: skip

    def _array(self, values: Any, dtype: Any = float) -> Any:
        return wp.array(np.asarray(values), dtype=dtype, device=self.device)

    def _integers(self, values: Any) -> Any:
        return self._array(np.asarray(values, dtype=np.int32), int)


def _bodies(walkers: Sequence[Walker]) -> list[MujocoBody]:
    """Each walker's body with its servos in MuJoCo; walkers of one task and one mu share it."""
    found: dict[tuple[int, bytes], MujocoBody] = {}
    step = walkers[0].physics_step
    off = mujoco.mjtDisableBit
    for walker in walkers:
        key = id(walker.task), walker.mu.tobytes()
        if key not in found:
            peer = MujocoBody(
                apply_parameters(walker.task.model, walker.mu),
                option=f'timestep="{step!r}" integrator="Euler"',
            )
            peer.model.opt.disableflags |= off.mjDSBL_CONSTRAINT | off.mjDSBL_CONTACT
            stiffness = walker.body.stiffness
            peer.set_servo(stiffness, walker.body.total_damping + step * stiffness)
            found[key] = peer
    return [found[id(walker.task), walker.mu.tobytes()] for walker in walkers]
