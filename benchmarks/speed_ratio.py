"""How many times longer a peer takes."""

from collections.abc import Callable
from time import perf_counter


def speed_ratio(
    theirs: Callable[[], Callable[[], object]],
    ours: Callable[[], object],
    *,
    their_rounds: int,
    our_rounds: int = 10,
) -> float:
    """Both run under the same load of the machine; the least time of a few runs of each counts.

    `theirs` prepares the work and returns it; only the work is timed.
    """

    def seconds(work: Callable[[], object]) -> float:
        start = perf_counter()
        work()
        return perf_counter() - start

    peer = min(seconds(theirs()) for _ in range(their_rounds))
    return peer / min(seconds(ours) for _ in range(our_rounds))
