"""What worker processes need, loaded on import: the server that forks them imports this once."""

from gaitval.memory import give_back_soon
from gaitval.policy import rollout_buffer, rollouts
from gaitval.policy.observation import is_mirrored

__all__ = ["rollout_buffer", "rollouts"]

give_back_soon()
is_mirrored(0.0)  # before its first compiled function numba reads all that it can compile: 0.4 s
