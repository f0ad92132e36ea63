"""How a walk went, without its trajectory."""

from types import SimpleNamespace


def score_rollout(environment, policy, *, mu, start_phase, seconds, push=None):
    """Whether so many `seconds` of a walk without noise end in a fall, and its gait cycles."""
    environment.centre(policy.act, mu, key=policy.key)
    options = {"phase": start_phase, "mu": mu, "push": push, "noise": 0.0}
    observation, _ = environment.reset(seed=0, options=options)
    fell, info = False, {"cycles": 0.0}
    for _ in range(round(seconds / environment.walker.action_seconds)):
        observation, _, fell, _, info = environment.step(policy.act(observation))
        if fell:
            break
    return SimpleNamespace(fell=fell, cycles=float(info["cycles"]))
