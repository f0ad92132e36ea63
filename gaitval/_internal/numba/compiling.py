"""Prints that numba compiles, which takes about a minute the first time and happens once per
machine.

From the command line and from Python alike it is one line on stderr. `compiled` loads this at the
first compilation, so nothing is printed where the cache has everything, nor by workers.
"""

import multiprocessing
import sys
from time import monotonic
from typing import Any, Final

from numba.core import event

WORTH_A_WORD: Final = 3.0
"""s of compiling after which the line is printed also if the cache was not empty."""


class Announcer(event.Listener):
    """Notices every compilation, and prints a line once.

    Parameters
    ----------
    first : whether nothing was compiled before.
    """

    def __init__(self, *, first: bool) -> None:
        self._first = first
        self._notified = False
        self._depth = 0
        self._since = self._spent = 0.0

    def on_start(self, event: Any) -> None:
        """A compilation starts, perhaps within another."""
        # Compiling one function compiles those that it calls: only the outermost start and end
        # measure, or nested times would be counted twice.
        if self._depth == 0:
            self._since = monotonic()
            if self._first:
                self._notify("for the first time, once, about a minute")
        self._depth += 1

    def on_end(self, event: Any) -> None:
        """It has ended, or failed."""
        self._depth -= 1
        if self._depth == 0:
            self._spent += monotonic() - self._since
            if self._spent > WORTH_A_WORD:
                self._notify("what was not used before, once, less than a minute")

    def _notify(self, how: str) -> None:
        # A worker process would repeat what its parent has printed already.
        if self._notified or multiprocessing.parent_process() is not None:
            return
        self._notified = True
        print(f"gaitval: compiling {how} ...", file=sys.stderr, flush=True)
