"""The plain way of walks side by side, which quicker ones are compared with."""

from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from gaitval.arrays import Array
from gaitval.policy.rollouts import _actions_together
from gaitval.policy.storage import Policy
from gaitval.policy.walking_group import WalkingGroup


def fell_together(
    group: WalkingGroup,
    policy: Policy,
    *,
    mu: Array,
    starts: Sequence[dict[str, Any]],
    seconds: Sequence[float],
) -> NDArray[np.bool_]:
    """Whether each of at most eight walks, followed for its `seconds`, ends in a fall (walks,); the
    other arguments as of `walks_together`.
    """
    action_seconds = group.environments[0].walker.action_seconds
    left = np.array([round(each / action_seconds) for each in seconds])
    fell = np.zeros(len(starts), dtype=bool)
    for fallen in _actions_together(group, policy, mu, starts):
        # A walk that is over is simulated on with its group, but no longer counts.
        fell |= fallen & (left > 0)
        left = np.where(fallen, 0, np.maximum(left - 1, 0))
        if not left.any():
            break
    return fell
