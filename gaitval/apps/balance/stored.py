"""A stored policy as a walker that is disturbed."""

from gaitval.apps.balance.experiment import TestedWalker
from gaitval.study.stored_policy import StoredPolicy


def walker_of(policy: StoredPolicy, *, delay: float = 0.0) -> TestedWalker:
    """The walker of a stored `policy`, with its identified body and corrected reference, as it is
    validated; by `delay` s it feels its body late.
    """
    task = policy.corrected_task
    if delay:
        task = task.with_environment(observation_delay=delay)
    return TestedWalker.of(task, policy.network, policy.identified)
