"""When memory is given back that is no longer needed, by the C library and by Python."""

import atexit
import ctypes
import gc
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Final

_ARENA_MAX: Final = -8  # of <malloc.h>


def seldom_search() -> None:
    """Let Python search less often for objects that only refer to each other, and not when it ends.

    By default it searches whenever there are 700 new ones: that took a fourteenth of the time of a
    report, and the end of a study 2 s. With a still rarer search a report takes more memory.
    """
    gc.set_threshold(10_000, 5, 5)
    # Frozen objects are outside the search that the interpreter makes as it ends.
    atexit.register(gc.freeze)


@contextmanager
def without_search() -> Iterator[None]:
    """Do not search in the block. What lays out a page makes objects by the hundred thousand, most
    of which stay: to search took a twelfth of a report's time. It takes a ninth more memory so.
    """
    searched = gc.isenabled()
    gc.disable()
    try:
        yield
    finally:
        if searched:
            gc.enable()


def share_heap() -> None:
    """Let threads share one heap of glibc, which would give each its own and keep what is free in
    it. With another C library nothing happens.
    """
    library = _glibc()
    if library is not None:
        library.mallopt(_ARENA_MAX, 1)


def give_back_now() -> None:
    """Give back what is free. Python's cycles are not looked for: that takes a second of a process
    with many objects.
    """
    library = _glibc()
    if library is not None:
        library.malloc_trim(0)


def _glibc() -> ctypes.CDLL | None:
    if sys.platform != "linux":
        return None
    # None opens the process itself; the symbol exists only in glibc, not in musl.
    library = ctypes.CDLL(None)
    return library if hasattr(library, "gnu_get_libc_version") else None
