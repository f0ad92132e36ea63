"""What the server of workers loads first: until it has loaded the rest, it ends within a second of
the process that started it. Only afterwards does `multiprocessing` notice that, which may be a
minute later on a busy machine.
"""

import os
import signal
import sys
from types import FrameType
from typing import Final

_SECONDS: Final = 0.5
_STARTER: Final = os.getppid()


def _look(_: int, frame: FrameType | None) -> None:
    """End if nobody is left to serve; look no more once nothing is being imported."""
    if os.getppid() != _STARTER:
        sys.exit()
    while frame is not None and frame.f_globals.get("__name__") != "importlib._bootstrap":
        frame = frame.f_back
    if frame is None:
        signal.setitimer(signal.ITIMER_REAL, 0.0)


if any("multiprocessing.forkserver" in word for word in sys.orig_argv):
    signal.signal(signal.SIGALRM, _look)
    signal.setitimer(signal.ITIMER_REAL, _SECONDS, _SECONDS)
