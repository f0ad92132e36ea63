"""How much of a policy's action bias to remove, found from the reference without the record.

A policy of one person at one speed walks nearest to its reference with half of its action bias
removed (`environment.centring`). One that has learned several speeds is more biased at some of them
than at others. So the share is found at each speed: that of the walk nearest to the reference.
"""

from typing import Final

import numpy as np

from gaitval.arrays import Array
from gaitval.metrics.comparison import curves_of
from gaitval.metrics.cycles import find_cycles
from gaitval.metrics.epsilon import epsilon
from gaitval.metrics.reference_curves import reference_curves
from gaitval.policy.environment import WalkingEnvironment
from gaitval.policy.rollouts import record_rollout
from gaitval.policy.storage import Policy
from gaitval.walk.simulation.walker import WalkingTask

SHARES: Final = (0.25, 0.5, 0.75, 1.0)
_CYCLES: Final = 8


def centred(task: WalkingTask, policy: Policy, mu: Array) -> float:
    """The share of action bias to remove so that the walk is nearest to its reference, by epsilon.

    Each of `SHARES` is tried on a walk of `policy` on `task` with the body parameters `mu` (14,).
    Walks that fall do not count; if all do, the configured share is returned.
    """
    validation = task.configuration.validation
    wanted = reference_curves(task.reference, task.model.mass, task.record.left_phase)
    best, least = task.configuration.environment.centring, np.inf
    for share in SHARES:
        walker = WalkingEnvironment(task.with_environment(centring=share))
        rollout = record_rollout(
            walker, policy, mu=mu, start_phase=0.0, cycles=validation.settling_cycles + _CYCLES
        )
        if rollout.fell[0]:
            continue
        found = epsilon(curves_of(task, rollout, find_cycles(rollout, task.configuration)), wanted)
        if found is not None and found.total is not None and found.total < least:
            best, least = share, found.total
    return best
