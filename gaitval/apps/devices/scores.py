"""How a walk went, without its trajectory."""

from dataclasses import dataclass

from gaitval.arrays import Array
from gaitval.policy.environment import WalkingEnvironment
from gaitval.policy.storage import Policy


@dataclass(frozen=True)
class RolloutScore:
    """Score of a rollout.

    Attributes
    ----------
    reward : mean reward of a planned step; steps after a fall count as zero.
    cycles : gait cycles walked.
    fell : the rollout ended early.
    """

    reward: float
    cycles: float
    fell: bool


def score_rollout(
    environment: WalkingEnvironment,
    policy: Policy,
    *,
    mu: Array,
    start_phase: float,
    seconds: float,
    push: tuple[float, float, float] | None = None,
) -> RolloutScore:
    """Simulate `seconds` of walking in the `environment`, by its engine, without keeping the
    trajectory. The `policy` is used without noise, with the body parameters `mu` (14,), from
    `start_phase`, the phase of the right gait cycle; `push` as in `WalkingEnvironment`.
    """
    options = {"phase": start_phase, "mu": mu, "push": push, "noise": 0.0}
    environment.centre(policy.act, mu, key=policy.key)
    observation, _ = environment.reset(seed=0, options=options)
    planned = round(seconds / environment.walker.action_seconds)
    total, fell, info = 0.0, False, {"cycles": 0.0}
    for _ in range(planned):
        observation, reward, fell, _, info = environment.step(policy.act(observation))
        if fell:
            break
        total += reward
    return RolloutScore(total / planned, float(info["cycles"]), fell)
