"""A stored policy as a walker that is disturbed."""

from gaitval.apps.balance.experiment import Walker
from gaitval.study.stored_policy import StoredPolicy


def walker_of(policy: StoredPolicy, *, delay: float = 0.0) -> Walker:
    """The walker of a stored `policy`, with its identified body and corrected reference, as it is
    validated; by `delay` s it feels its body late.
    """
    task = policy.corrected_task
    if delay:
        task = task.with_environment(observation_delay=delay)
    return Walker.of(task, policy.network, policy.identified)
