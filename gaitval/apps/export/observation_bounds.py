"""The largest and smallest observation of `gaitval/Walker-v0`: what a body can physically do."""

from typing import Final, NamedTuple

import numpy as np
from numpy.typing import NDArray

from gaitval.arrays import Array
from gaitval.coordinates import SIDES
from gaitval.policy.environment import WalkingEnvironment
from gaitval.policy.observation import (
    OBSERVATION_SIZES,
    OBSERVED,
    PARAMETERS_OBSERVED,
    VELOCITY_SCALE,
)
from gaitval.policy.senses import observation_size


class BodyLimits(NamedTuple):
    """What a body can do at most; convention.

    Attributes
    ----------
    turn : rad: half a turn, which no joint reaches from its zero; a rotation vector has no longer
        one.
    joint_rate : rad/s: sixteen turns a second, of a joint.
    body_rate : rad/s: five turns a second, of the whole body or the pelvis.
    speed : m/s: a fall from five metres.
    force : body weights, on one foot, mean over an action: a landing from a height has half of it.
    froude : speed over the square root of gravity times leg length: beyond 1 gravity cannot hold
        the body on the arc over its stance leg, so nobody walks faster.
    """

    turn: float
    joint_rate: float
    body_rate: float
    speed: float
    force: float
    froude: float


LIMITS: Final = BodyLimits(
    turn=np.pi, joint_rate=100.0, body_rate=30.0, speed=10.0, force=20.0, froude=1.0
)


def observation_bounds(
    environment: WalkingEnvironment, mu: Array
) -> tuple[NDArray[np.float32], NDArray[np.float32]]:
    """Low and high (size,) of the observation of an `environment` whose body has the parameters
    `mu` (14,), or others in the range that they are drawn from. A mirrored observation has the
    same.
    """
    constants, model = environment.constants, environment.task.model
    # An episode ends beyond a tolerance, at the latest an action later.
    travel = LIMITS.speed * environment.walker.action_seconds
    drift, height = constants.drift_tolerance + travel, constants.height_tolerance + travel
    # No foot is further from the pelvis' origin than hip and leg are long, here or there.
    hip = max(float(np.linalg.norm(model[f"thigh_{s[0]}"].joint_position)) for s in SIDES)
    apart = 2.0 * (hip + model.leg_length)
    extended = constants.observation == "extended"
    limits: dict[str, float | list[float]] = {
        "joint_angles": LIMITS.turn,
        "joint_velocities": LIMITS.joint_rate * (VELOCITY_SCALE if extended else 1.0),
        "centre_of_mass_velocity": LIMITS.speed,
        "angular_velocity": LIMITS.body_rate,
        "phase": 1.0,
        "parameters": np.inf,
        "waves": 1.0,
        "pelvis_rotation": LIMITS.turn,
        "pelvis_position": [drift, drift, height],
        "pelvis_angular_velocity": LIMITS.body_rate,
        "pelvis_velocity": LIMITS.speed,
        "feet": apart,
        "ground_reaction": LIMITS.force,
        "speed": LIMITS.froude,
        "action": constants.action_limit,
    }
    high = np.zeros(OBSERVATION_SIZES[constants.observation])
    for name, part in OBSERVED.items():
        if part.stop <= len(high):
            high[part] = limits[name]
    low = -high
    for name in ("phase", "speed"):
        low[OBSERVED[name]] = 0.0
    drawn = [environment.observed_parameters(each) for each in (*environment.parameter_range, mu)]
    low[PARAMETERS_OBSERVED], high[PARAMETERS_OBSERVED] = (
        np.min(drawn, axis=0),
        np.max(drawn, axis=0),
    )
    # what was done is as large as what is done
    memory = np.full(observation_size(constants) - len(high), constants.action_limit)
    low, high = np.append(low, -memory), np.append(high, memory)
    return low.astype(np.float32), high.astype(np.float32)
