"""The reward of a step: bounded kernels of squared errors, and a cost of the joint moments.

As in the paper (section III-A, equations 1 and 2) with the decisions of docs/paper.md.
"""

from typing import Any, Final

import numpy as np

from gaitval._internal.numba.compiled import njit_borrowing
from gaitval._internal.numba.lanes import exponential
from gaitval.arrays import Array
from gaitval.configuration import RewardSettings

REWARD_TERMS: Final[tuple[str, ...]] = (
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
"""Kernels of errors, and last the torque cost. `RewardSettings` has a weight of each name, and of
each kernel its sharpness; `observation.measure` writes a kernel's squared error at its place.
"""

KERNELS: Final = len(REWARD_TERMS) - 1
"""Number of kernels."""

# places of the terms and of their errors, for compiled code
(
    JOINT_POSITIONS, JOINT_VELOCITIES, CENTRE_OF_MASS, PELVIS_ROTATION, END_EFFECTORS,
    GROUND_REACTION, JOINT_MOMENTS, PACE, ACTION_CHANGE, TORQUE,
) = range(len(REWARD_TERMS))  # fmt: skip

ERRORS: Final = (*REWARD_TERMS[:KERNELS], "height", "rotation", "drift")
"""What `observation.measure` measures: squared errors of the kernels, and of the pelvis what ends
an episode, m, rad, m."""
HEIGHT, ROTATION, DRIFT = range(KERNELS, len(ERRORS))


@njit_borrowing
def weighted_reward(
    weights: Array, sharpness: Array, errors: Array, effort: Any, terms: Array
) -> Any:
    """Reward of a step, and its terms; of one walker, or of eight in lanes.

    A kernel is weight / (sum of the kernels' weights) x exp(-sharpness x squared error): they add
    up to 1 for a walker exactly on the reference; the last term is the torque cost.

    Parameters
    ----------
    weights : (10,) in the order of `REWARD_TERMS`.
    sharpness : (9,) of the kernels, in 1 / unit of the squared error.
    errors : of `ERRORS`, as `observation.measure` gives them.
    effort : sum of the joints' mean squared moments, (Nm/kg)².
    terms : (10,) out, in the order of `REWARD_TERMS`.

    Returns
    -------
    The sum of the terms.
    """
    total: Any = 0.0
    for i in range(KERNELS):
        total += weights[i]
    reward: Any = 0.0
    for i in range(KERNELS):
        # A kernel is between 0 and 1, so that no single error, however large, can outweigh the
        # others or make falling early worth its while.
        terms[i] = weights[i] / total * exponential(-sharpness[i] * errors[i])
        reward += terms[i]
    terms[TORQUE] = -weights[TORQUE] / total * effort
    return reward + terms[TORQUE]


def reward_numbers(reward: RewardSettings) -> tuple[Array, Array]:
    """Weights (10,) in the order of `REWARD_TERMS`, and sharpness (9,) of the kernels, by the
    settings of `reward`, which have a field for each term and `…_sharpness` for each kernel.
    """
    weights = [getattr(reward, name) for name in REWARD_TERMS]
    sharpness = [getattr(reward, f"{name}_sharpness") for name in REWARD_TERMS[:KERNELS]]
    return np.array(weights, dtype=float), np.array(sharpness, dtype=float)
