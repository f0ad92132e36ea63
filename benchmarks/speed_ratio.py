"""How many times as long a peer takes."""

from collections.abc import Callable
from time import perf_counter


def speed_ratio(
    theirs: Callable[[], Callable[[], object]],
    ours: Callable[[], object],
    *,
    their_rounds: int,
    our_rounds: int = 10,
) -> float:
    """Both meet the same load of the machine; the least of a few runs of each.

    `theirs` makes the work ready and returns it; only the work is timed.
    """

    def seconds(work: Callable[[], object]) -> float:
        start = perf_counter()
        work()
        return perf_counter() - start

    peer = min(seconds(theirs()) for _ in range(their_rounds))
    return peer / min(seconds(ours) for _ in range(our_rounds))
