"""What an action of the policy is, and what an environment makes of its outcome, compiled.

`WalkingEnvironment` calls this for itself, `WalkingGroup` for eight environments in one call.
"""

from typing import Any, NamedTuple

from gaitval.arrays import Array
from gaitval.compiled import njit, njit_borrowing
from gaitval.model.tree import Tree
from gaitval.policy.observation import ACTION_ORDER, ACTION_SIGNS, Targets, measure
from gaitval.policy.reward import weighted_reward


class Yardstick(NamedTuple):
    """What an environment measures with, all its life.

    Attributes
    ----------
    weights, sharpness : (10,), (9,) as in `policy.reward`.
    tolerances : (3,) of height m, rotation rad and drift m of the pelvis.
    half_action : phase of half an action.
    mass, weight : of the nominal body, kg and N.
    extended, mirrors : kind of the observation, and whether it is mirrored.
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


@njit
def take_action(
    asked: Any, limit: float, shares: Array, mirrored: bool, action: Array, before: Array
) -> None:
    """Enter the policy's action.

    Parameters
    ----------
    asked : (25,) or (26,), with the pace.
    shares : (26,) fraction of each number that reaches the body.
    mirrored : the policy acts on the mirror image.
    action, before : (26,) in and out.
    """
    for i in range(26):
        before[i] = action[i]
        source = ACTION_ORDER[i] if mirrored else i
        value = 0.0
        if source < asked.shape[0]:
            value = asked[source]
            value = limit if value > limit else (-limit if value < -limit else value)
        action[i] = shares[i] * (ACTION_SIGNS[i] * value if mirrored else value)


@njit_borrowing
def _mean_square_change(action: Array, before: Array) -> float:
    total = 0.0
    for i in range(26):
        total += (action[i] - before[i]) * (action[i] - before[i])
    return total / 26.0


@njit
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
) -> tuple[float, bool]:
    """Reward of the last action, and whether the walker has fallen; fills observation, errors and
    terms. If the simulation has diverged, that is a fall, and the observation stays.

    Parameters
    ----------
    lift : m, added to the reference's heights for the leg length of the body.
    tolerance_share : fraction of the tolerances at which an episode ends.
    ground, moments, squares : means over the action, see `WalkerArrays`.
    """
    errors, terms = episode.errors, episode.terms
    sound = measure(
        tree,
        yardstick.targets,
        state,
        phase,
        pace,
        lift,
        yardstick.half_action,
        yardstick.mass,
        yardstick.weight,
        ground,
        moments,
        episode.action,
        _mean_square_change(episode.action, episode.before),
        episode.parameters,
        yardstick.extended,
        yardstick.mirrors,
        episode.observation,
        errors,
    )
    if not sound:
        terms[:] = 0.0
        return 0.0, True
    effort = 0.0
    for i in range(25):
        effort += squares[i]
    effort /= yardstick.mass * yardstick.mass
    reward = weighted_reward(yardstick.weights, yardstick.sharpness, errors, effort, terms)
    within = True
    for i in range(3):
        within = within and errors[9 + i] < tolerance_share * yardstick.tolerances[i]
    return reward, not within
