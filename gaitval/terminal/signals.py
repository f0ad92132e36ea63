"""Signals that end the command do so in order, so that no processes, half-written files or
temporary folders remain.
"""

import os
import signal
import sys
import threading
from time import monotonic
from typing import Any, Final

from gaitval.terminal import display

ENDING: Final = 1.0
"""s after a signal in which another one means the same: Ctrl-C pressed twice, or what `timeout`
sends to a process and then to its group."""

_signal: int | None = None
"""The signal that asked this process to end."""


def received() -> int | None:
    """The signal that asked this process to end; None if none has."""
    return _signal


def end_in_order() -> None:
    """From now on handle signals that end the process as Ctrl-C.

    Python drops exceptions raised while a library calls back, for instance in a weak reference's
    function during an import; the signal is then sent again. Another signal must not interrupt the
    ending; if that takes longer than `ENDING`, it ends the process at once, as a kill does.
    """
    last, again = 0.0, False

    def end(number: int, _: object) -> None:
        global _signal
        nonlocal last, again
        first, sent_again, again = _signal is None, again, False
        if first:
            _signal, last = number, monotonic()
        elif not sent_again:
            if monotonic() - last > ENDING:
                os._exit(128 + number)  # workers and their server notice that it has gone
            return
        if number == signal.SIGINT:
            raise KeyboardInterrupt
        if first:
            display.messages.print("ended from outside; the same command resumes", style="yellow")
        # the exit code by which a shell reports a signal
        raise SystemExit(128 + number)

    for name, default in (
        ("SIGTERM", signal.SIG_DFL),
        ("SIGHUP", signal.SIG_DFL),
        ("SIGINT", signal.default_int_handler),
    ):
        kind = getattr(signal, name, None)
        # Windows has no SIGHUP; a handler that somebody else has set, such as nohup's, stays
        if kind is not None and signal.getsignal(kind) == default:
            signal.signal(kind, end)
    shown = sys.unraisablehook

    def dropped(unraisable: Any) -> None:
        if _signal is None or not issubclass(unraisable.exc_type, (KeyboardInterrupt, SystemExit)):
            shown(unraisable)
            return
        nonlocal again
        again = True
        timer = threading.Timer(0.05, os.kill, (os.getpid(), _signal))
        timer.daemon = True
        timer.start()

    sys.unraisablehook = dropped
