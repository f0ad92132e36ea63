"""The reward of a step: bounded kernels of squared errors, and a cost of the joint moments.

As in the paper (section III-A, equations 1 and 2) with the decisions of docs/decisions.md.
"""

import numpy as np

from gaitval.arrays import Array
from gaitval.compiled import njit_borrowing
from gaitval.configuration import RewardSettings

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
    weights: Array, sharpness: Array, errors: Array, effort: float, terms: Array
) -> float:
    """Terms (10,) of the reward, in the order of `REWARD_TERMS`, and their sum. The first nine are
    weight / (sum of the first nine weights) x exp(-sharpness (9,) x squared error); the last is
    the torque cost.
    """
    total, reward = 0.0, 0.0
    for i in range(9):
        total += weights[i]
    for i in range(9):
        terms[i] = weights[i] / total * np.exp(-sharpness[i] * errors[i])
        reward += terms[i]
    terms[9] = -weights[9] / total * effort
    return float(reward + terms[9])


def reward_numbers(reward: RewardSettings) -> tuple[Array, Array]:
    """Weights (10,) in the order of `REWARD_TERMS`, and sharpness (9,) of all but the last."""
    weights = [getattr(reward, name) for name in REWARD_TERMS]
    sharpness = [getattr(reward, f"{name}_sharpness") for name in REWARD_TERMS[:-1]]
    return np.array(weights, dtype=float), np.array(sharpness, dtype=float)
