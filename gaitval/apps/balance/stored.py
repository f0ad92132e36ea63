"""A stored policy as a walker that is disturbed."""

from gaitval.apps.balance.experiment import TestedWalker
from gaitval.study.stored_policy import StoredPolicy


def walker_of(
    policy: StoredPolicy, *, delays: tuple[float, float, float] | None = None
) -> TestedWalker:
    """The walker of a stored `policy`, with its identified body and corrected reference, as it is
    validated; if `delays`, s, are given, it feels its body as late as they say.
    """
    task = policy.corrected_task
    if delays is not None:
        task = task.with_environment(observation_delays=delays)
    return TestedWalker.of(task, policy.network, policy.identified)
