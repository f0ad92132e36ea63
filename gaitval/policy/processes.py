"""Worker processes: they end with the process that started them, however that ends, and may be kept
from one piece of work to the next.
"""

import multiprocessing as mp
import os
import signal
import sys
import threading
from collections.abc import Callable, Iterator
from concurrent.futures import ProcessPoolExecutor
from contextlib import contextmanager
from dataclasses import dataclass
from multiprocessing.connection import Connection
from multiprocessing.context import ForkServerContext, SpawnContext
from typing import Any, Final, TypeVar

from gaitval.memory import give_back_soon

Result = TypeVar("Result")

_PATIENCE: Final = 10
"""`nice` of a process beside this one: it only gets processor time that others leave."""


def ready_to_start(*also: str) -> ForkServerContext | SpawnContext:
    """How processes are started here: under Linux a server forks them, which has loaded once what
    they need, and shares that memory with them; elsewhere each loads it itself, in seconds.

    The first call starts the server, which loads while the caller continues. Its environment is
    that of the first call. It ends with this process.

    Parameters
    ----------
    also : modules that they will need, beside those of a walk; for the first call.
    """
    if sys.platform != "linux":
        return mp.get_context("spawn")
    from multiprocessing import forkserver

    # Not a plain fork: this process may have threads, of torch or BLAS, whose locks a forked child
    # would inherit locked.
    context = mp.get_context("forkserver")
    context.set_forkserver_preload(["gaitval.policy.preloaded", *also])
    try:
        with one_thread():
            forkserver.ensure_running()
    except OSError:  # its socket is a file, whose path may not be longer than some hundred bytes
        return mp.get_context("spawn")
    return context


def begin_as_worker() -> None:
    """What a worker process does first: it will end as soon as the one that started it has ended,
    and give memory back.

    A worker that waits for work never notices that its parent has gone, because it holds both ends
    of the queue itself. The watch is a thread that waits on the parent's sentinel, which exists on
    every system; Linux's signal at a parent's death would also come when only a thread of the
    parent ends.
    """
    give_back_soon()
    parent = mp.parent_process()
    if parent is None:
        return

    def watch() -> None:
        parent.join()
        # At once, without cleaning up: nobody is left to read what the worker might still write.
        os._exit(1)

    threading.Thread(target=watch, daemon=True).start()


@contextmanager
def one_thread() -> Iterator[None]:
    """Processes that start in this block use one thread, because a worker's arrays are tiny."""
    name = "OMP_NUM_THREADS"
    before = os.environ.get(name)
    os.environ[name] = "1"
    try:
        yield
    finally:
        if before is None:
            del os.environ[name]
        else:
            os.environ[name] = before


def new_workers(count: int) -> ProcessPoolExecutor:
    """`count` processes, in which linear algebra has one thread each."""
    workers = ProcessPoolExecutor(count, mp_context=ready_to_start(), initializer=begin_as_worker)
    with one_thread():
        # The environment is read when a process starts, so they start here, inside `one_thread`.
        for _ in range(count):  # each starts one, because none of them is idle yet
            workers.submit(os.getpid)
    return workers


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


_kept: list["_Kept"] = []


@dataclass
class _Kept:
    count: int
    workers: ProcessPoolExecutor | None = None


@contextmanager
def keeping_workers(count: int) -> Iterator[None]:
    """Within the block, whatever needs several workers uses the same processes, one piece of work
    after the other: to start them takes seconds. They start when they are first needed.

    Parameters
    ----------
    count : number of processes; with 1 none is started.
    """
    here = _Kept(count)
    _kept.append(here)
    try:
        yield
    finally:
        _kept.remove(here)
        if here.workers is not None:
            here.workers.shutdown(cancel_futures=True)


def kept_workers() -> ProcessPoolExecutor | None:
    """Those of the innermost `keeping_workers`; None outside, and if it keeps one only, which
    would do nothing beside this process.
    """
    if not _kept or _kept[-1].count == 1:
        return None
    here = _kept[-1]
    if here.workers is None:
        here.workers = new_workers(here.count)
    return here.workers
