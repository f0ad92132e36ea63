"""Work beside what this process does: in a thread, for work that worker processes do."""

import threading
from collections.abc import Callable, Iterator
from concurrent.futures import Future
from contextlib import contextmanager
from typing import TypeVar

import scipy.linalg  # noqa: F401  a library that is loaded later would not be limited
from threadpoolctl import threadpool_limits  # type: ignore[import-untyped]

_Result = TypeVar("_Result")


@contextmanager
def beside(function: Callable[..., _Result], *arguments: object) -> Iterator[Callable[[], _Result]]:
    """Run a function in a thread, whose linear algebra and that of the block have one thread each.

    Parameters
    ----------
    function : what it computes at length, `kept_workers` should do.
    arguments : its positional arguments.

    Yields
    ------
    A function that waits for the result, and raises what the other one raised. The block ends when
        both have; at once, if it raises itself.
    """
    answer: Future[_Result] = Future()

    def work() -> None:
        try:
            answer.set_result(function(*arguments))
        except BaseException as error:  # for who waits
            answer.set_exception(error)

    # A daemon: a program that is stopped does not wait for it.
    thread = threading.Thread(target=work, daemon=True)
    # The limit is the process's. Of two limits that overlap in time, the one that ends first would
    # lift the other's; within this one both only restore one thread.
    with threadpool_limits(1, "blas"):
        thread.start()
        yield answer.result
        thread.join()
