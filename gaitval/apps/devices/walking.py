"""A walker with devices: sensors and controllers once an action, hinges in every physics step."""

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any, Final, NamedTuple

import numpy as np
from numpy.typing import NDArray

from gaitval.apps.devices import hinge_step as column
from gaitval.apps.devices.device_walk import LOGGED, DeviceWalk, at_states
from gaitval.apps.devices.hinge_step import hinge_torques, steps_with_devices
from gaitval.apps.devices.phase_estimate import PhaseEstimate
from gaitval.arrays import Array
from gaitval.coordinates import ACTUATED, SIDES, Side
from gaitval.model.body import BodyModel
from gaitval.model.devices.composite import fitted
from gaitval.model.devices.controllers import Controller, Measured
from gaitval.model.devices.device import Device, Hinge, check_together
from gaitval.model.devices.springs_and_motors import Motor
from gaitval.model.tree import (
    ACTUATED_COUNT,
    COORDINATE_COUNT,
    ROOT_DOFS,
)
from gaitval.policy.environment import WalkingEnvironment
from gaitval.policy.rollouts import record_rollout
from gaitval.policy.storage import Policy
from gaitval.walk.simulation.physics_steps import (
    Action,
)
from gaitval.walk.simulation.servo import closed_cycle, servo_stiffness
from gaitval.walk.simulation.tables import read_row
from gaitval.walk.simulation.walker import Engine, Trajectory, Walker, WalkerArrays, WalkingTask

Maker = Callable[[], Controller]
"""Makes a controller for one hinge: a class, for instance."""
_PULLS: Final = {"down": -1.0, "both": 0.0, "up": 1.0}
_CARRYING: Final = ("pelvis", "torso")
"""Segments on which the legs carry a load."""
_OF_LEGS: Final = ("hip", "knee", "ankle", "subtalar", "mtp")
_ALWAYS: Final = 1e9
"""1/s: a motor without a lag."""


@dataclass(frozen=True)
class DeviceTask(WalkingTask):
    """The task of walking with devices; `model` is the person with them.

    Attributes
    ----------
    person : the body without devices, whose muscles the servos are.
    devices : that are worn.
    own : makes the controllers of all motors, instead of those of the devices' tables.
    """

    person: BodyModel | None = None
    devices: tuple[Device, ...] = ()
    own: Maker | None = None


def with_devices(
    task: WalkingTask, devices: Sequence[Device], own: Maker | None = None
) -> DeviceTask:
    """A person's `task` with `devices` on; see `DeviceTask` for `own`. Raises ConfigurationError if
    two replace the same part.
    """
    check_together(devices)
    return DeviceTask(
        fitted(task.model, devices),
        task.record,
        task.reference,
        task.configuration,
        task.reference_mu,
        task.model,
        tuple(devices),
        own,
    )


class FittedDevice(NamedTuple):
    """A hinge of a device on one side.

    Attributes
    ----------
    name : coordinate of its joint, such as `knee_angle_r`.
    joint : which of the actuated coordinates that is.
    implicit : spring and damper are the joint's own, and integrated as such: a prosthesis' without
        motor.
    """

    name: str
    joint: int
    side: Side
    hinge: Hinge
    device: Device
    controller: Controller | None
    implicit: bool

    @property
    def rigid(self) -> bool:
        """Whether it turns as its joint does: no strap lets it turn otherwise."""
        return self.hinge.strap is None


def fitted_devices(task: DeviceTask) -> tuple[FittedDevice, ...]:
    """The hinges of a task's devices, those of the right side first."""
    found = []
    for device in task.devices:
        for hinge in device.hinges:
            for name in device.places(hinge.joint):
                side: Side = "left" if name.endswith("_l") else "right"
                controller = task.own() if task.own and hinge.motor else hinge.controller
                implicit = not (hinge.muscles or hinge.motor)
                joint = ACTUATED.index(name)
                found.append(FittedDevice(name, joint, side, hinge, device, controller, implicit))
    return tuple(found)


def carried(task: DeviceTask) -> float:
    """Mass on trunk and pelvis of a task's devices that have no hinge, over the person's: what a
    person carries and does not wear.
    """
    person = task.person or task.model
    loads = (part for device in task.devices if not device.hinges for part in device.parts)
    return sum(part.mass for part in loads if part.segment in _CARRYING) / person.mass


