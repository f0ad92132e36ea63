"""Worker processes that are kept from one piece of work to the next; without, all is done here."""

from collections.abc import Callable, Iterable, Iterator
from concurrent.futures import ProcessPoolExecutor
from contextlib import contextmanager
from dataclasses import dataclass
from typing import TypeVar

_Item = TypeVar("_Item")
_Result = TypeVar("_Result")


_kept: list["_Kept"] = []


@dataclass
class _Kept:
    count: int
    workers: ProcessPoolExecutor | None = None


@contextmanager
def keeping_workers(count: int) -> Iterator[None]:
    """Within the block, whatever needs several workers uses the same `count` processes (with 1
    none), one piece of work after the other: to start them takes seconds. They start when they are
    first needed.
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
        from gaitval.policy.workers import new_workers

        here.workers = new_workers(here.count)
    return here.workers


def side_by_side(function: Callable[[_Item], _Result], items: Iterable[_Item]) -> Iterator[_Result]:
    """`function` of each of `items`, in order, in the workers that are kept, which get it pickled;
    without any, here, when its result is asked for.
    """
    workers = kept_workers()
    return map(function, items) if workers is None else workers.map(function, items)
