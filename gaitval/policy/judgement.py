"""Entering an action of the policy, and reward and fall from its outcome, compiled.

`WalkingEnvironment` calls this for itself, `WalkingGroup` for eight environments in lanes.
"""

from typing import Any, NamedTuple

from gaitval.arrays import Array
from gaitval.compiled import njit_borrowing
from gaitval.lanes import where
from gaitval.model.tree import ACTUATED_COUNT, Tree
from gaitval.policy.observation import (
    ACTION_ORDER,
    ACTION_SIGNS,
    MeasureWorkspace,
    Targets,
    diverged,
    measure,
)
from gaitval.policy.reward import weighted_reward


class Yardstick(NamedTuple):
    """What an environment compares a body with; constant from its construction on.

    Attributes
    ----------
    targets : of the reference, see `observation.targets_of`.
    weights, sharpness : (10,), (9,) as in `policy.reward`.
    tolerances : (3,) of height m, rotation rad and drift m of the pelvis.
    half_action : phase of half an action.
    mass, weight : of the nominal body, kg and N.
    extended, mirrors : whether the observation is the extended one, and whether it is mirrored in
        the left leg's half of the cycle.
    """

    targets: Targets
    weights: Array
    sharpness: Array
    tolerances: Array
    half_action: float
    mass: float
    weight: float
    extended: bool
    mirrors: bool


class EpisodeArrays(NamedTuple):
    """What changes with every action.

    Attributes
    ----------
    action, before : (26,) the last action as it acts, and the one before.
    parameters : (14,) the observed mu.
    observation : (size,), before it is mirrored.
    errors, terms : (12,), (10,) as in `measure` and `weighted_reward`.
    root_force : (6,) Nm, N, of the push.
    """

    action: Array
    before: Array
    parameters: Array
    observation: Array
    errors: Array
    terms: Array
    root_force: Array


@njit_borrowing
def take_action(
    asked: Any, limit: float, shares: Array, mirrored: bool, action: Array, before: Array
) -> None:
    """Enter the policy's action: clip, mirror and scale it.

    Parameters
    ----------
    asked : (25,) joints, or (26,) with the pace; clipped to -limit ... limit.
    limit : largest absolute value of an element of `asked`.
    shares : (26,) fraction of each number that reaches the body.
    mirrored : the policy acts on the mirror image.
    action, before : (26,) in and out; `before` receives the action so far, `action` the new one.
    """
    for i in range(26):
        before[i] = action[i]
        source = ACTION_ORDER[i] if mirrored else i
        # A policy that does not choose the pace asks for 25 numbers: the 26th is 0, a pace of 1.
        value = 0.0
        if source < asked.shape[0]:
            value = asked[source]
            value = limit if value > limit else (-limit if value < -limit else value)
        action[i] = shares[i] * (ACTION_SIGNS[i] * value if mirrored else value)


@njit_borrowing
def _mean_square_change(action: Array, before: Array) -> Any:
    total: Any = 0.0
    for i in range(26):
        total += (action[i] - before[i]) * (action[i] - before[i])
    return total / 26.0


@njit_borrowing
def judged(
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
    """As `judge`, of one walker whose `state` has not `diverged`, or of eight in lanes; whether it
    has fallen is a number, 1 or 0.
    """
    change = _mean_square_change(episode.action, episode.before)
    measure(
        tree, yardstick.targets, state, phase, pace, lift, yardstick.half_action, yardstick.mass,
        yardstick.weight, ground, moments, episode.action, change, episode.parameters,
        yardstick.extended, yardstick.mirrors, episode.observation, episode.errors, work,
    )  # fmt: skip
    errors, effort = episode.errors, 0.0
    for i in range(ACTUATED_COUNT):
        effort += squares[i]
    # Moments squared, so mass squared: the cost is of Nm/kg and does not depend on a person's size.
    effort /= yardstick.mass * yardstick.mass
    reward = weighted_reward(yardstick.weights, yardstick.sharpness, errors, effort, episode.terms)
    fell: Any = 0.0
    for i in range(3):
        # Elements 9 to 11 are height, rotation and drift, in the order of the tolerances. A NaN is
        # not smaller than anything, and so counts as a fall.
        within = errors[9 + i] < tolerance_share * yardstick.tolerances[i]
        fell = where(within, fell, 1.0)
    return reward, fell


@njit_borrowing
def judge(
    tree: Tree,
    yardstick: Yardstick,
    state: Array,
    phase: float,
    pace: float,
    lift: float,
    tolerance_share: float,
    ground: Array,
    moments: Array,
    squares: Array,
    episode: EpisodeArrays,
    work: MeasureWorkspace,
) -> tuple[float, bool]:
    """Reward of the last action, and whether the walker has fallen; fills observation, errors and
    terms of `episode`. If the simulation has diverged, that is a fall, and the observation is not
    changed.

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
    Reward of the action, and whether the pelvis is outside a tolerance (a fall).
    """
    if diverged(state) > 0.0:
        for i in range(episode.terms.shape[0]):
            episode.terms[i] = 0.0
        return 0.0, True
    reward, fell = judged(
        tree, yardstick, state, phase, pace, lift, tolerance_share, ground, moments, squares,
        episode, work,
    )  # fmt: skip
    return reward, fell > 0.0