def moments_of_carrying(moments: Array, ground_reaction: Array, load: float) -> Array:
    """Moments (N, 25) that are fed forward by who carries a `load` of so many body masses on the
    trunk: a leg's grow by it as far as its foot carries the body, by `ground_reaction` (N, 2, 3)
    body weights of right and left; the back's grow by it throughout.

    What people lift they know the weight of: a load that is only found out by errors brings half of
    them down at 30 %, and none who expect it.
    """
    vertical = np.maximum(ground_reaction[..., 2], 0.0)
    share = vertical / np.maximum(vertical.sum(axis=1, keepdims=True), 1e-6)
    more = np.zeros_like(moments)
    for joint, name in enumerate(ACTUATED):
        if name.startswith("lumbar"):
            more[:, joint] = load
        elif name.startswith(_OF_LEGS):
            more[:, joint] = load * share[:, "rl".index(name[-1])]
    return np.asarray(moments * (1.0 + more))


def hinge_numbers(hinge: Hinge) -> Array:
    """(NUMBERS,) of a hinge for `hinge_step`."""
    spring, motor, strap = hinge.spring, hinge.motor, hinge.strap
    ratchet = hinge.clutch is not None and hinge.clutch.ratchet
    numbers = np.zeros(column.NUMBERS)
    if spring is not None:
        numbers[:3] = spring.stiffness, spring.rest, _PULLS[spring.pulls]
    numbers[column.DAMPING], numbers[column.RATCHET] = hinge.damping, ratchet
    numbers[column.BANDWIDTH] = _ALWAYS
    if motor is not None:
        rate = 2.0 * math.pi * motor.bandwidth
        numbers[column.TORQUE : column.BANDWIDTH + 1] = motor.torque, motor.speed, motor.power, rate
    if strap is not None:
        numbers[column.STRAPPED :] = 1.0, strap.stiffness, strap.damping, strap.inertia
    return numbers


def command_noise(motor: Motor, step: float, steps: int) -> float:
    """Nm, SD of the noise on a command that is held for `steps` steps of `step` s, with which the
    torque after the motor's lag has the SD `motor.noise`.
    """
    left = np.exp(-2.0 * np.pi * motor.bandwidth * step * np.arange(1, steps + 1))
    # At the start of an action the torque's variance is that of a first-order process.
    start = (1.0 - left[-1]) / (1.0 + left[-1])
    return motor.noise / math.sqrt(float(np.mean(left**2 * start + (1.0 - left) ** 2)))


