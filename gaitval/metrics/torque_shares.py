"""Where the joint moments of a walk come from: feed-forward, servo, policy, passive damping.

The servo's law (`gaitval.walk.simulation.walker`) is a sum, so the moment that acted at each
instant is split without remainder:

    τ = τ_ff(φ)                             feed-forward: the reference's moment
      + k (q̂(φ) − q⁺) + d (p q̂̇(φ) − q̇⁺)    servo: spring and damper about the reference
      + k a                                 policy: what the action's offset a adds
      − β q̇⁺                                passive damping of the joint

with φ the phase before the physics step and q⁺, q̇⁺ the state after it, which in a walk is the next
row; the last row is left out.
"""

import numpy as np

from gaitval.arrays import Array
from gaitval.coordinates import ACTUATED
from gaitval.metrics.cycles import GaitCycles, step_of
from gaitval.metrics.results import PARTS, MomentShare, TorqueShares
from gaitval.metrics.typed import number
from gaitval.model.parameters import PARAMETERS
from gaitval.walk.simulation.rollout import Rollout
from gaitval.walk.simulation.servo import reference_tables, servo_stiffness
from gaitval.walk.simulation.walker import WalkingTask


def moment_parts(rollout: Rollout, task: WalkingTask) -> dict[str, Array]:
    """Each of `PARTS` (T - 1, 25) Nm of the moments of `rollout`, which was walked on `task`; they
    add up to `rollout.moments` but the last.
    """
    servo = task.configuration.servo
    stiffness = servo_stiffness(servo, task.model.mass)
    damping = servo.damping_time * stiffness
    tables = reference_tables(
        task.reference, servo.feed_forward, task.configuration.environment.physics_step
    )
    # the servo reads the phase before the step, and the state after it (implicit damping)
    before = rollout.phase[:-1]
    # p of the law above: how fast the phase runs compared with the reference's stride
    pace = np.diff(rollout.phase) * task.reference.stride_time / step_of(rollout)
    target, rate, feed_forward = (_at(table, before) for table in tables)
    # The actuated coordinates follow the six of the free pelvis; a step moves them by its velocity.
    positions = rollout.positions[1:, 6:]
    velocities = np.diff(rollout.positions[:, 6:], axis=0) / step_of(rollout)
    passive = -float(rollout.mu[PARAMETERS.index("damping")]) * velocities
    spring = stiffness * (target - positions)
    servo_moment = spring + damping * (pace[:, None] * rate - velocities)
    # the remainder, since k a is the only other term of the law
    policy = rollout.moments[:-1] - feed_forward - servo_moment - passive
    return dict(zip(PARTS, (feed_forward, servo_moment, policy, passive), strict=True))


def _at(table: Array, phase: Array) -> Array:
    """Rows of a closed table (N + 1, 25) at phases (T,), interpolated as the walker does."""
    # the last row repeats the first, so `row + 1` always exists
    place = (phase - np.floor(phase)) * (len(table) - 1)
    row = place.astype(int)
    part = (place - row)[:, None]
    return np.asarray((1.0 - part) * table[row] + part * table[row + 1])


def torque_shares(rollout: Rollout, cycles: GaitCycles, task: WalkingTask) -> TorqueShares | None:
    """RMS (Nm/kg) and explained variance of each part, by actuated coordinate, over the compared
    right `cycles` of `rollout` on `task`; None without a cycle.
    """
    if cycles.count("right") == 0:
        return None
    rows = cycles.rows()
    whole = rollout.moments[rows]
    parts = {name: part[rows] for name, part in moment_parts(rollout, task).items()}
    variance = whole.var(axis=0)
    return {
        joint: {
            name: MomentShare(
                rms=float(np.sqrt(np.mean(part[:, i] ** 2)) / task.model.mass),
                r_squared=number(1.0 - np.mean((whole[:, i] - part[:, i]) ** 2) / whole[:, i].var())
                if variance[i] > 0.0
                else None,
            )
            for name, part in parts.items()
        }
        for i, joint in enumerate(ACTUATED)
    }
