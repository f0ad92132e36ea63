"""One physics step of a device's hinges: motor, spring, damper, strap (compiled).

The device's own angle θ and speed ω are states beside the body's. With motor torque τ, inertia J,
spring k about r, damper c, and the strap's stiffness kₛ and damping dₛ to the joint's angle q,

    J ω̇ = τ - k (θ - r) - c ω - u,    u = kₛ (θ - q) + dₛ (ω - q̇),    θ̇ = ω,

and the limb gets the strap's torque u. It is integrated implicitly in θ and ω, with q a
step ahead along its velocity; without inertia θ follows from the balance alone. Without a strap θ
is q, and the limb gets τ - k (q - r) - c q̇. Torques and angles have the signs of the joint's
coordinate.
"""

import math
from typing import Final

from gaitval._internal.numba.compiled import njit_borrowing
from gaitval.arrays import Array, Index
from gaitval.model.tree import ACTUATED_COUNT
from gaitval.walk.simulation.dynamics import accelerations, integrate
from gaitval.walk.simulation.physics_steps import Account, WalkerBody, Workspace, enter, forces

# Columns of the numbers of a hinge.
(
    SPRING, REST, PULLS, DAMPING, RATCHET, TORQUE, FASTEST, POWER, BANDWIDTH,
    STRAPPED, STRAP, STRAP_DAMPING, INERTIA,
) = range(13)  # fmt: skip
NUMBERS: Final = INERTIA + 1
"""Stiffness Nm/rad, rest rad, -1 pulls down, 1 up, 0 both, damping Nms/rad, 1 if the clutch takes
up slack; Nm, rad/s, W, 1/s; 1 if there is a strap, its Nm/rad and Nms/rad, kg m²."""
# Columns of the state of a hinge.
COMMAND, ENGAGED, HELD, EXTRA, ANGLE, SPEED, MOTOR, LIMB, STORED = range(9)
STATE: Final = STORED + 1
"""Motor's command Nm, 1 if spring and damper act, rest angle rad that the ratchet holds, further
damping Nms/rad; the device's angle rad and speed rad/s, the motor's torque, the torque on the limb
Nm, and the energy in spring and strap J."""


@njit_borrowing
def motor_torque(step: float, numbers: Array, hinge: Array) -> float:
    """Nm, after a physics step of `step` s: the lagged command within the motor's limits."""
    # Exact for a command that is held.
    part = -math.expm1(-numbers[BANDWIDTH] * step)
    torque = hinge[MOTOR] + part * (hinge[COMMAND] - hinge[MOTOR])
    limit, speed = numbers[TORQUE], abs(hinge[SPEED])
    if torque * hinge[SPEED] > 0.0:  # it drives
        if speed >= numbers[FASTEST]:
            limit = 0.0
        elif limit * speed > numbers[POWER]:
            limit = numbers[POWER] / speed
    return float(min(max(torque, -limit), limit))


@njit_borrowing
def hinge_torque(step: float, angle: float, rate: float, numbers: Array, hinge: Array) -> float:
    """Torque Nm on the limb at a joint, after a physics `step` (s) of the hinge beside it. `angle`
    rad and `rate` rad/s are those of the joint before the step; `numbers` (NUMBERS,) and `hinge`
    (STATE,), in and out, are of the hinge.
    """
    motor = motor_torque(step, numbers, hinge)
    engaged = hinge[ENGAGED] > 0.0
    pulls, ratchet = numbers[PULLS], numbers[RATCHET] > 0.0
    damping = hinge[EXTRA] + (numbers[DAMPING] if engaged else 0.0)
    now = hinge[ANGLE] if numbers[STRAPPED] > 0.0 else angle
    if ratchet:
        if not engaged:
            hinge[HELD] = now
        elif pulls < 0.0:
            hinge[HELD] = min(hinge[HELD], now)
        else:
            hinge[HELD] = max(hinge[HELD], now)
    rest = hinge[HELD] if ratchet else numbers[REST]
    stiffness = numbers[SPRING] if engaged else 0.0
    limb = 0.0
    if numbers[STRAPPED] > 0.0:
        strap, loss, inertia = numbers[STRAP], numbers[STRAP_DAMPING], numbers[INERTIA]
        ahead = angle + step * rate
        for _ in range(2):
            # ω after the step, from the implicit balance.
            free = inertia / step + damping + loss + step * (stiffness + strap)
            drive = (
                inertia / step * hinge[SPEED]
                + motor
                - stiffness * (hinge[ANGLE] - rest)
                - strap * (hinge[ANGLE] - ahead)
                + loss * rate
            )
            speed = drive / free
            turned = hinge[ANGLE] + step * speed
            # A cable cannot push: where the spring would, it is slack.
            if pulls == 0.0 or pulls * (rest - turned) >= 0.0:
                break
            stiffness = 0.0
        limb = strap * (turned - ahead) + loss * (speed - rate)
        hinge[STORED] = 0.5 * strap * (turned - ahead) ** 2
    else:
        turned, speed = angle, rate
        if pulls != 0.0 and pulls * (rest - turned) < 0.0:
            stiffness = 0.0
        limb = motor - stiffness * (turned - rest) - damping * speed
        hinge[STORED] = 0.0
    hinge[STORED] += 0.5 * stiffness * (turned - rest) ** 2
    hinge[ANGLE], hinge[SPEED], hinge[MOTOR], hinge[LIMB] = turned, speed, motor, limb
    return float(limb)


@njit_borrowing
def hinge_torques(
    step: float, state: Array, which: Index, numbers: Array, hinges: Array, forces: Array
) -> None:
    """Add the torques of all hinges over a `step` (s) to the generalised `forces` (31,) Nm and N of
    a body, in and out. `state` (2, 31) has the body's positions and velocities, `which` (H,) the
    coordinate of each hinge; `numbers` (H, NUMBERS) and `hinges` (H, STATE), in and out, are
    theirs.
    """
    for h in range(which.shape[0]):
        i = which[h]
        forces[i] += hinge_torque(step, state[0, i], state[1, i], numbers[h], hinges[h])


@njit_borrowing
def steps_with_devices(
    body: WalkerBody,
    state: Array,
    phase: float,
    pace: float,
    target: Array,
    slope: Array,
    root_force: Array,
    memory: Array,
    account: Account,
    work: Workspace,
    which: Array,
    numbers: Array,
    hinges: Array,
    log: Array,
) -> float:
    """`walk.simulation.physics_steps.steps` with the hinges of devices: `body`, `state`, `phase`,
    `pace`, `target`, `slope`, `root_force`, `memory`, `account` and `work` as there, `which`,
    `numbers` and `hinges` as `hinge_torques` takes them. `log` (N, H, STATE) out has the hinges
    after each step.
    """
    for row in range(account.phase.shape[0]):
        for i in range(ACTUATED_COUNT):
            target[i] += slope[i]
        forces(body, state, phase, pace, target, root_force, memory, work)
        hinge_torques(body.physics_step, state, which, numbers, hinges, work.forces)
        accelerations(
            body.tree,
            work.frames,
            state,
            work.forces,
            body.stiffness,
            body.total_damping,
            body.physics_step,
            work.dynamics,
            work.acceleration,
        )
        integrate(state, work.acceleration, body.physics_step)
        phase += pace * body.phase_step
        enter(body, state, phase, row, account, work)
        for h in range(hinges.shape[0]):
            for k in range(hinges.shape[1]):
                log[row, h, k] = hinges[h, k]
    return phase