class DeviceWalker(Walker):
    """A walker with devices. Its moments are those of the person's own muscles.

    Parameters
    ----------
    task, engine, arrays : as of a `Walker`.

    Attributes
    ----------
    worn : its hinges.
    hinges : (H, STATE) their state, see `hinge_step`.
    """

    def __init__(
        self,
        task: DeviceTask,
        *,
        engine: Engine = "compiled",
        arrays: WalkerArrays | None = None,
    ) -> None:
        self._person = task.person or task.model
        self.fitted = fitted_devices(task)
        self._gone = np.array([w.joint for w in self.fitted if not w.hinge.muscles], dtype=int)
        self._acts = np.ones(ACTUATED_COUNT)
        self._acts[self._gone] = 0.0
        # The implicit ones are the joint's own; all others are beside it.
        self._inside = [w for w in self.fitted if w.implicit]
        self._beside = [w for w in self.fitted if not w.implicit]
        self._which = np.array([ROOT_DOFS + w.joint for w in self._beside], dtype=np.int64)
        self._numbers = np.zeros((len(self._beside), column.NUMBERS))
        for row, fit in enumerate(self._beside):
            self._numbers[row] = hinge_numbers(fit.hinge)
        self.hinges = np.zeros((len(self._beside), column.STATE))
        self._kept: list[Array] = []
        super().__init__(task, engine=engine, arrays=arrays)
        if load := carried(task):
            forces = closed_cycle(task.reference.ground_reaction)
            known = moments_of_carrying(self.tables.moments, forces, load)
            self.tables = self.tables._replace(moments=known)
            self.set_parameters(self.mu)
        self._target = np.zeros(ACTUATED_COUNT)
        self._log = np.zeros((self.steps_per_action, len(self._beside), column.STATE))
        motors = [fit.hinge.motor for fit in self._beside]
        self._noise_sd = [
            command_noise(motor, self.physics_step, self.steps_per_action) if motor else 0.0
            for motor in motors
        ]

    def set_parameters(self, mu: Array) -> None:
        """Give the body the parameters mu (14,), with the muscles of the person alone."""
        servo = self.task.configuration.servo
        # A device makes a person heavier, not stronger.
        stiffness = servo_stiffness(servo, self._person.mass)
        self.gains = np.vstack([stiffness, servo.damping_time * stiffness])
        super().set_parameters(mu)
        if not len(self._gone):
            return
        tables, body = self.body.tables, self.body
        positions, moments = tables.positions.copy(), tables.moments.copy()
        stiffness, damping = body.stiffness.copy(), body.damping.copy()
        total = body.total_damping.copy()
        for fit in self.fitted:
            if fit.hinge.muscles:
                continue
            # `_control` fills in those of implicit springs and dampers, before every action.
            stiffness[fit.joint] = damping[fit.joint] = total[fit.joint] = 0.0
            spring = fit.hinge.spring if fit.implicit else None
            positions[:, fit.joint] = spring.rest if spring else 0.0
            moments[:, fit.joint] = 0.0
        self.body = body._replace(
            tables=tables._replace(positions=positions, moments=moments),
            stiffness=stiffness,
            damping=damping,
            total_damping=total,
        )

    def reset(self, positions: Array, velocities: Array, phase: float) -> None:
        """Place the body at a state (31,), (31,) and a phase, with the devices just switched on."""
        super().reset(positions, velocities, phase)
        self.hinges[:] = 0.0
        self.hinges[:, column.ANGLE] = self.hinges[:, column.HELD] = positions[self._which]
        self.hinges[:, column.SPEED] = velocities[self._which]
        self._time = 0.0
        self._kept = []
        self._noise = np.random.default_rng(0)
        stride = self.task.reference.stride_time
        self._estimates = {
            (id(device), side): PhaseEstimate(device.foot_switch, stride)
            for device in {id(w.device): w.device for w in self.fitted}.values()
            for side in SIDES
        }
        vertical = self._memory.reshape(2, -1, 3)[:, :, 2].sum(axis=1)
        for (_, side), estimate in self._estimates.items():
            estimate.start(float(vertical[SIDES.index(side)]))
        self._loads = vertical
        self._commanded: list[list[tuple[float, float]]] = [[] for _ in self._beside]
        # Until the first action nothing has moved.
        self.mean_moments[:] = 0.0

    def step(
        self,
        offset: Array,
        root_force: Array,
        recording: Trajectory | None = None,
        *,
        pace: float = 1.0,
    ) -> None:
        """Advance by one action, see `Walker.step`; the devices' controllers act once before it."""
        self._control()
        account, work = self._account, self._work
        offset = offset * self._acts
        action = Action(pace, self.offset, offset, root_force)
        if self._outside is None:
            self._target[:] = self.offset
            self.phase = steps_with_devices(
                self.body, self.state, self.phase, pace, self._target,
                (offset - self.offset) / len(account.phase), root_force, self._memory,
                account, work, self._which, self._numbers, self.hinges, self._log,
            )  # fmt: skip
        else:
            self.phase = self._advance_outside(action)
        self.offset[:] = offset
        self._time += self.action_seconds
        self._loads = account.feet[-1, :, 2].copy()
        if recording is not None:
            self._kept.append(self._rows())
        if len(self._gone):
            # What acts there is the prosthesis, not a muscle.
            account.moments[:, self._gone] = 0.0
            self.mean_moments[self._gone] = self.mean_square_moments[self._gone] = 0.0
        if recording is not None:
            recording.append(account, root_force)

    def _rows(self) -> Array:
        """(N, H, 5) of the last action, in the order of `fit` and `LOGGED`."""
        account = self._account
        rows = np.zeros((len(account.phase), len(self.fitted), len(LOGGED)))
        beside = 0
        for h, fit in enumerate(self.fitted):
            if fit.implicit:
                rows[:, h, 0] = account.moments[:, fit.joint]
            else:
                rows[:, h] = self._log[:, beside, LOGGED]
                beside += 1
            if fit.rigid:
                rows[:, h, 3] = account.positions[:, ROOT_DOFS + fit.joint]
                rows[:, h, 4] = account.velocities[:, ROOT_DOFS + fit.joint]
        return rows

    def _add_forces(self, row: int, step: float) -> None:
        hinge_torques(step, self.state, self._which, self._numbers, self.hinges, self._work.forces)
        self._log[row] = self.hinges

    def _control(self) -> None:
        """Read the sensors, and set clutches, dampers and commands for the next action."""
        for (_, side), estimate in self._estimates.items():
            estimate.see(self._time, float(self._loads[SIDES.index(side)]))
        for fit in self._inside:
            self._set_joint(fit)
        if self._inside and self._outside is not None:
            self._outside.set_servo(self.body.stiffness, self.body.total_damping)
        for row, fit in enumerate(self._beside):
            hinge, state = fit.hinge, self.hinges[row]
            estimate = self._estimates[id(fit.device), fit.side]
            state[column.ENGAGED] = _engaged(hinge, estimate)
            state[column.EXTRA] = _further_damping(hinge, estimate)
            if hinge.motor is None or fit.controller is None:
                continue
            commanded = float(fit.controller.torque(self._measured(fit, estimate, state)))
            if not math.isfinite(commanded):
                raise ValueError(
                    f"{fit.device.name}: the controller at {fit.name} asked for {commanded} Nm at "
                    f"{self._time:.3f} s, which no motor can do. Return a finite number."
                )
            queue = self._commanded[row]
            queue.append((self._time + hinge.motor.delay, commanded))
            while len(queue) > 1 and queue[1][0] <= self._time + 1e-9:
                queue.pop(0)
            if queue[0][0] <= self._time + 1e-9:
                state[column.COMMAND] = queue[0][1]
                if self._noise_sd[row]:
                    state[column.COMMAND] += self._noise_sd[row] * self._noise.standard_normal()

    def _set_joint(self, fit: FittedDevice) -> None:
        """Spring and damper of a prosthetic joint, for the next action.

        A spring that pulls one way acts through whole actions, which are 6 ms: the joint may move a
        little before it acts or lets go.
        """
        hinge, estimate = fit.hinge, self._estimates[id(fit.device), fit.side]
        acts = _engaged(hinge, estimate)
        spring, stiffness = hinge.spring, 0.0
        if spring is not None and acts:
            away = spring.rest - self.state[0, ROOT_DOFS + fit.joint]
            stiffness = spring.stiffness if _PULLS[spring.pulls] * away >= 0.0 else 0.0
        self.body.stiffness[fit.joint] = stiffness
        damping = (hinge.damping if acts else 0.0) + _further_damping(hinge, estimate)
        self.body.total_damping[fit.joint] = damping

    def _measured(self, fit: FittedDevice, estimate: PhaseEstimate, state: Array) -> Measured:
        return Measured(
            time=self._time,
            side=fit.side,
            phase=estimate.phase,
            stride_time=estimate.stride_time,
            loaded=estimate.loaded,
            angle=float(state[column.ANGLE]),
            speed=float(state[column.SPEED]),
            torque=float(state[column.LIMB]),
            moment=float(self.mean_moments[fit.joint]),
            mass=self._person.mass,
        )

    def move(self, way: Array) -> None:
        """Move the whole body by `way` (2,) m, forward and left."""
        self.state[0, 3:5] += way
        if self._outside is not None:
            self._outside.set(self.state[0], self.state[1])

    def logged(self) -> Array:
        """(T, H, 5) what was kept of the recorded steps, in the order of `worn` and `LOGGED`."""
        return np.concatenate(self._kept) if self._kept else np.zeros((0, len(self.fitted), 5))


