"""A process beside this one, which works with what other processes leave of the processors."""

import os
import signal
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from multiprocessing.connection import Connection
from typing import Any, Final, TypeVar

from gaitval.policy.processes import begin_as_worker, one_thread, ready_to_start

Result = TypeVar("Result")

_PATIENCE: Final = 10
"""`nice` of a process beside this one: it only gets processor time that others leave."""


@contextmanager
def beside(function: Callable[..., Result], *arguments: object) -> Iterator[Callable[[], Result]]:
    """Run a function in a process of its own, with what other processes leave of the processors.

    Parameters
    ----------
    function : a module's function.
    arguments : its positional arguments; these and the result are pickled.

    Yields
    ------
    A function that waits for the result, and raises what the other one raised, or RuntimeError if
        the process ended without a result. If the block is left before, the process is ended.
    """
    context = ready_to_start()
    here, there = context.Pipe(duplex=False)
    process = context.Process(target=_answer, args=(there, function, arguments), daemon=True)
    with one_thread():
        process.start()
    # This process's copy of the sending end: as long as one is open, a killed process gives no
    # EOFError.
    there.close()

    def result() -> Result:
        try:
            value, error = here.recv()
        except EOFError:
            process.join()
            raise RuntimeError(
                f"The process of {function.__name__} ended with {process.exitcode}."
            ) from None
        if error is not None:
            raise error
        answer: Result = value
        return answer

    try:
        yield result
    finally:
        process.terminate()
        process.join()
        here.close()


def _answer(
    sending: Connection, function: Callable[..., Any], arguments: tuple[object, ...]
) -> None:
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # the process that started it ends it
    begin_as_worker()
    if hasattr(os, "nice"):
        os.nice(_PATIENCE)
    try:
        sending.send((function(*arguments), None))
    except Exception as error:  # for the process that waits
        sending.send((None, error))
