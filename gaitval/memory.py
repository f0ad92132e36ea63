"""How soon memory is given back that is no longer needed, by the C library and by Python."""

import atexit
import ctypes
import gc
import sys
from typing import Final

_TRIM_THRESHOLD, _MMAP_THRESHOLD, _ARENA_MAX = -1, -3, -8  # of <malloc.h>
_LARGE: Final = 4 * 1024 * 1024
"""Bytes of a block that is given back as soon as it is free. A training asks for blocks of up to
2 MiB all the time: to have them anew from the system took it a fortieth longer."""


def seldom_search() -> None:
    """Have Python search less often for objects that only refer to each other, and not at its end.

    By itself it searches whenever there are 700 new ones: that took a fourteenth of the time of a
    report, and the end of a study 2 s. Still less often, and a report takes more memory.
    """
    gc.set_threshold(10_000, 5, 5)
    atexit.register(gc.freeze)


def give_back_soon() -> None:
    """Have glibc give back large blocks at once, and share one heap among threads.

    By itself it raises the size of what it gives back with every large block that was freed, and
    keeps the others: after a training that was a sixth of a process. Nothing happens with another
    C library.
    """
    library = _glibc()
    if library is not None:
        for what, value in ((_MMAP_THRESHOLD, _LARGE), (_TRIM_THRESHOLD, _LARGE), (_ARENA_MAX, 1)):
            library.mallopt(what, value)


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
    library = ctypes.CDLL(None)
    return library if hasattr(library, "gnu_get_libc_version") else None