def _further_damping(hinge: Hinge, estimate: PhaseEstimate) -> float:
    """Nms/rad of a stance damper now."""
    damper = hinge.stance_damper
    # An unknown phase is not past the end.
    if damper is None or not estimate.loaded or estimate.phase >= damper.until:
        return 0.0
    return damper.damping


def _engaged(hinge: Hinge, estimate: PhaseEstimate) -> bool:
    """Whether spring and damper of a hinge act now."""
    if hinge.clutch is None:
        return True
    if hinge.clutch.during != "phase":
        return estimate.loaded == (hinge.clutch.during == "loaded")
    first, last = hinge.clutch.phases
    if math.isnan(estimate.phase):
        return False
    if first <= last:
        return first <= estimate.phase <= last
    return estimate.phase >= first or estimate.phase <= last


class DeviceEnvironment(WalkingEnvironment):
    """A `WalkingEnvironment` whose walker wears devices, and may choose its own speed.

    A policy holds the walker at its reference's place on the walkway. Somebody who carries a load
    or has a prosthesis walks slower, and would be dragged along. So the reference waits: where the
    walker is more than `SLACK` m from its place, body and feet are moved back to it at `RETURN`
    times the excess a second, and what is recorded is where it would have been. On level ground
    that changes no force.

    With a `pace` the walker is held to a speed instead, as on a treadmill: the reference does not
    wait, and goes through the cycle at this pace and no other. What the policy shows of a place
    behind the reference's then pulls the walker on, until it walks as fast; who cannot falls back
    until it counts as a fall.

    Attributes
    ----------
    pace : over that of the reference; None for one that the walker chooses.
    shift : (2,) m, forward and left, by which the walker has been moved since its reset.
    """

    walker: DeviceWalker
    SLACK = 0.05
    RETURN = 4.0

    def __init__(
        self, task: DeviceTask, *, engine: Engine = "compiled", pace: float | None = None
    ) -> None:
        super().__init__(task)
        self.pace = pace
        self.walker = DeviceWalker(task, engine=engine)
        self.shift = np.zeros(2)
        self._place = np.zeros(COORDINATE_COUNT)

    def reset(
        self, *, seed: int | None = None, options: dict[str, Any] | None = None
    ) -> tuple[NDArray[np.float32], dict[str, Any]]:
        """As `WalkingEnvironment.reset`."""
        self.shift = np.zeros(2)
        return super().reset(seed=seed, options=options)

    def step(
        self, action: NDArray[np.float32], recording: Trajectory | None = None
    ) -> tuple[NDArray[np.float32], float, bool, bool, dict[str, Any]]:
        """As `WalkingEnvironment.step`."""
        if self.pace is None:
            self._follow()
        found = super().step(action, recording)
        if recording is not None and self.shift.any():
            rows = slice(recording.rows - self.walker.steps_per_action, recording.rows)
            recording.positions[rows, 3:5] -= self.shift
            # Moments about the world's origin: r x F with r moved in the plane.
            feet, (x, y) = recording.feet[rows], -self.shift
            feet[..., 3] += y * feet[..., 2]
            feet[..., 4] -= x * feet[..., 2]
            feet[..., 5] += x * feet[..., 1] - y * feet[..., 0]
        return found

    def _pace(self) -> float:
        """That which the walker is held to, or chose in its last action."""
        return super()._pace() if self.pace is None else self.pace

    def _follow(self) -> None:
        """Move the walker towards its reference's place, if it is far from it."""
        walker, targets = self.walker, self.yardstick.targets
        read_row(targets.positions, walker.phase, self._place)
        away = walker.state[0, 3:5] - self._place[3:5]
        away[0] -= targets.stride_length * walker.phase
        distance = float(np.hypot(*away))
        if distance <= self.SLACK:
            return
        part = self.RETURN * walker.action_seconds * (distance - self.SLACK) / distance
        self.shift -= part * away
        walker.move(-part * away)


def walk_with(
    environment: DeviceEnvironment,
    policy: Policy,
    *,
    mu: Array,
    start_phase: float = 0.0,
    cycles: float,
) -> DeviceWalk:
    """Walk in an `environment`; arguments as of `policy.rollouts.record_rollout`."""
    rollout = record_rollout(environment, policy, mu=mu, start_phase=start_phase, cycles=cycles)
    walker = environment.walker
    log = at_states(walker.logged())
    names = tuple(fit.name for fit in walker.fitted)
    return DeviceWalk(rollout, names, *(log[:, :, k] for k in range(len(LOGGED))))
