"""The reward of a step: bounded kernels of squared errors, and a cost of the joint moments.

As in the paper (section III-A, equations 1 and 2) with the decisions of docs/decisions.md.
"""

from typing import Any

import numpy as np

from gaitval.arrays import Array
from gaitval.compiled import njit_borrowing
from gaitval.configuration import RewardSettings
from gaitval.lanes import exponential

REWARD_TERMS = (
    "joint_positions",
    "joint_velocities",
    "centre_of_mass",
    "pelvis_rotation",
    "end_effectors",
    "ground_reaction",
    "joint_moments",
    "pace",
    "action_change",
    "torque",
)


@njit_borrowing
def weighted_reward(
    weights: Array, sharpness: Array, errors: Array, effort: Any, terms: Array
) -> Any:
    """Reward of a step, and its terms; of one walker, or of eight in lanes.

    The first nine terms are weight / (sum of the first nine weights) x exp(-sharpness x squared
    error), which add up to 1 for a walker exactly on the reference; the last is the torque cost.

    Parameters
    ----------
    weights : (10,) in the order of `REWARD_TERMS`.
    sharpness : (9,) of all but the last, in 1 / unit of the squared error.
    errors : the first nine are squared errors, as `observation.measure` gives them.
    effort : sum of the joints' mean squared moments, (Nm/kg)².
    terms : (10,) out, in the order of `REWARD_TERMS`.

    Returns
    -------
    The sum of the terms.
    """
    total: Any = 0.0
    for i in range(9):
        total += weights[i]
    reward: Any = 0.0
    for i in range(9):
        # A kernel is between 0 and 1, so that no single error, however large, can outweigh the
        # others or make falling early worth its while.
        terms[i] = weights[i] / total * exponential(-sharpness[i] * errors[i])
        reward += terms[i]
    terms[9] = -weights[9] / total * effort
    return reward + terms[9]


def reward_numbers(reward: RewardSettings) -> tuple[Array, Array]:
    """Weights (10,) in the order of `REWARD_TERMS`, and sharpness (9,) of all but the last, by the
    settings of `reward`, which have a field for each term and `…_sharpness` for each of the first
    nine.
    """
    weights = [getattr(reward, name) for name in REWARD_TERMS]
    sharpness = [getattr(reward, f"{name}_sharpness") for name in REWARD_TERMS[:-1]]
    return np.array(weights, dtype=float), np.array(sharpness, dtype=float)
