"""What worker processes need, loaded on import: the server that forks them imports this once."""

# ruff: noqa: E402
import signal

# First: the Ctrl-C of a terminal goes to all processes, and whoever started this one ends it. While
# it loads it would end with a traceback.
signal.signal(signal.SIGINT, signal.SIG_IGN)

from gaitval.memory import share_heap
from gaitval.policy import rollout_buffer, rollouts
from gaitval.policy.observation import is_mirrored

__all__ = ["rollout_buffer", "rollouts"]

share_heap()
is_mirrored(0.0)  # before its first compiled function numba reads all that it can compile: 0.4 s
