"""Entering an action of the policy, and reward and fall from its outcome, compiled.

`WalkingEnvironment` calls this for itself, `WalkingGroup` for eight environments in lanes.
"""

from typing import Any

from gaitval._internal.numba.compiled import njit_borrowing
from gaitval._internal.numba.lanes import where
from gaitval.arrays import Array
from gaitval.model.tree import ACTUATED_COUNT, Tree
from gaitval.policy.observation import (
    ACTION_COUNT,
    ACTION_ORDER,
    ACTION_SIGNS,
    EpisodeArrays,
    MeasureWorkspace,
    Yardstick,
    diverged,
    measure,
)
from gaitval.policy.reward import HEIGHT, weighted_reward


@njit_borrowing
def take_action(
    requested: Any,
    limit: float,
    entering: float,
    shares: Array,
    mirrored: bool,
    action: Array,
    before: Array,
) -> None:
    """Enter the policy's action `requested`, (25,) joints, or (26,) with the pace: clip it to
    -`limit` ... `limit`, mirror it if the policy acts on the mirror image (`mirrored`), scale it
    by the `shares` (26,) that reach the body, and go the share `entering` of the way to it.
    `action` and `before` (26,) are in and out: `before` receives the action so far, `action` the
    new one, which is what the policy sees of it.
    """
    for i in range(ACTION_COUNT):
        before[i] = action[i]
        source = ACTION_ORDER[i] if mirrored else i
        # A policy that does not choose the pace asks for 25 numbers: the 26th is 0, a pace of 1.
        value = 0.0
        if source < requested.shape[0]:
            value = requested[source]
            value = limit if value > limit else (-limit if value < -limit else value)
        wanted = shares[i] * (ACTION_SIGNS[i] * value if mirrored else value)
        # written so that all of the way is the new action exactly
        action[i] = wanted + (1.0 - entering) * (before[i] - wanted)


@njit_borrowing
def _mean_square_change(action: Array, before: Array) -> Any:
    total: Any = 0.0
    for i in range(ACTION_COUNT):
        total += (action[i] - before[i]) * (action[i] - before[i])
    return total / float(ACTION_COUNT)


@njit_borrowing
def judge(
    tree: Tree,
    yardstick: Yardstick,
    state: Array,
    phase: Any,
    pace: Any,
    lift: Any,
    tolerance_share: float,
    ground: Array,
    moments: Array,
    squares: Array,
    episode: EpisodeArrays,
    work: MeasureWorkspace,
) -> Any:
    """Reward of the last action, and whether the walker has fallen; fills observation, errors and
    terms of `episode`. Of one walker, or of eight in lanes.

    Parameters
    ----------
    tree : the body.
    yardstick : reference, weights and tolerances.
    state : (2, 31) positions and velocities of the coordinates.
    phase : of the right gait cycle, counting on over cycles.
    pace : of the last action; 1 is the reference's.
    lift : m, added to the reference's heights for the leg length of the body.
    tolerance_share : fraction of the tolerances at which an episode ends.
    ground, moments, squares : (2, 3) N, (25,) Nm, (25,) Nm², means over the action, see
        `WalkerArrays`.
    episode : its last actions and parameters are read.
    work : overwritten.

    Returns
    -------
    Reward of the action; and 0 if the pelvis is within the tolerances, 1 if it is not (a fall), 2
    if the simulation has `diverged`: then nothing else that is given means anything.
    """
    change = _mean_square_change(episode.action, episode.before)
    measure(tree, yardstick, state, phase, pace, lift, ground, moments, change, episode, work)
    errors, effort = episode.errors, 0.0
    for i in range(ACTUATED_COUNT):
        effort += squares[i]
    # Moments squared, so mass squared: the cost is of Nm/kg and does not depend on a person's size.
    effort /= yardstick.mass * yardstick.mass
    reward = weighted_reward(yardstick.weights, yardstick.sharpness, errors, effort, episode.terms)
    fell: Any = 0.0
    for i in range(3):
        # height, rotation and drift are in the order of the tolerances
        within = errors[HEIGHT + i] < tolerance_share * yardstick.tolerances[i]
        fell = where(within, fell, 1.0)
    return reward, where(diverged(state) > 0.0, 2.0, fell)
