"""Processes that end with the one that needs them, and what they leave, whoever is killed.

Nothing here loads anything but the standard library: a process must be able to end while the rest
is loaded, and while it compiles.
"""

import os
import select
import shutil
import signal
import sys
import time
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from multiprocessing import resource_tracker
from pathlib import Path
from typing import Final

PATIENCE: Final = 15.0
"""s in which the processes that write to a folder of a killed one end."""
STEP: Final = 0.2
"""s between two tries to remove it."""


def hold(line: int) -> None:
    """End this process, and all of its group, as soon as the other end of the pipe `line` is
    closed, at which nothing is ever written: whoever holds it has ended.

    Linux's kernel does it by a signal, whatever the process does then. A thread would wait for a
    compiler or a loop that lets no other run; the signal at a parent's death would also come when
    only the thread ends that has started this process. Elsewhere nothing is done.
    """
    if sys.platform != "linux":
        return
    import fcntl

    signal.signal(signal.SIGIO, signal.SIG_DFL)
    fcntl.fcntl(line, fcntl.F_SETOWN, -os.getpgrp())
    fcntl.fcntl(line, fcntl.F_SETFL, fcntl.fcntl(line, fcntl.F_GETFL) | fcntl.FASYNC)
    ended = select.poll()
    ended.register(line, 0)
    if ended.poll(0):  # before the signal was asked for
        os.killpg(os.getpgrp(), signal.SIGKILL)


@contextmanager
def swept(folder: Path) -> Iterator[None]:
    """In the block a process of its own group waits, which removes `folder` and the semaphores of
    `multiprocessing` when this process and those that it started have been killed, together or
    alone. Where there is none, the next start removes the folder.
    """
    if sys.platform != "linux":
        yield
        return
    tracker = resource_tracker._resource_tracker
    reads, writes = os.pipe()
    os.set_inheritable(reads, True)
    devices = [(os.POSIX_SPAWN_OPEN, number, os.devnull, os.O_RDWR, 0) for number in range(3)]
    try:
        sweeper = os.posix_spawn(
            sys.executable,
            [sys.executable, "-I", "-S", "-W", "ignore", __file__, str(reads), str(folder)],
            os.environ,
            file_actions=devices,
            setsid=True,
        )
    finally:
        os.close(reads)
    # That of `multiprocessing` is of this group, and a kill of it leaves what it would remove.
    if adopted := getattr(tracker, "_fd", 0) is None:
        tracker._fd, tracker._pid = writes, sweeper  # type: ignore[attr-defined]
    try:
        yield
    finally:
        if not adopted:  # or it waits for the last semaphore, as that of `multiprocessing` does
            os.close(writes)
            with suppress(ChildProcessError):
                os.waitpid(sweeper, 0)


def sweep(line: int, folder: Path) -> None:
    """What the process of `swept` does."""
    resource_tracker.main(line)  # until all that hold the other end have ended
    end = time.monotonic() + PATIENCE
    while folder.exists() and time.monotonic() < end:
        shutil.rmtree(folder, ignore_errors=True)
        time.sleep(STEP)


if __name__ == "__main__":
    sweep(int(sys.argv[1]), Path(sys.argv[2]))
