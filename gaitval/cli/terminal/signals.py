"""Signals that end the command do so in order, so that no processes, half-written files or
temporary folders remain.
"""

import signal

from gaitval.cli.terminal import display


def end_in_order() -> None:
    """From now on end in order, as after Ctrl-C, when asked to from outside. A handler that
    somebody else has set, such as nohup's, stays.
    """

    def end(number: int, _: object) -> None:
        display.messages.print("ended from outside; the same command resumes", style="yellow")
        # the exit code by which a shell reports a signal
        raise SystemExit(128 + number)

    for name in ("SIGTERM", "SIGHUP"):
        kind = getattr(signal, name, None)  # Windows has no SIGHUP
        if kind is not None and signal.getsignal(kind) == signal.SIG_DFL:
            signal.signal(kind, end)
