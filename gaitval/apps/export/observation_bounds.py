"""The largest and smallest observation of `gaitval/Walker-v0`: what a body can physically do."""

from typing import Final

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

TURN: Final = np.pi
"""rad: half a turn, which no joint reaches from its zero; a rotation vector has no longer one."""
JOINT_RATE: Final = 100.0
"""rad/s: sixteen turns a second, of a joint."""
BODY_RATE: Final = 30.0
"""rad/s: five turns a second, of the whole body or the pelvis."""
SPEED: Final = 10.0
"""m/s: a fall from five metres."""
FORCE: Final = 20.0
"""Body weights, on one foot, mean over an action: a landing from a height has half of it."""
FROUDE: Final = 1.0
"""Speed over the square root of gravity times leg length: beyond 1 gravity cannot hold the body on
the arc over its stance leg, so nobody walks faster."""


def observation_bounds(
    environment: WalkingEnvironment, mu: Array
) -> tuple[NDArray[np.float32], NDArray[np.float32]]:
    """Low and high (size,) of the observation of an `environment` whose body has the parameters
    `mu` (14,), or others in the range that they are drawn from. A mirrored observation has the
    same.
    """
    constants, model = environment.constants, environment.task.model
    # An episode ends beyond a tolerance, at the latest an action later.
    travel = SPEED * environment.walker.action_seconds
    drift, height = constants.drift_tolerance + travel, constants.height_tolerance + travel
    # No foot is further from the pelvis' origin than hip and leg are long, here or there.
    hip = max(float(np.linalg.norm(model[f"thigh_{s[0]}"].joint_position)) for s in SIDES)
    apart = 2.0 * (hip + model.leg_length)
    extended = constants.observation == "extended"
    limits: dict[str, float | list[float]] = {
        "joint_angles": TURN,
        "joint_velocities": JOINT_RATE * (VELOCITY_SCALE if extended else 1.0),
        "centre_of_mass_velocity": SPEED,
        "angular_velocity": BODY_RATE,
        "phase": 1.0,
        "parameters": np.inf,
        "waves": 1.0,
        "pelvis_rotation": TURN,
        "pelvis_position": [drift, drift, height],
        "pelvis_angular_velocity": BODY_RATE,
        "pelvis_velocity": SPEED,
        "feet": apart,
        "ground_reaction": FORCE,
        "speed": FROUDE,
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
