"""Worker processes: how they start, and that they end with the process that started them, however
that ends. Loaded where there is more than one process.
"""

import multiprocessing as mp
import os
import shutil
import signal
import sys
import tempfile
import threading
from collections.abc import Iterator
from concurrent.futures import ProcessPoolExecutor
from contextlib import contextmanager
from multiprocessing import resource_tracker, util
from multiprocessing.context import ForkServerContext, SpawnContext
from pathlib import Path
from typing import Final

from gaitval._internal.io.partial_files import OF_SOCKETS, hold, remove_abandoned


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
    loaded = ("server_watch", "rollouts", "rollout_buffer")
    context.set_forkserver_preload([*(f"gaitval.policy.{name}" for name in loaded), *also])
    try:
        _place_of_sockets()
        with fresh_processes(), _deaf_to_interrupts():
            forkserver.ensure_running()
    except OSError:  # its socket is a file, whose path may not be longer than some hundred bytes
        return mp.get_context("spawn")
    return context


@contextmanager
def _deaf_to_interrupts() -> Iterator[None]:
    """What starts in this block never sees the Ctrl-C of a terminal, which goes to all processes:
    whoever started it ends it, and while it loads it would end with a traceback.
    """
    resource_tracker.ensure_running()  # else it starts in the block, and ends that
    before = signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT})
    try:
        yield
    finally:
        signal.pthread_sigmask(signal.SIG_SETMASK, before)


def _place_of_sockets() -> None:
    """Make the folder of the server's socket, which is removed when this process ends, and if it
    was killed by the next one. The one that `multiprocessing` makes stays then, and ends a process
    with a traceback where the disk has become read-only.
    """
    known = mp.current_process()._config  # type: ignore[attr-defined]
    if known.get("tempdir") is None:
        where = Path(tempfile.gettempdir())
        remove_abandoned(where, OF_SOCKETS, "")
        known["tempdir"] = folder = tempfile.mkdtemp(dir=where, prefix=OF_SOCKETS)
        hold(folder)
        # After the sockets, like that of `multiprocessing`; True: without a word if it cannot be.
        util.Finalize(None, shutil.rmtree, args=(folder, True), exitpriority=-100)


def begin_as_worker() -> None:
    """What a worker process does first: it will end as soon as the one that started it has ended.

    A worker that waits for work never notices that its parent has gone, because it holds both ends
    of the queue itself. The watch is a thread that waits on the parent's sentinel, which exists on
    every system; Linux's signal at a parent's death would also come when only a thread of the
    parent ends.
    """
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # the one that started it ends it
    parent = mp.parent_process()
    if parent is None:
        return

    def watch() -> None:
        parent.join()
        # At once, without cleaning up: nobody is left to read what the worker might still write.
        os._exit(1)

    threading.Thread(target=watch, daemon=True).start()


OF_WORKERS: Final = {"OMP_NUM_THREADS": "1", "PYTHONSAFEPATH": "1"}
"""Environment that workers start with: one thread, because a worker's arrays are tiny; and nothing
from the current folder, where Python would look for its own modules first."""


@contextmanager
def fresh_processes() -> Iterator[None]:
    """Processes that start in this block have the environment `OF_WORKERS`, and do not run the
    user's script again, which would begin its study once more.
    """
    main, before = vars(sys.modules["__main__"]), os.environ.copy()
    script = {key: value for key, value in main.items() if key in ("__file__", "__spec__")}
    os.environ.update(OF_WORKERS)
    # what `multiprocessing` would have each process load
    main.update(dict.fromkeys(script))
    try:
        yield
    finally:
        main.update(script)
        for name in OF_WORKERS:
            del os.environ[name]
            if name in before:
                os.environ[name] = before[name]


def new_workers(count: int) -> ProcessPoolExecutor:
    """`count` processes, in which linear algebra has one thread each."""
    workers = ProcessPoolExecutor(count, mp_context=ready_to_start(), initializer=begin_as_worker)
    # All start with the first task, here, because they need this environment; one that started when
    # the others are busy would have another, and run the user's script.
    workers._safe_to_dynamically_spawn_children = False  # type: ignore[attr-defined]
    with fresh_processes():
        workers.submit(os.getpid)
    return workers
