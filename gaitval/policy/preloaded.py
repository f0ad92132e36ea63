"""What worker processes need, loaded on import: the server that forks them imports this once."""

import atexit
import shutil
from multiprocessing import forkserver
from pathlib import Path

from gaitval.memory import give_back_soon
from gaitval.policy import rollout_buffer, rollouts
from gaitval.policy.observation import is_mirrored

__all__ = ["rollout_buffer", "rollouts"]

give_back_soon()
is_mirrored(0.0)  # before its first compiled function numba reads all that it can compile: 0.4 s


@atexit.register
def _remove_socket() -> None:
    """The folder of the server's socket, which its parent removes, if that has not been killed."""
    address = getattr(getattr(forkserver, "_forkserver", None), "_forkserver_address", None)
    if isinstance(address, str) and (folder := Path(address).parent).name.startswith("pymp-"):
        shutil.rmtree(folder, ignore_errors=True)
